// Spatial reuse: reservoirs of random pixels within a radius join the pixel's own.
// One invocation: one pixel. Reads the visibility buffer and the reservoirs of the pass before. Writes the combined
// reservoirs. Run once an iteration, `pass_index.value` counting from 0.
// Source: Bitterli et al. 2020, Algorithm 5, lines 13 to 19; thesis 001, section 5.4 (depth and normal thresholds).
#include "scene/visibility_buffer.wgsl"
#include "scene/counters.wgsl"
#include "techniques/common/combine.wgsl"
#include "techniques/restir-di/params.wgsl"

struct PassIndex {
    value: u32,
}

@group(1) @binding(4) var<storage, read> reservoirs: array<Reservoir>;
@group(1) @binding(5) var<storage, read_write> reservoirs_out: array<Reservoir>;
@group(1) @binding(6) var<uniform> pass_index: PassIndex;

fn view_depth(position: vec3f) -> f32 {
    return dot(position - frame.camera.position, frame.camera.forward);
}

// Whether a neighbour is like enough to help. It looks only at surfaces, never at samples, so it adds no bias.
fn is_similar(surface: Surface, neighbor: Surface) -> bool {
    if reuse_everything {
        return true;
    }
    let depth = view_depth(surface.position);
    return abs(view_depth(neighbor.position) - depth) <= params.spatial_depth_threshold * abs(depth)
        && dot(surface.basis.normal, neighbor.basis.normal) >= params.spatial_normal_threshold;
}

fn reuse_pixel(pixel: vec2u) {
    if !pixel_has_surface(pixel)
        || reservoirs[reservoir_index(pixel, 0u)].confidence_weight >= params.spatial_confidence_limit {
        for (var slot = 0u; slot < slot_count(); slot += 1u) {
            reservoirs_out[reservoir_index(pixel, slot)] = reservoirs[reservoir_index(pixel, slot)];
        }
        return;
    }
    let surface = load_pixel(pixel);
    var rng = rng_new(pixel, frame.index, frame.seed, STREAM_SPATIAL + pass_index.value);

    // Domain 0 is the pixel itself, the others are those neighbours that are like enough.
    var domains: array<vec2u, MAXIMUM_DOMAINS>;
    domains[0] = pixel;
    var found = 1u;
    for (var i = 0u; i < params.spatial_neighbors; i += 1u) {
        let offset = sample_disk(random_2(&rng)) * params.spatial_radius;
        let candidate = vec2i(floor(vec2f(pixel) + 0.5 + offset));
        if any(candidate < vec2i(0)) || any(candidate >= vec2i(frame.size)) || all(candidate == vec2i(pixel)) {
            continue;
        }
        let neighbor = vec2u(candidate);
        if pixel_has_surface(neighbor) && is_similar(surface, load_pixel(neighbor)) {
            domains[found] = neighbor;
            found += 1u;
        }
    }

    for (var slot = 0u; slot < slot_count(); slot += 1u) {
        combination_begin();
        for (var j = 0u; j < found; j += 1u) {
            combination_offer(reservoirs[reservoir_index(domains[j], slot)]);
        }
        for (var j = 0u; j < combination_valuers(); j += 1u) {
            combination_value(load_pixel(domains[j]), j, false);
        }
        reservoirs_out[reservoir_index(pixel, slot)] = combination_finish(&rng);
    }
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) pixel: vec3u, @builtin(local_invocation_index) local_index: u32) {
    if all(pixel.xy < frame.size) {
        reuse_pixel(pixel.xy);
    }
    flush_ray_count(local_index);
}
