// Accumulation.
// One invocation: one pixel. Reads the frame's radiance. Adds it to the sum (rgb) and count (a) of the pixel; a sample
// that is not finite is left out and counted.
#include "film/film.wgsl"
#include "lib/math.wgsl"

struct Counters {
    rays: atomic<u32>,
    nan: atomic<u32>,
    infinite: atomic<u32>,
    padding: u32,
}

@group(1) @binding(1) var radiance: texture_2d<f32>;
@group(1) @binding(2) var<storage, read_write> accumulation: array<vec4f>;
@group(1) @binding(3) var<storage, read_write> counters: Counters;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= film.size) {
        return;
    }
    let sample = textureLoad(radiance, id.xy, 0).rgb;
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
