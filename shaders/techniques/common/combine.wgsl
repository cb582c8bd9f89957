// Combining reservoirs of several pixels ("domains") into one: resampled importance sampling with one candidate a domain.
//
// Domain i offers its sample x_i with resampling weight w_i = m_i(x_i) p-hat(x_i) W_i, where p-hat is the target function
// of the pixel that combines (domain 0, the canonical one); the sample y that is selected gets W = sum w / p-hat(y).
// The reuse weights are the choice of the MIS weights m_i. With C the sum of all confidence weights, N = C - c_0:
//   constant    m_i = c_i / C
//   1/|Z|       m_i = c_i / sum_j c_j over the domains j with p-hat_j(x_i) > 0
//   balance     m_i = c_i p-hat_i(x_i) / sum_j c_j p-hat_j(x_i)
//   pairwise    m_i = c_i p-hat_i / (c_0 p-hat_0 + N p-hat_i),  m_0 = sum_j (c_j / N) c_0 p-hat_0 / (c_0 p-hat_0 + N p-hat_j)
//   defensive   m_i = N / C times that of pairwise,             m_0 = c_0 / C + N / C times that of pairwise
// Balance asks every domain about every sample, pairwise the canonical domain about all and each other one about two. With
// `reuse_visibility` the visibility V_j is a factor of p-hat_j. Which of them are biased: docs/conventions.md.
// Sources: Bitterli et al. 2020, sections 4.3 and 4.4, here in the resampling weights as in dissertation 004, Eq. 6.19 and
// 6.36 to 6.38, where a domain of confidence c counts as c domains; thesis 000, Eq. 26 to 29.
#include "techniques/common/resampling.wgsl"

// The choice, fixed when a pipeline is made (src/techniques/reuse.rs); balance if none of constant, valid and pairwise is set.
override reuse_constant: bool = false;
override reuse_everything: bool = false; // no neighbour is to be rejected, whatever it is
override reuse_valid: bool = false; // 1/|Z|
override reuse_pairwise: bool = false;
override reuse_defensive: bool = false; // with reuse_pairwise
override reuse_visibility: bool = false;

const MAXIMUM_DOMAINS = 17u;

// One combination at a time; private variables, for WGSL's base language has no pointers to array elements.
var<private> domain_count: u32;
var<private> confidence_sum: f32; // C
var<private> domain_reservoirs: array<Reservoir, MAXIMUM_DOMAINS>;
var<private> canonical_targets: array<f32, MAXIMUM_DOMAINS>; // p-hat(x_i)
var<private> mis_numerators: array<f32, MAXIMUM_DOMAINS>; // c_i p-hat_i(x_i), or what the choice has in its place
var<private> mis_denominators: array<f32, MAXIMUM_DOMAINS>; // the sum over j; not used by pairwise, whose m_i are sums

fn combination_begin() {
    domain_count = 0u;
    confidence_sum = 0.0;
}

// Step 1, once a domain, the canonical one first: what it offers. Its confidence weight is the one to combine with.
fn combination_offer(reservoir: Reservoir) {
    domain_reservoirs[domain_count] = reservoir;
    canonical_targets[domain_count] = 0.0;
    mis_numerators[domain_count] = 0.0;
    mis_denominators[domain_count] = 0.0;
    domain_count += 1u;
    confidence_sum += reservoir.confidence_weight;
}

// How many domains step 2 needs.
fn combination_valuers() -> u32 {
    if reuse_constant {
        return 1u;
    }
    return domain_count;
}

// p-hat_j(x_i).
fn domain_target(surface: Surface, sample: LightSample, is_own: bool, previous: bool) -> f32 {
    let valued = value_sample(surface, sample, previous);
    if !reuse_visibility || valued.target_value <= 0.0 || (reservoirs_are_visible && is_own) {
        return valued.target_value;
    }
    return select(0.0, valued.target_value, sample_is_visible(surface, valued, previous));
}

// The part of m_i that domain j > 0 has a say in, by its value of x_i: i is j or 0.
fn weigh_pair(i: u32, j: u32, value: f32) {
    let canonical = domain_reservoirs[0].confidence_weight;
    let others = confidence_sum - canonical;
    let denominator = canonical * canonical_targets[i] + others * value;
    if denominator <= 0.0 {
        return;
    }
    // Not 0 / 0 where nobody else has any confidence: the canonical sample has all the weight already.
    let share = domain_reservoirs[j].confidence_weight / max(select(others, confidence_sum, reuse_defensive), 1e-30);
    if i == 0u {
        mis_numerators[0] += share * canonical * canonical_targets[0] / denominator;
    } else {
        mis_numerators[i] = share * others * value / denominator;
    }
}

// Step 2, once a domain j < combination_valuers(), in order: how it values the samples. `previous` says that it is of the
// previous frame.
fn combination_value(surface: Surface, j: u32, previous: bool) {
    let confidence_weight = domain_reservoirs[j].confidence_weight;
    // Samples i = 0, stride, ... : all of them, or the canonical one and the domain's own.
    var stride = 1u;
    var count = domain_count;
    if reuse_pairwise && j > 0u {
        stride = j;
        count = 2u;
    }
    for (var n = 0u; n < count; n += 1u) {
        let i = n * stride;
        // What counts nothing for the canonical domain needs no weight.
        if domain_reservoirs[i].unbiased_contribution_weight <= 0.0 || (j > 0u && canonical_targets[i] <= 0.0) {
            continue;
        }
        let value = domain_target(surface, reservoir_sample(domain_reservoirs[i]), i == j, previous);
        if j == 0u {
            canonical_targets[i] = value;
        }
        if reuse_pairwise {
            if j > 0u {
                weigh_pair(i, j, value);
            } else if i == 0u && (reuse_defensive || confidence_sum <= confidence_weight) {
                mis_numerators[0] = confidence_weight / confidence_sum;
            }
            continue;
        }
        var share = confidence_weight * value;
        if reuse_valid {
            share = select(0.0, confidence_weight, value > 0.0);
        }
        mis_denominators[i] += share;
        if i == j {
            mis_numerators[i] = share;
        }
    }
}

// m_i(x_i).
fn mis_weight_of_domain(i: u32) -> f32 {
    if reuse_constant {
        return domain_reservoirs[i].confidence_weight / confidence_sum;
    }
    if reuse_pairwise {
        return mis_numerators[i];
    }
    return select(0.0, mis_numerators[i] / mis_denominators[i], mis_denominators[i] > 0.0);
}

// Step 3: selects, and gives the combined reservoir.
fn combination_finish(rng: ptr<function, Rng>) -> Reservoir {
    var stream = stream_empty();
    stream.confidence_sum = confidence_sum;
    var selected_target = 0.0;
    for (var i = 0u; i < domain_count; i += 1u) {
        let reservoir = domain_reservoirs[i];
        let u = random_1(rng);
        if canonical_targets[i] <= 0.0 {
            continue;
        }
        let weight = mis_weight_of_domain(i) * canonical_targets[i] * reservoir.unbiased_contribution_weight;
        if stream_update(&stream, reservoir_sample(reservoir), weight, u) {
            selected_target = canonical_targets[i];
        }
    }
    return Reservoir(stream.selected.light, stream.selected.point,
        stream_contribution_weight(stream, selected_target), stream.confidence_sum);
}
