// Light from infinitely far away: an equirectangular map (docs/conventions.md), read bilinearly, with one alias-table
// entry a texel.
#include "scene/bindings.wgsl"
#include "lib/reservoir.wgsl"
#include "lib/rng.wgsl"

const ENVIRONMENT_DISTANCE = 3.0e38;

// acos(y) by way of atan2, which drivers compute a hundred times more accurately. At the poles, where atan2 is
// undefined, the middle column.
fn environment_uv(direction: vec3f) -> vec2f {
    let r = length(direction.xz);
    let z = select(-direction.z, 1.0, r == 0.0);
    return vec2f(0.5 + atan2(direction.x, z) / (2.0 * PI), atan2(r, direction.y) / PI);
}

// The inverse of `environment_uv`.
fn environment_direction(uv: vec2f) -> vec3f {
    let phi = 2.0 * PI * (uv.x - 0.5);
    let theta = PI * uv.y;
    let r = sin(theta);
    return vec3f(r * sin(phi), cos(theta), -r * cos(phi));
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

// Density per solid angle of `environment_sample`, at any direction.
fn environment_pdf(direction: vec3f) -> f32 {
    let size = textureDimensions(environment_alias);
    return environment_texel_pdf(min(vec2u(environment_uv(direction) * vec2f(size)), size - 1u));
}

// The same at a sample. Exact, where the way over the sample's direction might end up in the next texel.
fn environment_point_pdf(point: u32) -> f32 {
    return environment_texel_pdf(texel_of_cell(unpack_cell(point), textureDimensions(environment_alias)));
}

fn environment_texel_pdf(texel: vec2u) -> f32 {
    return bitcast<f32>(textureLoad(environment_alias, texel, 0).z);
}

// The texel in which the centre of one of the map's 65536 x 65536 cells lies. Sides are at most 8192 texels, so that
// this and the next function are exact.
fn texel_of_cell(cell: vec2u, size: vec2u) -> vec2u {
    return ((2u * cell + 1u) * size) >> vec2u(17u);
}

// The first cell, along both axes, whose centre lies in the texel or after it.
fn first_cell(texel: vec2u, size: vec2u) -> vec2u {
    return ((texel * 131072u + size - 1u) / size) >> vec2u(1u);
}

// A point of the map: a texel by its alias table, then uniform in solid angle among the cells of the texel.
fn environment_sample(bits: vec2u, u: vec3f) -> u32 {
    let size = textureDimensions(environment_alias);
    var texel = vec2u(bits_below(bits.x, size.x), bits_below(bits.y, size.y));
    let entry = textureLoad(environment_alias, texel, 0);
    if u.x >= bitcast<f32>(entry.x) {
        texel = vec2u(entry.y % size.x, entry.y / size.x);
    }
    // Solid angle goes with 1 - cos(theta) = 2 sin^2(theta / 2), theta from the nearer pole: cos(theta) itself has no
    // digits left there.
    let is_southern = 2u * texel.y >= size.y;
    let row = select(texel.y, size.y - 1u - texel.y, is_southern);
    let edges = sin(vec2f(vec2u(row, row + 1u)) * (0.5 * PI / f32(size.y)));
    let height = mix(edges.x * edges.x, edges.y * edges.y, u.z);
    let v = atan2(sqrt(height), sqrt(1.0 - height)) * (2.0 / PI);
    let uv = vec2f((f32(texel.x) + u.y) / f32(size.x), select(v, 1.0 - v, is_southern));
    return pack_cell(clamp(vec2u(uv * 65536.0), first_cell(texel, size), first_cell(texel + 1u, size) - 1u));
}
