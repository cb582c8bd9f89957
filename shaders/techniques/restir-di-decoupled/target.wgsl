// The target function: luminance of the unshadowed integrand, of a material that is cheaper than the real one. Any function
// will do that is positive wherever the integrand is; how close it comes to it decides noise alone
// (Wyman and Panteleev 2021, section 3.3 and, for simplified materials, section 9).
#include "techniques/common/resampling.wgsl"
#include "techniques/restir-di-decoupled/domain.wgsl"

// Lobes that `approximate_scatter` knows nothing of.
fn has_other_lobes() -> bool {
    return scene_has_volumes || scene_has_sheen || scene_has_clearcoat || scene_has_anisotropy;
}

// About the luminance of f |cos|: a GGX reflection over a Lambertian one, without colours.
fn approximate_scatter(domain: Domain, wi: vec3f) -> f32 {
    var cos_i = dot(domain.normal, wi);
    // As `surface_evaluate`: nothing where the two normals do not agree on the side.
    let is_above = dot(domain.geometric_normal, wi) > 0.0;
    if domain.is_black || is_above != (cos_i > 0.0) || (!is_above && !domain.transmits) {
        return 0.0;
    }
    if scene_has_transmission {
        cos_i = max(abs(cos_i), 1e-3);
    }
    let cos_o = max(dot(domain.normal, domain.wo), 1e-3);
    let alpha_2 = square(domain.alpha);
    // The half vector by its cosines alone: |wo + wi|^2 = 2 + 2 cos.
    let length_2 = max(2.0 + 2.0 * dot(domain.wo, wi), 1e-12);
    let inverse_length = inverseSqrt(length_2);
    let cos_half = min((cos_i + cos_o) * inverse_length, 1.0);
    let cos_difference = clamp(1.0 - 0.5 * length_2 * inverse_length, 0.0, 1.0);
    let spread = max(cos_half * cos_half * (alpha_2 - 1.0) + 1.0, alpha_2);
    let distribution = alpha_2 / (PI * spread * spread);
    // Smith's masking, correlated, as Hammon 2017 approximates it.
    let masking = 0.5 / mix(2.0 * cos_i * cos_o, cos_i + cos_o, domain.alpha);
    let schlick = square(square(cos_difference)) * cos_difference;
    let fresnel = mix(mix(domain.f0, domain.albedo, domain.metallic), mix(domain.f90, 1.0, domain.metallic), schlick);
    // A little more than nothing on black, so that whatever the real material does is covered.
    return cos_i * ((1.0 - domain.metallic) * domain.albedo / PI + 1e-5 + fresnel * distribution * masking);
}

// The same for what a pixel sees now, whose whole material is at hand: other lobes are evaluated in full. Not so where light
// comes through: which directions cannot be refracted is more than the next frame will know of this domain.
fn pixel_scatter(surface: Surface, domain: Domain, wi: vec3f, distance: f32) -> f32 {
    if has_other_lobes() && !domain.transmits {
        return luminance(direct_scatter(surface, wi, distance));
    }
    return approximate_scatter(domain, wi);
}
