// The glTF 2.0 metallic-roughness BRDF (specification, appendix B): mix(dielectric, metal, metallic), where the
// dielectric lays a GGX coat of index of refraction 1.5 over a Lambert base. All directions are local unit vectors,
// +z the shading normal, and point away from the surface.
#include "lib/math.wgsl"
#include "lib/sampling.wgsl"

// Below this GGX is a spike that f32 cannot resolve; see docs/conventions.md.
const MINIMUM_ALPHA = 0.001;

struct Brdf {
    base_color: vec3f,
    metallic: f32,
    // GGX alpha: roughness squared.
    alpha: f32,
}

// Normal distribution D of an isotropic GGX surface, from components so that it stays exact near the peak.
fn ggx_distribution(alpha: f32, h: vec3f) -> f32 {
    let s = (h.x * h.x + h.y * h.y) / (alpha * alpha) + h.z * h.z;
    return 1.0 / (PI * alpha * alpha * s * s);
}

// Smith's Lambda (Heitz 2014).
fn ggx_lambda(alpha: f32, w: vec3f) -> f32 {
    let tangent_2 = (w.x * w.x + w.y * w.y) / max(w.z * w.z, 1e-14);
    return 0.5 * (sqrt(1.0 + alpha * alpha * tangent_2) - 1.0);
}

// Height-correlated masking-shadowing G2 (Heitz 2014, Eq. 99).
fn ggx_masking_shadowing(alpha: f32, wo: vec3f, wi: vec3f) -> f32 {
    return 1.0 / (1.0 + ggx_lambda(alpha, wo) + ggx_lambda(alpha, wi));
}

// A microfacet normal visible from `wo` (Dupuy and Benyoub 2023, spherical caps).
fn ggx_sample_visible_normal(alpha: f32, wo: vec3f, u: vec2f) -> vec3f {
    let wo_stretched = normalize(vec3f(alpha * wo.xy, wo.z));
    let phi = 2.0 * PI * u.x;
    let z = (1.0 - u.y) * (1.0 + wo_stretched.z) - wo_stretched.z;
    let sin_theta = sqrt(clamp(1.0 - z * z, 0.0, 1.0));
    let h = vec3f(sin_theta * cos(phi), sin_theta * sin(phi), z) + wo_stretched;
    return normalize(vec3f(alpha * h.xy, max(h.z, 1e-9)));
}

// Density of the reflected direction `wi` when the normal is drawn by the function above:
// D_v(h) / (4 wo.h) = D(h) G1(wo) / (4 wo.z).
fn ggx_pdf(alpha: f32, wo: vec3f, wi: vec3f) -> f32 {
    let h = normalize(wo + wi);
    return ggx_distribution(alpha, h) / ((1.0 + ggx_lambda(alpha, wo)) * 4.0 * wo.z);
}

// Schlick's power of the half angle.
fn schlick_weight(v_dot_h: f32) -> f32 {
    let x = clamp(1.0 - v_dot_h, 0.0, 1.0);
    return x * x * x * x * x;
}

fn dielectric_fresnel(weight: f32) -> f32 {
    return 0.04 + 0.96 * weight;
}

// What the specular lobe reflects, metal and dielectric mixed.
fn specular_color(brdf: Brdf, weight: f32) -> vec3f {
    let metal = brdf.base_color + (1.0 - brdf.base_color) * weight;
    return mix(vec3f(dielectric_fresnel(weight)), metal, brdf.metallic);
}

// Probability of sampling the specular lobe: the lobes' share of reflected luminance at the mirror angle, kept away
// from 0 and 1 so that neither lobe is ever starved.
fn specular_probability(brdf: Brdf, wo: vec3f) -> f32 {
    let weight = schlick_weight(wo.z);
    let specular = luminance(specular_color(brdf, weight));
    let diffuse = (1.0 - brdf.metallic) * luminance(brdf.base_color) * (1.0 - dielectric_fresnel(weight));
    if diffuse <= 0.0 {
        return 1.0;
    }
    return clamp(specular / (specular + diffuse), 0.1, 0.9);
}

// f(wo, wi) times cos(theta_i): the factor of the rendering equation. Zero below the surface.
fn brdf_evaluate(brdf: Brdf, wo: vec3f, wi: vec3f) -> vec3f {
    if wo.z <= 1e-6 || wi.z <= 1e-6 {
        return vec3f(0.0);
    }
    let h = normalize(wo + wi);
    let weight = schlick_weight(dot(wo, h));
    let diffuse = brdf.base_color * ((1.0 - brdf.metallic) * (1.0 - dielectric_fresnel(weight)) / PI) * wi.z;
    // D G2 F / (4 wo.z wi.z), times wi.z.
    let specular = specular_color(brdf, weight)
        * (ggx_distribution(brdf.alpha, h) * ggx_masking_shadowing(brdf.alpha, wo, wi) / (4.0 * wo.z));
    return diffuse + specular;
}

// Density per solid angle with which `brdf_sample` draws `wi`.
fn brdf_pdf(brdf: Brdf, wo: vec3f, wi: vec3f) -> f32 {
    if wo.z <= 1e-6 || wi.z <= 1e-6 {
        return 0.0;
    }
    let p = specular_probability(brdf, wo);
    return mix(wi.z / PI, ggx_pdf(brdf.alpha, wo, wi), p);
}

// Draws wi with density `brdf_pdf`: a lobe by its probability, then the lobe's own sampler. May point below the
// surface (wi.z <= 0), where brdf and pdf are zero.
fn brdf_sample(brdf: Brdf, wo: vec3f, u: vec3f) -> vec3f {
    if u.z < specular_probability(brdf, wo) {
        return reflect(-wo, ggx_sample_visible_normal(brdf.alpha, wo, u.xy));
    }
    return sample_cosine_hemisphere(u.xy);
}
