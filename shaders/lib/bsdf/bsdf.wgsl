// The glTF 2.0 material: metallic-roughness (specification, appendix B) with the extensions specular, ior, transmission,
// volume, iridescence, anisotropy, sheen and clearcoat, as docs/materials.md writes it out:
//
//   base      mix(dielectric, metal, metallic), the dielectric a GGX layer over mix(diffuse, transmission)
//   sheen     over the base, which it dims by its albedo
//   clearcoat over both, which it dims by its Fresnel term
//
// Directions are local unit vectors, +z the shading normal, x along the anisotropy, and point away from the surface.
// wo lies above it. A mask of lobes says which lobes a function is about; LOBE_ALL is the material.
#include "lib/math.wgsl"
#include "lib/sampling.wgsl"
#include "lib/bsdf/lobes.wgsl"
#include "lib/bsdf/fresnel.wgsl"
#include "lib/bsdf/iridescence.wgsl"
#include "lib/bsdf/ggx.wgsl"
#include "lib/bsdf/transmission.wgsl"
#include "lib/bsdf/sheen.wgsl"
#include "lib/bsdf/albedo.wgsl"

// No lobe is chosen less often than about this, so that none is ever starved.
const MINIMUM_LOBE_PROBABILITY = 0.1;
const CLEARCOAT_F0 = 0.04;

struct Bsdf {
    base_color: vec3f,
    metallic: f32,
    f0: vec3f, // of the dielectric, times `f90`
    f90: f32, // KHR_materials_specular's strength
    alpha: vec2f, // GGX alpha along x and y: roughness squared
    transmission: f32,
    eta: f32, // index of refraction below the surface over that above it, or THIN_WALLED
    sheen_color: vec3f,
    sheen_alpha: f32, // sheen roughness squared
    clearcoat_normal: vec3f,
    clearcoat: f32,
    clearcoat_alpha: f32,
    iridescence: f32,
    film_ior: f32,
    film_thickness: f32, // nanometres
}

// A choice of lobes: what each is chosen with.
struct LobeProbabilities {
    diffuse: f32,
    specular: f32,
    transmission: f32,
    sheen: f32,
    clearcoat: f32,
}

fn has_lobe(lobes: u32, lobe: u32) -> bool {
    return (lobes & lobe) != 0u;
}

// What the dielectric interface reflects at a cosine to its normal; all of it at total internal reflection.
fn dielectric_reflectance(bsdf: Bsdf, cosine: f32) -> vec3f {
    var c = cosine;
    if scene_has_transmission && bsdf.eta != THIN_WALLED && bsdf.eta < 1.0 {
        c = schlick_cosine(bsdf.eta, cosine);
        if c < 0.0 {
            return vec3f(1.0);
        }
    }
    let schlick = mix(bsdf.f0, vec3f(bsdf.f90), schlick_weight(c));
    if !scene_has_iridescence || bsdf.iridescence <= 0.0 {
        return schlick;
    }
    return mix(schlick, iridescent_reflectance(bsdf.film_ior, bsdf.film_thickness, bsdf.f0, c), bsdf.iridescence);
}

fn metal_reflectance(bsdf: Bsdf, cosine: f32) -> vec3f {
    let schlick = mix(bsdf.base_color, vec3f(1.0), schlick_weight(cosine));
    if !scene_has_iridescence || bsdf.iridescence <= 0.0 {
        return schlick;
    }
    return mix(schlick, iridescent_reflectance(bsdf.film_ior, bsdf.film_thickness, bsdf.base_color, cosine),
        bsdf.iridescence);
}

// What the specular lobe reflects, metal and dielectric mixed.
fn specular_reflectance(bsdf: Bsdf, dielectric: vec3f, cosine: f32) -> vec3f {
    return mix(dielectric, metal_reflectance(bsdf, cosine), bsdf.metallic);
}

// Roughness by which the tables are read; the geometric mean where it depends on direction.
fn table_roughness(bsdf: Bsdf) -> f32 {
    return sqrt(sqrt(bsdf.alpha.x * bsdf.alpha.y));
}

// Light scattered more than once between microfacets, returned to the specular lobe (Turquin 2019, after thesis 000,
// section 2.1.3): a factor 1 + K0 (1 - E) / E.
fn energy_compensation_factor(bsdf: Bsdf, wo: vec3f) -> vec3f {
    if !energy_compensation {
        return vec3f(1.0);
    }
    let albedo = max(albedo_read(wo.z, table_roughness(bsdf)).x, 0.05);
    return 1.0 + mix(bsdf.f0, bsdf.base_color, bsdf.metallic) * ((1.0 - albedo) / albedo);
}

// What the dielectric's specular layer reflects of light from everywhere, its greatest channel.
fn specular_layer_albedo(bsdf: Bsdf, cosine: f32) -> f32 {
    let table = albedo_read(cosine, table_roughness(bsdf));
    var albedo = bsdf.f0 * (table.x - table.y) + bsdf.f90 * table.y;
    let is_schlick = bsdf.iridescence <= 0.0 && (bsdf.eta >= 1.0 || bsdf.eta == THIN_WALLED);
    if !is_schlick {
        // No table has these; take the reflectance at the mirror angle.
        albedo = dielectric_reflectance(bsdf, cosine) * table.x;
    }
    if energy_compensation {
        albedo *= 1.0 + bsdf.f0 * ((1.0 - table.x) / max(table.x, 0.05));
    }
    return min(max_component(albedo), 1.0);
}

// The share of light that passes the specular layer to the diffuse lobe below. The specification's is one minus the
// Fresnel term at the half vector, which gains light at grazing angles; the conserving one is one minus the layer's
// albedo, the lesser of both directions' (docs/materials.md).
fn diffuse_share(bsdf: Bsdf, dielectric: vec3f, wo: vec3f, wi: vec3f) -> f32 {
    if !conserving_mix {
        return 1.0 - max_component(dielectric);
    }
    return 1.0 - max(specular_layer_albedo(bsdf, wo.z), specular_layer_albedo(bsdf, wi.z));
}

// What the clearcoat reflects towards wo, its weight included.
fn clearcoat_reflectance(bsdf: Bsdf, wo: vec3f) -> f32 {
    if !scene_has_clearcoat {
        return 0.0;
    }
    return bsdf.clearcoat * mix(CLEARCOAT_F0, 1.0, schlick_weight(abs(dot(bsdf.clearcoat_normal, wo))));
}

// More than 1 for smooth sheens near the horizon: there the extension's formula gains light.
fn sheen_albedo(bsdf: Bsdf, cosine: f32) -> f32 {
    let table = albedo_read(abs(cosine), sqrt(bsdf.sheen_alpha));
    return table.z + 4.0 * table.w;
}

// What the conserving setting takes away of that.
fn sheen_share(bsdf: Bsdf, wo: vec3f, wi: vec3f) -> f32 {
    if !conserving_mix {
        return 1.0;
    }
    return 1.0 / max(1.0, max(sheen_albedo(bsdf, wo.z), sheen_albedo(bsdf, wi.z)));
}

// What the sheen lets through to the base: Conty Estevez and Kulla's albedo scaling.
fn sheen_transmittance(bsdf: Bsdf, wo: vec3f, wi: vec3f) -> f32 {
    if !scene_has_sheen {
        return 1.0;
    }
    let color = max_component(bsdf.sheen_color);
    return max(1.0 - color * max(sheen_albedo(bsdf, wo.z), sheen_albedo(bsdf, wi.z)), 0.0);
}

// The probabilities with which the lobes of a mask are chosen: their shares of the light reflected at the mirror angle,
// kept away from zero.
fn lobe_probabilities(bsdf: Bsdf, lobes: u32, wo: vec3f) -> LobeProbabilities {
    let coat = clearcoat_reflectance(bsdf, wo);
    let below_coat = 1.0 - coat;
    var sheen = 0.0;
    var below_sheen = below_coat;
    if scene_has_sheen {
        let albedo = min(sheen_albedo(bsdf, wo.z), 1.0);
        sheen = below_coat * luminance(bsdf.sheen_color) * albedo;
        below_sheen = below_coat * max(1.0 - max_component(bsdf.sheen_color) * albedo, 0.0);
    }
    let dielectric = dielectric_reflectance(bsdf, wo.z);
    let base = (1.0 - bsdf.metallic) * luminance(bsdf.base_color);
    let through = below_sheen * base * (1.0 - max_component(dielectric));
    let specular = below_sheen * luminance(specular_reflectance(bsdf, dielectric, wo.z));

    // Weights of the lobes that are asked for. A lobe that is there is chosen now and then even where its weight is zero.
    var w = LobeProbabilities();
    w.diffuse = select(0.0, through, has_lobe(lobes, LOBE_DIFFUSE));
    w.specular = select(0.0, specular, has_lobe(lobes, LOBE_SPECULAR));
    var untransmitted = base;
    if scene_has_transmission {
        w.transmission = select(0.0, through * bsdf.transmission, has_lobe(lobes, LOBE_TRANSMISSION));
        w.diffuse *= 1.0 - bsdf.transmission;
        untransmitted *= 1.0 - bsdf.transmission;
    }
    if scene_has_sheen {
        w.sheen = select(0.0, sheen, has_lobe(lobes, LOBE_SHEEN));
    }
    if scene_has_clearcoat {
        w.clearcoat = select(0.0, coat, has_lobe(lobes, LOBE_CLEARCOAT));
    }
    let scale = 1.0 / max(w.diffuse + w.specular + w.transmission + w.sheen + w.clearcoat, 1e-20);
    var p = LobeProbabilities();
    p.diffuse = raised(w.diffuse * scale, has_lobe(lobes, LOBE_DIFFUSE) && untransmitted > 0.0);
    p.specular = raised(w.specular * scale, has_lobe(lobes, LOBE_SPECULAR));
    if scene_has_transmission {
        p.transmission = raised(w.transmission * scale, has_lobe(lobes, LOBE_TRANSMISSION) && base * bsdf.transmission > 0.0);
    }
    if scene_has_sheen {
        p.sheen = raised(w.sheen * scale, has_lobe(lobes, LOBE_SHEEN) && luminance(bsdf.sheen_color) > 0.0);
    }
    if scene_has_clearcoat {
        p.clearcoat = raised(w.clearcoat * scale, has_lobe(lobes, LOBE_CLEARCOAT) && bsdf.clearcoat > 0.0);
    }
    let total = p.diffuse + p.specular + p.transmission + p.sheen + p.clearcoat;
    let normalization = 1.0 / max(total, 1e-20);
    return LobeProbabilities(p.diffuse * normalization, p.specular * normalization, p.transmission * normalization,
        p.sheen * normalization, p.clearcoat * normalization);
}

fn raised(probability: f32, is_present: bool) -> f32 {
    return select(0.0, max(probability, MINIMUM_LOBE_PROBABILITY), is_present);
}

// f(wo, wi) |cos(theta_i)| of the lobes of a mask: the factor of the rendering equation.
fn bsdf_evaluate(bsdf: Bsdf, lobes: u32, wo: vec3f, wi: vec3f) -> vec3f {
    if wo.z <= 1e-6 || abs(wi.z) <= 1e-6 {
        return vec3f(0.0);
    }
    let coat = clearcoat_reflectance(bsdf, wo);
    let below = (1.0 - coat) * sheen_transmittance(bsdf, wo, wi);
    if wi.z < 0.0 {
        if !scene_has_transmission || !has_lobe(lobes, LOBE_TRANSMISSION) || bsdf.transmission <= 0.0 {
            return vec3f(0.0);
        }
        let cosine = dot(wo, transmission_half_vector(bsdf.eta, wo, wi));
        let through = 1.0 - max_component(dielectric_reflectance(bsdf, cosine));
        return bsdf.base_color * (below * (1.0 - bsdf.metallic) * bsdf.transmission * through
            * transmission_evaluate(bsdf.alpha, bsdf.eta, wo, wi));
    }
    let cosine = dot(wo, normalize(wo + wi));
    let dielectric = dielectric_reflectance(bsdf, cosine);
    var value = vec3f(0.0);
    if has_lobe(lobes, LOBE_DIFFUSE) {
        var share = (1.0 - bsdf.metallic) * diffuse_share(bsdf, dielectric, wo, wi);
        if scene_has_transmission {
            share *= 1.0 - bsdf.transmission;
        }
        value += bsdf.base_color * (share / PI * wi.z);
    }
    if has_lobe(lobes, LOBE_SPECULAR) {
        value += specular_reflectance(bsdf, dielectric, cosine) * energy_compensation_factor(bsdf, wo)
            * ggx_reflection(bsdf.alpha, wo, wi);
    }
    value *= below;
    if scene_has_sheen && has_lobe(lobes, LOBE_SHEEN) {
        value += bsdf.sheen_color * ((1.0 - coat) * sheen_share(bsdf, wo, wi)
            * sheen_evaluate(bsdf.sheen_alpha, wo, wi));
    }
    if scene_has_clearcoat && has_lobe(lobes, LOBE_CLEARCOAT) {
        value += coat * clearcoat_evaluate(bsdf, wo, wi);
    }
    return value;
}

// Density per solid angle with which `bsdf_sample` draws wi for the same mask.
fn bsdf_pdf(bsdf: Bsdf, lobes: u32, wo: vec3f, wi: vec3f) -> f32 {
    if wo.z <= 1e-6 || abs(wi.z) <= 1e-6 {
        return 0.0;
    }
    let p = lobe_probabilities(bsdf, lobes, wo);
    if wi.z < 0.0 {
        if !scene_has_transmission {
            return 0.0;
        }
        return p.transmission * transmission_pdf(bsdf.alpha, bsdf.eta, wo, wi);
    }
    var pdf = p.diffuse * wi.z / PI + p.specular * ggx_reflection_pdf(bsdf.alpha, wo, wi);
    if scene_has_sheen {
        pdf += p.sheen * SHEEN_PDF;
    }
    if scene_has_clearcoat {
        pdf += p.clearcoat * clearcoat_pdf(bsdf, wo, wi);
    }
    return pdf;
}

struct BsdfSample {
    wi: vec3f,
    lobe: u32, // the one that was chosen; 0 if nothing was drawn
}

// Draws wi with density `bsdf_pdf`: a lobe of the mask by its probability, then the lobe's own sampler. What a sampler
// puts on the wrong side of the surface is not drawn at all: wi is then in the horizon, where BSDF and density are zero.
fn bsdf_sample(bsdf: Bsdf, lobes: u32, wo: vec3f, u: vec3f) -> BsdfSample {
    let p = lobe_probabilities(bsdf, lobes, wo);
    var choice = u.z - p.specular;
    if choice < 0.0 {
        return reflected(reflect(-wo, ggx_sample_visible_normal(bsdf.alpha, wo, u.xy)), LOBE_SPECULAR);
    }
    choice -= p.diffuse;
    if choice < 0.0 {
        return reflected(sample_cosine_hemisphere(u.xy), LOBE_DIFFUSE);
    }
    choice -= p.transmission;
    if scene_has_transmission && choice < 0.0 {
        let wi = transmission_sample(bsdf.alpha, bsdf.eta, wo, u.xy);
        if wi.z < -1e-6 {
            return BsdfSample(wi, LOBE_TRANSMISSION);
        }
        return nothing_drawn();
    }
    choice -= p.sheen;
    if scene_has_sheen && choice < 0.0 {
        return reflected(sheen_sample(u.xy), LOBE_SHEEN);
    }
    choice -= p.clearcoat;
    if scene_has_clearcoat && choice < 0.0 {
        return reflected(clearcoat_sample(bsdf, wo, u.xy), LOBE_CLEARCOAT);
    }
    return nothing_drawn();
}

fn reflected(wi: vec3f, lobe: u32) -> BsdfSample {
    if wi.z > 1e-6 {
        return BsdfSample(wi, lobe);
    }
    return nothing_drawn();
}

fn nothing_drawn() -> BsdfSample {
    return BsdfSample(vec3f(1.0, 0.0, 0.0), 0u);
}

// The clearcoat has a normal of its own; these three work in its frame. Its Fresnel factor is taken at the normal rather
// than at the microfacet (KHR_materials_clearcoat) and is not in `clearcoat_evaluate`.

fn clearcoat_is_lit(wo: vec3f, wi: vec3f) -> bool {
    return wo.z > 1e-6 && wi.z > 1e-6;
}

fn clearcoat_evaluate(bsdf: Bsdf, wo: vec3f, wi: vec3f) -> f32 {
    let frame = orthonormal_basis(bsdf.clearcoat_normal);
    let o = basis_to_local(frame, wo);
    let i = basis_to_local(frame, wi);
    if !clearcoat_is_lit(o, i) {
        return 0.0;
    }
    return ggx_reflection(vec2f(bsdf.clearcoat_alpha), o, i);
}

fn clearcoat_pdf(bsdf: Bsdf, wo: vec3f, wi: vec3f) -> f32 {
    let frame = orthonormal_basis(bsdf.clearcoat_normal);
    let o = basis_to_local(frame, wo);
    let i = basis_to_local(frame, wi);
    if !clearcoat_is_lit(o, i) {
        return 0.0;
    }
    return ggx_reflection_pdf(vec2f(bsdf.clearcoat_alpha), o, i);
}

// Into the horizon where the coat is turned away or the reflection goes below it.
fn clearcoat_sample(bsdf: Bsdf, wo: vec3f, u: vec2f) -> vec3f {
    let frame = orthonormal_basis(bsdf.clearcoat_normal);
    let o = basis_to_local(frame, wo);
    let i = reflect(-o, ggx_sample_visible_normal(vec2f(bsdf.clearcoat_alpha), o, u));
    if !clearcoat_is_lit(o, i) {
        return vec3f(1.0, 0.0, 0.0);
    }
    return basis_to_world(frame, i);
}
