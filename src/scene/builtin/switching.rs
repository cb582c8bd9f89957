//! A room whose lamps are switched on and off, or fade, one after the other: lights that appear, vanish and change their power.

use super::{hue, matte, place};
use crate::scene::area_light::{AreaLight, Outline};
use crate::scene::rig::{Dimmer, LINEAR, STEP};
use crate::scene::{Camera, Material, PunctualKind, PunctualLight, Scene, shapes};
use glam::{Mat4, Vec3};
use std::f32::consts::PI;

/// Lamps along each of the three walls.
const LAMPS_A_WALL: u32 = 12;
const LAMPS: u32 = 3 * LAMPS_A_WALL;
/// Length of the loop in seconds, keyframes in it, and for what part of it a lamp is on.
const DURATION: f32 = 6.0;
const KEYS: u32 = 36;
const SHARE: f32 = 0.3;
/// Half the width, the height and half the depth of the room in metres; the floor is at y = 0, the front open.
const ROOM: Vec3 = Vec3::new(3.0, 2.6, 3.0);
/// How far lamps stand from their wall, and half the size of one, in metres.
const GAP: f32 = 0.25;
const HALF: f32 = 0.05;
/// Radiance of a sphere before its colour. What gives the same light: that over six squares of a cube, or from a point.
const RADIANCE: f32 = 120.0;

pub(super) fn switching() -> Scene {
    let [floor, wall, thing] = [0, 1, 2];
    let mut scene = Scene {
        name: "switching".into(),
        materials: vec![
            Material { roughness: 0.4, ..matte("floor", Vec3::splat(0.5)) },
            matte("wall", Vec3::new(0.7, 0.69, 0.66)),
            matte("thing", Vec3::new(0.65, 0.6, 0.55)),
        ],
        cameras: vec![
            Camera::look_at("room", Vec3::new(0.0, 1.7, 6.4), Vec3::new(0.0, 0.9, 0.0), 42f32.to_radians()),
            Camera::look_at("floor", Vec3::new(0.0, 2.3, 2.2), Vec3::new(0.0, 0.1, -0.6), 50f32.to_radians()),
        ],
        ..Scene::default()
    };
    let low = Vec3::new(-ROOM.x, 0.0, -ROOM.z);
    let (x, y, z) = (Vec3::X * 2.0 * ROOM.x, Vec3::Y * ROOM.y, Vec3::Z * 2.0 * ROOM.z);
    for mesh in [
        shapes::parallelogram(low, z, x, floor),
        shapes::parallelogram(low + y, x, z, wall),
        shapes::parallelogram(low, x, y, wall),
        shapes::parallelogram(low, y, z, wall),
        shapes::parallelogram(low + x, z, y, wall),
        shapes::cuboid(Vec3::new(-1.3, 0.0, -0.9), Vec3::new(-0.6, 0.9, -0.2), thing),
        shapes::cuboid(Vec3::new(0.5, 0.0, 0.1), Vec3::new(1.3, 0.5, 0.9), thing),
        shapes::sphere(Vec3::new(0.6, 0.45, -1.0), 0.45, 24, thing),
    ] {
        place(&mut scene, mesh, Mat4::IDENTITY);
    }
    scene.rig.add_clip("in turn");
    for i in 0..LAMPS {
        lamp(&mut scene, i);
    }
    scene
}

/// Where lamp `i` hangs: from the front left along the walls to the front right.
fn position(i: u32) -> Vec3 {
    let along = ((i % LAMPS_A_WALL) as f32 + 0.5) / LAMPS_A_WALL as f32 * 2.0 - 1.0;
    // Neighbours hang at different heights.
    let height = [1.0, 1.5, 2.0][(i / 3 % 3) as usize];
    let (side, back) = (ROOM.x - GAP, ROOM.z - GAP);
    match i / LAMPS_A_WALL {
        0 => Vec3::new(-side, height, -along * back),
        1 => Vec3::new(along * side, height, -back),
        _ => Vec3::new(side, height, along * back),
    }
}

/// One lamp, of the three kinds in turn, and its factor. Every other one is switched, the others fade.
fn lamp(scene: &mut Scene, i: u32) {
    let phase = i as f32 / LAMPS as f32;
    let (color, at) = (hue(phase), Mat4::from_translation(position(i)));
    // A sphere sends radiance times pi r^2 in every direction.
    let intensity = color * (RADIANCE * PI * HALF * HALF);
    let power = scene.rig.add_power(1.0);
    match i % 3 {
        0 => {
            let material = scene.materials.len() as u32;
            // A cube's mean cross-section is a quarter of its surface.
            let emissive = intensity / (6.0 * HALF * HALF);
            scene.materials.push(Material { emissive, ..matte("lamp", Vec3::ZERO) });
            place(scene, shapes::cuboid(Vec3::splat(-HALF), Vec3::splat(HALF), material), at);
        }
        1 => {
            let outline = Outline::Sphere { radius: HALF };
            let light = AreaLight { outline, radiance: color * RADIANCE, double_sided: false };
            let placed = scene.add_area_light(&light, at);
            debug_assert!(placed.is_ok(), "size and radiance are sound");
        }
        _ => {
            scene.rig.dimmed_lights.push(Dimmer { target: scene.lights.len() as u32, power });
            scene.lights.push(PunctualLight {
                kind: PunctualKind::Point,
                position: position(i),
                direction: Vec3::NEG_Z,
                intensity,
                range: f32::INFINITY,
            });
        }
    }
    if i % 3 != 2 {
        scene.rig.dimmed_instances.push(Dimmer { target: scene.instances.len() as u32 - 1, power });
    }
    let is_on = |key: u32| (key as f32 / KEYS as f32 - phase).rem_euclid(1.0) < SHARE;
    let times: Vec<f32> = (0..=KEYS).map(|key| key as f32 / KEYS as f32 * DURATION).collect();
    let values: Vec<f32> = (0..=KEYS).map(|key| f32::from(u8::from(is_on(key % KEYS)))).collect();
    scene.rig.add_power_channel(power, if i.is_multiple_of(2) { STEP } else { LINEAR }, &times, &values);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::FlatScene;
    use crate::scene::gpu_types::NONE;

    #[test]
    fn some_lamps_are_on_at_every_moment_and_each_has_its_turn() {
        let scene = switching();
        let mut was_on = vec![false; LAMPS as usize];
        for frame in 0..360 {
            let powers = scene.rig.pose(0, f64::from(frame) / 60.0).powers;
            let on = powers.iter().filter(|power| **power > 0.0).count();
            assert!((LAMPS as usize / 5..LAMPS as usize / 2).contains(&on), "{on} at frame {frame}");
            was_on.iter_mut().zip(&powers).for_each(|(was, power)| *was |= *power == 1.0);
            // In the middle between two keyframes one fades.
            let fades = powers.iter().any(|power| (0.4..0.6).contains(power));
            assert!(fades || frame % 10 != 5, "frame {frame}");
        }
        assert!(was_on.into_iter().all(|was| was));
    }

    #[test]
    fn every_light_has_the_factor_of_its_lamp() {
        let flat = FlatScene::build(&switching(), &mut |_, _| ()).unwrap();
        // Twelve triangles a cube.
        assert_eq!(flat.lights.len() as u32, LAMPS / 3 * (12 + 1 + 1));
        assert!(flat.light_powers.iter().all(|&power| power != NONE));
        for power in 0..LAMPS {
            let own = flat.light_powers.iter().filter(|other| **other == power).count();
            assert_eq!(own, [12, 1, 1][power as usize % 3], "lamp {power}");
        }
    }
}
