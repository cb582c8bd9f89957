//! Every lobe of the material model on spheres: a row a lobe, its parameter growing from left to right, on a checkered
//! floor under three panels and a dim sky.

use super::{checkers, matte, place};
use crate::scene::{
    Anisotropy, Camera, Clearcoat, Environment, Iridescence, Material, Scene, Sheen, Specular, Transmission, Volume,
    shapes,
};
use glam::{Mat4, Vec3, Vec4};

const COLUMNS: usize = 7;
const RADIUS: f32 = 0.5;
const SPACING: f32 = 1.22;
const PANEL: f32 = 1.8;
const PANEL_RADIANCE: f32 = 14.0;

pub(super) fn materials() -> Scene {
    let [dark, bright, wall, panel] = [0, 1, 2, 3];
    let mut scene = Scene {
        name: "materials".into(),
        materials: vec![
            Material { roughness: 0.6, ..matte("dark", Vec3::splat(0.1)) },
            Material { roughness: 0.6, ..matte("bright", Vec3::splat(0.65)) },
            matte("wall", Vec3::new(0.45, 0.5, 0.55)),
            Material { emissive: Vec3::new(1.0, 0.95, 0.88) * PANEL_RADIANCE, ..matte("panel", Vec3::splat(0.5)) },
        ],
        environment: Some(Environment::even(Vec3::new(0.25, 0.28, 0.33))),
        cameras: vec![Camera::look_at(
            "front",
            Vec3::new(0.0, 9.4, 11.2),
            Vec3::new(0.0, 0.0, 0.25),
            35f32.to_radians(),
        )],
        ..Scene::default()
    };
    for (parity, material) in [(0, dark), (1, bright)] {
        place(&mut scene, checkers(parity, material), Mat4::IDENTITY);
    }
    let back = shapes::parallelogram(Vec3::new(-10.0, 0.0, -6.0), Vec3::X * 20.0, Vec3::Y * 8.0, wall);
    place(&mut scene, back, Mat4::IDENTITY);
    for x in [-3.6, 0.0, 3.6] {
        let corner = Vec3::new(x - 0.5 * PANEL, 6.5, 0.5 - 0.5 * PANEL);
        place(&mut scene, shapes::parallelogram(corner, Vec3::X * PANEL, Vec3::Z * PANEL, panel), Mat4::IDENTITY);
    }
    for (row, make) in ROWS.iter().enumerate() {
        for column in 0..COLUMNS {
            let t = column as f32 / (COLUMNS - 1) as f32;
            let x = (column as f32 - 0.5 * (COLUMNS - 1) as f32) * SPACING;
            let z = (row as f32 - 0.5 * (ROWS.len() - 1) as f32) * SPACING;
            let material = scene.materials.len() as u32;
            scene.materials.push(make(t));
            let mut mesh = shapes::sphere(Vec3::new(x, RADIUS, z), RADIUS, 32, material);
            // Tangents round the vertical axis, for the anisotropic ones.
            mesh.tangents = mesh
                .normals
                .iter()
                .map(|n| Vec3::Y.cross(*n).try_normalize().unwrap_or(Vec3::X).extend(1.0))
                .collect::<Vec<Vec4>>();
            place(&mut scene, mesh, Mat4::IDENTITY);
        }
    }
    scene
}

type Row = fn(f32) -> Material;

/// From the back of the picture to the front.
const ROWS: [Row; 7] = [
    // Metal, its highlight stretched more and more.
    |t| Material {
        metallic: 1.0,
        roughness: 0.25,
        anisotropy: Anisotropy { strength: t, ..Anisotropy::default() },
        ..matte("anisotropy", Vec3::new(0.95, 0.75, 0.45))
    },
    // A film that grows over a dark dielectric, then over metal.
    |t| Material {
        metallic: if t > 0.6 { 1.0 } else { 0.0 },
        roughness: 0.1,
        iridescence: Iridescence {
            factor: 1.0,
            ior: 1.6,
            thickness_maximum: 150.0 + 600.0 * t,
            ..Iridescence::default()
        },
        ..matte("iridescence", if t > 0.6 { Vec3::splat(0.9) } else { Vec3::splat(0.05) })
    },
    // Cloth.
    |t| Material {
        sheen: Sheen { color: Vec3::new(0.9, 0.8, 1.0), roughness: 0.15 + 0.85 * t, ..Sheen::default() },
        ..matte("sheen", Vec3::new(0.25, 0.06, 0.12))
    },
    // Varnish over a rough base.
    |t| Material {
        roughness: 0.6,
        metallic: 0.3,
        clearcoat: Clearcoat { factor: 1.0, roughness: 0.5 * t, ..Clearcoat::default() },
        ..matte("clearcoat", Vec3::new(0.6, 0.08, 0.05))
    },
    // Thin walls, from clear to frosted, tinted by the base colour.
    |t| Material {
        roughness: 0.5 * t,
        transmission: Transmission { factor: 1.0, texture: None },
        double_sided: true,
        ..matte("thin wall", Vec3::new(0.75, 0.92, 1.0))
    },
    // Glass, from clear to frosted, coloured by absorption.
    |t| Material {
        roughness: 0.5 * t,
        transmission: Transmission { factor: 1.0, texture: None },
        volume: Some(Volume { attenuation_distance: 0.8, attenuation_color: Vec3::new(0.35, 0.85, 0.6) }),
        ..matte("glass", Vec3::ONE)
    },
    // Dielectrics of growing index of refraction; the last refracts as diamond does, with its colours.
    |t| Material {
        roughness: 0.0,
        ior: 1.05 + 1.37 * t,
        dispersion: if t == 1.0 { 0.36 } else { 0.0 },
        specular: Specular::default(),
        transmission: Transmission { factor: 1.0, texture: None },
        volume: Some(Volume { attenuation_distance: f32::INFINITY, attenuation_color: Vec3::ONE }),
        ..matte("index of refraction", Vec3::ONE)
    },
];
