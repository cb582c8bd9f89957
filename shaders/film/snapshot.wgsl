// A picture that a pass has written, as the film would show it.
// One invocation: one pixel. Reads radiance, or what a debug view has in its place. Writes sRGB-encoded RGBA8, red in the lowest
// byte.
#include "film/show.wgsl"

@group(1) @binding(1) var radiance: texture_2d<f32>;
@group(1) @binding(2) var<storage, read> exposure_state: array<f32>;
@group(1) @binding(3) var<storage, read_write> display: array<u32>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if all(id.xy < film.size) {
        display[id.y * film.size.x + id.x] = shown(textureLoad(radiance, id.xy, 0).rgb, exposure_state[0]);
    }
}
