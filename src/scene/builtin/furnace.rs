//! A white sphere in an even white sky: whatever it fails to reflect is missing from the picture.

use super::{matte, place};
use crate::scene::{Camera, Environment, Scene, shapes};
use glam::{Mat4, Vec3};

pub(super) fn furnace() -> Scene {
    let mut scene = Scene {
        name: "furnace".into(),
        materials: vec![matte("white", Vec3::ONE)],
        environment: Some(Environment::even(Vec3::ONE)),
        cameras: vec![Camera::look_at("front", Vec3::new(0.0, 0.0, 3.8), Vec3::ZERO, 40f32.to_radians())],
        ..Scene::default()
    };
    place(&mut scene, shapes::sphere(Vec3::ZERO, 1.0, 48, 0), Mat4::IDENTITY);
    scene
}
