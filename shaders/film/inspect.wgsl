// The pixel inspector: what became of the pixel.
// One invocation in all. Reads the frame's radiance and the accumulation. Writes both into the head of the trace.
#include "scene/trace.wgsl"
#include "film/film.wgsl"

@group(1) @binding(1) var radiance: texture_2d<f32>;
@group(1) @binding(2) var<storage, read> accumulation: array<vec4f>;

@compute @workgroup_size(1)
fn main() {
    if any(inspected.pixel >= film.size) {
        return;
    }
    trace.head.radiance = textureLoad(radiance, inspected.pixel, 0);
    let pixel = accumulation[inspected.pixel.y * film.size.x + inspected.pixel.x];
    trace.head.mean = vec4f(pixel.rgb / max(pixel.a, 1.0), 1.0);
    trace.head.samples = pixel.a;
}
