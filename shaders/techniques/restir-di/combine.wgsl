// Combining reservoirs of several pixels ("domains") into one: resampled importance sampling with one candidate a domain.
//
// Domain i offers its sample x_i with resampling weight w_i = m_i(x_i) p-hat(x_i) W_i, where p-hat is the target function
// of the pixel that combines (domain 0, the canonical one); the sample y that is selected gets W = sum w / p-hat(y).
// The bias correction is the choice of the MIS weights m_i:
//   none              m_i = c_i / sum_j c_j                                               biased
//   1/Z               m_i = c_i / sum_j c_j over the domains j with p-hat_j(x_i) > 0      biased with visibility reuse
//   MIS               m_i = c_i p-hat_i(x_i) / sum_j c_j p-hat_j(x_i)                     biased with visibility reuse
//   MIS + visibility  the same, with the visibility V_j a factor of p-hat_j               unbiased
// The choices are those of Bitterli et al. 2020, sections 4.3 and 4.4; they stand in the resampling weights, as in
// dissertation 004, chapter 6, not in the contribution weight as in the paper's Algorithm 6: there one m, that of the
// selected sample, multiplies everything, and its spread is noise (measured in docs/techniques/restir-di.md).
#include "techniques/common/resampling.wgsl"
#include "techniques/restir-di/params.wgsl"

const MAXIMUM_DOMAINS = 17u;

// One combination at a time; private variables, for WGSL's base language has no pointers to array elements.
var<private> domain_count: u32;
var<private> domain_reservoirs: array<Reservoir, MAXIMUM_DOMAINS>;
var<private> canonical_targets: array<f32, MAXIMUM_DOMAINS>; // p-hat(x_i)
var<private> mis_numerators: array<f32, MAXIMUM_DOMAINS>; // c_i p-hat_i(x_i), or what the choice has in its place
var<private> mis_denominators: array<f32, MAXIMUM_DOMAINS>; // the sum over j

fn combination_begin() {
    domain_count = 0u;
}

// Step 1, once a domain, the canonical one first: what it offers. Its confidence weight is the one to combine with.
fn combination_offer(reservoir: Reservoir) {
    domain_reservoirs[domain_count] = reservoir;
    canonical_targets[domain_count] = 0.0;
    mis_numerators[domain_count] = 0.0;
    mis_denominators[domain_count] = 0.0;
    domain_count += 1u;
}

// Whether only the canonical domain's surface is needed in step 2.
fn needs_every_domain() -> bool {
    return params.bias_correction != BIAS_CORRECTION_NONE;
}

// p-hat_j(x_i). With visibility as a factor a shadow ray is traced, but for a domain's own sample: visibility reuse and
// this very factor see to it that what a reservoir holds is lit where it is held.
fn domain_target(surface: Surface, sample: LightSample, is_own: bool, previous: bool) -> f32 {
    let value = target_function(surface, sample, previous);
    if value <= 0.0 || params.bias_correction != BIAS_CORRECTION_MIS_VISIBILITY
        || (is_own && params.visibility_reuse == 1u) {
        return value;
    }
    return select(0.0, value, sample_is_visible(surface, sample, previous));
}

// Step 2, once a domain j that is needed: how it values every sample. `previous` says that it is of the previous frame.
fn combination_value(surface: Surface, j: u32, previous: bool) {
    let confidence_weight = domain_reservoirs[j].confidence_weight;
    for (var i = 0u; i < domain_count; i += 1u) {
        if domain_reservoirs[i].unbiased_contribution_weight <= 0.0 {
            continue;
        }
        let value = domain_target(surface, reservoir_sample(domain_reservoirs[i]), i == j, previous);
        if j == 0u {
            canonical_targets[i] = value;
        }
        var share = confidence_weight * value;
        if params.bias_correction == BIAS_CORRECTION_Z {
            share = select(0.0, confidence_weight, value > 0.0);
        }
        mis_denominators[i] += share;
        if i == j {
            mis_numerators[i] = share;
        }
    }
}

// Step 3: selects, and gives the combined reservoir.
fn combination_finish(rng: ptr<function, Rng>) -> Reservoir {
    var stream = stream_empty();
    for (var i = 0u; i < domain_count; i += 1u) {
        stream.confidence_sum += domain_reservoirs[i].confidence_weight;
    }
    var selected_target = 0.0;
    for (var i = 0u; i < domain_count; i += 1u) {
        let reservoir = domain_reservoirs[i];
        var numerator = mis_numerators[i];
        var denominator = mis_denominators[i];
        if params.bias_correction == BIAS_CORRECTION_NONE {
            numerator = reservoir.confidence_weight;
            denominator = stream.confidence_sum;
        }
        let u = random_1(rng);
        if canonical_targets[i] <= 0.0 || denominator <= 0.0 {
            continue;
        }
        let weight = numerator / denominator * canonical_targets[i] * reservoir.unbiased_contribution_weight;
        if stream_update(&stream, reservoir_sample(reservoir), weight, u) {
            selected_target = canonical_targets[i];
        }
    }
    return Reservoir(stream.selected.light, stream.selected.point,
        stream_contribution_weight(stream, selected_target), stream.confidence_sum);
}
