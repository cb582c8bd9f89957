// Shading: each reservoir's sample, plus what the surface emits and the indirect light. A shadow ray goes to the sample where it
// is not known to be lit.
// One invocation: one pixel. Reads the visibility buffer, the scene, the final reservoirs and the indirect radiance. Writes
// radiance, or a debug view, and counts rays.
// Source: Bitterli et al. 2020, Algorithm 5, lines 20 to 22; thesis 001, section 5.5 (several slots are averaged).
#include "techniques/common/shade.wgsl"
#include "scene/visibility_buffer.wgsl"
#include "scene/counters.wgsl"
#include "techniques/common/resampling.wgsl"
#include "techniques/restir-di/reservoirs.wgsl"

@group(1) @binding(2) var radiance_out: texture_storage_2d<rgba32float, write>;

const VIEW_DIRECT = 1u;
const VIEW_INDIRECT = 2u;
const VIEW_CONTRIBUTION_WEIGHT = 3u;
const VIEW_TARGET_FUNCTION = 4u;
const VIEW_CONFIDENCE_WEIGHT = 5u;
const VIEW_LIGHT = 6u;
const VIEW_DUPLICATES = 7u;

// How many of the pixels within `DUPLICATES_RADIUS` hold the very sample that this one holds, as a share of them (Wyman and
// Panteleev 2021, Figure 9).
const DUPLICATES_RADIUS = 5;

fn duplicates(pixel: vec2u, own: Reservoir) -> f32 {
    var count = 0u;
    var pixels = 0u;
    for (var y = -DUPLICATES_RADIUS; y <= DUPLICATES_RADIUS; y += 1) {
        for (var x = -DUPLICATES_RADIUS; x <= DUPLICATES_RADIUS; x += 1) {
            let other = vec2i(pixel) + vec2i(x, y);
            if any(other < vec2i(0)) || any(other >= vec2i(frame.size)) || (x == 0 && y == 0) {
                continue;
            }
            let reservoir = load_reservoir(vec2u(other), 0u);
            pixels += 1u;
            count += u32(reservoir.light == own.light && reservoir.point == own.point && own.light != NONE
                && reservoir.unbiased_contribution_weight > 0.0);
        }
    }
    return f32(count) / f32(max(pixels, 1u));
}

fn pixel_radiance(pixel: vec2u) -> vec3f {
    if !pixel_has_surface(pixel) {
        return select(vec3f(0.0), environment_evaluate(primary_ray(pixel).direction), frame.view == 0u);
    }
    let surface = load_pixel(pixel);
    let slots = slot_count();
    let first = load_reservoir(pixel, 0u);
    switch frame.view {
        case VIEW_INDIRECT: { return indirect_light(pixel, params.indirect); }
        case VIEW_CONTRIBUTION_WEIGHT: { return vec3f(first.unbiased_contribution_weight); }
        case VIEW_TARGET_FUNCTION: { return vec3f(target_function(surface, reservoir_sample(first), false)); }
        case VIEW_CONFIDENCE_WEIGHT: { return vec3f(first.confidence_weight); }
        case VIEW_LIGHT: { return number_color(first.light); }
        case VIEW_DUPLICATES: { return vec3f(duplicates(pixel, first)); }
        default: {}
    }
    var direct = vec3f(0.0);
    for (var slot = 0u; slot < slots; slot += 1u) {
        direct += shade_reservoir(surface, load_reservoir(pixel, slot));
    }
    direct /= f32(slots);
    if frame.view == VIEW_DIRECT {
        return direct;
    }
    return surface.emission + direct + indirect_light(pixel, params.indirect);
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) pixel: vec3u, @builtin(local_invocation_index) local_index: u32) {
    if all(pixel.xy < frame.size) {
        textureStore(radiance_out, pixel.xy, vec4f(pixel_radiance(pixel.xy), 1.0));
        count_pixel(pixel.xy);
    }
    flush_ray_count(local_index);
}
