// The pixel inspector at restir-di-decoupled/shade.
// One invocation in all. Reads what that pass reads for the inspected pixel. Writes notes on the samples that are shaded, and on
// the one that is kept for the next frame.
// Source: that of restir-di-decoupled/shade.
#include "techniques/common/observed_joining.wgsl"
#include "techniques/restir-di-decoupled/observed_value.wgsl"
#include "techniques/restir-di-decoupled/shade_samples.wgsl"

@compute @workgroup_size(1)
fn main() {
    if !observe_begin(1u) {
        return;
    }
    let kept = shade_direct(inspected.pixel, observed_surface, domain_of(observed_surface)).reservoir;
    let confidence_weight = unpack_state(kept.state).confidence_weight;
    observe_result(0u, Reservoir(kept.light, kept.point, kept.unbiased_contribution_weight, confidence_weight), REASON_NONE);
}
