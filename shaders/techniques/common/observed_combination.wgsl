// Notes on a combination of reservoirs: every domain, then what comes out.
#include "techniques/common/observed.wgsl"
#include "techniques/common/combine.wgsl"

fn observe_offer(slot: u32, domain: u32) {
    let reservoir = domain_reservoirs[domain];
    var note = observation(OBSERVATION_DOMAIN, slot, reservoir_sample(reservoir));
    note.pixel = observed_pixels[domain];
    note.unbiased_contribution_weight = reservoir.unbiased_contribution_weight;
    note.confidence_weight = reservoir.confidence_weight;
    if canonical_targets[domain] > 0.0 {
        note.mis_weight = mis_weight_of_domain(domain);
        note.resampling_weight = note.mis_weight * canonical_targets[domain] * reservoir.unbiased_contribution_weight;
    }
    observe(note);
}

fn observe_result(slot: u32, reservoir: Reservoir, reason: u32) {
    if reason == REASON_NONE {
        for (var domain = 0u; domain < domain_count; domain += 1u) {
            observe_offer(slot, domain);
        }
    }
    observe_reservoir(slot, reservoir, reason);
}
