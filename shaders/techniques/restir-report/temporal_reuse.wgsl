// How a pixel joins its history: the code of restir-report/temporal and of its inspection.
#include "techniques/common/reprojection.wgsl"
#include "techniques/restir-report/merge.wgsl"
#include "techniques/restir-report/similarity.wgsl"
#include "techniques/restir-report/keep.wgsl"

@group(1) @binding(5) var<storage, read> reservoirs_previous: array<ReportReservoir>;

// The history of a strategy as this frame may use it: its area measure is this frame's, its count is capped.
fn load_history(pixel: vec2u, strategy: u32, own_count: f32) -> ReportReservoir {
    var history = reservoirs_previous[reservoir_index(pixel, strategy)];
    if history.light != NONE {
        let growth = history_factor(history.light);
        history.unbiased_contribution_weight *= growth;
        history.desired_pdf = select(0.0, history.desired_pdf / growth, growth > 0.0);
    }
    history.samples_count = min(history.samples_count, params.history_cap * own_count);
    return history;
}

fn reuse_pixel(pixel: vec2u) {
    if frame.history == 0u {
        keep(pixel, REASON_NO_HISTORY);
        return;
    }
    if !pixel_has_surface(pixel) {
        keep(pixel, REASON_NO_SURFACE);
        return;
    }
    let surface = load_pixel(pixel);
    // Fault: the history is that of the same pixel, whatever it sees.
    var film = vec2f(pixel);
    var position = surface.position;
    if params.fault_no_reprojection == 0u {
        position = previous_position(pixel);
        film = project(frame.previous_camera, position);
    }
    if !is_on_film(film) {
        keep(pixel, REASON_OFF_FILM);
        return;
    }
    let previous_pixel = vec2u(film);
    if !previous_pixel_has_surface(previous_pixel) {
        keep(pixel, REASON_NO_SURFACE);
        return;
    }
    let previous = load_previous_pixel(previous_pixel);
    if params.fault_no_reprojection == 0u && !is_similar(surface, position, previous, frame.previous_camera) {
        keep(pixel, REASON_OTHER_SURFACE);
        return;
    }
    var rng = rng_new(pixel, frame.index, frame.seed, STREAM_TEMPORAL);
    for (var strategy = 0u; strategy < STRATEGY_COUNT; strategy += 1u) {
        let own = reservoirs[reservoir_index(pixel, strategy)];
        let history = load_history(previous_pixel, strategy, own.samples_count);
        let pixels = array<vec2u, 2>(pixel, previous_pixel);
        store_reservoir(pixel, strategy, merge(strategy, pixels, own, history, surface, previous, true, &rng), REASON_NONE);
    }
}
