// How a pixel joins its neighbour: the code of restir-report/spatial and of its inspection.
#include "scene/visibility_buffer.wgsl"
#include "techniques/restir-report/merge.wgsl"
#include "techniques/restir-report/similarity.wgsl"
#include "techniques/restir-report/keep.wgsl"

fn reuse_pixel(pixel: vec2u) {
    if !pixel_has_surface(pixel) {
        keep(pixel, REASON_NO_SURFACE);
        return;
    }
    var rng = rng_new(pixel, frame.index, frame.seed, STREAM_SPATIAL);
    let offset = sample_disk(random_2(&rng)) * (params.spatial_radius * f32(frame.size.y));
    let candidate = vec2i(floor(vec2f(pixel) + 0.5 + offset));
    if any(candidate < vec2i(0)) || any(candidate >= vec2i(frame.size)) || all(candidate == vec2i(pixel)) {
        keep(pixel, REASON_NO_NEIGHBOR);
        return;
    }
    let neighbor = vec2u(candidate);
    if !pixel_has_surface(neighbor) {
        observe_rejected(neighbor);
        keep(pixel, REASON_REJECTED);
        return;
    }
    let surface = load_pixel(pixel);
    let other = load_pixel(neighbor);
    // Fault: any surface will do.
    if params.fault_no_similarity == 0u && !is_similar(surface, surface.position, other, frame.camera) {
        observe_rejected(neighbor);
        keep(pixel, REASON_REJECTED);
        return;
    }
    for (var strategy = 0u; strategy < STRATEGY_COUNT; strategy += 1u) {
        let merged = merge(strategy, array<vec2u, 2>(pixel, neighbor), reservoirs[reservoir_index(pixel, strategy)],
            reservoirs[reservoir_index(neighbor, strategy)], surface, other, false, &rng);
        store_reservoir(pixel, strategy, merged, REASON_NONE);
    }
}
