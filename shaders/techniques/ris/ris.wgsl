// Direct light by resampled importance sampling, without reuse.
// One invocation: one pixel. Reads the visibility buffer and the scene. Writes radiance.
// Source: Talbot et al. 2005; Bitterli et al. 2020, Algorithm 3; Wyman and Panteleev 2021, Eq. 5 (stratified) and 13.
#include "scene/visibility_buffer.wgsl"
#include "scene/counters.wgsl"
#include "techniques/common/candidates.wgsl"

struct RisParams {
    candidates: u32, // M
    bsdf_samples: u32,
    light_choice: u32,
    samples: u32, // N
    stratified: u32,
}

@group(1) @binding(2) var radiance_out: texture_storage_2d<rgba32float, write>;
@group(1) @binding(3) var<uniform> params: RisParams;

fn pixel_radiance(pixel: vec2u) -> vec3f {
    if !pixel_has_surface(pixel) {
        return environment_evaluate(primary_ray(pixel).direction);
    }
    let surface = load_pixel(pixel);
    if frame.light_count == 0u {
        return surface.emission;
    }
    var rng = rng_new(pixel, frame.index, frame.seed, STREAM_INITIAL);
    let settings = CandidateSettings(params.candidates, params.bsdf_samples, params.samples, params.stratified);
    select_candidates(surface, settings, &rng);
    var direct = vec3f(0.0);
    for (var i = 0u; i < params.samples; i += 1u) {
        let selected = streams[i].selected;
        let weight = stream_contribution_weight(streams[i], target_function(surface, selected, false));
        direct += shade_reservoir(surface, Reservoir(selected.light, selected.point, weight, 1.0));
    }
    return surface.emission + direct / f32(params.samples);
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) pixel: vec3u, @builtin(local_invocation_index) local_index: u32) {
    if all(pixel.xy < frame.size) {
        textureStore(radiance_out, pixel.xy, vec4f(pixel_radiance(pixel.xy), 1.0));
    }
    flush_ray_count(local_index);
}
