// The sheen of cloth, KHR_materials_sheen: Charlie's distribution of fibres and the fit of its masking (Conty Estevez and
// Kulla 2017). `alpha` is the square of sheen roughness. A white sheen; the colour is a factor.
#include "lib/math.wgsl"

// Below this the sheen is a line at the horizon, many times brighter than white.
const MINIMUM_SHEEN_ALPHA = 0.01;

fn sheen_distribution(alpha: f32, h: vec3f) -> f32 {
    let sin_2 = h.x * h.x + h.y * h.y;
    return (2.0 + 1.0 / alpha) * pow(sin_2, 0.5 / alpha) / (2.0 * PI);
}

fn sheen_fit(x: f32, alpha: f32) -> f32 {
    let t = (1.0 - alpha) * (1.0 - alpha);
    let a = mix(21.5473, 25.3245, t);
    let b = mix(3.82987, 3.32435, t);
    let c = mix(0.19823, 0.16801, t);
    let d = mix(-1.97760, -1.27393, t);
    let e = mix(-4.32054, -4.85967, t);
    return a / (1.0 + b * pow(max(x, 0.0), c)) + d * x + e;
}

fn sheen_lambda(alpha: f32, cosine: f32) -> f32 {
    if cosine < 0.5 {
        return exp(sheen_fit(cosine, alpha));
    }
    return exp(2.0 * sheen_fit(0.5, alpha) - sheen_fit(1.0 - cosine, alpha));
}

// The BRDF times cos(theta_i).
fn sheen_evaluate(alpha: f32, wo: vec3f, wi: vec3f) -> f32 {
    let masking_shadowing = 1.0 / (1.0 + sheen_lambda(alpha, wo.z) + sheen_lambda(alpha, wi.z));
    return sheen_distribution(alpha, normalize(wo + wi)) * masking_shadowing / (4.0 * wo.z);
}

// Uniform over the hemisphere, as the paper recommends; density SHEEN_PDF.
fn sheen_sample(u: vec2f) -> vec3f {
    let phi = 2.0 * PI * u.x;
    let r = sqrt(max(0.0, 1.0 - u.y * u.y));
    return vec3f(r * cos(phi), r * sin(phi), u.y);
}

const SHEEN_PDF = 0.15915494;
