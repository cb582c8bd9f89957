// Initial candidates and visibility reuse.
// One invocation: one pixel. Reads the visibility buffer and the scene. Writes the pixel's reservoirs (1 or 4 slots),
// each with confidence weight 1: one frame's worth of candidates.
// Source: Bitterli et al. 2020, Algorithm 3 and Algorithm 5, lines 2 to 7; thesis 001, section 5.3.1.
#include "scene/visibility_buffer.wgsl"
#include "scene/counters.wgsl"
#include "techniques/common/resampling.wgsl"
#include "techniques/restir-di/params.wgsl"

@group(1) @binding(4) var<storage, read_write> reservoirs_out: array<Reservoir>;

fn sample_pixel(pixel: vec2u) {
    let slots = slot_count();
    let lit = pixel_has_surface(pixel) && frame.light_count > 0u;
    if !lit {
        for (var slot = 0u; slot < slots; slot += 1u) {
            reservoirs_out[reservoir_index(pixel, slot)] = reservoir_empty();
        }
        return;
    }
    let surface = load_pixel(pixel);
    var rng = rng_new(pixel, frame.index, frame.seed, STREAM_INITIAL);
    // Every slot resamples the same candidates with its own random numbers.
    var streams = array<Stream, MAXIMUM_RESERVOIR_SIZE>(
        stream_empty(), stream_empty(), stream_empty(), stream_empty());
    for (var i = 0u; i < params.light_samples; i += 1u) {
        let sample = light_sample(surface.position, &rng);
        let weight = candidate_weight(surface, sample, params.light_samples);
        let u = random_4(&rng);
        for (var slot = 0u; slot < slots; slot += 1u) {
            // By way of a copy: naga cannot pass a pointer to a dynamically indexed element.
            var stream = streams[slot];
            stream_update(&stream, sample, weight, u[slot]);
            streams[slot] = stream;
        }
    }
    for (var slot = 0u; slot < slots; slot += 1u) {
        let sample = streams[slot].selected;
        var weight = stream_contribution_weight(streams[slot], target_function(surface, sample, false));
        // Visibility reuse: a shadowed sample is not passed on.
        if weight > 0.0 && params.visibility_reuse == 1u && !sample_is_visible(surface, sample, false) {
            weight = 0.0;
        }
        reservoirs_out[reservoir_index(pixel, slot)] = Reservoir(sample.light, sample.point, weight, 1.0);
    }
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) pixel: vec3u, @builtin(local_invocation_index) local_index: u32) {
    if all(pixel.xy < frame.size) {
        sample_pixel(pixel.xy);
    }
    flush_ray_count(local_index);
}
