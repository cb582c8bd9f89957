// What a pixel shows by resampled importance sampling: the code of ris/ris and of its inspection.
#include "scene/visibility_buffer.wgsl"
#include "techniques/common/candidates.wgsl"
#include "techniques/common/number_color.wgsl"

struct RisParams {
    candidates: u32, // M
    bsdf_samples: u32,
    light_choice: u32,
    samples: u32, // N
    stratified: u32,
}

@group(1) @binding(3) var<uniform> params: RisParams;

const VIEW_CONTRIBUTION_WEIGHT = 1u;
const VIEW_TARGET_FUNCTION = 2u;
const VIEW_LIGHT = 3u;

fn pixel_radiance(pixel: vec2u) -> vec3f {
    if !pixel_has_surface(pixel) {
        return select(vec3f(0.0), environment_evaluate(primary_ray(pixel).direction), frame.view == 0u);
    }
    let surface = load_pixel(pixel);
    if frame.light_count == 0u {
        return select(vec3f(0.0), surface.emission, frame.view == 0u);
    }
    var rng = rng_new(pixel, frame.index, frame.seed, STREAM_INITIAL);
    let settings = CandidateSettings(params.candidates, params.bsdf_samples, params.samples, params.stratified);
    select_candidates(surface, settings, &rng);
    var direct = vec3f(0.0);
    for (var i = 0u; i < params.samples; i += 1u) {
        let selected = streams[i].selected;
        let target_value = target_function(surface, selected, false);
        let weight = stream_contribution_weight(streams[i], target_value);
        let reservoir = Reservoir(selected.light, selected.point, weight, 1.0);
        // Views show the first of N.
        switch frame.view {
            case VIEW_CONTRIBUTION_WEIGHT: { return vec3f(weight); }
            case VIEW_TARGET_FUNCTION: { return vec3f(target_value); }
            case VIEW_LIGHT: { return number_color(selected.light); }
            default: {}
        }
        direct += shade_reservoir(surface, reservoir);
        observe_result(i, reservoir, REASON_NONE);
    }
    return surface.emission + direct / f32(params.samples);
}
