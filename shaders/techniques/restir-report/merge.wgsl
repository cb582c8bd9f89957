// Merging a second reservoir into a pixel's own, right and as the report had it wrong.
//
// Reservoir i, of the pixel itself (0), or of its history or neighbour (1), holds sample y_i with weight W_i and count c_i.
// With p-hat_j the desired pdf at the surface of j and p-hat that of the pixel that merges,
//
//     w_i = m_i(y_i) (c_0 + c_1) p-hat(y_i) W_i,      W = (w_0 + w_1) / (p-hat(y) (c_0 + c_1)),
//     m_i(y) = c_i p-hat_i(y) / (c_0 p-hat_0(y) + c_1 p-hat_1(y)).
//
// No reservoir has met a shadow ray, so p-hat_i > 0 says exactly what reservoir i can hold and this is unbiased without
// shadow rays in the weights (docs/conventions.md; Bitterli et al. 2020, section 4.3; dissertation 004, Eq. 6.19 to 6.22).
// Report 003, section 4.6, only says that "the two reservoirs" are combined; the faults are read from its sections 4.5 to 7.
#include "techniques/restir-report/reservoir.wgsl"

// The merged reservoir of a strategy. `other_surface` is what the other reservoir's pixel sees, in the previous frame if
// `previous`; `pixels` say where both are from.
fn merge(strategy: u32, pixels: array<vec2u, 2>, own: ReportReservoir, other: ReportReservoir, surface: Surface, other_surface: Surface, previous: bool,
    rng: ptr<function, Rng>) -> ReportReservoir {
    let desired_pdf = target_function(surface, report_sample(other), false);
    // Fault: the other's weights stay those of its own pixel, while W divides by the desired pdf at this one.
    let assumed_pdf = select(desired_pdf, other.desired_pdf, params.fault_target_not_reevaluated == 1u);

    let count = own.samples_count + other.samples_count;
    var own_share = own.samples_count / count;
    var other_share = other.samples_count / count;
    // Fault: shares by count alone (1/M), also for a reservoir that could not have made the sample.
    if params.fault_count_weights == 0u {
        let own_pdf_there = target_function(other_surface, report_sample(own), previous);
        own_share = balance(own.samples_count * own.desired_pdf, other.samples_count * own_pdf_there);
        other_share = balance(other.samples_count * other.desired_pdf, own.samples_count * assumed_pdf);
    }

    var stream = stream_empty();
    let own_weight = own_share * count * own.desired_pdf * own.unbiased_contribution_weight;
    let other_weight = other_share * count * assumed_pdf * other.unbiased_contribution_weight;
    observe_joined(strategy, pixels[0], common_reservoir(own), own_share, own_weight / count);
    observe_joined(strategy, pixels[1], common_reservoir(other), other_share, other_weight / count);
    stream_update(&stream, report_sample(own), own_weight, random_1(rng));
    let takes_other = stream_update(&stream, report_sample(other), other_weight, random_1(rng));
    let selected_pdf = select(own.desired_pdf, desired_pdf, takes_other);
    // Fault: the other counts as the one candidate that it was offered as, not as all that it has seen.
    let merged_count = select(count, own.samples_count + 1.0, params.fault_sample_count == 1u);
    return finish_reservoir(stream, selected_pdf, merged_count);
}

// The balance heuristic: the part of a in a + b.
fn balance(a: f32, b: f32) -> f32 {
    return select(a / (a + b), 0.0, a <= 0.0);
}
