// The pixel inspector at restir-di/initial.
// One invocation in all. Reads what that pass reads for the inspected pixel. Writes notes on every candidate and on what is selected, and the pixel's
// reservoirs once more, as that pass left them.
// Source: that of restir-di/initial.
#include "techniques/common/observed_joining.wgsl"
#include "techniques/common/observed_value.wgsl"
#include "techniques/restir-di/initial_samples.wgsl"

@compute @workgroup_size(1)
fn main() {
    if observe_begin(0u) {
        sample_pixel(inspected.pixel);
    }
}
