// Initial candidates, of lights and of the BSDF, and visibility reuse.
// One invocation: one pixel. Reads the visibility buffer and the scene. Writes the pixel's reservoirs (1 or 4 slots),
// each with confidence weight 1: one frame's worth of candidates.
// Source: Bitterli et al. 2020, Algorithm 3 and Algorithm 5, lines 2 to 7; thesis 001, section 5.3.1; thesis
// 000, listing 3.
#include "scene/visibility_buffer.wgsl"
#include "scene/counters.wgsl"
#include "techniques/common/candidates.wgsl"
#include "techniques/restir-di/reservoirs.wgsl"

fn sample_pixel(pixel: vec2u) {
    let slots = slot_count();
    let lit = pixel_has_surface(pixel) && frame.light_count > 0u;
    if !lit {
        for (var slot = 0u; slot < slots; slot += 1u) {
            store_reservoir(pixel, slot, reservoir_empty());
        }
        return;
    }
    let surface = load_pixel(pixel);
    var rng = rng_new(pixel, frame.index, frame.seed, STREAM_INITIAL);
    let settings = CandidateSettings(params.light_samples, params.bsdf_samples, slots, params.stratified);
    select_candidates(surface, settings, &rng);
    for (var slot = 0u; slot < slots; slot += 1u) {
        let sample = streams[slot].selected;
        let valued = value_sample(surface, sample, false);
        var weight = stream_contribution_weight(streams[slot], valued.target_value);
        // Visibility reuse: a shadowed sample is not passed on.
        if weight > 0.0 && params.visibility_reuse == 1u && !sample_is_visible(surface, valued, false) {
            weight = 0.0;
        }
        store_reservoir(pixel, slot, Reservoir(sample.light, sample.point, weight, 1.0));
    }
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) pixel: vec3u, @builtin(local_invocation_index) local_index: u32) {
    if all(pixel.xy < frame.size) {
        sample_pixel(pixel.xy);
    }
    flush_ray_count(local_index);
}
