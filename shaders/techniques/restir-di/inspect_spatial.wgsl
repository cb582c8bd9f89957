// The pixel inspector at restir-di/spatial.
// One invocation in all. Reads what that pass reads for the inspected pixel. Writes notes on neighbours that join or are rejected, and the pixel's
// reservoirs once more, as that pass left them.
// Source: that of restir-di/spatial.
#include "techniques/common/observed_combination.wgsl"
#include "techniques/restir-di/spatial_reuse.wgsl"

@compute @workgroup_size(1)
fn main() {
    if observe_begin(2u + pass_index.value) {
        reuse_pixel(inspected.pixel);
    }
}
