// Where what a pixel sees was one frame ago.
#include "scene/visibility_buffer.wgsl"

@group(1) @binding(2) var previous_visibility: texture_2d<u32>;

// Where the point that a pixel sees was in the previous frame.
fn previous_position(pixel: vec2u) -> vec3f {
    let seen = textureLoad(visibility, pixel, 0);
    return triangle_point(previous_instance(seen.x), previous_triangle(seen.x, seen.y), bitcast<vec2f>(seen.zw));
}

fn previous_pixel_has_surface(pixel: vec2u) -> bool {
    return textureLoad(previous_visibility, pixel, 0).x != NONE;
}

// The surface that a pixel saw in the previous frame, as it was then: triangles are numbered for their frame, instances are those
// of this one.
fn load_previous_pixel(pixel: vec2u) -> Surface {
    let seen = textureLoad(previous_visibility, pixel, 0);
    return load_seen(frame.previous_camera, previous_instance(seen.x), seen.y, bitcast<vec2f>(seen.zw));
}

// How deep in the previous frame's picture a point was.
fn previous_depth(position: vec3f) -> f32 {
    return dot(position - frame.previous_camera.position, frame.previous_camera.forward);
}

fn is_on_film(film: vec2f) -> bool {
    return all(film >= vec2f(0.0)) && all(film < vec2f(frame.size));
}
