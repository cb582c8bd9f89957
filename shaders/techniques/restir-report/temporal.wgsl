// Temporal reuse: the previous frame's reservoirs are merged into this frame's.
// One invocation: one pixel. Reads both visibility buffers, the scene, this frame's reservoirs and the previous frame's
// final ones. Writes the merged reservoirs.
// Source: report 003, section 4.5, with what it calls missing in section 8: reprojection, and a test that the history is
// of the same surface. Surface and lights of the history are those of the previous frame, so that lights may revolve.
#include "techniques/common/reprojection.wgsl"
#include "techniques/restir-report/merge.wgsl"
#include "techniques/restir-report/similarity.wgsl"

@group(1) @binding(4) var<storage, read> reservoirs: array<ReportReservoir>;
@group(1) @binding(5) var<storage, read> reservoirs_previous: array<ReportReservoir>;
@group(1) @binding(6) var<storage, read_write> reservoirs_out: array<ReportReservoir>;

fn keep(pixel: vec2u) {
    for (var strategy = 0u; strategy < STRATEGY_COUNT; strategy += 1u) {
        reservoirs_out[reservoir_index(pixel, strategy)] = reservoirs[reservoir_index(pixel, strategy)];
    }
}

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
    if frame.history == 0u || !pixel_has_surface(pixel) {
        keep(pixel);
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
        keep(pixel);
        return;
    }
    let previous_pixel = vec2u(film);
    if !previous_pixel_has_surface(previous_pixel) {
        keep(pixel);
        return;
    }
    let previous = load_previous_pixel(previous_pixel);
    if params.fault_no_reprojection == 0u && !is_similar(surface, position, previous, frame.previous_camera) {
        keep(pixel);
        return;
    }
    var rng = rng_new(pixel, frame.index, frame.seed, STREAM_TEMPORAL);
    for (var strategy = 0u; strategy < STRATEGY_COUNT; strategy += 1u) {
        let own = reservoirs[reservoir_index(pixel, strategy)];
        let history = load_history(previous_pixel, strategy, own.samples_count);
        reservoirs_out[reservoir_index(pixel, strategy)] = merge(own, history, surface, previous, true, &rng);
    }
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) pixel: vec3u) {
    if all(pixel.xy < frame.size) {
        reuse_pixel(pixel.xy);
    }
}
