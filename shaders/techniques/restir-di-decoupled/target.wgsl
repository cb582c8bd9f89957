// The target function: luminance of the unshadowed integrand, of a material that is cheaper than the real one. Any function
// will do that is positive wherever the integrand is; how close it comes to it decides noise alone
// (Wyman and Panteleev 2021, section 3.3 and, for simplified materials, section 9).
#include "techniques/common/resampling.wgsl"

// About the luminance of f |cos|: a GGX reflection over a Lambertian one, without colours. Materials with other lobes are
// evaluated in full.
fn approximate_scatter(surface: Surface, wi: vec3f, distance: f32) -> f32 {
    if scene_has_transmission || scene_has_volumes || scene_has_sheen || scene_has_clearcoat || scene_has_anisotropy {
        return luminance(direct_scatter(surface, wi, distance));
    }
    let cos_i = dot(surface.basis.normal, wi);
    let cos_o = max(dot(surface.basis.normal, surface.wo), 1e-3);
    if cos_i <= 0.0 || !above_surface(surface, wi) {
        return 0.0;
    }
    let color = luminance(surface.bsdf.base_color);
    let metallic = surface.bsdf.metallic;
    let alpha_2 = square(surface.bsdf.alpha.x);
    // The half vector by its cosines alone: |wo + wi|^2 = 2 + 2 cos.
    let length_2 = max(2.0 + 2.0 * dot(surface.wo, wi), 1e-12);
    let inverse_length = inverseSqrt(length_2);
    let cos_half = min((cos_i + cos_o) * inverse_length, 1.0);
    let cos_difference = clamp(1.0 - 0.5 * length_2 * inverse_length, 0.0, 1.0);
    let spread = max(cos_half * cos_half * (alpha_2 - 1.0) + 1.0, alpha_2);
    let distribution = alpha_2 / (PI * spread * spread);
    // Smith's masking, correlated, as Hammon 2017 approximates it.
    let masking = 0.5 / mix(2.0 * cos_i * cos_o, cos_i + cos_o, surface.bsdf.alpha.x);
    let schlick = square(square(cos_difference)) * cos_difference;
    let fresnel = mix(mix(luminance(surface.bsdf.f0), color, metallic), mix(surface.bsdf.f90, 1.0, metallic), schlick);
    // A little more than nothing on black, so that whatever the real material does is covered.
    return cos_i * ((1.0 - metallic) * color / PI + 1e-5 + fresnel * distribution * masking);
}

// p-hat of a domain's surface; `previous` says that it is of the previous frame.
fn approximate_target(surface: Surface, sample: LightSample, previous: bool) -> f32 {
    let light = light_contribution(sample, surface.position, previous);
    let value = luminance(light.value);
    if value <= 0.0 {
        return 0.0;
    }
    return value * approximate_scatter(surface, light.direction, light.distance);
}
