// Combining reservoirs of several pixels ("domains") into one, with the choice of bias correction.
//
// Every domain j offers its sample y_j with weight c_j p-hat(y_j) W_j, where p-hat is the target function of the pixel
// that combines; one sample y is selected. Its weight is then W = m(y) / p-hat(y) times the sum of the weights, and the
// correction is the choice of m (Bitterli et al. 2020, Algorithms 4 and 6, in the confidence weights of dissertation
// 004, chapter 6):
//   none              m = 1 / sum of c_j over all domains                                           biased
//   1/Z               m = 1 / sum of c_j over domains with p-hat_j(y) > 0                           biased
//   MIS               m = p-hat_s(y) / sum of c_j p-hat_j(y), s the domain y came from              biased
//   MIS + visibility  the same with p-hat_j V_j for p-hat_j                                         unbiased
// 1/Z and MIS would be unbiased if supports were told apart by p-hat alone; visibility reuse makes supports shadowed,
// and only the last follows that.
#include "techniques/common/resampling.wgsl"
#include "techniques/restir-di/params.wgsl"

struct Combination {
    stream: Stream,
    source: u32, // s: which domain the selected sample came from
    source_target: f32, // p-hat_s(y)
    denominator: f32, // the sum that m divides by
}

fn combination_empty() -> Combination {
    return Combination(stream_empty(), NONE, 0.0, 0.0);
}

// Step 1, once a domain: offers the domain's sample. `canonical` is the surface of the pixel that combines.
fn combination_offer(combination: ptr<function, Combination>, canonical: Surface, reservoir: Reservoir, domain: u32,
    u: f32) {
    (*combination).stream.confidence_sum += reservoir.confidence_weight;
    if reservoir.unbiased_contribution_weight <= 0.0 {
        return;
    }
    let sample = reservoir_sample(reservoir);
    let weight = reservoir.confidence_weight * target_function(canonical, sample, false)
        * reservoir.unbiased_contribution_weight;
    // By way of a copy: WGSL's base language has no pointers to members as arguments.
    var stream = (*combination).stream;
    if stream_update(&stream, sample, weight, u) {
        (*combination).source = domain;
    }
    (*combination).stream = stream;
}

// Step 2, once a domain: how likely the domain would have been to make the selected sample.
fn combination_correct(combination: ptr<function, Combination>, surface: Surface, domain: u32, confidence_weight: f32,
    previous: bool) {
    if params.bias_correction == BIAS_CORRECTION_NONE || (*combination).source == NONE {
        return;
    }
    let selected = (*combination).stream.selected;
    var value = target_function(surface, selected, previous);
    if params.bias_correction == BIAS_CORRECTION_Z {
        (*combination).denominator += select(0.0, confidence_weight, value > 0.0);
        return;
    }
    if value > 0.0 && params.bias_correction == BIAS_CORRECTION_MIS_VISIBILITY
        && !sample_is_visible(surface, selected, previous) {
        value = 0.0;
    }
    (*combination).denominator += confidence_weight * value;
    if (*combination).source == domain {
        (*combination).source_target = value;
    }
}

// Step 3: the combined reservoir.
fn combination_finish(combination: Combination, canonical: Surface) -> Reservoir {
    let stream = combination.stream;
    let selected = stream.selected;
    var m = 0.0;
    switch params.bias_correction {
        case BIAS_CORRECTION_NONE: { m = 1.0 / max(stream.confidence_sum, 1e-20); }
        case BIAS_CORRECTION_Z: { m = select(0.0, 1.0 / combination.denominator, combination.denominator > 0.0); }
        default: {
            m = select(0.0, combination.source_target / combination.denominator, combination.denominator > 0.0);
        }
    }
    var weight = 0.0;
    if combination.source != NONE {
        weight = m * stream_contribution_weight(stream, target_function(canonical, selected, false));
    }
    return Reservoir(selected.light, selected.point, weight, stream.confidence_sum);
}
