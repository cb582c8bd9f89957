// Kernel 1: selects a candidate from the light tiles, and the two pixels of the previous frame that it will meet.
// One invocation: one pixel. Reads the light tiles, the visibility buffer, materials and the previous frame's domains; no
// lights and no triangles of lights. Writes the pixel's selection, and counts pixels that it rejects.
// Source: Wyman and Panteleev 2021, section 5.2 (candidates), section 6.2 (neighbours, all of the previous frame),
// section 4.3 (which of them are like enough).
#include "techniques/common/unobserved.wgsl"
#include "techniques/restir-di-decoupled/select_samples.wgsl"

@group(1) @binding(6) var<storage, read_write> selections: array<Selection>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let pixel = invocation_pixel(id.xy);
    if any(pixel >= frame.size) {
        return;
    }
    selections[pixel_index(pixel)] = select_samples(pixel);
    count_pixel(pixel);
}
