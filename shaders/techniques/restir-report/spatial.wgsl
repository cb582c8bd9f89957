// Spatial reuse: the reservoirs of one neighbour are merged into the pixel's own.
// One invocation: one pixel. Reads the visibility buffer, the scene and the reservoirs of the pass before. Writes the merged
// reservoirs, and counts neighbours that it rejects.
// Source: report 003, section 4.6: one neighbour "within a radius based on the screen resolution"; and section 9, the checks
// that it lacks.
#include "techniques/common/unobserved.wgsl"
#include "techniques/restir-report/spatial_reuse.wgsl"

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) pixel: vec3u) {
    if all(pixel.xy < frame.size) {
        reuse_pixel(pixel.xy);
        count_pixel(pixel.xy);
    }
}
