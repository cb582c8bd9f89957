// The report's reservoir (report 003, section 4.1): a sample, its desired pdf, the final weight and the number of samples
// seen; the accumulated weight sum is the product of the last three. In the terms of docs/conventions.md the desired pdf is
// the target function p-hat, the final weight is W, and the number of samples, counted in proposals, is the confidence
// weight c.
#include "techniques/common/resampling.wgsl"
#include "techniques/restir-report/params.wgsl"

struct ReportReservoir {
    light: u32,
    point: u32,
    desired_pdf: f32, // p-hat of the sample at the pixel that holds it
    unbiased_contribution_weight: f32, // W = WeightSum / (Pdf * SamplesCount)
    samples_count: f32,
}

// One reservoir a strategy, side by side for each pixel. The report's third strategy, the indirect direction, has no
// reservoir yet: it would be number 2 and make the count 3.
const STRATEGY_AREA = 0u;
const STRATEGY_POINT = 1u;
const STRATEGY_COUNT = 2u;

fn reservoir_index(pixel: vec2u, strategy: u32) -> u32 {
    return (pixel.y * frame.size.x + pixel.x) * STRATEGY_COUNT + strategy;
}

fn report_reservoir_empty() -> ReportReservoir {
    return ReportReservoir(NONE, 0u, 0.0, 0.0, 0.0);
}

fn report_sample(reservoir: ReportReservoir) -> LightSample {
    return LightSample(reservoir.light, reservoir.point);
}

fn common_reservoir(reservoir: ReportReservoir) -> Reservoir {
    return Reservoir(reservoir.light, reservoir.point, reservoir.unbiased_contribution_weight, reservoir.samples_count);
}

// A reservoir once everything has been offered to its stream: Weight = WeightSum / (Pdf * SamplesCount) (section 4.3).
// Where nothing was selected Weight and Pdf are 0. `fault_unguarded_pdf` divides all the same.
fn finish_reservoir(stream: Stream, desired_pdf: f32, samples_count: f32) -> ReportReservoir {
    var weight = stream.weight_sum / (desired_pdf * samples_count);
    if params.fault_unguarded_pdf == 0u {
        let mean = Stream(stream.selected, stream.weight_sum / max(samples_count, 1e-30), samples_count);
        weight = stream_contribution_weight(mean, desired_pdf);
    }
    return ReportReservoir(stream.selected.light, stream.selected.point, desired_pdf, weight, samples_count);
}
