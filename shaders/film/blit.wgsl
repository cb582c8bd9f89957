// The display buffer onto a canvas of any size, nearest pixel.
// One vertex invocation: a corner of one triangle that covers the canvas. One fragment: one canvas pixel.
#include "film/film.wgsl"

@group(1) @binding(1) var<storage, read> display: array<u32>;

struct Vertex {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Vertex {
    let uv = vec2f(f32((index << 1u) & 2u), f32(index & 2u));
    return Vertex(vec4f(uv * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0), 0.0, 1.0), uv);
}

@fragment
fn fragment(vertex: Vertex) -> @location(0) vec4f {
    let pixel = min(vec2u(vertex.uv * vec2f(film.size)), film.size - 1u);
    return unpack4x8unorm(display[pixel.y * film.size.x + pixel.x]);
}
