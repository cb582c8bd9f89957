//! A wall and a floor with a few things on it, under a sphere, a rectangle and a disk of light.

use super::{matte, place};
use crate::scene::area_light::{AreaLight, Outline};
use crate::scene::{Camera, Material, Scene, shapes};
use glam::{Mat4, Quat, Vec3};
use std::f32::consts::FRAC_PI_2;

pub(super) fn area_lights() -> Scene {
    let [ground, clay, metal] = [0, 1, 2];
    let mut scene = Scene {
        name: "area-lights".into(),
        materials: vec![
            matte("ground", Vec3::splat(0.6)),
            matte("clay", Vec3::new(0.7, 0.45, 0.35)),
            Material { metallic: 1.0, roughness: 0.25, ..matte("metal", Vec3::new(0.9, 0.88, 0.85)) },
        ],
        cameras: vec![Camera::look_at("front", Vec3::new(0.0, 2.6, 6.4), Vec3::new(0.0, 0.9, 0.0), 40f32.to_radians())],
        ..Scene::default()
    };
    let floor = shapes::parallelogram(Vec3::new(-6.0, 0.0, 6.0), Vec3::X * 12.0, Vec3::Z * -8.0, ground);
    place(&mut scene, floor, Mat4::IDENTITY);
    let wall = shapes::parallelogram(Vec3::new(-6.0, 0.0, -2.0), Vec3::X * 12.0, Vec3::Y * 6.0, ground);
    place(&mut scene, wall, Mat4::IDENTITY);
    for (x, z, material) in [(-1.6, 0.2, metal), (0.0, 0.6, clay), (1.6, 0.2, metal)] {
        place(&mut scene, shapes::sphere(Vec3::new(x, 0.5, z), 0.5, 32, material), Mat4::IDENTITY);
    }
    let block = shapes::cuboid(Vec3::new(-0.5, 0.0, -1.3), Vec3::new(0.5, 0.7, -0.6), clay);
    place(&mut scene, block, Mat4::IDENTITY);

    let down = Quat::from_rotation_x(-FRAC_PI_2);
    let lights = [
        (Outline::Sphere { radius: 0.25 }, Vec3::new(20.0, 13.0, 7.0), Vec3::new(-1.9, 1.9, -0.8), Quat::IDENTITY),
        (Outline::Rectangle { width: 1.6, height: 0.6 }, Vec3::new(15.0, 16.0, 17.5), Vec3::new(0.0, 2.3, 0.8), down),
        (
            Outline::Disk { radius: 0.45 },
            Vec3::new(5.0, 10.0, 18.0),
            Vec3::new(2.3, 1.8, -0.9),
            Quat::from_rotation_y(0.7) * Quat::from_rotation_x(-0.7),
        ),
    ];
    for (outline, radiance, position, turn) in lights {
        let light = AreaLight { outline, radiance, double_sided: false };
        let placed = scene.add_area_light(&light, Mat4::from_rotation_translation(turn, position));
        debug_assert!(placed.is_ok(), "sizes and radiances above are sound");
    }
    scene
}
