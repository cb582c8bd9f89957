// The pixel inspector at restir-di-decoupled/select.
// One invocation in all. Reads what that pass reads for the inspected pixel. Writes notes on every candidate, on what is
// selected, and on pixels of the previous frame that are too different.
// Source: that of restir-di-decoupled/select.
#include "techniques/common/observed_joining.wgsl"
#include "techniques/restir-di-decoupled/observed_value.wgsl"
#include "techniques/restir-di-decoupled/select_samples.wgsl"

@compute @workgroup_size(1)
fn main() {
    // A pixel that is left out has none.
    if !observe_begin(0u) || is_left_out(inspected.pixel) {
        return;
    }
    let selection = select_samples(inspected.pixel);
    let candidate = Reservoir(selection.light, selection.point, selection.unbiased_contribution_weight, 1.0);
    observe_result(0u, candidate, REASON_NONE);
}
