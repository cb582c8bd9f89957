// The GGX microfacet distribution, isotropic or stretched along the local x and y axes (`alpha.x`, `alpha.y`: the square
// of roughness along each). Source: Heitz 2014; KHR_materials_anisotropy writes the same D.
#include "lib/math.wgsl"

// Below this GGX is a spike that f32 cannot resolve; see docs/materials.md.
const MINIMUM_ALPHA = 0.001;

// Normal distribution D, from components so that it stays exact near the peak.
fn ggx_distribution(alpha: vec2f, h: vec3f) -> f32 {
    let slope = h.xy / alpha;
    let s = dot(slope, slope) + h.z * h.z;
    return 1.0 / (PI * alpha.x * alpha.y * s * s);
}

// Smith's Lambda (Heitz 2014); the same for a direction and its opposite.
fn ggx_lambda(alpha: vec2f, w: vec3f) -> f32 {
    let stretched = alpha * w.xy;
    return 0.5 * (sqrt(1.0 + dot(stretched, stretched) / max(w.z * w.z, 1e-14)) - 1.0);
}

// Masking G1.
fn ggx_masking(alpha: vec2f, w: vec3f) -> f32 {
    return 1.0 / (1.0 + ggx_lambda(alpha, w));
}

// Height-correlated masking-shadowing G2 of a reflection (Heitz 2014, Eq. 99).
fn ggx_masking_shadowing(alpha: vec2f, wo: vec3f, wi: vec3f) -> f32 {
    return 1.0 / (1.0 + ggx_lambda(alpha, wo) + ggx_lambda(alpha, wi));
}

// A microfacet normal visible from `wo` (Dupuy and Benyoub 2023, spherical caps).
fn ggx_sample_visible_normal(alpha: vec2f, wo: vec3f, u: vec2f) -> vec3f {
    let wo_stretched = normalize(vec3f(alpha * wo.xy, wo.z));
    let phi = 2.0 * PI * u.x;
    let z = (1.0 - u.y) * (1.0 + wo_stretched.z) - wo_stretched.z;
    let sin_theta = sqrt(clamp(1.0 - z * z, 0.0, 1.0));
    let h = vec3f(sin_theta * cos(phi), sin_theta * sin(phi), z) + wo_stretched;
    return normalize(vec3f(alpha * h.xy, max(h.z, 1e-9)));
}

// D G2 / (4 wo.z wi.z), times wi.z: what a perfect mirror's microfacets send from wi to wo.
fn ggx_reflection(alpha: vec2f, wo: vec3f, wi: vec3f) -> f32 {
    return ggx_distribution(alpha, normalize(wo + wi)) * ggx_masking_shadowing(alpha, wo, wi) / (4.0 * wo.z);
}

// Density of the reflected direction `wi` when the normal is drawn by `ggx_sample_visible_normal`:
// D_v(h) / (4 wo.h) = D(h) G1(wo) / (4 wo.z).
fn ggx_reflection_pdf(alpha: vec2f, wo: vec3f, wi: vec3f) -> f32 {
    return ggx_distribution(alpha, normalize(wo + wi)) * ggx_masking(alpha, wo) / (4.0 * wo.z);
}
