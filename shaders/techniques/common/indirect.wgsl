// Indirect light: the reference path tracer's later bounces, without the light that the technique estimates itself.
// One invocation: one pixel. Reads the visibility buffer and the scene. Writes indirect radiance and counts rays.
// Source: as path-tracer (techniques/path-tracer/path.wgsl).
#include "scene/visibility_buffer.wgsl"
#include "scene/counters.wgsl"
#include "techniques/path-tracer/path.wgsl"

@group(1) @binding(2) var indirect_out: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local_index: u32) {
    let pixel = id.xy;
    if all(pixel < frame.size) {
        var radiance = vec3f(0.0);
        if pixel_has_surface(pixel) {
            var rng = rng_new(pixel, frame.index, frame.seed, STREAM_INDIRECT);
            radiance = scattered_radiance(load_pixel(pixel), false, &rng);
        }
        textureStore(indirect_out, pixel, vec4f(radiance, 1.0));
        count_pixel(pixel);
    }
    flush_ray_count(local_index);
}
