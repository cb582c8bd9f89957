// The switches of restir-di-decoupled, declared in src/techniques/restir_di_decoupled.rs, and what a pixel keeps.
#include "lib/reservoir.wgsl"
#include "scene/bindings.wgsl"

struct RestirDiDecoupledParams {
    candidates: u32, // M
    tile_subsets: u32, // S
    tile_lights: u32, // |S_j|
    tile_size: u32,
    visibility: u32,
    visibility_reuse_radius: f32,
    visibility_lifetime: u32,
    reuse_weights: u32,
    temporal_reuse: u32,
    spatiotemporal_reuse: u32,
    spatiotemporal_radius: f32,
    spatiotemporal_tries: u32,
    fill_disocclusions: u32,
    history_cap: f32,
    depth_threshold: f32,
    normal_threshold: f32,
    checkerboard: u32,
    indirect: u32,
}

// What is traced, and what becomes of it (Wyman and Panteleev 2021, Fig. 15 and section 4.6).
const VISIBILITY_NONE = 0u; // (a) nothing
const VISIBILITY_SHADING = 1u; // (b) all three samples, for shading alone
const VISIBILITY_CANDIDATE = 2u; // (c) the candidate, for shading and resampling
const VISIBILITY_DISCARD = 3u; // (d) all three, for both; a shadowed reservoir is thrown away
const VISIBILITY_KEEP = 4u; // (e) all three, for both; a shadowed reservoir keeps its confidence
const VISIBILITY_DECOUPLED = 5u; // (f) the candidate for both, the others, reused where that will do, for shading
const VISIBILITY_MIS = 6u; // every sample in every domain, for shading, resampling and its weights

const REUSE_WEIGHT_HEURISTICS = 0u;
const REUSE_WEIGHT_Z = 1u;
const REUSE_WEIGHT_BALANCE = 2u;

@group(1) @binding(3) var<uniform> params: RestirDiDecoupledParams;

// The three samples that a pixel shades and resamples, and the domains (a pixel, now or one frame ago) that they are from.
const CANDIDATE = 0u;
const TEMPORAL = 1u;
const SPATIOTEMPORAL = 2u;
const DOMAINS = 3u;

// What a pixel hands to the next frame.
struct DecoupledReservoir {
    light: u32,
    point: u32,
    unbiased_contribution_weight: f32, // W
    state: u32, // confidence weight c, visibility and its age: pack_state
}

// What a pixel's first kernel hands to the others.
struct Selection {
    light: u32, // the candidate
    point: u32,
    unbiased_contribution_weight: f32,
    temporal: u32, // pack_domain, or NONE
    spatiotemporal: u32,
    visibility: u32, // bit 3 j + i: V_j(x_i), sample i seen from domain j; bit 9 + i: V_0(x_i) was traced in this frame
}

struct ReservoirState {
    confidence_weight: f32, // in frames
    is_visible: bool, // whether the sample was lit, as far as is known
    age: u32, // frames since that was found out
}

const MAXIMUM_AGE = 254u;
const CONFIDENCE_UNIT = 32.0; // of 16-bit fixed point: up to 2047 frames, in steps that matter to nobody

fn pack_state(state: ReservoirState) -> u32 {
    return min(u32(state.confidence_weight * CONFIDENCE_UNIT + 0.5), 0xffffu) | (u32(state.is_visible) << 16u)
        | (min(state.age, MAXIMUM_AGE) << 17u);
}

fn unpack_state(packed: u32) -> ReservoirState {
    return ReservoirState(f32(packed & 0xffffu) / CONFIDENCE_UNIT, ((packed >> 16u) & 1u) == 1u, packed >> 17u);
}

// A pixel of the previous frame, and whether the visibility of its sample may be reused.
fn pack_domain(pixel: vec2u, may_reuse_visibility: bool) -> u32 {
    return pixel.x | (pixel.y << 16u) | (u32(may_reuse_visibility) << 31u);
}

fn domain_pixel(domain: u32) -> vec2u {
    return vec2u(domain & 0xffffu, (domain >> 16u) & 0x7fffu);
}

fn domain_may_reuse_visibility(domain: u32) -> bool {
    return (domain >> 31u) == 1u;
}

fn pixel_index(pixel: vec2u) -> u32 {
    return pixel.y * frame.size.x + pixel.x;
}

fn visibility_bit(domain: u32, sample: u32) -> u32 {
    return 1u << (DOMAINS * domain + sample);
}

fn traced_bit(sample: u32) -> u32 {
    return 1u << (DOMAINS * DOMAINS + sample);
}

// Whether a pixel goes without a candidate and rays of its own in this frame.
fn is_left_out(pixel: vec2u) -> bool {
    return params.checkerboard == 1u && ((pixel.x + pixel.y + frame.index) & 1u) == 1u;
}

// The pixel of an invocation of the kernels that run for those only that are not left out.
fn invocation_pixel(id: vec2u) -> vec2u {
    if params.checkerboard == 0u {
        return id;
    }
    return vec2u(2u * id.x + ((id.y + frame.index) & 1u), id.y);
}
