// The pixel inspector at restir-di/temporal.
// One invocation in all. Reads what that pass reads for the inspected pixel. Writes notes on the history that joins, or on why none does, and the pixel's
// reservoirs once more, as that pass left them.
// Source: that of restir-di/temporal.
#include "techniques/common/observed_combination.wgsl"
#include "techniques/restir-di/temporal_reuse.wgsl"

@compute @workgroup_size(1)
fn main() {
    if observe_begin(1u) {
        reuse_pixel(inspected.pixel);
    }
}
