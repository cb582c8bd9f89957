// Reservoirs in the convention of dissertation 004, chapter 6: a reservoir holds a sample, its unbiased contribution
// weight W and its confidence weight c (the "M" of Bitterli et al. 2020).
#include "lib/math.wgsl"

// A point on a light, in primary form: which light, and two 16-bit numbers in [0, 1) that mean barycentrics (after
// `sample_triangle`), the coordinates of the environment map, or nothing, by the kind of light.
struct LightSample {
    light: u32,
    point: u32,
}

struct Reservoir {
    light: u32,
    point: u32,
    unbiased_contribution_weight: f32, // W
    confidence_weight: f32, // c
}

// Weighted reservoir sampling of a stream (Chao 1982; Bitterli et al. 2020, Algorithm 2).
struct Stream {
    selected: LightSample,
    weight_sum: f32,
    confidence_sum: f32,
}

fn stream_empty() -> Stream {
    return Stream(LightSample(NONE, 0u), 0.0, 0.0);
}

// Offers a sample with resampling weight w; true if it was selected.
fn stream_update(stream: ptr<function, Stream>, sample: LightSample, weight: f32, u: f32) -> bool {
    (*stream).weight_sum += weight;
    // Strict, so that a zero weight is never selected.
    if u * (*stream).weight_sum < weight {
        (*stream).selected = sample;
        return true;
    }
    return false;
}

fn reservoir_empty() -> Reservoir {
    return Reservoir(NONE, 0u, 0.0, 0.0);
}

fn reservoir_sample(reservoir: Reservoir) -> LightSample {
    return LightSample(reservoir.light, reservoir.point);
}

// A reservoir in three words: light, point, and one of both weights. Its high 20 bits are W: 8 of exponent and 12 of
// mantissa, rounded, so at most 1/8192 off. Its low 12 bits are c: 6 of exponent and 6 of mantissa, above 2^-31 and below
// 2^33, rounded, so at most 1/128 off; whole numbers up to 128 are exact.
fn pack_weights(reservoir: Reservoir) -> u32 {
    // Signs are 0, and the largest finite number is not rounded up to infinity.
    let w = min(bitcast<u32>(max(reservoir.unbiased_contribution_weight, 0.0)) + 0x400u, 0x7f7fffffu) >> 11u;
    let c = bitcast<u32>(clamp(reservoir.confidence_weight, 0.0, 8.5e9)) + 0x10000u;
    // The exponent counts from that of 2^-31, which stands for 0.
    return (w << 12u) | (max(c >> 17u, 96u << 6u) - (96u << 6u));
}

fn unpack_reservoir(words: vec3u) -> Reservoir {
    let c = words.z & 0xfffu;
    return Reservoir(words.x, words.y, bitcast<f32>((words.z >> 12u) << 11u),
        select(0.0, bitcast<f32>((c + (96u << 6u)) << 17u), c > 0u));
}

fn pack_cell(cell: vec2u) -> u32 {
    return cell.x | (cell.y << 16u);
}

fn unpack_cell(point: u32) -> vec2u {
    return vec2u(point & 0xffffu, point >> 16u);
}

fn pack_point(u: vec2f) -> u32 {
    return pack_cell(min(vec2u(u * 65536.0), vec2u(65535u)));
}

// The centre of the cell that `pack_point` chose: never exactly 0 or 1.
fn unpack_point(point: u32) -> vec2f {
    return (vec2f(unpack_cell(point)) + 0.5) / 65536.0;
}
