// Proposals of the area and the point strategy, resampled into one reservoir each.
// One invocation: one pixel. Reads the visibility buffer and the scene. Writes the pixel's reservoirs.
// Source: report 003, sections 4.1 to 4.3. No shadow ray: visibility is no part of the desired pdf.
#include "scene/visibility_buffer.wgsl"
#include "techniques/restir-report/proposals.wgsl"

@group(1) @binding(4) var<storage, read_write> reservoirs_out: array<ReportReservoir>;

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
        if stream_update(&stream, proposal.sample, desired_pdf / proposal.pdf, u) {
            selected_pdf = desired_pdf;
        }
    }
    return finish_reservoir(stream, selected_pdf, f32(count));
}

fn sample_pixel(pixel: vec2u) {
    if !pixel_has_surface(pixel) {
        for (var strategy = 0u; strategy < STRATEGY_COUNT; strategy += 1u) {
            reservoirs_out[reservoir_index(pixel, strategy)] = report_reservoir_empty();
        }
        return;
    }
    let surface = load_pixel(pixel);
    let strategies = load_strategies();
    var rng = rng_new(pixel, frame.index, frame.seed, STREAM_INITIAL);
    for (var strategy = 0u; strategy < STRATEGY_COUNT; strategy += 1u) {
        reservoirs_out[reservoir_index(pixel, strategy)] = resample(strategy, strategies, surface, &rng);
    }
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) pixel: vec3u) {
    if all(pixel.xy < frame.size) {
        sample_pixel(pixel.xy);
    }
}
