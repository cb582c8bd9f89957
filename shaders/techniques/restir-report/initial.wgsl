// Proposals of the area and the point strategy, resampled into one reservoir each.
// One invocation: one pixel. Reads the visibility buffer and the scene. Writes the pixel's reservoirs.
// Source: report 003, sections 4.1 to 4.3. No shadow ray: visibility is no part of the desired pdf.
#include "techniques/common/unobserved.wgsl"
#include "techniques/restir-report/initial_samples.wgsl"

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) pixel: vec3u) {
    if all(pixel.xy < frame.size) {
        sample_pixel(pixel.xy);
    }
}
