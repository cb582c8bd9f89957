// The template technique: shading normals as colours.
// One invocation: one pixel. Reads the visibility buffer. Writes radiance.
#include "scene/visibility_buffer.wgsl"

@group(1) @binding(2) var radiance_out: texture_storage_2d<rgba32float, write>;
@group(1) @binding(3) var<uniform> params: NormalsParams;

struct NormalsParams {
    geometric: u32,
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let pixel = id.xy;
    if any(pixel >= frame.size) {
        return;
    }
    var color = vec3f(0.0);
    if pixel_has_surface(pixel) {
        let surface = load_pixel(pixel);
        color = select(surface.basis.normal, surface.geometric_normal, params.geometric == 1u) * 0.5 + 0.5;
    }
    textureStore(radiance_out, pixel, vec4f(color, 1.0));
}
