// The pixel inspector at restir-report/temporal.
// One invocation in all. Reads what that pass reads for the inspected pixel. Writes notes on the history that joins, or on why none does, and the pixel's
// reservoirs once more, as that pass left them.
// Source: that of restir-report/temporal.
#include "techniques/common/observed_joining.wgsl"
#include "techniques/common/observed_value.wgsl"
#include "techniques/restir-report/temporal_reuse.wgsl"

@compute @workgroup_size(1)
fn main() {
    if observe_begin(1u) {
        reuse_pixel(inspected.pixel);
    }
}
