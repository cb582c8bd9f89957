// What a pixel's initial reservoirs hold: the code of restir-di/initial and of its inspection.
#include "scene/visibility_buffer.wgsl"
#include "techniques/common/candidates.wgsl"
#include "techniques/restir-di/reservoirs.wgsl"

fn sample_pixel(pixel: vec2u) {
    let slots = slot_count();
    let lit = pixel_has_surface(pixel) && frame.light_count > 0u;
    if !lit {
        for (var slot = 0u; slot < slots; slot += 1u) {
            store_reservoir(pixel, slot, reservoir_empty());
            observe_result(slot, reservoir_empty(), REASON_NO_SURFACE);
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
        let reservoir = Reservoir(sample.light, sample.point, weight, 1.0);
        store_reservoir(pixel, slot, reservoir);
        observe_result(slot, reservoir, REASON_NONE);
    }
}
