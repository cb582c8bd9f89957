// Resampled importance sampling of direct light (Talbot et al. 2005): candidates from the light table, one of them kept
// with probability proportional to its resampling weight.
#include "scene/lights.wgsl"

// The target function of direct light: luminance of the unshadowed integrand, p-hat = lum(f L G)
// (Bitterli et al. 2020, section 3). `previous` evaluates it in the previous frame.
fn target_function(surface: Surface, sample: LightSample, previous: bool) -> f32 {
    if sample.light == NONE {
        return 0.0;
    }
    let light = light_contribution(sample, surface.position, previous);
    return luminance(surface_scatter(surface, light.direction, light.distance) * light.value);
}

// Resampling weight w = m p-hat / p of one candidate, with m = 1 / M for M candidates of one kind.
fn candidate_weight(surface: Surface, sample: LightSample, candidate_count: u32) -> f32 {
    let pdf = light_sample_pdf(surface.position, sample);
    if pdf <= 0.0 {
        return 0.0;
    }
    return target_function(surface, sample, false) / (pdf * f32(candidate_count));
}

// W of a stream's selected sample: its weight sum over its target function; zero where nothing was selected. A quotient
// that is not finite is dropped here, for reuse would spread it over the picture and keep it for ever.
fn stream_contribution_weight(stream: Stream, target_value: f32) -> f32 {
    let weight = stream.weight_sum / max(target_value, 1e-30);
    if target_value <= 0.0 || is_nan(weight) || is_infinite(weight) {
        return 0.0;
    }
    return weight;
}

// f L G of a light sample, without the visibility V.
fn unshadowed_contribution(surface: Surface, sample: LightSample) -> vec3f {
    let light = light_contribution(sample, surface.position, false);
    return surface_scatter(surface, light.direction, light.distance) * light.value;
}

// V between a surface and a light sample, in this frame or, for a surface of the previous one, in that.
fn sample_is_visible(surface: Surface, sample: LightSample, previous: bool) -> bool {
    let light = light_contribution(sample, surface.position, previous);
    let top_level = select(frame.top_level, frame.previous_top_level, previous);
    return is_visible_from(top_level, surface, light.direction, light.distance);
}

// The estimate of direct light that a reservoir stands for: f L G V W.
fn shade_reservoir(surface: Surface, reservoir: Reservoir) -> vec3f {
    if reservoir.unbiased_contribution_weight <= 0.0 || reservoir.light == NONE {
        return vec3f(0.0);
    }
    let sample = reservoir_sample(reservoir);
    let light = light_contribution(sample, surface.position, false);
    let unshadowed = surface_scatter(surface, light.direction, light.distance) * light.value;
    if luminance(unshadowed) <= 0.0 || !is_visible(surface, light.direction, light.distance) {
        return vec3f(0.0);
    }
    return unshadowed * reservoir.unbiased_contribution_weight;
}
