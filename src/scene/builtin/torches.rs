//! A maze of rooms, each with a torch that hardly any other room sees: many small, strongly occluded lights, of which
//! only a few matter anywhere. It stands for worlds like that of Wyman and Panteleev 2021, figure 20, which is not ours.

use super::{count, matte, place};
use crate::error::Result;
use crate::scene::random::Random;
use crate::scene::{Camera, Material, Mesh, Scene, shapes};
use glam::{Mat4, Vec3};
use std::ops::RangeInclusive;

const COUNT: RangeInclusive<u32> = 9..=40_000;
/// Side of a room, height and thickness of walls, metres.
const ROOM: f32 = 3.0;
const WALL: f32 = 2.4;
const THICKNESS: f32 = 0.2;
/// Probabilities that there is a wall between two rooms, and a roof over one.
const WALLED: f32 = 0.7;
const ROOFED: f32 = 0.35;
/// A torch: half its width, its height, and where it begins.
const HALF_TORCH: f32 = 0.05;
const TORCH: f32 = 0.22;
const FOOT: f32 = 1.3;
const RADIANCE: Vec3 = Vec3::new(160.0, 80.0, 24.0);
const SEED: u64 = 0x746f_7263;

/// The part of the name after the `:` is the number of torches, of twelve triangles each: one a room, for as many rooms as
/// make a square.
pub(super) fn torches(number: &str) -> Result<Scene> {
    let number = count("torches:N", number, COUNT)?;
    let side = (number as f32).sqrt().ceil() as u32;
    let half = 0.5 * side as f32 * ROOM;
    let [earth, stone, roof, torch] = [0, 1, 2, 3];
    let mut scene = Scene {
        name: format!("torches:{number}"),
        materials: vec![
            matte("earth", Vec3::new(0.36, 0.28, 0.2)),
            matte("stone", Vec3::new(0.5, 0.48, 0.46)),
            matte("roof", Vec3::new(0.35, 0.2, 0.12)),
            Material { emissive: RADIANCE, ..matte("torch", Vec3::ZERO) },
        ],
        cameras: vec![
            Camera::look_at(
                "above",
                Vec3::new(-0.3 * ROOM, 8.0, half - 2.0 * ROOM),
                Vec3::new(0.4 * ROOM, 0.0, half - 4.2 * ROOM),
                50f32.to_radians(),
            ),
            Camera::look_at(
                "inside",
                Vec3::new(-0.5 * half + 0.3 * ROOM, 1.7, half - 0.4),
                Vec3::new(-0.5 * half + 0.8 * ROOM, 1.1, half - 3.0 * ROOM),
                70f32.to_radians(),
            ),
        ],
        ..Scene::default()
    };
    let floor =
        shapes::parallelogram(Vec3::new(-half, 0.0, half), Vec3::X * 2.0 * half, Vec3::NEG_Z * 2.0 * half, earth);
    place(&mut scene, floor, Mat4::IDENTITY);
    let mut walls = Mesh { material: stone, ..Mesh::default() };
    let mut roofs = Mesh { material: roof, ..Mesh::default() };
    let mut torches = Mesh { material: torch, ..Mesh::default() };
    let mut random = Random::new(SEED);
    let corner = |i: u32, k: u32| Vec3::new(i as f32 * ROOM - half, 0.0, k as f32 * ROOM - half);
    for k in 0..=side {
        for i in 0..=side {
            let p = corner(i, k);
            let inner = |edge: u32| (1..side).contains(&edge);
            let thin = Vec3::new(0.5 * THICKNESS, 0.0, 0.5 * THICKNESS);
            // Draws are made whether or not they are used, so that rooms do not depend on the size of the world's edge.
            let [along_x, along_z, over] = [(); 3].map(|()| random.unit());
            if i < side && (along_x < WALLED || !inner(k)) {
                let wall = shapes::cuboid(p - thin, p + Vec3::X * (ROOM - THICKNESS) + thin + Vec3::Y * WALL, stone);
                shapes::append(&mut walls, &wall);
            }
            if k < side && (along_z < WALLED || !inner(i)) {
                let wall = shapes::cuboid(
                    p - thin + Vec3::Z * THICKNESS,
                    p + Vec3::Z * (ROOM - THICKNESS) + thin + Vec3::Y * WALL,
                    stone,
                );
                shapes::append(&mut walls, &wall);
            }
            if i == side || k == side {
                continue;
            }
            if over < ROOFED {
                let top = p + Vec3::Y * (WALL + 0.01);
                let slab = shapes::cuboid(top - thin, top + Vec3::new(ROOM, 0.15, ROOM) + thin, roof);
                shapes::append(&mut roofs, &slab);
            }
            if (side - 1 - k) * side + i < number {
                let inside = 0.5 * THICKNESS + 2.0 * HALF_TORCH;
                let at = p + Vec3::new(random.range(inside, ROOM - inside), FOOT, random.range(inside, ROOM - inside));
                let half = Vec3::new(HALF_TORCH, 0.0, HALF_TORCH);
                shapes::append(&mut torches, &shapes::cuboid(at - half, at + half + Vec3::Y * TORCH, torch));
                let post = Vec3::new(0.02, 0.0, 0.02);
                let stick = shapes::cuboid(at.with_y(0.0) - post, at + post - Vec3::Y * 0.001, roof);
                shapes::append(&mut roofs, &stick);
            }
        }
    }
    for mesh in [walls, roofs, torches] {
        place(&mut scene, mesh, Mat4::IDENTITY);
    }
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_room_has_its_torch() {
        for (number, sides) in [("9", 3u32), ("10", 4), ("300", 18)] {
            let scene = torches(number).unwrap();
            let lit =
                scene.meshes.iter().find(|m| scene.materials[m.material as usize].emissive != Vec3::ZERO).unwrap();
            assert_eq!(lit.indices.len() / 36, number.parse::<usize>().unwrap());
            let half = 0.5 * sides as f32 * ROOM;
            assert!(lit.positions.iter().all(|p| p.x.abs() < half && p.z.abs() < half && p.y < WALL));
        }
        assert!(torches("8").is_err() && torches("40001").is_err() && torches("1.5").is_err());
    }
}
