// Temporal reuse: the reservoir of the same surface point in the previous frame joins this frame's.
// One invocation: one pixel. Reads both visibility buffers, the scene, this frame's initial reservoirs and the previous frame's
// final ones. Writes the combined reservoirs and counts rays.
// What the previous frame's pixel saw is rebuilt and its shadow rays are traced in the scene as it was then: transforms,
// shapes, lights with their power, and BVH of one frame are kept. So reuse stays unbiased whatever moves or is switched.
// Source: Bitterli et al. 2020, Algorithm 5, lines 8 to 12; thesis 001, section 5.3.1 (rejection by position, normal and
// albedo); history cap of Bitterli et al. 2020, section 4.2.
#include "scene/counters.wgsl"
#include "techniques/common/unobserved.wgsl"
#include "techniques/restir-di/temporal_reuse.wgsl"

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) pixel: vec3u, @builtin(local_invocation_index) local_index: u32) {
    if all(pixel.xy < frame.size) {
        reuse_pixel(pixel.xy);
        count_pixel(pixel.xy);
    }
    flush_ray_count(local_index);
}
