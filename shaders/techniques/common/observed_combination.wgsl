// Notes on a combination of reservoirs: every domain, then what comes out.
#include "techniques/common/observed_value.wgsl"
#include "techniques/common/combine.wgsl"

fn observe_offer(slot: u32, domain: u32) {
    let reservoir = domain_reservoirs[domain];
    var mis_weight = 0.0;
    if canonical_targets[domain] > 0.0 {
        mis_weight = mis_weight_of_domain(domain);
    }
    let weight = mis_weight * canonical_targets[domain] * reservoir.unbiased_contribution_weight;
    observe_joined(slot, observed_pixels[domain], reservoir, mis_weight, weight);
}

fn observe_result(slot: u32, reservoir: Reservoir, reason: u32) {
    if reason == REASON_NONE {
        for (var domain = 0u; domain < domain_count; domain += 1u) {
            observe_offer(slot, domain);
        }
    }
    observe_reservoir(slot, reservoir, reason);
}
