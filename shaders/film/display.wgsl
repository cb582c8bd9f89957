// Exposure and tone mapping.
// One invocation: one pixel. Reads the accumulation. Writes sRGB-encoded RGBA8, red in the lowest byte.
#include "film/show.wgsl"

@group(1) @binding(1) var<storage, read> accumulation: array<vec4f>;
@group(1) @binding(2) var<storage, read> exposure_state: array<f32>;
@group(1) @binding(3) var<storage, read_write> display: array<u32>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= film.size) {
        return;
    }
    let index = id.y * film.size.x + id.x;
    let pixel = accumulation[index];
    display[index] = shown(pixel.rgb / max(pixel.a, 1.0), exposure_state[0]);
}
