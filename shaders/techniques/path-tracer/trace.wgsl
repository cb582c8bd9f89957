// The reference path tracer: one path a pixel a frame.
// One invocation: one pixel. Reads the visibility buffer and the scene. Writes radiance.
// Source: thesis 000, section 2.1 and 2.2; the path itself is in path.wgsl.
#include "scene/visibility_buffer.wgsl"
#include "scene/counters.wgsl"
#include "techniques/path-tracer/path.wgsl"

@group(1) @binding(2) var radiance_out: texture_storage_2d<rgba32float, write>;

fn pixel_radiance(pixel: vec2u) -> vec3f {
    if !pixel_has_surface(pixel) {
        return environment_evaluate(primary_ray(pixel).direction);
    }
    let surface = load_pixel(pixel);
    var rng = rng_new(pixel, frame.index, frame.seed, STREAM_PATH);
    return surface.emission + scattered_radiance(surface, true, &rng);
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) pixel: vec3u, @builtin(local_invocation_index) local_index: u32) {
    if all(pixel.xy < frame.size) {
        textureStore(radiance_out, pixel.xy, vec4f(pixel_radiance(pixel.xy), 1.0));
        count_pixel(pixel.xy);
    }
    flush_ray_count(local_index);
}
