// Resampled importance sampling of direct light (Talbot et al. 2005): candidates from the light table, one of them kept
// with probability proportional to its resampling weight.
#include "scene/lights.wgsl"

// Whether what a reservoir holds is known to be lit where it is held, fixed when a pipeline is made (src/techniques/reuse.rs): no
// shadow ray is traced for that.
override reservoirs_are_visible: bool = false;

// What a surface scatters of light from a direction: a dispersing one each colour by its own index of refraction, as a path
// that has chosen its colour sees it.
fn direct_scatter(surface: Surface, wi: vec3f, distance: f32) -> vec3f {
    if scene_has_dispersion {
        let own = surface.boundary;
        if own != NONE && extension_factors(own, 3u).y > 0.0 {
            var value = vec3f(0.0);
            for (var c = 0u; c < 3u; c += 1u) {
                var seen = surface;
                surface_set_media(&seen, select(own, NONE, seen.is_front), select(NONE, own, seen.is_front), c + 1u);
                value[c] = surface_scatter(seen, wi, distance)[c];
            }
            return value;
        }
    }
    return surface_scatter(surface, wi, distance);
}

// A light sample as a surface values it.
struct ValuedSample {
    target_value: f32, // p-hat
    direction: vec3f, // of its shadow ray
    distance: f32,
}

// The target function of direct light: luminance of the unshadowed integrand, p-hat = lum(f L G)
// (Bitterli et al. 2020, section 3). `previous` evaluates it in the previous frame.
fn value_sample(surface: Surface, sample: LightSample, previous: bool) -> ValuedSample {
    if sample.light == NONE {
        return ValuedSample();
    }
    let light = light_contribution(sample, surface.position, previous);
    let value = luminance(direct_scatter(surface, light.direction, light.distance) * light.value);
    return ValuedSample(value, light.direction, light.distance);
}

fn target_function(surface: Surface, sample: LightSample, previous: bool) -> f32 {
    return value_sample(surface, sample, previous).target_value;
}

// Whether there are BSDF samples among the candidates, fixed when a pipeline is made (src/techniques/candidates.rs).
override bsdf_candidates: bool = false;

// Resampling weight w = m p-hat / p of a candidate of either kind, with the balance heuristic m over `light_samples` light
// samples and `bsdf_samples` BSDF samples, all densities in the measure of the sample's light (thesis 000, listing 3).
fn candidate_weight(surface: Surface, sample: LightSample, light_samples: u32, bsdf_samples: u32) -> f32 {
    if sample.light == NONE {
        return 0.0;
    }
    let light = light_contribution(sample, surface.position, false);
    let value = luminance(direct_scatter(surface, light.direction, light.distance) * light.value);
    var density = f32(light_samples) * light_sample_pdf(surface.position, sample);
    if bsdf_candidates {
        density += f32(bsdf_samples) * light_hit_sample_pdf(sample, light, surface_pdf(surface, light.direction));
    }
    return select(0.0, value / density, value > 0.0 && density > 0.0);
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

// V between a surface and a light sample, in this frame or, for a surface of the previous one, in that.
fn sample_is_visible(surface: Surface, sample: ValuedSample, previous: bool) -> bool {
    let top_level = select(frame.top_level, frame.previous_top_level, previous);
    return is_visible_from(top_level, surface, sample.direction, sample.distance);
}

// The estimate of direct light that a reservoir stands for: f L G V W.
fn shade_reservoir(surface: Surface, reservoir: Reservoir) -> vec3f {
    if reservoir.unbiased_contribution_weight <= 0.0 || reservoir.light == NONE {
        return vec3f(0.0);
    }
    let sample = reservoir_sample(reservoir);
    let light = light_contribution(sample, surface.position, false);
    let unshadowed = direct_scatter(surface, light.direction, light.distance) * light.value;
    if luminance(unshadowed) <= 0.0 {
        return vec3f(0.0);
    }
    if !reservoirs_are_visible && !is_visible(surface, light.direction, light.distance) {
        return vec3f(0.0);
    }
    return unshadowed * reservoir.unbiased_contribution_weight;
}
