// Auxiliary pictures for denoisers, EXR channels and debug views.
// One invocation: one pixel. Reads the visibility buffer. Writes albedo (rgb) with depth along the view axis in metres
// (a), and the world-space shading normal (xyz) with the instance (w); zero where there is no surface.
#include "scene/visibility_buffer.wgsl"

@group(1) @binding(1) var albedo_depth_out: texture_storage_2d<rgba32float, write>;
@group(1) @binding(2) var normal_out: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let pixel = id.xy;
    if any(pixel >= frame.size) {
        return;
    }
    var albedo_depth = vec4f(0.0);
    var normal = vec4f(0.0);
    if pixel_has_surface(pixel) {
        let surface = load_pixel(pixel);
        let depth = dot(surface.position - frame.camera.position, frame.camera.forward);
        albedo_depth = vec4f(surface.bsdf.base_color, depth);
        normal = vec4f(surface.basis.normal, f32(surface.instance));
    }
    textureStore(albedo_depth_out, pixel, albedo_depth);
    textureStore(normal_out, pixel, normal);
}
