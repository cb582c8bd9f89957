// Light from infinitely far away: an equirectangular map (docs/conventions.md) and a sun, both turned about +Y by
// `frame.environment_turn`.
//
// A texel of the map is drawn with probability proportional to its weight, solid angle times mean luminance, in one of
// two ways: by an alias table that was made when the scene was loaded, or by descent of a pyramid of weights that passes
// make every frame (scene/environment_weights.wgsl). Within the texel directions are uniform in solid angle.
#include "scene/environment_map.wgsl"
#include "scene/environment_turn.wgsl"
#include "scene/sun.wgsl"
#include "lib/reservoir.wgsl"
#include "lib/rng.wgsl"

const ENVIRONMENT_DISTANCE = 3.0e38;

// Radiance of the map alone from the direction towards which a ray leaves the scene.
fn environment_map_radiance(direction: vec3f) -> vec3f {
    if !scene_has_environment {
        return vec3f(0.0);
    }
    return environment_read(environment_uv(turn_to_map(direction, frame.environment_turn)));
}

// Radiance from the direction towards which a ray leaves the scene; black without environment and sun.
fn environment_evaluate(direction: vec3f) -> vec3f {
    return environment_map_radiance(direction) + sun_radiance(direction);
}

// Density per solid angle of `environment_sample`, at any direction.
fn environment_pdf(direction: vec3f) -> f32 {
    let size = textureDimensions(environment_radiance);
    let uv = environment_uv(turn_to_map(direction, frame.environment_turn));
    return environment_texel_pdf(min(vec2u(uv * vec2f(size)), size - 1u));
}

// The same at a sample. Exact, where the way over the sample's direction might end up in the next texel.
fn environment_point_pdf(point: u32) -> f32 {
    return environment_texel_pdf(texel_of_cell(unpack_cell(point), textureDimensions(environment_radiance)));
}

fn environment_texel_pdf(texel: vec2u) -> f32 {
    if !scene_has_environment_pyramid {
        return bitcast<f32>(textureLoad(environment_alias, texel, 0).z);
    }
    // The probabilities of the descent, child over parent, multiply to texel over total.
    let weights = textureLoad(environment_pyramid, texel / 2u, 0);
    let top = textureLoad(environment_pyramid, vec2u(0u), textureNumLevels(environment_pyramid) - 1u);
    let size = textureDimensions(environment_radiance);
    let weight = weights[(texel.x & 1u) + 2u * (texel.y & 1u)];
    return weight / (pyramid_sum(top) * environment_texel_solid_angle(texel.y, size));
}

// The sum of a texel of the pyramid, the same wherever it is taken.
fn pyramid_sum(weights: vec4f) -> f32 {
    return ((weights.x + weights.y) + weights.z) + weights.w;
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

// A point of the map.
fn environment_sample(bits: vec2u, rng: ptr<function, Rng>) -> u32 {
    let u = random_4(rng);
    if scene_has_environment_pyramid {
        return environment_cell(environment_texel_by_pyramid(rng), u.yz);
    }
    return environment_cell(environment_texel_by_alias(bits, u.x), u.yz);
}

fn environment_texel_by_alias(bits: vec2u, u: f32) -> vec2u {
    let size = textureDimensions(environment_alias);
    let texel = vec2u(bits_below(bits.x, size.x), bits_below(bits.y, size.y));
    let entry = textureLoad(environment_alias, texel, 0);
    if u >= bitcast<f32>(entry.x) {
        return vec2u(entry.y % size.x, entry.y / size.x);
    }
    return texel;
}

// Inversion of the distribution function, level by level: one of the four children of each texel, from the coarsest
// level down to the texels of the map (Wyman and Panteleev 2021, section 5.3). Each level has a random word of its own,
// for a number that is scaled up from level to level runs out of digits.
fn environment_texel_by_pyramid(rng: ptr<function, Rng>) -> vec2u {
    let levels = textureNumLevels(environment_pyramid);
    var texel = vec2u(0u);
    var words = vec4u(0u);
    for (var i = 0u; i < levels; i += 1u) {
        if i % 4u == 0u {
            words = random_bits(rng);
        }
        let weights = textureLoad(environment_pyramid, texel, levels - 1u - i);
        let u = bits_to_unit(words.x) * pyramid_sum(weights);
        words = words.yzww;
        let is_past = vec3<bool>(u >= weights.x, u >= weights.x + weights.y, u >= weights.x + weights.y + weights.z);
        let child = u32(is_past.x) + u32(is_past.y) + u32(is_past.z);
        texel = 2u * texel + vec2u(child & 1u, child >> 1u);
    }
    return texel;
}

// A point within a texel, uniform in solid angle among the cells whose centre lies in it.
fn environment_cell(texel: vec2u, u: vec2f) -> u32 {
    let size = textureDimensions(environment_radiance);
    // Solid angle goes with 1 - cos(theta) = 2 sin^2(theta / 2), theta from the nearer pole: cos(theta) itself has no
    // digits left there.
    let is_southern = 2u * texel.y >= size.y;
    let row = select(texel.y, size.y - 1u - texel.y, is_southern);
    let edges = sin(vec2f(vec2u(row, row + 1u)) * (0.5 * PI / f32(size.y)));
    let height = mix(edges.x * edges.x, edges.y * edges.y, u.y);
    let v = atan2(sqrt(height), sqrt(1.0 - height)) * (2.0 / PI);
    let uv = vec2f((f32(texel.x) + u.x) / f32(size.x), select(v, 1.0 - v, is_southern));
    return pack_cell(clamp(vec2u(uv * 65536.0), first_cell(texel, size), first_cell(texel + 1u, size) - 1u));
}
