// What a pixel's initial reservoirs hold: the code of restir-report/initial and of its inspection.
#include "scene/visibility_buffer.wgsl"
#include "techniques/restir-report/proposals.wgsl"
#include "techniques/restir-report/store.wgsl"

fn resample(strategy: u32, strategies: Strategies, surface: Surface, rng: ptr<function, Rng>) -> ReportReservoir {
    var stream = stream_empty();
    var selected_pdf = 0.0;
    let count = proposal_count();
    for (var i = 0u; i < count; i += 1u) {
        let proposal = propose(strategy, strategies, surface.position, rng);
        let u = random_1(rng);
        if proposal.pdf <= 0.0 {
            continue;
        }
        let desired_pdf = target_function(surface, proposal.sample, false);
        let weight = desired_pdf / proposal.pdf;
        observe_candidate(strategy, proposal.sample, weight / f32(count));
        if stream_update(&stream, proposal.sample, weight, u) {
            selected_pdf = desired_pdf;
        }
    }
    return finish_reservoir(stream, selected_pdf, f32(count));
}

fn sample_pixel(pixel: vec2u) {
    if !pixel_has_surface(pixel) {
        for (var strategy = 0u; strategy < STRATEGY_COUNT; strategy += 1u) {
            store_reservoir(pixel, strategy, report_reservoir_empty(), REASON_NO_SURFACE);
        }
        return;
    }
    let surface = load_pixel(pixel);
    let strategies = load_strategies();
    var rng = rng_new(pixel, frame.index, frame.seed, STREAM_INITIAL);
    for (var strategy = 0u; strategy < STRATEGY_COUNT; strategy += 1u) {
        store_reservoir(pixel, strategy, resample(strategy, strategies, surface, &rng), REASON_NONE);
    }
}
