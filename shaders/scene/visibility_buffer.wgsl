// The visibility buffer: what each pixel's primary ray hit, as (instance, triangle, barycentrics). Surfaces are rebuilt
// from it where they are needed, this frame's and the previous frame's alike, instead of being kept in a fat G-buffer.
#include "scene/camera.wgsl"
#include "scene/surface.wgsl"

@group(1) @binding(0) var visibility: texture_2d<u32>;

fn pixel_has_surface(pixel: vec2u) -> bool {
    return textureLoad(visibility, pixel, 0).x != NONE;
}

// The surface at a point of a triangle, as a pixel of `camera` sees it.
fn load_seen(camera: CameraView, instance: u32, triangle: u32, uv: vec2f) -> Surface {
    let position = triangle_point(instance, triangle, uv);
    return load_surface(instance, triangle, uv, direction_to_camera(camera, position),
        camera_footprint(camera, position));
}

// The surface at a pixel that has one.
fn load_pixel(pixel: vec2u) -> Surface {
    let v = textureLoad(visibility, pixel, 0);
    let uv = bitcast<vec2f>(v.zw);
    return load_seen(frame.camera, v.x, v.y, uv);
}
