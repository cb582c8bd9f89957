// Auxiliary pictures for denoisers, EXR channels and debug views.
// One invocation: one pixel. Reads the visibility buffer. Writes albedo (rgb) with depth along the view axis in metres
// (a), and the world-space shading normal (xyz) with the instance (w), zero where there is no surface; and how far what is
// seen has moved in the picture since the previous frame, in pixels, x to the right and y down.
// Source of motion: thesis 000, section 4.2.3.
#include "scene/visibility_buffer.wgsl"

@group(1) @binding(1) var albedo_depth_out: texture_storage_2d<rgba32float, write>;
@group(1) @binding(2) var normal_out: texture_storage_2d<rgba32float, write>;
@group(1) @binding(3) var motion_out: texture_storage_2d<rgba32float, write>;

// Zero for what the previous frame's camera had behind it.
fn pixel_motion(pixel: vec2u) -> vec2f {
    let seen = textureLoad(visibility, pixel, 0);
    // What is infinitely far away moves with the camera's turn alone.
    let ray = primary_ray(pixel);
    var now = vec4f(ray.direction, 0.0);
    var before = now;
    if seen.x != NONE {
        let uv = bitcast<vec2f>(seen.zw);
        now = vec4f(triangle_point(seen.x, seen.y, uv), 1.0);
        before = vec4f(triangle_point(previous_instance(seen.x), previous_triangle(seen.x, seen.y), uv), 1.0);
    }
    let clip = frame.camera.world_to_clip * now;
    let previous_clip = frame.previous_camera.world_to_clip * before;
    if clip.w <= 0.0 || previous_clip.w <= 0.0 {
        return vec2f(0.0);
    }
    return (clip.xy / clip.w - previous_clip.xy / previous_clip.w) * vec2f(0.5, -0.5) * vec2f(frame.size);
}

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
    textureStore(motion_out, pixel, vec4f(pixel_motion(pixel), 0.0, 0.0));
}
