// Direct light by resampled importance sampling, without reuse.
// One invocation: one pixel. Reads the visibility buffer and the scene. Writes radiance.
// Source: Talbot et al. 2005; Bitterli et al. 2020, Algorithm 3.
#include "scene/visibility_buffer.wgsl"
#include "scene/counters.wgsl"
#include "techniques/common/resampling.wgsl"

struct RisParams {
    candidates: u32, // M
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
    var stream = stream_empty();
    for (var i = 0u; i < params.candidates; i += 1u) {
        let sample = light_sample(surface.position, &rng);
        stream_update(&stream, sample, candidate_weight(surface, sample, params.candidates), random_1(&rng));
    }
    let weight = stream_contribution_weight(stream, target_function(surface, stream.selected, false));
    let reservoir = Reservoir(stream.selected.light, stream.selected.point, weight, 1.0);
    return surface.emission + shade_reservoir(surface, reservoir);
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) pixel: vec3u, @builtin(local_invocation_index) local_index: u32) {
    if all(pixel.xy < frame.size) {
        textureStore(radiance_out, pixel.xy, vec4f(pixel_radiance(pixel.xy), 1.0));
    }
    flush_ray_count(local_index);
}
