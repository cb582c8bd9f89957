// The pixel inspector at restir-report/spatial.
// One invocation in all. Reads what that pass reads for the inspected pixel. Writes notes on the neighbour that joins or is rejected, and the pixel's
// reservoirs once more, as that pass left them.
// Source: that of restir-report/spatial.
#include "techniques/common/observed_joining.wgsl"
#include "techniques/common/observed_value.wgsl"
#include "techniques/restir-report/spatial_reuse.wgsl"

@compute @workgroup_size(1)
fn main() {
    if observe_begin(2u) {
        reuse_pixel(inspected.pixel);
    }
}
