// Spatial reuse: the reservoirs of one neighbour are merged into the pixel's own.
// One invocation: one pixel. Reads the visibility buffer, the scene and the reservoirs of the pass before. Writes the merged
// reservoirs.
// Source: report 003, section 4.6: one neighbour "within a radius based on the screen resolution"; and section 9, the checks
// that it lacks.
#include "scene/visibility_buffer.wgsl"
#include "techniques/restir-report/merge.wgsl"
#include "techniques/restir-report/similarity.wgsl"

@group(1) @binding(4) var<storage, read> reservoirs: array<ReportReservoir>;
@group(1) @binding(5) var<storage, read_write> reservoirs_out: array<ReportReservoir>;

fn keep(pixel: vec2u) {
    for (var strategy = 0u; strategy < STRATEGY_COUNT; strategy += 1u) {
        reservoirs_out[reservoir_index(pixel, strategy)] = reservoirs[reservoir_index(pixel, strategy)];
    }
}

fn reuse_pixel(pixel: vec2u) {
    if !pixel_has_surface(pixel) {
        keep(pixel);
        return;
    }
    var rng = rng_new(pixel, frame.index, frame.seed, STREAM_SPATIAL);
    let offset = sample_disk(random_2(&rng)) * (params.spatial_radius * f32(frame.size.y));
    let candidate = vec2i(floor(vec2f(pixel) + 0.5 + offset));
    if any(candidate < vec2i(0)) || any(candidate >= vec2i(frame.size)) || all(candidate == vec2i(pixel)) {
        keep(pixel);
        return;
    }
    let neighbor = vec2u(candidate);
    if !pixel_has_surface(neighbor) {
        keep(pixel);
        return;
    }
    let surface = load_pixel(pixel);
    let other = load_pixel(neighbor);
    // Fault: any surface will do.
    if params.fault_no_similarity == 0u && !is_similar(surface, surface.position, other, frame.camera) {
        keep(pixel);
        return;
    }
    for (var strategy = 0u; strategy < STRATEGY_COUNT; strategy += 1u) {
        reservoirs_out[reservoir_index(pixel, strategy)] = merge(reservoirs[reservoir_index(pixel, strategy)],
            reservoirs[reservoir_index(neighbor, strategy)], surface, other, false, &rng);
    }
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) pixel: vec3u) {
    if all(pixel.xy < frame.size) {
        reuse_pixel(pixel.xy);
    }
}
