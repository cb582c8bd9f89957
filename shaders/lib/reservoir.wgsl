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
