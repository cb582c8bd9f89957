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
const STREAM_LIGHT_TILES = 16u;
const STREAM_TILE_CHOICE = 17u;
const STREAM_TILE_LIGHTS = 18u;
const STREAM_DECOUPLED = 19u;

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

// Four independent words.
fn random_bits(rng: ptr<function, Rng>) -> vec4u {
    let bits = pcg4d(vec4u((*rng).key, (*rng).dimension));
    (*rng).dimension += 1u;
    return bits;
}

// A word as a number in [0, 1), a multiple of 2^-24.
fn bits_to_unit(bits: u32) -> f32 {
    return f32(bits >> 8u) * 5.9604645e-8;
}

// A word as an integer below n: the high half of bits * n (Lemire 2019, without the rejection; off by n / 2^32 at most).
// Not bits % n: a low bit of PCG4D depends on no more than the lowest bits of its key.
fn bits_below(bits: u32, n: u32) -> u32 {
    let a = vec2u(bits & 0xffffu, bits >> 16u);
    let b = vec2u(n & 0xffffu, n >> 16u);
    let middle = a.y * b.x + ((a.x * b.x) >> 16u);
    let carry = (a.x * b.y + (middle & 0xffffu)) >> 16u;
    return a.y * b.y + (middle >> 16u) + carry;
}

// Four independent numbers in [0, 1), multiples of 2^-24.
fn random_4(rng: ptr<function, Rng>) -> vec4f {
    return vec4f(random_bits(rng) >> vec4u(8u)) * 5.9604645e-8;
}

fn random_2(rng: ptr<function, Rng>) -> vec2f {
    return random_4(rng).xy;
}

fn random_1(rng: ptr<function, Rng>) -> f32 {
    return random_4(rng).x;
}
