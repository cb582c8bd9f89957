// Light from infinitely far away: an equirectangular map (docs/conventions.md), read bilinearly, with one alias-table
// entry a texel.
#include "scene/bindings.wgsl"

const ENVIRONMENT_DISTANCE = 3.0e38;

// acos(y) by way of atan2, which drivers compute a hundred times more accurately.
fn environment_uv(direction: vec3f) -> vec2f {
    return vec2f(0.5 + atan2(direction.x, -direction.z) / (2.0 * PI), atan2(length(direction.xz), direction.y) / PI);
}

fn environment_texel(p: vec2i, size: vec2i) -> vec3f {
    let x = ((p.x % size.x) + size.x) % size.x;
    return textureLoad(environment_radiance, vec2i(x, clamp(p.y, 0, size.y - 1)), 0).rgb;
}

// Radiance from the direction towards which a ray leaves the scene; black without an environment.
fn environment_evaluate(direction: vec3f) -> vec3f {
    if !scene_has_environment {
        return vec3f(0.0);
    }
    let size = vec2i(textureDimensions(environment_radiance));
    let p = environment_uv(direction) * vec2f(size) - 0.5;
    let base = floor(p);
    let f = p - base;
    let i = vec2i(base);
    let top = mix(environment_texel(i, size), environment_texel(i + vec2i(1, 0), size), f.x);
    let bottom = mix(environment_texel(i + vec2i(0, 1), size), environment_texel(i + vec2i(1, 1), size), f.x);
    return mix(top, bottom, f.y);
}

// Density per solid angle of `environment_sample`.
fn environment_pdf(direction: vec3f) -> f32 {
    let size = textureDimensions(environment_alias);
    let texel = min(vec2u(environment_uv(direction) * vec2f(size)), size - 1u);
    return bitcast<f32>(textureLoad(environment_alias, texel, 0).z);
}

// A direction: a texel by its alias table, then uniform in solid angle within the texel.
fn environment_sample(u: vec4f) -> vec3f {
    let size = textureDimensions(environment_alias);
    let count = size.x * size.y;
    var index = min(u32(u.x * f32(count)), count - 1u);
    let entry = textureLoad(environment_alias, vec2u(index % size.x, index / size.x), 0);
    if u.y >= bitcast<f32>(entry.x) {
        index = entry.y;
    }
    let texel = vec2f(vec2u(index % size.x, index / size.x));
    let phi = 2.0 * PI * ((texel.x + u.z) / f32(size.x) - 0.5);
    let y = mix(cos(PI * texel.y / f32(size.y)), cos(PI * (texel.y + 1.0) / f32(size.y)), u.w);
    let r = sqrt(max(0.0, 1.0 - y * y));
    return vec3f(r * sin(phi), y, -r * cos(phi));
}
