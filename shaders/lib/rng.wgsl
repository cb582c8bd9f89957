// Counter-based random numbers: a pure function of (pixel, frame, seed, stream, dimension), so that any path can be
// replayed and any frame reproduced.

struct Rng {
    key: vec3u,
    dimension: u32,
}

// One stream for each use that must be independent of the others within a frame.
const STREAM_PRIMARY = 0u;
const STREAM_PATH = 1u;
const STREAM_INITIAL = 2u;
const STREAM_TEMPORAL = 3u;
const STREAM_SPATIAL = 4u;
const STREAM_INDIRECT = 8u;

// PCG4D, Jarzynski and Olano 2020, "Hash Functions for GPU Rendering".
fn pcg4d(seed: vec4u) -> vec4u {
    var v = seed * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> vec4u(16u);
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

fn rng_new(pixel: vec2u, frame_index: u32, seed: u32, stream: u32) -> Rng {
    return Rng(vec3u(pixel.x | (pixel.y << 16u), frame_index, seed), stream << 20u);
}

// Four independent numbers in [0, 1), multiples of 2^-24.
fn random_4(rng: ptr<function, Rng>) -> vec4f {
    let bits = pcg4d(vec4u((*rng).key, (*rng).dimension));
    (*rng).dimension += 1u;
    return vec4f(bits >> vec4u(8u)) * 5.9604645e-8;
}

fn random_2(rng: ptr<function, Rng>) -> vec2f {
    return random_4(rng).xy;
}

fn random_1(rng: ptr<function, Rng>) -> f32 {
    return random_4(rng).x;
}
