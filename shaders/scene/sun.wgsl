// The sun: a disk of even radiance, infinitely far away. Its light holds the direction in which it shines before
// anything is turned, its radiance as `intensity`, and 1 - cos(angular radius) as `cos_outer`: the cosine itself has no
// digits left for a disk of a quarter of a degree.
#include "scene/environment_turn.wgsl"

// A direction within the disk, uniform in solid angle.
fn sun_sample_direction(point: vec2f, turn: vec2f) -> vec3f {
    let basis = orthonormal_basis(-lights[frame.sun_light].direction);
    let height = point.x * lights[frame.sun_light].cos_outer; // 1 - cos(theta)
    let r = sqrt(height * (2.0 - height));
    let phi = 2.0 * PI * point.y;
    return turn_to_world(basis_to_world(basis, vec3f(r * cos(phi), r * sin(phi), 1.0 - height)), turn);
}

// The inverse of `sun_sample_direction`, within the disk.
fn sun_point(direction: vec3f, turn: vec2f) -> vec2f {
    let basis = orthonormal_basis(-lights[frame.sun_light].direction);
    let local = basis_to_local(basis, turn_to_map(direction, turn));
    let height = dot(local.xy, local.xy) / (1.0 + local.z); // 1 - cos(theta)
    return vec2f(height / lights[frame.sun_light].cos_outer, fract(atan2(local.y, local.x) / (2.0 * PI)));
}

fn is_in_sun(direction: vec3f, turn: vec2f) -> bool {
    // The chord's length squared is 2 (1 - cos).
    let chord = turn_to_map(direction, turn) + lights[frame.sun_light].direction;
    return dot(chord, chord) <= 2.0 * lights[frame.sun_light].cos_outer;
}

// Density per solid angle of `sun_sample_direction`, within the disk.
fn sun_pdf() -> f32 {
    return 1.0 / (2.0 * PI * lights[frame.sun_light].cos_outer);
}

// Radiance from the direction towards which a ray leaves the scene.
fn sun_radiance(direction: vec3f) -> vec3f {
    if !scene_has_sun {
        return vec3f(0.0);
    }
    return select(vec3f(0.0), lights[frame.sun_light].intensity, is_in_sun(direction, frame.environment_turn));
}
