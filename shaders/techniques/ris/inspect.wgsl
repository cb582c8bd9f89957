// The pixel inspector at ris/ris.
// One invocation in all. Reads what that pass reads for the inspected pixel. Writes notes on every candidate and on what is
// selected.
// Source: that of ris/ris.
#include "techniques/common/observed_joining.wgsl"
#include "techniques/common/observed_value.wgsl"
#include "techniques/ris/resample.wgsl"

@compute @workgroup_size(1)
fn main() {
    if observe_begin(0u) {
        _ = pixel_radiance(inspected.pixel);
    }
}
