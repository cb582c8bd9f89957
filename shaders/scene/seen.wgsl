// What the visibility buffer holds, for a frame that is taken apart.
// One invocation: one pixel. Reads the visibility buffer. Writes a colour for each triangle.
#include "lib/rng.wgsl"
#include "scene/bindings.wgsl"

@group(1) @binding(0) var visibility: texture_2d<u32>;
@group(1) @binding(2) var radiance_out: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) {
        return;
    }
    let seen = textureLoad(visibility, id.xy, 0);
    var color = vec3f(0.0);
    if seen.x != NONE {
        color = vec3f(pcg4d(vec4u(seen.x, seen.y, 1u, 2u)).xyz >> vec3u(8u)) * 5.9604645e-8;
    }
    textureStore(radiance_out, id.xy, vec4f(color, 1.0));
}
