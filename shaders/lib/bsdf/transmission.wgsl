// GGX transmission, without its Fresnel factor. wo lies above the surface, wi below it.
//
// `eta` is the index of refraction below the surface over that above it, or THIN_WALLED: there the surface is a sheet
// whose two sides blur the light without bending it (KHR_materials_transmission). Otherwise light refracts at the
// microfacets (KHR_materials_volume; Walter et al. 2007). Radiance is not scaled by the square of the index where it
// crosses: what travels inside a medium is radiance over index squared.
#include "lib/bsdf/ggx.wgsl"

const THIN_WALLED = 0.0;

// The microfacet normal that sends wi to wo, on the upper side.
fn transmission_half_vector(eta: f32, wo: vec3f, wi: vec3f) -> vec3f {
    let bent = wo + eta * wi;
    let h = select(select(bent, -bent, bent.z < 0.0), wo + vec3f(wi.xy, -wi.z), eta == THIN_WALLED);
    return normalize(h);
}

// Density per solid angle of the direction drawn by `transmission_sample`.
fn transmission_pdf(alpha: vec2f, eta: f32, wo: vec3f, wi: vec3f) -> f32 {
    let h = transmission_half_vector(eta, wo, wi);
    let density = ggx_distribution(alpha, h) * ggx_masking(alpha, wo) / wo.z; // of visible normals, over wo.h
    if eta == THIN_WALLED {
        return 0.25 * density;
    }
    let wo_h = dot(wo, h);
    let wi_h = dot(wi, h);
    if wo_h <= 0.0 || wi_h >= 0.0 {
        return 0.0;
    }
    let sum = wo_h + eta * wi_h;
    return density * wo_h * eta * eta * -wi_h / max(sum * sum, 1e-20);
}

// The BTDF times |cos|: separable Smith masking, as the extensions state it, makes it the density times G1(wi).
fn transmission_evaluate(alpha: vec2f, eta: f32, wo: vec3f, wi: vec3f) -> f32 {
    return transmission_pdf(alpha, eta, wo, wi) * ggx_masking(alpha, wi);
}

// A direction through a microfacet visible from wo. It may come out above the surface, and is the zero vector at total
// internal reflection: neither carries light.
fn transmission_sample(alpha: vec2f, eta: f32, wo: vec3f, u: vec2f) -> vec3f {
    let h = ggx_sample_visible_normal(alpha, wo, u);
    if eta == THIN_WALLED {
        return reflect(-wo, h) * vec3f(1.0, 1.0, -1.0);
    }
    return refract(-wo, h, 1.0 / eta);
}
