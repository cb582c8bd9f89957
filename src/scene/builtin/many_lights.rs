//! A closed hall with two rows of columns, lit by N small coloured triangles.

use super::{hue, matte, place};
use crate::error::{Error, Result};
use crate::scene::random::Random;
use crate::scene::{Camera, Material, Mesh, Scene, shapes};
use glam::{Mat4, Vec2, Vec3};
use std::f32::consts::TAU;

/// Half the width, the height and half the length of the hall in metres; the floor is at y = 0.
const HALL: Vec3 = Vec3::new(4.0, 4.5, 8.0);
const COLUMN_RADIUS: f32 = 0.28;
const COLUMN_X: f32 = 2.1;
const COLUMN_SIDES: u32 = 32;
const COLUMN_SPACING: f32 = 3.0;
const COLUMN_PAIRS: i32 = 5;
/// All lights together, whatever their number: square metres, and radiance of one before its colour.
const TOTAL_AREA: f32 = 2.0;
const RADIANCE: f32 = 100.0;
const COLORS: u32 = 16;
/// How far below the ceiling lights hang at most, metres.
const LIGHT_LAYER: f32 = 0.8;
const MAX_LIGHTS: u32 = 1_000_000;
const SEED: u64 = 0x6d61_6e79;

/// The part of the name after the `:` is the number of lights.
pub(super) fn many_lights(count: &str) -> Result<Scene> {
    let count = count.parse().ok().filter(|n| (1..=MAX_LIGHTS).contains(n)).ok_or_else(|| {
        Error::bad_value("many-lights:N", format!("'{count}' is not a whole number from 1 to {MAX_LIGHTS}"))
    })?;
    let [floor, wall, column] = [0, 1, 2];
    let eye = Vec3::new(1.1, 2.6, HALL.z - 0.6);
    let mut scene = Scene {
        name: format!("many-lights:{count}"),
        materials: vec![
            Material { roughness: 0.35, ..matte("floor", Vec3::splat(0.4)) },
            matte("wall", Vec3::new(0.72, 0.7, 0.66)),
            Material { roughness: 0.5, ..matte("column", Vec3::new(0.8, 0.78, 0.74)) },
        ],
        // The first sees no light itself, so that errors measured in its picture are those of the lighting.
        cameras: vec![
            Camera::look_at("hall", eye, Vec3::new(-0.4, 0.05, 0.4), 45f32.to_radians()),
            Camera::look_at("ceiling", eye, Vec3::new(-0.5, 2.6, -HALL.z), 55f32.to_radians()),
        ],
        ..Scene::default()
    };
    for mesh in hall(floor, wall) {
        place(&mut scene, mesh, Mat4::IDENTITY);
    }
    for center in columns() {
        let at = Mat4::from_translation(Vec3::new(center.x, 0.0, center.y));
        place(&mut scene, shaft(column), at);
    }
    for (i, mut mesh) in lights(count).into_iter().enumerate().filter(|(_, mesh)| !mesh.indices.is_empty()) {
        mesh.material = scene.materials.len() as u32;
        // Tints rather than pure hues: a reservoir keeps one light, and how its colour differs from the mean is noise that
        // no resampling by luminance removes.
        let tint = Vec3::ONE.lerp(hue((i as f32 + 1.0) / COLORS as f32), 0.3);
        let emissive = tint * RADIANCE;
        scene.materials.push(Material { emissive, ..matte("light", Vec3::ZERO) });
        place(&mut scene, mesh, Mat4::IDENTITY);
    }
    Ok(scene)
}

/// The six inner faces of the hall.
fn hall(floor: u32, wall: u32) -> [Mesh; 6] {
    let low = Vec3::new(-HALL.x, 0.0, -HALL.z);
    let (x, y, z) = (Vec3::X * 2.0 * HALL.x, Vec3::Y * HALL.y, Vec3::Z * 2.0 * HALL.z);
    [
        shapes::parallelogram(low, z, x, floor),
        shapes::parallelogram(low + y, x, z, wall),
        shapes::parallelogram(low, y, z, wall),
        shapes::parallelogram(low + x, z, y, wall),
        shapes::parallelogram(low, x, y, wall),
        shapes::parallelogram(low + z, y, x, wall),
    ]
}

/// Where the columns stand: x and z.
fn columns() -> impl Iterator<Item = Vec2> {
    (0..COLUMN_PAIRS).flat_map(|i| {
        let z = (i - COLUMN_PAIRS / 2) as f32 * COLUMN_SPACING;
        [Vec2::new(-COLUMN_X, z), Vec2::new(COLUMN_X, z)]
    })
}

/// The side of a cylinder from the floor to the ceiling.
fn shaft(material: u32) -> Mesh {
    let mut mesh = Mesh { material, ..Mesh::default() };
    for side in 0..=COLUMN_SIDES {
        let (sin, cos) = (side as f32 / COLUMN_SIDES as f32 * TAU).sin_cos();
        let normal = Vec3::new(sin, 0.0, cos);
        for y in [0.0, HALL.y] {
            mesh.positions.push(normal * COLUMN_RADIUS + Vec3::Y * y);
            mesh.normals.push(normal);
        }
    }
    for side in 0..COLUMN_SIDES {
        let a = 2 * side;
        mesh.indices.extend([a, a + 2, a + 3, a, a + 3, a + 1]);
    }
    mesh
}

/// The triangles of each colour.
fn lights(count: u32) -> Vec<Mesh> {
    let mut random = Random::new(SEED);
    let mut meshes = vec![Mesh::default(); COLORS as usize];
    // An equilateral triangle of this circumradius has the area 3 sqrt(3) / 4 radius^2.
    let radius = (TOTAL_AREA / count as f32 * 4.0 / (3.0 * 3f32.sqrt())).sqrt();
    for _ in 0..count {
        let center = spot(&mut random, radius);
        let normal = (Vec3::NEG_Y + 0.5 * random.direction()).normalize();
        let (u, v) = normal.any_orthonormal_pair();
        let spin = random.range(0.0, TAU);
        // Colours change along the hall, so that neighbours in the picture have different lights that matter.
        let along = ((center.z / HALL.z * 0.5 + 0.5) * COLORS as f32) as usize;
        let mesh = &mut meshes[along.min(COLORS as usize - 1)];
        let base = mesh.positions.len() as u32;
        for corner in 0..3 {
            let (sin, cos) = (spin + corner as f32 * TAU / 3.0).sin_cos();
            mesh.positions.push(center + radius * (cos * u + sin * v));
            mesh.normals.push(normal);
        }
        mesh.indices.extend([base, base + 1, base + 2]);
    }
    meshes
}

/// A place for a light of this radius under the ceiling, clear of walls and columns.
fn spot(random: &mut Random, radius: f32) -> Vec3 {
    let margin = radius + 0.05;
    loop {
        let x = random.range(margin - HALL.x, HALL.x - margin);
        let y = HALL.y - margin - random.range(0.0, LIGHT_LAYER);
        let z = random.range(margin - HALL.z, HALL.z - margin);
        // The largest light would leave no room beside the columns.
        let clearance = COLUMN_RADIUS + margin.min(0.5);
        if columns().all(|column| column.distance(Vec2::new(x, z)) > clearance) {
            return Vec3::new(x, y, z);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn power(scene: &Scene) -> f32 {
        let meshes = scene.meshes.iter().flat_map(|mesh| {
            let emissive = scene.materials[mesh.material as usize].emissive.element_sum();
            mesh.indices.as_chunks::<3>().0.iter().map(move |corners| {
                let [a, b, c] = corners.map(|i| mesh.positions[i as usize]);
                emissive * 0.5 * (b - a).cross(c - a).length()
            })
        });
        meshes.sum()
    }

    #[test]
    fn power_does_not_depend_on_the_number() {
        let one = power(&many_lights("1").unwrap());
        for count in ["7", "100", "20000"] {
            assert!((power(&many_lights(count).unwrap()) / one - 1.0).abs() < 1e-3);
        }
    }

    #[test]
    fn lights_face_down_and_stay_in_the_hall() {
        let scene = many_lights("2000").unwrap();
        let emitters = scene.meshes.iter().filter(|m| scene.materials[m.material as usize].emissive != Vec3::ZERO);
        for mesh in emitters {
            for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
                assert!(p.x.abs() < HALL.x && p.z.abs() < HALL.z && (0.0..HALL.y).contains(&p.y), "{p}");
                assert!(n.y < 0.0);
            }
        }
    }

    #[test]
    fn counts_out_of_range_are_errors() {
        for bad in ["", "0", "-1", "1000001", "1.5", "ten"] {
            assert!(matches!(many_lights(bad), Err(Error::BadValue { .. })), "{bad}");
        }
    }
}
