// Primary visibility.
// One invocation: one pixel. Reads the scene. Writes the visibility buffer: (instance, triangle, barycentrics as bits),
// instance NONE where the ray left the scene; and counts rays.
// Source: Burns and Hunt 2013, "The Visibility Buffer".
#include "scene/camera.wgsl"
#include "scene/counters.wgsl"

@group(1) @binding(2) var visibility_out: texture_storage_2d<rgba32uint, write>;

fn trace_pixel(pixel: vec2u) {
    let ray = primary_ray(pixel);
    let hit = traverse(ray.origin, ray.direction, 3.0e38, false);
    var result = vec4u(NONE);
    if hit.triangle != NONE {
        result = vec4u(hit.instance, hit.triangle, bitcast<vec2u>(hit.uv));
    }
    textureStore(visibility_out, pixel, result);
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) pixel: vec3u, @builtin(local_invocation_index) local_index: u32) {
    if all(pixel.xy < frame.size) {
        trace_pixel(pixel.xy);
        count_pixel(pixel.xy);
    }
    flush_ray_count(local_index);
}
