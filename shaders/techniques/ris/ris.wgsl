// Direct light by resampled importance sampling, without reuse.
// One invocation: one pixel. Reads the visibility buffer and the scene. Writes radiance.
// Source: Talbot et al. 2005; Bitterli et al. 2020, Algorithm 3; Wyman and Panteleev 2021, Eq. 5 (stratified) and 13.
#include "scene/counters.wgsl"
#include "techniques/common/unobserved.wgsl"
#include "techniques/ris/resample.wgsl"

@group(1) @binding(2) var radiance_out: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) pixel: vec3u, @builtin(local_invocation_index) local_index: u32) {
    if all(pixel.xy < frame.size) {
        textureStore(radiance_out, pixel.xy, vec4f(pixel_radiance(pixel.xy), 1.0));
        count_pixel(pixel.xy);
    }
    flush_ray_count(local_index);
}
