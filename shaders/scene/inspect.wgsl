// The pixel inspector: what the pixel shows.
// One invocation in all. Reads the visibility buffer and the scene. Writes the head of the trace, with no notes yet.
#include "scene/trace.wgsl"
#include "scene/visibility_buffer.wgsl"

@compute @workgroup_size(1)
fn main() {
    trace.head.count = 0u;
    trace.head.dropped = 0u;
    trace.head.instance = NONE;
    if any(inspected.pixel >= frame.size) || !pixel_has_surface(inspected.pixel) {
        return;
    }
    let surface = load_pixel(inspected.pixel);
    let seen = textureLoad(visibility, inspected.pixel, 0);
    trace.head.instance = seen.x;
    trace.head.triangle = seen.y;
    trace.head.position = surface.position;
    trace.head.depth = dot(surface.position - frame.camera.position, frame.camera.forward);
    trace.head.normal = surface.basis.normal;
    trace.head.metallic = surface.bsdf.metallic;
    trace.head.base_color = surface.bsdf.base_color;
    trace.head.alpha = surface.bsdf.alpha.x;
    trace.head.emission = surface.emission;
}
