// The light table: choosing a light and a point on it, and what such a sample sends to a surface.
//
// A sample lives in its light's own measure: area for an emissive triangle, solid angle for environment and sun, and a
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
const LIGHT_SUN = 5u;

// How a light is chosen: by the alias table, or, settings of techniques (src/techniques/candidates.rs), by
// search in the cumulative distribution or all alike.
override light_choice_cdf: bool = false;
override light_choice_uniform: bool = false;

struct LightContribution {
    direction: vec3f, // unit, from the surface to the light
    distance: f32, // how far a shadow ray must be free
    value: vec3f, // unshadowed incident radiance per unit of the sample's measure, geometry term included
    solid_angle_jacobian: f32, // converts a density in the sample's measure to solid angle; 0 for a point mass
}

// The point of a light sample on its triangle, in barycentrics; on another shape, as `triangle_point` takes it.
fn light_sample_barycentrics(sample: LightSample) -> vec2f {
    let u = unpack_point(sample.point);
    if scene_has_shapes {
        return shape_sample(shape_of(load_triangle(lights[sample.light].triangle).flags), u);
    }
    return sample_triangle(u);
}

// A light by its probability.
fn choose_light(bits: vec2u) -> u32 {
    if light_choice_cdf {
        // The last light whose part begins at the word or before it.
        var first = 0u;
        var count = frame.light_count;
        while count > 1u {
            let half = count / 2u;
            if lights[first + half].cumulative <= bits.x {
                first += half;
                count -= half;
            } else {
                count = half;
            }
        }
        return first;
    }
    let light = bits_below(bits.x, frame.light_count);
    if light_choice_uniform || bits_to_unit(bits.y) < lights[light].alias_threshold {
        return light;
    }
    return lights[light].alias_light;
}

// The probability with which `choose_light` chooses a light.
fn light_pmf(light: u32) -> f32 {
    if light_choice_uniform {
        return 1.0 / f32(frame.light_count);
    }
    if light_choice_cdf {
        let start = lights[light].cumulative;
        if light + 1u == frame.light_count {
            return 1.0 - f32(start) * 2.3283064e-10;
        }
        return f32(lights[light + 1u].cumulative - start) * 2.3283064e-10;
    }
    return lights[light].pmf;
}

// Draws a light by its probability and a point on it, for a surface at `position`: on a sphere a point of the cap that is
// seen from there.
fn light_sample(position: vec3f, rng: ptr<function, Rng>) -> LightSample {
    let bits = random_bits(rng);
    let light = choose_light(bits.xy);
    return light_sample_on(light, position, bits.zw, rng);
}

// Draws a point on this light, from two random words and, for the environment, more.
fn light_sample_on(light: u32, position: vec3f, bits: vec2u, rng: ptr<function, Rng>) -> LightSample {
    if scene_has_environment && light == frame.environment_light {
        return LightSample(light, environment_sample(bits, rng));
    }
    if scene_has_shapes && lights[light].kind == LIGHT_TRIANGLE && is_sphere(load_triangle(lights[light].triangle).flags) {
        let u = vec2f(bits_to_unit(bits.x), bits_to_unit(bits.y));
        return LightSample(light, sample_sphere_light(light, position, u));
    }
    return LightSample(light, pack_cell(bits >> vec2u(16u)));
}

// The light sample that is the point where a ray from `surface` along `direction` ended, or one of no light. Its point is
// the centre of the cell in which the ray ended. In the sun's disk it is the sun, and the map behind is not sampled so.
fn light_sample_of_hit(hit: Hit, direction: vec3f) -> LightSample {
    if hit.triangle == NONE {
        if scene_has_sun && is_in_sun(direction, frame.environment_turn) {
            return LightSample(frame.sun_light, pack_point(sun_point(direction, frame.environment_turn)));
        }
        if scene_has_environment {
            let uv = environment_uv(turn_to_map(direction, frame.environment_turn));
            return LightSample(frame.environment_light, pack_point(uv));
        }
        return LightSample(NONE, 0u);
    }
    let triangle = load_triangle(hit.triangle);
    var light = triangle.light;
    if light == NONE {
        return LightSample(NONE, 0u);
    }
    if scene_has_instances {
        light += instance_first_light(hit.instance);
    }
    if scene_has_shapes {
        return LightSample(light, pack_point(shape_unsample(shape_of(triangle.flags), hit.uv)));
    }
    return LightSample(light, pack_point(unsample_triangle(hit.uv)));
}

// Density of `light_sample_of_hit` in the sample's own measure, for rays drawn with density `pdf` per solid angle.
fn light_hit_sample_pdf(sample: LightSample, light: LightContribution, pdf: f32) -> f32 {
    if light.solid_angle_jacobian <= 0.0 {
        return 0.0;
    }
    if scene_has_sun && scene_has_environment && sample.light == frame.environment_light
        && is_in_sun(light.direction, frame.environment_turn) {
        return 0.0;
    }
    return pdf / light.solid_angle_jacobian;
}

struct Sphere {
    center: vec3f,
    radius: f32,
}

fn world_sphere(instance: u32, triangle: u32) -> Sphere {
    let corners = triangle_corners(instance, triangle);
    return Sphere(corners.p0, length(corners.p1 - corners.p0));
}

// A point of a spherical light that is seen from a position; any point from within, where none is.
fn sample_sphere_light(light: u32, position: vec3f, u: vec2f) -> u32 {
    let instance = lights[light].instance;
    let sphere = world_sphere(instance, lights[light].triangle);
    let to_center = sphere.center - position;
    if dot(to_center, to_center) <= square(sphere.radius) {
        return 0u;
    }
    var normal = sample_visible_sphere(to_center, sphere.radius, u);
    if scene_has_instances {
        normal = normalize(instance_vector(instance, TO_OBJECT, normal));
    }
    return pack_point(sphere_uv(normal));
}

// Density per solid angle of directions to the sphere from a position; 0 from within.
fn sphere_solid_angle_pdf(instance: u32, triangle: u32, position: vec3f) -> f32 {
    let sphere = world_sphere(instance, triangle);
    let to_center = sphere.center - position;
    let distance_2 = dot(to_center, to_center);
    if distance_2 <= square(sphere.radius) {
        return 0.0;
    }
    return 1.0 / (2.0 * PI * sphere_cone_height(distance_2, sphere.radius));
}

fn triangle_area(instance: u32, triangle: u32) -> f32 {
    let scaled = length(triangle_normal(instance, triangle));
    if scene_has_shapes {
        return scaled * shape_area_factor(shape_of(load_triangle(triangle).flags));
    }
    return 0.5 * scaled;
}

// Density of `light_sample` in the sample's own measure.
fn light_sample_pdf(position: vec3f, sample: LightSample) -> f32 {
    let pmf = light_pmf(sample.light);
    let kind = lights[sample.light].kind;
    if kind == LIGHT_TRIANGLE {
        let instance = lights[sample.light].instance;
        let triangle = lights[sample.light].triangle;
        if scene_has_shapes && is_sphere(load_triangle(triangle).flags) {
            // Solid angle to area.
            let uv = light_sample_barycentrics(sample);
            let to_light = triangle_point(instance, triangle, uv) - position;
            let distance_2 = dot(to_light, to_light);
            let cosine = dot(front_normal(instance, triangle, uv), -to_light) / sqrt(max(distance_2, 1e-30));
            let pdf = sphere_solid_angle_pdf(instance, triangle, position) * cosine / max(distance_2, 1e-30);
            return select(0.0, pmf * pdf, cosine > 0.0);
        }
        let area = triangle_area(instance, triangle);
        // Also 0 where the area is 0 in f32, or the density too large for it.
        return select(0.0, pmf / area, area > 1e-30);
    }
    if scene_has_environment && kind == LIGHT_ENVIRONMENT {
        return pmf * environment_point_pdf(sample.point);
    }
    if scene_has_sun && kind == LIGHT_SUN {
        return pmf * sun_pdf();
    }
    return pmf;
}

// Density per solid angle with which `light_sample` would have drawn the hit that a BRDF ray from `position` made on
// light `light`.
fn light_hit_pdf(light: u32, instance: u32, triangle: u32, position: vec3f, direction: vec3f, distance: f32) -> f32 {
    let flags = load_triangle(triangle).flags;
    if scene_has_shapes && is_sphere(flags) {
        return light_pmf(light) * sphere_solid_angle_pdf(instance, triangle, position);
    }
    var cosine_times_area = abs(dot(triangle_normal(instance, triangle), direction)) * 0.5;
    if scene_has_shapes {
        cosine_times_area *= 2.0 * shape_area_factor(shape_of(flags));
    }
    if cosine_times_area <= 0.0 {
        return 0.0;
    }
    return light_pmf(light) * distance * distance / cosine_times_area;
}

fn environment_hit_pdf(direction: vec3f) -> f32 {
    return light_pmf(frame.environment_light) * environment_pdf(direction);
}

fn sun_hit_pdf() -> f32 {
    return light_pmf(frame.sun_light) * sun_pdf();
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

// Whether a light shines at all in this frame.
fn is_switched_on(light: u32) -> bool {
    let kind = lights[light].kind;
    if kind == LIGHT_TRIANGLE {
        return emitter_power(light, false) > 0.0;
    }
    return kind >= LIGHT_ENVIRONMENT || any(lights[light].intensity > vec3f(0.0));
}

// By what the contribution weight W of a sample that the previous frame held is multiplied in this one: the Jacobian of the
// shift; or 0 for a light that has been switched off, so that the sample is dropped before anything is evaluated or traced
// for it.
// The confidence of such a reservoir stays as it is. Its history might have held any other light, so its share of the MIS
// weights belongs to the samples of those; leaving it out only where the light is dead would choose by the sample, and be
// too bright. Nor does it make the picture dark: the share that it has of a sample is what its own target function says, with
// the powers of that frame, and so 0 for a light that was dark then and could not have been drawn.
fn history_factor(light: u32) -> f32 {
    if !scene_has_motion {
        return 1.0;
    }
    return select(0.0, light_growth(light), is_switched_on(light));
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
        var cosine = dot(front_normal(instance, triangle, uv), -direction);
        if (load_triangle(triangle).flags & TRIANGLE_DOUBLE_SIDED) != 0u {
            cosine = abs(cosine);
        }
        // Not `cosine <= 0`, which is false for the 0 / 0 of a triangle without area.
        if !(cosine > 0.0) || distance_2 <= 1e-12 || growth <= 0.0 {
            return LightContribution(direction, distance, vec3f(0.0), 0.0);
        }
        let free = max(distance - shadow_margin(instance, triangle, position) / cosine, 0.0);
        let scale = emitter_power(light, previous) * (cosine / distance_2 / growth);
        return LightContribution(direction, free, emitted_radiance(triangle, uv, cosine) * scale, distance_2 / cosine);
    }
    if scene_has_environment && kind == LIGHT_ENVIRONMENT {
        let uv = unpack_point(sample.point);
        let direction = turn_to_world(environment_direction(uv), environment_turn(previous));
        return LightContribution(direction, ENVIRONMENT_DISTANCE, environment_read(uv), 1.0);
    }
    if scene_has_sun && kind == LIGHT_SUN {
        let direction = sun_sample_direction(unpack_point(sample.point), environment_turn(previous));
        return LightContribution(direction, ENVIRONMENT_DISTANCE, lights[light].intensity, 1.0);
    }
    if !scene_has_punctual_lights {
        return LightContribution(vec3f(0.0, 1.0, 0.0), 0.0, vec3f(0.0), 0.0);
    }
    let punctual = select(light, lights[light].previous, previous && scene_has_motion);
    if kind == LIGHT_DIRECTIONAL {
        return LightContribution(-lights[punctual].direction, ENVIRONMENT_DISTANCE, lights[punctual].intensity, 0.0);
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
    return LightContribution(direction, distance, lights[punctual].intensity * attenuation, 0.0);
}
