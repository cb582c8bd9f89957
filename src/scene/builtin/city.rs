//! A few blocks of a city at night: houses with N lit windows, and street lamps. It stands for the night scenes of Wyman and
//! Panteleev 2021, which are not ours to show.

use super::{count, matte, place};
use crate::error::Result;
use crate::scene::random::Random;
use crate::scene::{Camera, Material, Mesh, Scene, shapes};
use glam::{Mat4, Vec3};
use std::ops::RangeInclusive;

const COUNT: RangeInclusive<u32> = 10..=5000;
/// Houses along either axis, metres from one to the next, and half the side of one: between them lie streets.
const HOUSES: i32 = 6;
const PITCH: f32 = 20.0;
const HALF_HOUSE: f32 = 6.5;
const STOREY: f32 = 3.0;
const STOREYS: [f32; 2] = [3.0, 10.0];
/// Windows of a storey on one side of a house; width and height of one, and how far it stands out.
const COLUMNS: i32 = 6;
const WINDOW: [f32; 2] = [1.1, 1.4];
const RELIEF: f32 = 0.02;
/// Colours that windows have, from tungsten to a screen's, and the radiance of the brightest.
const COLORS: [Vec3; 4] =
    [Vec3::new(1.0, 0.62, 0.3), Vec3::new(1.0, 0.78, 0.5), Vec3::new(0.9, 0.92, 1.0), Vec3::new(0.45, 0.65, 1.0)];
const RADIANCE: [f32; 2] = [4.0, 12.0];
const LAMP_RADIANCE: f32 = 150.0;
const LAMP_HEIGHT: f32 = 5.5;
const SEED: u64 = 0x6369_7479;

/// The part of the name after the `:` is the number of lit windows, of two triangles each.
pub(super) fn city(number: &str) -> Result<Scene> {
    let number = count("city:N", number, COUNT)?;
    let [asphalt, pavement, facade, iron, lamp] = [0, 1, 2, 3, 4];
    let mut scene = Scene {
        name: format!("city:{number}"),
        materials: vec![
            Material { roughness: 0.25, ..matte("wet asphalt", Vec3::splat(0.06)) },
            matte("pavement", Vec3::splat(0.35)),
            matte("facade", Vec3::new(0.45, 0.4, 0.36)),
            Material { roughness: 0.5, ..matte("iron", Vec3::splat(0.1)) },
            Material { emissive: Vec3::new(1.0, 0.75, 0.45) * LAMP_RADIANCE, ..matte("street lamp", Vec3::ZERO) },
        ],
        cameras: vec![
            Camera::look_at("street", Vec3::new(0.9, 1.8, 38.0), Vec3::new(-0.6, 4.0, 0.0), 60f32.to_radians()),
            Camera::look_at("above", Vec3::new(45.0, 42.0, 60.0), Vec3::new(0.0, 4.0, 0.0), 45f32.to_radians()),
        ],
        ..Scene::default()
    };
    let half = 0.5 * HOUSES as f32 * PITCH;
    let ground =
        shapes::parallelogram(Vec3::new(-half, 0.0, half), Vec3::X * 2.0 * half, Vec3::NEG_Z * 2.0 * half, asphalt);
    place(&mut scene, ground, Mat4::IDENTITY);
    let mut walls = Mesh { material: facade, ..Mesh::default() };
    let mut kerbs = Mesh { material: pavement, ..Mesh::default() };
    let mut posts = Mesh { material: iron, ..Mesh::default() };
    let mut lamps = Mesh { material: lamp, ..Mesh::default() };
    for house in houses() {
        let (c, h) = (house.center, HALF_HOUSE);
        let block = |low: f32, high: f32, half: f32, material: u32| {
            shapes::cuboid(c + Vec3::new(-half, low, -half), c + Vec3::new(half, high, half), material)
        };
        shapes::append(&mut kerbs, &block(0.0, 0.15, h + 1.6, pavement));
        shapes::append(&mut walls, &block(0.151, house.height(), h, facade));
        for (x, z) in [(-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)] {
            let foot = c + Vec3::new(x, 0.0, z) * (h + 1.2) + Vec3::new(z, 0.0, x) * 4.0;
            let thick = Vec3::new(0.06, 0.0, 0.06);
            let post = shapes::cuboid(foot - thick + Vec3::Y * 0.15, foot + thick + Vec3::Y * LAMP_HEIGHT, iron);
            shapes::append(&mut posts, &post);
            let corner = foot + Vec3::new(-0.2, LAMP_HEIGHT - 0.02, -0.2) + Vec3::new(x, 0.0, z) * 0.5;
            shapes::append(&mut lamps, &shapes::parallelogram(corner, Vec3::X * 0.4, Vec3::Z * 0.4, lamp));
        }
    }
    for mesh in [walls, kerbs, posts, lamps] {
        place(&mut scene, mesh, Mat4::IDENTITY);
    }
    let mut random = Random::new(SEED);
    let mut slots = windows();
    let mut lit = vec![Mesh::default(); COLORS.len() * 2];
    for i in 0..number as usize {
        // The first of a shuffle (Fisher and Yates).
        let other = i + (random.next_u32() as usize) % (slots.len() - i);
        slots.swap(i, other);
        let (corner, along) = slots[i];
        let kind = (random.next_u32() as usize) % lit.len();
        let pane = shapes::parallelogram(corner, along * WINDOW[0], Vec3::Y * WINDOW[1], 0);
        shapes::append(&mut lit[kind], &pane);
    }
    for (i, mut mesh) in lit.into_iter().enumerate().filter(|(_, mesh)| !mesh.indices.is_empty()) {
        mesh.material = scene.materials.len() as u32;
        let emissive = COLORS[i / 2] * RADIANCE[i % 2];
        scene.materials.push(Material { emissive, ..matte("window", Vec3::splat(0.05)) });
        place(&mut scene, mesh, Mat4::IDENTITY);
    }
    Ok(scene)
}

/// One house: the middle of its floor, and its storeys.
struct House {
    center: Vec3,
    storeys: i32,
}

impl House {
    fn height(&self) -> f32 {
        self.storeys as f32 * STOREY + 0.8
    }
}

fn houses() -> Vec<House> {
    let mut random = Random::new(SEED ^ 1);
    let at = |i: i32| (i as f32 - 0.5 * (HOUSES - 1) as f32) * PITCH;
    let place = |k: i32| Vec3::new(at(k % HOUSES), 0.0, at(k / HOUSES));
    (0..HOUSES * HOUSES)
        .map(|k| House { center: place(k), storeys: random.range(STOREYS[0], STOREYS[1] + 1.0) as i32 })
        .collect()
}

/// Where a window can be: its lower corner and the direction of its width, so that it faces the street.
fn windows() -> Vec<(Vec3, Vec3)> {
    let mut slots = Vec::new();
    for house in houses() {
        for side in 0..4 {
            let along = Mat4::from_rotation_y(side as f32 * std::f32::consts::FRAC_PI_2).transform_vector3(Vec3::X);
            let out = along.cross(Vec3::Y);
            let spacing = 2.0 * HALF_HOUSE / COLUMNS as f32;
            for storey in 0..house.storeys {
                for column in 0..COLUMNS {
                    let x = (column as f32 + 0.5) * spacing - HALF_HOUSE - 0.5 * WINDOW[0];
                    let y = storey as f32 * STOREY + 1.2;
                    slots.push((house.center + along * x + out * (HALF_HOUSE + RELIEF) + Vec3::Y * y, along));
                }
            }
        }
    }
    slots
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_are_enough_and_face_out_of_their_houses() {
        let slots = windows();
        assert!(slots.len() as u32 >= *COUNT.end(), "{}", slots.len());
        let houses = houses();
        for (corner, along) in slots {
            let middle = corner + along * (0.5 * WINDOW[0]);
            let near = |house: &&House| middle.with_y(0.0).distance(house.center) < 1.5 * HALF_HOUSE;
            let house = houses.iter().find(near).expect("a window has a house");
            assert!(along.cross(Vec3::Y).dot(middle - house.center) > 0.0);
            assert!(middle.y + WINDOW[1] < house.height());
        }
        let lit = |n: &str| city(n).unwrap().meshes.iter().map(|m| m.indices.len() / 6).sum::<usize>();
        assert_eq!(lit("500") - lit("100"), 400);
        assert!(city("9").is_err() && city("5001").is_err() && city("").is_err());
    }
}
