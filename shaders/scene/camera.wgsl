// Rays through pixels, and points back to pixels.
#include "scene/bindings.wgsl"
#include "lib/rng.wgsl"

struct Ray {
    origin: vec3f,
    direction: vec3f, // unit
}

// The ray through `film`, in pixels from the top left corner.
fn camera_ray(camera: CameraView, film: vec2f) -> Ray {
    let ndc = (film / vec2f(frame.size) * 2.0 - 1.0) * vec2f(1.0, -1.0);
    let offset = camera.right * ndc.x + camera.up * ndc.y;
    if camera.orthographic == 1u {
        return Ray(camera.position + offset, camera.forward);
    }
    return Ray(camera.position, normalize(camera.forward + offset));
}

const PIXEL_FILTER_BOX = 0u;
const PIXEL_FILTER_CENTER = 1u;

// This frame's ray of a pixel: uniform over the pixel's square (box filter), or through its centre. The same for every
// pass of the frame.
fn primary_ray(pixel: vec2u) -> Ray {
    var rng = rng_new(pixel, frame.index, frame.seed, STREAM_PRIMARY);
    let offset = select(random_2(&rng), vec2f(0.5), frame.pixel_filter == PIXEL_FILTER_CENTER);
    return camera_ray(frame.camera, vec2f(pixel) + offset);
}

// Unit direction from a point to the camera.
fn direction_to_camera(camera: CameraView, position: vec3f) -> vec3f {
    if camera.orthographic == 1u {
        return -camera.forward;
    }
    let to_camera = camera.position - position;
    return to_camera / max(length(to_camera), 1e-20);
}

// Where `camera` sees `position`, in pixels; (-1, -1) if it is behind.
fn project(camera: CameraView, position: vec3f) -> vec2f {
    let clip = camera.world_to_clip * vec4f(position, 1.0);
    if clip.w <= 0.0 {
        return vec2f(-1.0);
    }
    return (clip.xy / clip.w * vec2f(0.5, -0.5) + 0.5) * vec2f(frame.size);
}
