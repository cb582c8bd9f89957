// Unidirectional path tracing: at every surface light arrives along two kinds of paths, one made by sampling a light
// (next-event estimation) and one by sampling the BRDF and running into a light; multiple importance sampling weights
// each by how well it was suited.
// Sources: thesis 000, sections 2.1 and 2.2; Veach and Guibas 1995 for the weights.
#include "scene/lights.wgsl"
#include "scene/media.wgsl"
#include "scene/camera.wgsl"
#include "lib/mis.wgsl"

// Russian roulette (thesis 000, Eq. 23 and 24): the probability of going on, q.
fn continuation_probability(throughput: vec3f) -> f32 {
    return min(1.0, max(frame.roulette_minimum, length(throughput) / frame.roulette_threshold));
}

// Next-event estimation: the light that one light sample brings to the surface, weighted against BRDF sampling.
fn estimate_direct_light(surface: Surface, rng: ptr<function, Rng>) -> vec3f {
    let sample = light_sample(surface.position, rng);
    let light = light_contribution(sample, surface.position, false);
    let scattered = surface_scatter(surface, light.direction, light.distance) * light.value;
    let pdf = light_sample_pdf(surface.position, sample);
    if luminance(scattered) <= 0.0 || pdf <= 0.0 || !is_visible(surface, light.direction, light.distance) {
        return vec3f(0.0);
    }
    var weight = 1.0;
    if light.solid_angle_jacobian > 0.0 {
        weight = mis_weight(frame.mis_heuristic, pdf * light.solid_angle_jacobian,
            surface_pdf(surface, light.direction));
    }
    return scattered * (weight / pdf);
}

// Light that a ray drawn with density `brdf_pdf` found by itself, weighted against next-event estimation.
fn weighted_emission(surface: Surface, direction: vec3f, distance: f32, brdf_pdf: f32) -> vec3f {
    let start = surface.position - distance * direction;
    let pdf = light_hit_pdf(surface.light, surface.instance, surface.triangle, start, direction, distance);
    return surface.emission * mis_weight(frame.mis_heuristic, brdf_pdf, pdf);
}

// The same for a ray that left the scene. Map and sun are two lights, each weighted by its own density.
fn weighted_environment(direction: vec3f, brdf_pdf: f32) -> vec3f {
    var radiance = vec3f(0.0);
    if scene_has_environment {
        let weight = mis_weight(frame.mis_heuristic, brdf_pdf, environment_hit_pdf(direction));
        radiance += environment_map_radiance(direction) * weight;
    }
    if scene_has_sun {
        radiance += sun_radiance(direction) * mis_weight(frame.mis_heuristic, brdf_pdf, sun_hit_pdf());
    }
    return radiance;
}

// The colour that a path carries from its first dispersing medium on (KHR_materials_dispersion): one of three by chance,
// at three times its weight.
fn choose_channel(surface: Surface, channel: u32, throughput: ptr<function, vec3f>, rng: ptr<function, Rng>) -> u32 {
    if !scene_has_dispersion || channel != ALL_CHANNELS || surface.boundary == NONE
        || extension_factors(surface.boundary, 3u).y <= 0.0 {
        return channel;
    }
    let chosen = bits_below(random_bits(rng).x, 3u) + 1u;
    *throughput *= select(vec3f(0.0), vec3f(3.0), vec3u(1u, 2u, 3u) == vec3u(chosen));
    return chosen;
}

// Radiance scattered by `start` towards its viewer, over paths of at most `frame.max_depth` scattering events. Without
// `direct`, light that reaches `start` straight from a light is left out, for a technique that has estimated it already.
// What shines without being a light (KHR_materials_unlit) is always counted, for no light sample finds it.
fn scattered_radiance(start: Surface, direct: bool, rng: ptr<function, Rng>) -> vec3f {
    var surface = start;
    var radiance = vec3f(0.0);
    var throughput = vec3f(1.0);
    var media = media_none();
    var channel = ALL_CHANNELS;
    var spread = camera_spread(frame.camera);
    for (var depth = 1u; depth <= frame.max_depth; depth += 1u) {
        let counts = direct || depth > 1u;
        channel = choose_channel(surface, channel, &throughput, rng);
        surface_meets(&surface, media, channel);
        if counts && frame.light_count > 0u {
            radiance += throughput * estimate_direct_light(surface, rng);
        }
        if !counts && depth == frame.max_depth && !scene_has_unlit {
            break;
        }

        let u = random_4(rng);
        let wi = surface_sample(surface, u.xyz);
        let pdf = surface_pdf(surface, wi);
        let scattered = surface_evaluate(surface, wi);
        if pdf <= 0.0 || luminance(scattered) <= 0.0 {
            break;
        }
        throughput *= scattered / pdf;
        if depth >= frame.roulette_start {
            let q = continuation_probability(throughput);
            if u.w >= q {
                break;
            }
            throughput /= q;
        }

        let hit = traverse(ray_origin(surface, wi), wi, 3.0e38, false);
        throughput *= surface_transmittance(surface, wi, hit.t);
        media = media_after(media, surface, wi);
        if hit.triangle == NONE {
            if counts {
                radiance += throughput * weighted_environment(wi, pdf);
            }
            break;
        }
        spread = scattered_spread(surface.instance, surface.triangle, spread, surface.footprint, pdf);
        surface = load_surface(hit.instance, hit.triangle, hit.uv, -wi, surface.footprint + spread * hit.t);
        if scene_has_unlit && surface.light == NONE {
            radiance += throughput * surface.emission;
        } else if counts && surface.light != NONE {
            radiance += throughput * weighted_emission(surface, wi, hit.t, pdf);
        }
    }
    return radiance;
}
