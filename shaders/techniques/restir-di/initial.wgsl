// Initial candidates, of lights and of the BSDF, and visibility reuse.
// One invocation: one pixel. Reads the visibility buffer and the scene. Writes the pixel's reservoirs (1 or 4 slots),
// each with confidence weight 1: one frame's worth of candidates.
// Source: Bitterli et al. 2020, Algorithm 3 and Algorithm 5, lines 2 to 7; thesis 001, section 5.3.1; thesis
// 000, listing 3.
#include "scene/counters.wgsl"
#include "techniques/common/unobserved.wgsl"
#include "techniques/restir-di/initial_samples.wgsl"

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) pixel: vec3u, @builtin(local_invocation_index) local_index: u32) {
    if all(pixel.xy < frame.size) {
        sample_pixel(pixel.xy);
        count_pixel(pixel.xy);
    }
    flush_ray_count(local_index);
}
