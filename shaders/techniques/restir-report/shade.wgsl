// Shading: the sample of each reservoir with a shadow ray of its own, plus what the surface emits and the indirect light.
// One invocation: one pixel. Reads the visibility buffer, the scene, the final reservoirs and the indirect radiance. Writes
// radiance, or a debug view, and counts rays.
// Source: report 003, sections 4.3 and 4.4. Its power heuristic between strategies has nothing to weigh here: no light is in
// two strategies, and the hemisphere samples of the indirect light leave out what lights send straight to the surface.
#include "techniques/common/shade.wgsl"
#include "scene/visibility_buffer.wgsl"
#include "scene/counters.wgsl"
#include "techniques/restir-report/reservoir.wgsl"

@group(1) @binding(2) var radiance_out: texture_storage_2d<rgba32float, write>;
@group(1) @binding(4) var<storage, read> reservoirs: array<ReportReservoir>;

const VIEW_AREA_LIGHTS = 1u;
const VIEW_POINT_LIGHTS = 2u;
const VIEW_INDIRECT = 3u;
const VIEW_SAMPLES_COUNT = 4u;
const VIEW_BROKEN_WEIGHTS = 5u;

// f L G V W. A weight that is not finite is not hidden, so that the film counts it: `fault_unguarded_pdf` alone makes any.
fn shade_strategy(surface: Surface, pixel: vec2u, strategy: u32) -> vec3f {
    let reservoir = reservoirs[reservoir_index(pixel, strategy)];
    let weight = reservoir.unbiased_contribution_weight;
    if !is_finite(weight) {
        return vec3f(weight);
    }
    return shade_reservoir(surface, common_reservoir(reservoir));
}

fn pixel_radiance(pixel: vec2u) -> vec3f {
    if !pixel_has_surface(pixel) {
        return select(vec3f(0.0), environment_evaluate(primary_ray(pixel).direction), frame.view == 0u);
    }
    let area = reservoirs[reservoir_index(pixel, STRATEGY_AREA)];
    let point = reservoirs[reservoir_index(pixel, STRATEGY_POINT)];
    if frame.view == VIEW_INDIRECT {
        return indirect_light(pixel, params.indirect);
    }
    // Red: area lights, green: point lights. Full at what a pixel and its history can have seen, and a neighbour as much.
    if frame.view == VIEW_SAMPLES_COUNT {
        return vec3f(area.samples_count, point.samples_count, 0.0)
            / (2.0 * (params.history_cap + 1.0) * f32(proposal_count()));
    }
    // Red and green as well: whose weight is NaN or infinite; dark where all is well.
    if frame.view == VIEW_BROKEN_WEIGHTS {
        let bad = vec3<bool>(!is_finite(area.unbiased_contribution_weight), !is_finite(point.unbiased_contribution_weight),
            false);
        return select(vec3f(0.02), vec3f(1.0), bad);
    }
    let surface = load_pixel(pixel);
    var radiance = vec3f(0.0);
    for (var strategy = 0u; strategy < STRATEGY_COUNT; strategy += 1u) {
        if frame.view == 0u || frame.view == strategy + VIEW_AREA_LIGHTS {
            radiance += shade_strategy(surface, pixel, strategy);
        }
    }
    if frame.view != 0u {
        return radiance;
    }
    return surface.emission + radiance + indirect_light(pixel, params.indirect);
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) pixel: vec3u, @builtin(local_invocation_index) local_index: u32) {
    if all(pixel.xy < frame.size) {
        textureStore(radiance_out, pixel.xy, vec4f(pixel_radiance(pixel.xy), 1.0));
        count_pixel(pixel.xy);
    }
    flush_ray_count(local_index);
}
