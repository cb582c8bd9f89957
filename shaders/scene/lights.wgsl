// The light table: choosing a light and a point on it, and what such a sample sends to a surface.
//
// A sample lives in its light's own measure: area for an emissive triangle, solid angle for the environment, and a
// point mass for point, spot and directional lights. `LightContribution.value` is the integrand's light part in that
// measure, so that value / pdf is an estimate whatever the kind.
#include "scene/surface.wgsl"
#include "scene/environment.wgsl"
#include "lib/reservoir.wgsl"
#include "lib/rng.wgsl"

const LIGHT_TRIANGLE = 0u;
const LIGHT_POINT = 1u;
const LIGHT_SPOT = 2u;
const LIGHT_DIRECTIONAL = 3u;
const LIGHT_ENVIRONMENT = 4u;

struct LightContribution {
    direction: vec3f, // unit, from the surface to the light
    distance: f32, // how far a shadow ray must be free
    value: vec3f, // unshadowed incident radiance per unit of the sample's measure, geometry term included
    solid_angle_jacobian: f32, // converts a density in the sample's measure to solid angle; 0 for a point mass
}

// The point of a light sample on its triangle, in barycentrics.
fn light_sample_barycentrics(sample: LightSample) -> vec2f {
    return sample_triangle(unpack_point(sample.point));
}

fn environment_sample_direction(sample: LightSample) -> vec3f {
    return environment_direction(unpack_point(sample.point));
}

// Draws a light by its probability and a point on it.
fn light_sample(rng: ptr<function, Rng>) -> LightSample {
    let bits = random_bits(rng);
    var light = bits_below(bits.x, frame.light_count);
    if bits_to_unit(bits.y) >= lights[light].alias_threshold {
        light = lights[light].alias_light;
    }
    if scene_has_environment && light == frame.environment_light {
        return LightSample(light, environment_sample(bits.zw, random_4(rng).xyz));
    }
    return LightSample(light, pack_cell(bits.zw >> vec2u(16u)));
}

fn triangle_area(instance: u32, triangle: u32) -> f32 {
    return 0.5 * length(triangle_normal(instance, triangle));
}

// Density of `light_sample` in the sample's own measure.
fn light_sample_pdf(sample: LightSample) -> f32 {
    let pmf = lights[sample.light].pmf;
    let kind = lights[sample.light].kind;
    if kind == LIGHT_TRIANGLE {
        let area = triangle_area(lights[sample.light].instance, lights[sample.light].triangle);
        // Also 0 where the area is 0 in f32, or the density too large for it.
        return select(0.0, pmf / area, area > 1e-30);
    }
    if scene_has_environment && kind == LIGHT_ENVIRONMENT {
        return pmf * environment_point_pdf(sample.point);
    }
    return pmf;
}

// Density per solid angle with which `light_sample` would have drawn the hit that a BRDF ray made on light `light`.
fn light_hit_pdf(light: u32, instance: u32, triangle: u32, direction: vec3f, distance: f32) -> f32 {
    let scaled_normal = triangle_normal(instance, triangle);
    let cosine_times_twice_area = abs(dot(scaled_normal, direction));
    if cosine_times_twice_area <= 0.0 {
        return 0.0;
    }
    return lights[light].pmf * 2.0 * distance * distance / cosine_times_twice_area;
}

fn environment_hit_pdf(direction: vec3f) -> f32 {
    return lights[frame.environment_light].pmf * environment_pdf(direction);
}

// KHR_lights_punctual: inverse square, windowed by the range where one is given.
fn distance_attenuation(light: u32, distance: f32) -> f32 {
    let range = lights[light].range;
    var window = 1.0;
    if range > 0.0 {
        let x = distance / range;
        window = clamp(1.0 - x * x * x * x, 0.0, 1.0);
    }
    return window / max(distance * distance, 1e-12);
}

// KHR_lights_punctual: linear in the cosine between the cones, squared.
fn cone_attenuation(light: u32, direction: vec3f) -> f32 {
    let cosine = dot(lights[light].direction, -direction);
    let scale = 1.0 / max(0.001, lights[light].cos_inner - lights[light].cos_outer);
    return square(clamp((cosine - lights[light].cos_outer) * scale, 0.0, 1.0));
}

// How far from the plane of a light triangle a shadow ray must end so that the light does not shadow itself: a few ulps
// of the largest coordinate in the test of the ray against the triangle.
fn shadow_margin(instance: u32, triangle: u32, position: vec3f) -> f32 {
    let corners = triangle_corners(instance, triangle);
    let largest = max(max(max(abs(corners.p0), abs(corners.p1)), abs(corners.p2)), abs(position));
    return 2e-6 * max(largest.x, max(largest.y, largest.z));
}

// By how much the area of an emissive triangle has grown since the previous frame. A sample's point is kept in barycentrics,
// so that this is the Jacobian of taking it from that frame to this one; 1 for other lights.
fn light_growth(light: u32) -> f32 {
    if !scene_has_motion || !scene_has_instances || lights[light].kind != LIGHT_TRIANGLE {
        return 1.0;
    }
    let triangle = lights[light].triangle;
    let instance = lights[light].instance;
    let before = triangle_area(previous_instance(instance), previous_triangle(instance, triangle));
    return select(0.0, triangle_area(instance, triangle) / before, before > 1e-30);
}

// What a light sample sends to a point, unshadowed. `previous` asks for the light as it was in the previous frame; the
// measure stays this frame's.
fn light_contribution(sample: LightSample, position: vec3f, previous: bool) -> LightContribution {
    let light = sample.light;
    let kind = lights[light].kind;
    if kind == LIGHT_TRIANGLE {
        var triangle = lights[light].triangle;
        var instance = lights[light].instance;
        var growth = 1.0;
        if previous {
            growth = light_growth(light);
            triangle = previous_triangle(instance, triangle);
            instance = previous_instance(instance);
        }
        let uv = light_sample_barycentrics(sample);
        let to_light = triangle_point(instance, triangle, uv) - position;
        let distance_2 = dot(to_light, to_light);
        let distance = sqrt(distance_2);
        let direction = to_light / max(distance, 1e-20);
        let scaled_normal = triangle_normal(instance, triangle);
        var cosine = dot(scaled_normal, -direction) / length(scaled_normal);
        if (load_triangle(triangle).flags & TRIANGLE_DOUBLE_SIDED) != 0u {
            cosine = abs(cosine);
        }
        // Not `cosine <= 0`, which is false for the 0 / 0 of a triangle without area.
        if !(cosine > 0.0) || distance_2 <= 1e-12 || growth <= 0.0 {
            return LightContribution(direction, distance, vec3f(0.0), 0.0);
        }
        let free = max(distance - shadow_margin(instance, triangle, position) / cosine, 0.0);
        return LightContribution(direction, free, emitted_radiance(triangle, uv) * (cosine / distance_2 / growth),
            distance_2 / cosine);
    }
    if scene_has_environment && kind == LIGHT_ENVIRONMENT {
        let direction = environment_sample_direction(sample);
        return LightContribution(direction, ENVIRONMENT_DISTANCE, environment_evaluate(direction), 1.0);
    }
    if !scene_has_punctual_lights {
        return LightContribution(vec3f(0.0, 1.0, 0.0), 0.0, vec3f(0.0), 0.0);
    }
    let punctual = select(light, lights[light].previous, previous && scene_has_motion);
    if kind == LIGHT_DIRECTIONAL {
        return LightContribution(-lights[punctual].direction, ENVIRONMENT_DISTANCE, lights[light].intensity, 0.0);
    }
    let to_light = lights[punctual].position - position;
    let distance = length(to_light);
    let direction = to_light / max(distance, 1e-20);
    if distance <= 1e-6 {
        // No direction; and an infinite intensity times a BRDF of 0 would not be a number.
        return LightContribution(direction, distance, vec3f(0.0), 0.0);
    }
    var attenuation = distance_attenuation(light, distance);
    if kind == LIGHT_SPOT {
        attenuation *= cone_attenuation(punctual, direction);
    }
    return LightContribution(direction, distance, lights[light].intensity * attenuation, 0.0);
}
