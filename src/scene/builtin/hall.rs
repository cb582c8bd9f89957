//! A closed hall full of displaced spheres and boxes, of any number of triangles: what traversal is measured in.

use super::{matte, place};
use crate::error::{Error, Result};
use crate::scene::random::Random;
use crate::scene::{Camera, Material, Mesh, Scene, shapes};
use glam::{EulerRot, Mat3, Mat4, Vec3};
use std::f32::consts::{PI, TAU};

/// Half the width, the height and half the depth in metres; the floor is at y = 0.
const HALL: Vec3 = Vec3::new(40.0, 20.0, 25.0);
/// Spheres and boxes, half of each.
const OBJECTS: usize = 300;
/// Square lamps under the ceiling along the width and the depth.
const LAMPS: [u32; 2] = [8, 5];
/// Side of a lamp in metres.
const LAMP_SIZE: f32 = 2.0;
const COLORS: usize = 6;
/// Where the camera stands, and how near to it no object is, which would hide the others.
const EYE: Vec3 = Vec3::new(-36.0, 9.0, -21.0);
const CLEARANCE: f32 = 9.0;
const FEWEST: u32 = 10_000;
const MOST: u32 = 8_000_000;
const SEED: u64 = 0x6861_6c6c;

/// The part of the name after the `:` is the number of triangles, met to within a few in a hundred.
pub(super) fn hall(count: &str) -> Result<Scene> {
    let count = count.parse().ok().filter(|n| (FEWEST..=MOST).contains(n)).ok_or_else(|| {
        Error::bad_value("hall:N", format!("'{count}' is not a whole number from {FEWEST} to {MOST}"))
    })?;
    let [wall, lamp] = [0, 1];
    let mut scene = Scene {
        name: format!("hall:{count}"),
        materials: vec![
            matte("wall", Vec3::new(0.72, 0.7, 0.66)),
            Material { emissive: Vec3::splat(30.0), ..matte("lamp", Vec3::ZERO) },
        ],
        cameras: vec![Camera::look_at("hall", EYE, Vec3::new(10.0, 6.0, 8.0), 60f32.to_radians())],
        ..Scene::default()
    };
    for i in 0..COLORS {
        let tint = Vec3::splat(0.7).lerp(super::hue(i as f32 / COLORS as f32), 0.4);
        scene.materials.push(Material { roughness: 0.2 + 0.1 * i as f32, ..matte("object", tint) });
    }
    let mut room = Mesh { material: wall, ..Mesh::default() };
    let low = Vec3::new(-HALL.x, 0.0, -HALL.z);
    let (x, y, z) = (Vec3::X * 2.0 * HALL.x, Vec3::Y * HALL.y, Vec3::Z * 2.0 * HALL.z);
    for (corner, u, v) in [(low, z, x), (low + y, x, z), (low, y, z), (low + x, z, y), (low, x, y), (low + z, y, x)] {
        shapes::append(&mut room, &shapes::parallelogram(corner, u, v, wall));
    }
    place(&mut scene, room, Mat4::IDENTITY);
    let mut lamps = Mesh { material: lamp, ..Mesh::default() };
    let spacing = [0, 1].map(|k| 2.0 * HALL[2 * k] / LAMPS[k] as f32);
    for i in 0..LAMPS[0] * LAMPS[1] {
        let cell = [i % LAMPS[0], i / LAMPS[0]].map(|c| c as f32 + 0.5);
        let corner = Vec3::new(cell[0] * spacing[0] - HALL.x, HALL.y - 0.1, cell[1] * spacing[1] - HALL.z);
        let corner = corner - Vec3::new(LAMP_SIZE, 0.0, LAMP_SIZE) / 2.0;
        shapes::append(&mut lamps, &shapes::parallelogram(corner, Vec3::X * LAMP_SIZE, Vec3::Z * LAMP_SIZE, lamp));
    }
    place(&mut scene, lamps, Mat4::IDENTITY);
    let mut missing = count;
    for i in 0..OBJECTS {
        // Each is of about as many as asked; what it is off by is shared by those that follow.
        let mut mesh = object(i, missing / (OBJECTS - i) as u32);
        missing = missing.saturating_sub(mesh.indices.len() as u32 / 3);
        mesh.material = 2 + (i % COLORS) as u32;
        place(&mut scene, mesh, Mat4::IDENTITY);
    }
    Ok(scene)
}

/// The `index`th sphere or box, in the world, of about `triangles` triangles.
fn object(index: usize, triangles: u32) -> Mesh {
    let mut random = Random::new(SEED + index as u64);
    let radius = 0.6 + 1.8 * random.unit() * random.unit();
    // More of them near the floor.
    let height = radius + (18.0 - 2.0 * radius) * random.unit() * random.unit();
    let mut center = Vec3::new(random.range(-37.0, 37.0), height, random.range(-22.0, 22.0));
    if center.distance(EYE) < CLEARANCE {
        center.x = -center.x;
    }
    let frequency = random.in_box(Vec3::splat(2.0), Vec3::splat(8.0));
    let phase = random.in_box(Vec3::ZERO, Vec3::splat(9.0));
    let amplitude = random.range(0.05, 0.2);
    let wave = |p: Vec3| {
        let q = p * frequency + phase;
        q.x.sin() * q.y.sin() * q.z.sin()
    };
    let swell = |p: Vec3| 1.0 + amplitude * (wave(p) + 0.35 * wave(5.3 * p) + 0.12 * wave(23.0 * p));
    if index.is_multiple_of(2) {
        let rings = (((triangles as f32 + 1.0).sqrt() * 0.5 + 0.5).round() as u32).max(3);
        // Longitude wraps exactly, so that the surface is closed.
        let segments = 2 * rings;
        patches(rings, segments, &|ring, segment| {
            let (sin_theta, cos_theta) = (ring as f32 / rings as f32 * PI).sin_cos();
            let sin_theta = if ring == 0 || ring == rings { 0.0 } else { sin_theta };
            let (sin_phi, cos_phi) = ((segment % segments) as f32 / segments as f32 * TAU).sin_cos();
            let direction = Vec3::new(sin_theta * sin_phi, cos_theta, sin_theta * cos_phi);
            center + direction * (radius * swell(direction))
        })
    } else {
        let steps = ((triangles as f32 / 12.0).sqrt().round() as u32).max(1);
        let turn = Mat3::from_euler(EulerRot::YXZ, random.range(0.0, TAU), random.unit(), random.unit());
        let size = 0.6 * radius * random.in_box(Vec3::splat(0.5), Vec3::splat(1.5));
        let mut mesh = Mesh::default();
        for face in 0..6 {
            let (axis, side) = (face / 2, if face % 2 == 0 { 1.0 } else { -1.0 });
            let along = |i: u32| 2.0 * i as f32 / steps as f32 - 1.0;
            let side_mesh = patches(steps, steps, &|i, j| {
                let mut p = Vec3::ZERO;
                p[axis] = side;
                p[(axis + 1) % 3] = side * along(i);
                p[(axis + 2) % 3] = along(j);
                center + turn * (p * size * swell(0.7 * p))
            });
            shapes::append(&mut mesh, &side_mesh);
        }
        mesh
    }
}

/// A grid of quadrilaterals over `at`, with smooth normals; sides that shrink to a point leave one triangle.
fn patches(rows: u32, columns: u32, at: &dyn Fn(u32, u32) -> Vec3) -> Mesh {
    let mut mesh = Mesh::default();
    for row in 0..=rows {
        mesh.positions.extend((0..=columns).map(|column| at(row, column)));
    }
    for row in 0..rows {
        for column in 0..columns {
            let a = row * (columns + 1) + column;
            let (right, below) = (a + 1, a + columns + 1);
            for corners in [[a, below, right], [right, below, below + 1]] {
                let [p, q, r] = corners.map(|i| mesh.positions[i as usize]);
                if p != q && q != r && r != p {
                    mesh.indices.extend(corners);
                }
            }
        }
    }
    mesh.normals = vec![Vec3::ZERO; mesh.positions.len()];
    for corners in mesh.indices.as_chunks::<3>().0 {
        let [p, q, r] = corners.map(|i| mesh.positions[i as usize]);
        let normal = (q - p).cross(r - p);
        corners.iter().for_each(|&i| mesh.normals[i as usize] += normal);
    }
    mesh.normals.iter_mut().for_each(|normal| *normal = normal.normalize_or(Vec3::Y));
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_triangles_as_asked_for() {
        for count in [10_000u32, 100_000] {
            let scene = hall(&count.to_string()).unwrap();
            let made: usize = scene.meshes.iter().map(|mesh| mesh.indices.len() / 3).sum();
            assert!((made as f32 / count as f32 - 1.0).abs() < 0.05, "{made} for {count}");
        }
        assert!(hall("9999").is_err() && hall("many").is_err());
    }

    /// Along every edge of a sphere lies another triangle, the other way round.
    #[test]
    fn objects_are_closed() {
        for index in 0..4 {
            let mesh = object(index, 3000);
            let key = |i: u32| mesh.positions[i as usize].to_array().map(f32::to_bits);
            let mut edges = std::collections::HashMap::new();
            for corners in mesh.indices.as_chunks::<3>().0 {
                for k in 0..3 {
                    *edges.entry((key(corners[k]), key(corners[(k + 1) % 3]))).or_insert(0) += 1;
                }
            }
            for (&(a, b), count) in &edges {
                assert_eq!(edges.get(&(b, a)), Some(count), "object {index}");
            }
        }
    }
}
