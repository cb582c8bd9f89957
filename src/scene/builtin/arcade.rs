//! An arcade at night: two rows of arches with stalls behind them, under strings of small coloured lamps. It stands for
//! scenes like the Amusement Park of Wyman and Panteleev 2021, which is not ours to show.

use super::{count, hue, matte, place};
use crate::error::Result;
use crate::scene::random::Random;
use crate::scene::{Camera, Material, Mesh, Scene, shapes};
use glam::{Mat4, Vec3};
use std::f32::consts::PI;
use std::ops::RangeInclusive;

const COUNT: RangeInclusive<u32> = 10..=200_000;
/// Metres: half the width between the arches, half the length, and from one pillar to the next.
const HALF_WIDTH: f32 = 3.0;
const HALF_LENGTH: f32 = 21.0;
const BAY: f32 = 3.0;
const PILLAR: f32 = 0.35;
/// Height where the arches begin, and of the wall over them.
const SPRING: f32 = 2.2;
const WALL: f32 = 4.6;
const ARCH_STEPS: u32 = 12;
/// Lamps of a string, and how far it sags.
const LAMPS: u32 = 40;
const SAG: [f32; 2] = [0.3, 0.9];
/// All lamps together, whatever their number: square metres, and radiance before the colour.
const TOTAL_AREA: f32 = 3.0;
const LARGEST_RADIUS: f32 = 0.08;
const RADIANCE: f32 = 40.0;
const COLORS: usize = 12;
const SEED: u64 = 0x6172_6361;

/// The part of the name after the `:` is the number of lamps, of eight triangles each.
pub(super) fn arcade(number: &str) -> Result<Scene> {
    let number = count("arcade:N", number, COUNT)?;
    let [ground, plaster, wood] = [0, 1, 2];
    let eye = Vec3::new(-0.8, 1.7, HALF_LENGTH - 2.0);
    let mut scene = Scene {
        name: format!("arcade:{number}"),
        materials: vec![
            Material { roughness: 0.3, ..matte("ground", Vec3::splat(0.25)) },
            matte("plaster", Vec3::new(0.7, 0.62, 0.5)),
            Material { roughness: 0.6, ..matte("wood", Vec3::new(0.4, 0.22, 0.12)) },
        ],
        cameras: vec![
            Camera::look_at("walk", eye, Vec3::new(0.5, 2.0, 0.0), 60f32.to_radians()),
            Camera::look_at("stalls", Vec3::new(1.8, 1.7, 6.0), Vec3::new(-4.5, 1.0, 1.0), 60f32.to_radians()),
        ],
        ..Scene::default()
    };
    let depth = HALF_WIDTH + 3.0;
    let floor = shapes::parallelogram(
        Vec3::new(-depth, 0.0, HALF_LENGTH),
        Vec3::X * 2.0 * depth,
        Vec3::NEG_Z * 2.0 * HALF_LENGTH,
        ground,
    );
    place(&mut scene, floor, Mat4::IDENTITY);
    place(&mut scene, arches(plaster), Mat4::IDENTITY);
    // The other side is the first turned round.
    place(&mut scene, arches(plaster), Mat4::from_rotation_y(PI));
    place(&mut scene, stalls(wood), Mat4::IDENTITY);
    let mut lamps = vec![Mesh::default(); COLORS];
    let radius = (TOTAL_AREA / number as f32 / (4.0 * 3f32.sqrt())).sqrt().min(LARGEST_RADIUS);
    for (string, position) in positions(number) {
        let mut lamp = octahedron(position, radius);
        lamp.material = 0;
        shapes::append(&mut lamps[string as usize % COLORS], &lamp);
    }
    for (i, mut mesh) in lamps.into_iter().enumerate().filter(|(_, mesh)| !mesh.indices.is_empty()) {
        mesh.material = scene.materials.len() as u32;
        // Most strings are nearly white, every third is coloured.
        let strength = if i % 3 == 0 { 0.8 } else { 0.15 };
        let tint = Vec3::new(1.0, 0.85, 0.6).lerp(hue(i as f32 / COLORS as f32), strength);
        scene.materials.push(Material { emissive: tint * RADIANCE, ..matte("lamp", Vec3::ZERO) });
        place(&mut scene, mesh, Mat4::IDENTITY);
    }
    Ok(scene)
}

/// One row of pillars with arches and the wall over them, at positive x.
fn arches(material: u32) -> Mesh {
    let mut mesh = Mesh { material, ..Mesh::default() };
    let (inner, outer) = (HALF_WIDTH, HALF_WIDTH + PILLAR);
    let bays = (2.0 * HALF_LENGTH / BAY) as u32;
    let radius = 0.5 * (BAY - PILLAR);
    for bay in 0..=bays {
        let z = bay as f32 * BAY - HALF_LENGTH;
        let pillar =
            shapes::cuboid(Vec3::new(inner, 0.0, z - 0.5 * PILLAR), Vec3::new(outer, WALL, z + 0.5 * PILLAR), material);
        shapes::append(&mut mesh, &pillar);
        if bay == bays {
            continue;
        }
        let middle = z + 0.5 * BAY;
        let on_arch = |step: u32| {
            let (sin, cos) = (step as f32 / ARCH_STEPS as f32 * PI).sin_cos();
            (SPRING + radius * sin, middle - radius * cos)
        };
        for step in 0..ARCH_STEPS {
            let ((y0, z0), (y1, z1)) = (on_arch(step), on_arch(step + 1));
            // The soffit, and the wall over it on either side: quadrilaterals between the arch and the top.
            quad(&mut mesh, [(inner, y0, z0), (outer, y0, z0), (outer, y1, z1), (inner, y1, z1)]);
            quad(&mut mesh, [(inner, y0, z0), (inner, y1, z1), (inner, WALL, z1), (inner, WALL, z0)]);
            quad(&mut mesh, [(outer, y0, z0), (outer, WALL, z0), (outer, WALL, z1), (outer, y1, z1)]);
            quad(&mut mesh, [(inner, WALL, z0), (inner, WALL, z1), (outer, WALL, z1), (outer, WALL, z0)]);
        }
    }
    mesh
}

/// A flat quadrilateral, seen from where its corners run counter-clockwise.
fn quad(mesh: &mut Mesh, corners: [(f32, f32, f32); 4]) {
    let p = corners.map(Vec3::from);
    let normal = (p[1] - p[0]).cross(p[2] - p[0]).normalize_or(Vec3::Y);
    let base = mesh.positions.len() as u32;
    mesh.positions.extend(p);
    mesh.normals.extend([normal; 4]);
    mesh.uvs[0].extend([glam::Vec2::ZERO; 4]);
    mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|i| base + i));
}

/// Back walls, counters and crates behind the arches, on both sides.
fn stalls(material: u32) -> Mesh {
    let mut random = Random::new(SEED ^ 1);
    let mut mesh = Mesh { material, ..Mesh::default() };
    let bays = (2.0 * HALF_LENGTH / BAY) as u32;
    for side in [-1.0f32, 1.0] {
        let mut put = |x0: f32, x1: f32, y0: f32, y1: f32, z0: f32, z1: f32| {
            let (low, high) = ((side * x0).min(side * x1), (side * x0).max(side * x1));
            let block = shapes::cuboid(Vec3::new(low, y0, z0), Vec3::new(high, y1, z1), material);
            shapes::append(&mut mesh, &block);
        };
        let back = HALF_WIDTH + 2.8;
        put(back, back + 0.2, 0.0, 3.2, -HALF_LENGTH, HALF_LENGTH);
        for bay in 0..bays {
            let z = (bay as f32 + 0.5) * BAY - HALF_LENGTH;
            put(HALF_WIDTH + 0.9, HALF_WIDTH + 1.4, 0.0, 0.95, z - 1.1, z + 1.1);
            for _ in 0..3 {
                let (size, along) = (random.range(0.15, 0.35), random.range(-0.9, 0.9));
                let x = HALF_WIDTH + random.range(1.0, 1.2);
                put(x, x + size, 0.951, 0.95 + size, z + along, z + along + size);
            }
            // A partition to the next stall.
            put(HALF_WIDTH + 1.4, back, 0.0, 2.4, z + 0.5 * BAY - 0.04, z + 0.5 * BAY + 0.04);
        }
    }
    mesh
}

/// The string that each lamp hangs on, and where.
fn positions(number: u32) -> impl Iterator<Item = (u32, Vec3)> {
    let strings = number.div_ceil(LAMPS);
    let mut random = Random::new(SEED);
    let mut string = (Vec3::ZERO, Vec3::ZERO, 0.0);
    (0..number).map(move |lamp| {
        let (index, along) = (lamp / LAMPS, (lamp % LAMPS) as f32 + 0.5);
        if lamp % LAMPS == 0 {
            let z = ((index as f32 + 0.5) / strings as f32 * 2.0 - 1.0) * (HALF_LENGTH - 0.5);
            let side = if index % 2 == 0 { 1.0 } else { -1.0 };
            let end = |x: f32, random: &mut Random| {
                let z = (z + random.range(-1.5, 1.5)).clamp(0.3 - HALF_LENGTH, HALF_LENGTH - 0.3);
                Vec3::new(x, random.range(3.4, WALL), z)
            };
            let inside = HALF_WIDTH - 0.12;
            let from = end(-side * inside, &mut random);
            string = (from, end(side * inside, &mut random), random.range(SAG[0], SAG[1]));
        }
        let (from, to, sag) = string;
        let t = along / LAMPS as f32;
        // A parabola is near enough to a catenary.
        (index, from.lerp(to, t) - Vec3::Y * (4.0 * sag * t * (1.0 - t)))
    })
}

/// Eight triangles round a centre.
fn octahedron(center: Vec3, radius: f32) -> Mesh {
    let mut mesh = Mesh::default();
    for octant in 0..8u32 {
        let sign = |bit: u32| if octant >> bit & 1 == 0 { radius } else { -radius };
        let (x, y, z) = (Vec3::X * sign(0), Vec3::Y * sign(1), Vec3::Z * sign(2));
        // An odd number of mirrored axes turns the triangle round.
        let corners = if octant.count_ones().is_multiple_of(2) { [x, y, z] } else { [x, z, y] };
        let normal = (x + y + z).normalize();
        let base = mesh.positions.len() as u32;
        mesh.positions.extend(corners.map(|corner| center + corner));
        mesh.normals.extend([normal; 3]);
        mesh.uvs[0].extend([glam::Vec2::ZERO; 3]);
        mesh.indices.extend([base, base + 1, base + 2]);
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lamps_hang_inside_and_face_outwards() {
        for number in [10, 400, 5000] {
            let lamps: Vec<_> = positions(number).collect();
            assert_eq!(lamps.len() as u32, number);
            for (_, p) in lamps {
                assert!(p.x.abs() < HALF_WIDTH && p.z.abs() < HALF_LENGTH && (2.0..WALL).contains(&p.y), "{p}");
            }
        }
        let mesh = octahedron(Vec3::ONE, 0.5);
        for corners in mesh.indices.as_chunks::<3>().0 {
            let [a, b, c] = corners.map(|i| mesh.positions[i as usize] - Vec3::ONE);
            assert!((b - a).cross(c - a).dot(a + b + c) > 0.0);
        }
        assert!(arcade("9").is_err() && arcade("200001").is_err() && arcade("x").is_err());
    }
}
