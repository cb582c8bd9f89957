// Accumulation.
// One invocation: one pixel. Reads the frame's radiance. Adds it to the sum (rgb) and count (a) of the pixel; a sample
// that is not finite is left out and counted; in the view of these, it is 1 and all others are 0.
#include "film/film.wgsl"
#include "lib/math.wgsl"
#include "film/counters.wgsl"

@group(1) @binding(1) var radiance: texture_2d<f32>;
@group(1) @binding(2) var<storage, read_write> accumulation: array<vec4f>;
@group(1) @binding(3) var<storage, read_write> counters: Counters;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= film.size) {
        return;
    }
    var sample = textureLoad(radiance, id.xy, 0).rgb;
    if film.view == VIEW_NOT_FINITE {
        sample = vec3f(select(1.0, 0.0, is_finite(sample.r) && is_finite(sample.g) && is_finite(sample.b)));
    }
    if is_nan(sample.r) || is_nan(sample.g) || is_nan(sample.b) {
        atomicAdd(&counters.nan, 1u);
        return;
    }
    if is_infinite(sample.r) || is_infinite(sample.g) || is_infinite(sample.b) {
        atomicAdd(&counters.infinite, 1u);
        return;
    }
    accumulation[id.y * film.size.x + id.x] += vec4f(sample, 1.0);
}
