// Temporal reuse: the previous frame's reservoirs are merged into this frame's.
// One invocation: one pixel. Reads both visibility buffers, the scene, this frame's reservoirs and the previous frame's
// final ones. Writes the merged reservoirs.
// Source: report 003, section 4.5, with what it calls missing in section 8: reprojection, and a test that the history is
// of the same surface. Surface and lights of the history are those of the previous frame, so that lights may revolve.
#include "techniques/common/unobserved.wgsl"
#include "techniques/restir-report/temporal_reuse.wgsl"

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) pixel: vec3u) {
    if all(pixel.xy < frame.size) {
        reuse_pixel(pixel.xy);
    }
}
