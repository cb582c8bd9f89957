//! Glossy plates under spherical lights of equal power (after Veach 1997, figure 9.2): large lights in rough plates are
//! found by sampling lights, small ones in smooth plates by sampling the BRDF.

use super::{hue, matte, place};
use crate::scene::{Camera, Material, Scene, shapes};
use glam::{Mat4, Vec3, Vec4};

const EYE: Vec3 = Vec3::new(0.0, 2.0, 15.0);
/// Radii of the lights, from the left; they hang in a row through the origin.
const RADII: [f32; 4] = [0.033, 0.1, 0.3, 0.9];
const SPACING: f32 = 2.5;
/// Radiance times squared radius, the same for all: equal power.
const RADIANCE_TIMES_SQUARED_RADIUS: f32 = 3.0;
/// (centre of the plate (y, z), roughness), from the back.
const PLATES: [(f32, f32, f32); 4] = [(-2.4, -0.13, 0.05), (-3.06, 0.92, 0.11), (-3.58, 2.22, 0.23), (-3.9, 3.57, 0.5)];
const PLATE_SIZE: Vec3 = Vec3::new(8.0, 0.1, 1.05);

pub(super) fn veach_mis() -> Scene {
    let grey = 0;
    let mut scene = Scene {
        name: "veach-mis".into(),
        materials: vec![matte("grey", Vec3::splat(0.45))],
        cameras: vec![Camera::look_at("front", EYE, Vec3::new(0.0, -2.2, 2.0), 31f32.to_radians())],
        ..Scene::default()
    };
    let (floor, back) = (-4.6, -3.5);
    let corner = Vec3::new(-20.0, floor, back);
    place(&mut scene, shapes::parallelogram(corner, Vec3::Z * 40.0, Vec3::X * 40.0, grey), Mat4::IDENTITY);
    place(&mut scene, shapes::parallelogram(corner, Vec3::X * 40.0, Vec3::Y * 20.0, grey), Mat4::IDENTITY);
    for (i, radius) in RADII.into_iter().enumerate() {
        let x = (i as f32 - 0.5 * (RADII.len() - 1) as f32) * SPACING;
        let tint = Vec3::ONE.lerp(2.0 * hue(i as f32 / RADII.len() as f32), 0.4);
        let emissive = tint * (RADIANCE_TIMES_SQUARED_RADIUS / (radius * radius));
        let material = add(&mut scene, Material { emissive, ..matte("light", Vec3::ZERO) });
        place(&mut scene, shapes::sphere(Vec3::X * x, radius, 16, material), Mat4::IDENTITY);
    }
    for (y, z, roughness) in PLATES {
        let steel = Material {
            name: format!("steel, roughness {roughness}"),
            base_color: Vec4::new(0.56, 0.57, 0.58, 1.0),
            metallic: 1.0,
            roughness,
            ..Material::default()
        };
        let material = add(&mut scene, steel);
        let center = Vec3::new(0.0, y, z);
        // Tilted to mirror the row of lights into the eye.
        let normal = (EYE - center).normalize() - center.normalize();
        let tilt = Mat4::from_translation(center) * Mat4::from_rotation_x(normal.z.atan2(normal.y));
        place(&mut scene, shapes::cuboid(-0.5 * PLATE_SIZE, 0.5 * PLATE_SIZE, material), tilt);
    }
    scene
}

fn add(scene: &mut Scene, material: Material) -> u32 {
    scene.materials.push(material);
    scene.materials.len() as u32 - 1
}
