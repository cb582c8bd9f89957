// Presampled lights: points on lights, drawn once a frame by the light table, resolved and packed so that whoever weighs
// them reads 32 bytes in a row and nothing of the scene.
//
// A presampled light is drawn before anybody knows for which surface. So its density depends on no surface: a sphere's
// points are uniform over the whole of it, where `light_sample` takes those that a surface sees.
// Source: Wyman and Panteleev 2021, sections 5.1 to 5.3.
#include "scene/lights.wgsl"

const TILE_LIGHT_SURFACE = 0u; // `place` is the point; `weight` the normal, times luminance over density
const TILE_LIGHT_TWO_SIDED = 1u; // the same
const TILE_LIGHT_POINT = 2u; // `weight` is luminance over density, and the range
const TILE_LIGHT_SPOT = 3u; // `weight` is luminance over density, the axis and the cones' cosines, packed
const TILE_LIGHT_DISTANT = 4u; // `place` is the direction to the light; `weight` luminance over density
const TILE_LIGHT_KIND_SHIFT = 29u;

struct TileLight {
    place: vec3f,
    light: u32, // and its kind in the highest three bits
    weight: vec3f,
    point: u32,
}

// What a presampled light sends to a point: luminance of the unshadowed radiance, geometry term included, over the
// density of the sample.
struct TileIncidence {
    direction: vec3f,
    distance: f32,
    value: f32,
}

fn tile_light_sample(light: TileLight) -> LightSample {
    return LightSample(light.light & ((1u << TILE_LIGHT_KIND_SHIFT) - 1u), light.point);
}

// A light by its probability and a point on it, for no surface in particular.
fn presample_light(rng: ptr<function, Rng>) -> LightSample {
    var sample = light_sample(vec3f(0.0), rng);
    if scene_has_shapes && lights[sample.light].kind == LIGHT_TRIANGLE
        && is_sphere(load_triangle(lights[sample.light].triangle).flags) {
        let u = random_2(rng);
        let z = 1.0 - 2.0 * u.x;
        let r = sqrt(max(0.0, 1.0 - z * z));
        let phi = 2.0 * PI * u.y;
        sample.point = pack_point(sphere_uv(vec3f(r * cos(phi), r * sin(phi), z)));
    }
    return sample;
}

// Density of `presample_light` in the sample's own measure.
fn presample_pdf(sample: LightSample) -> f32 {
    let light = lights[sample.light];
    if scene_has_shapes && light.kind == LIGHT_TRIANGLE && is_sphere(load_triangle(light.triangle).flags) {
        let radius = world_sphere(light.instance, light.triangle).radius;
        return select(0.0, light.pmf / (4.0 * PI * radius * radius), radius > 1e-15);
    }
    return light_sample_pdf(vec3f(0.0), sample);
}

// A presampled light with its colours: radiance, or the intensity of a light without extent.
struct ResolvedLight {
    packed: TileLight,
    radiance: vec3f,
}

// Resolves a sample of density 1 / `inverse_pdf`.
fn resolve_light(sample: LightSample, inverse_pdf: f32) -> ResolvedLight {
    let light = sample.light;
    let kind = lights[light].kind;
    var packed = TileLight(vec3f(0.0), light, vec3f(0.0), sample.point);
    if kind == LIGHT_TRIANGLE {
        let triangle = lights[light].triangle;
        let instance = lights[light].instance;
        let uv = light_sample_barycentrics(sample);
        packed.place = triangle_point(instance, triangle, uv);
        // Seen at a right angle, where a clearcoat dims least: never zero where the light is not.
        let radiance = emitted_radiance(triangle, uv, 1.0) * emitter_power(light, false);
        packed.weight = front_normal(instance, triangle, uv) * (luminance(radiance) * inverse_pdf);
        if (load_triangle(triangle).flags & TRIANGLE_DOUBLE_SIDED) != 0u {
            packed.light |= TILE_LIGHT_TWO_SIDED << TILE_LIGHT_KIND_SHIFT;
        }
        return ResolvedLight(packed, radiance);
    }
    if scene_has_environment && kind == LIGHT_ENVIRONMENT {
        let uv = unpack_point(sample.point);
        packed.place = turn_to_world(environment_direction(uv), frame.environment_turn);
        let radiance = environment_read(uv);
        packed.weight.x = luminance(radiance) * inverse_pdf;
        packed.light |= TILE_LIGHT_DISTANT << TILE_LIGHT_KIND_SHIFT;
        return ResolvedLight(packed, radiance);
    }
    let intensity = lights[light].intensity;
    if scene_has_sun && kind == LIGHT_SUN {
        packed.place = sun_sample_direction(unpack_point(sample.point), frame.environment_turn);
        packed.weight.x = luminance(intensity) * inverse_pdf;
        packed.light |= TILE_LIGHT_DISTANT << TILE_LIGHT_KIND_SHIFT;
        return ResolvedLight(packed, intensity);
    }
    if !scene_has_punctual_lights {
        return ResolvedLight(packed, vec3f(0.0));
    }
    packed.weight.x = luminance(intensity) * inverse_pdf;
    if kind == LIGHT_DIRECTIONAL {
        packed.place = -lights[light].direction;
        packed.light |= TILE_LIGHT_DISTANT << TILE_LIGHT_KIND_SHIFT;
        return ResolvedLight(packed, intensity);
    }
    packed.place = lights[light].position;
    if kind == LIGHT_POINT {
        packed.weight.y = lights[light].range;
        packed.light |= TILE_LIGHT_POINT << TILE_LIGHT_KIND_SHIFT;
        return ResolvedLight(packed, intensity);
    }
    packed.weight.y = bitcast<f32>(pack2x16snorm(octahedral_encode(lights[light].direction)));
    packed.weight.z = bitcast<f32>(pack2x16snorm(vec2f(lights[light].cos_outer, lights[light].cos_inner)));
    packed.light |= TILE_LIGHT_SPOT << TILE_LIGHT_KIND_SHIFT;
    return ResolvedLight(packed, intensity);
}

// What a presampled light sends to a point: exactly that, but for spot lights, and where a clearcoat dims it. Positive
// wherever the light itself sends anything, and close to it: a spot light has no range here.
fn tile_incidence(light: TileLight, position: vec3f) -> TileIncidence {
    let kind = light.light >> TILE_LIGHT_KIND_SHIFT;
    if (scene_has_environment || scene_has_sun || scene_has_punctual_lights) && kind == TILE_LIGHT_DISTANT {
        return TileIncidence(light.place, ENVIRONMENT_DISTANCE, light.weight.x);
    }
    let to_light = light.place - position;
    let distance_2 = dot(to_light, to_light);
    let inverse_distance = inverseSqrt(max(distance_2, 1e-20));
    let direction = to_light * inverse_distance;
    let inverse_square = inverse_distance * inverse_distance;
    var value = -dot(light.weight, direction);
    if kind == TILE_LIGHT_TWO_SIDED {
        value = abs(value);
    }
    if scene_has_punctual_lights && kind >= TILE_LIGHT_POINT {
        value = light.weight.x;
        if kind == TILE_LIGHT_POINT && light.weight.y > 0.0 {
            let x = distance_2 / square(light.weight.y);
            value *= max(1.0 - x * x, 0.0);
        }
        if kind == TILE_LIGHT_SPOT {
            // As cone_attenuation; but all is rounded, so the cone is a little wider, lest anything within be left out.
            let axis = octahedral_decode(unpack2x16snorm(bitcast<u32>(light.weight.y)));
            let cones = unpack2x16snorm(bitcast<u32>(light.weight.z));
            let within = 2e-4 - dot(axis, direction) - cones.x;
            value *= square(clamp(within / max(0.001, cones.y - cones.x), 0.0, 1.0));
        }
    }
    // As where light_contribution gives up.
    value = select(0.0, max(value, 0.0) * inverse_square, distance_2 > 1e-12);
    return TileIncidence(direction, distance_2 * inverse_distance, value);
}

// Whether `tile_incidence` is all that can be said of a light.
fn tile_light_is_exact(light: TileLight) -> bool {
    return !scene_has_clearcoat
        && !(scene_has_punctual_lights && light.light >> TILE_LIGHT_KIND_SHIFT == TILE_LIGHT_SPOT);
}

// What a resolved light of density 1 sends to a point, in colours.
fn resolved_contribution(light: ResolvedLight, position: vec3f) -> LightContribution {
    if !tile_light_is_exact(light.packed) {
        return light_contribution(tile_light_sample(light.packed), position, false);
    }
    let incidence = tile_incidence(light.packed, position);
    let value = light.radiance * (incidence.value / max(luminance(light.radiance), 1e-30));
    return LightContribution(incidence.direction, incidence.distance, value, 0.0);
}
