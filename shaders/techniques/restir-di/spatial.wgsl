// Spatial reuse: reservoirs of random pixels within a radius join the pixel's own.
// One invocation: one pixel. Reads the visibility buffer, the scene, the reservoirs of the pass before and, for their confidence
// weights, those that reuse in time left (`reservoirs_previous`). Writes the combined reservoirs and counts rays. Run once an
// iteration, `pass_index.value` counting from 0.
// Source: Bitterli et al. 2020, Algorithm 5, lines 13 to 19; thesis 001, section 5.4 (depth and normal thresholds); thesis
// 000, section 4.5.4 (retries); Wyman and Panteleev 2021, section 6.4 (more neighbours without history).
#include "scene/counters.wgsl"
#include "techniques/common/unobserved.wgsl"
#include "techniques/restir-di/spatial_reuse.wgsl"

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) pixel: vec3u, @builtin(local_invocation_index) local_index: u32) {
    if all(pixel.xy < frame.size) {
        reuse_pixel(pixel.xy);
        count_pixel(pixel.xy);
    }
    flush_ray_count(local_index);
}
