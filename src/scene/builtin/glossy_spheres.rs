//! Rows of spheres from smooth to rough and from plastic to metal, on a checkered floor under three panels and a dim
//! sky.

use super::{CELL, CELLS, checkers, matte, place};
use crate::scene::{Camera, Environment, Material, Scene, shapes};
use glam::{Mat4, Vec3};

const ROUGHNESS: [f32; 7] = [0.05, 0.12, 0.22, 0.35, 0.5, 0.7, 1.0];
const METALLIC: [f32; 3] = [1.0, 0.5, 0.0];
const COLOR: Vec3 = Vec3::new(0.9, 0.52, 0.22);
const RADIUS: f32 = 0.5;
const SPACING: f32 = 1.25;
const PANEL: f32 = 1.6;
const PANEL_RADIANCE: f32 = 12.0;

pub(super) fn glossy_spheres() -> Scene {
    let [dark, bright, wall, panel] = [0, 1, 2, 3];
    let mut scene = Scene {
        name: "glossy-spheres".into(),
        materials: vec![
            Material { roughness: 0.6, ..matte("dark", Vec3::splat(0.12)) },
            Material { roughness: 0.6, ..matte("bright", Vec3::splat(0.6)) },
            matte("wall", Vec3::new(0.45, 0.5, 0.55)),
            Material { emissive: Vec3::new(1.0, 0.95, 0.88) * PANEL_RADIANCE, ..matte("panel", Vec3::splat(0.5)) },
        ],
        // So that mirrors have something to show.
        environment: Some(Environment::even(Vec3::new(0.2, 0.23, 0.28))),
        cameras: vec![Camera::look_at(
            "front",
            Vec3::new(0.0, 4.6, 8.6),
            Vec3::new(0.0, 0.3, 0.0),
            33.5f32.to_radians(),
        )],
        ..Scene::default()
    };
    for (parity, material) in [(0, dark), (1, bright)] {
        place(&mut scene, checkers(parity, material), Mat4::IDENTITY);
    }
    let half = 0.5 * CELLS as f32 * CELL;
    let back = shapes::parallelogram(Vec3::new(-half, 0.0, -4.0), Vec3::X * 2.0 * half, Vec3::Y * 8.0, wall);
    place(&mut scene, back, Mat4::IDENTITY);
    for x in [-3.2, 0.0, 3.2] {
        let corner = Vec3::new(x - 0.5 * PANEL, 4.5, 0.5 - 0.5 * PANEL);
        place(&mut scene, shapes::parallelogram(corner, Vec3::X * PANEL, Vec3::Z * PANEL, panel), Mat4::IDENTITY);
    }
    for (row, metallic) in METALLIC.into_iter().enumerate() {
        for (column, roughness) in ROUGHNESS.into_iter().enumerate() {
            let x = (column as f32 - 0.5 * (ROUGHNESS.len() - 1) as f32) * SPACING;
            let z = (row as f32 - 0.5 * (METALLIC.len() - 1) as f32) * SPACING;
            let name = format!("roughness {roughness}, metallic {metallic}");
            let material = scene.materials.len() as u32;
            scene.materials.push(Material { metallic, roughness, ..matte(&name, COLOR) });
            place(&mut scene, shapes::sphere(Vec3::new(x, RADIUS, z), RADIUS, 24, material), Mat4::IDENTITY);
        }
    }
    scene
}
