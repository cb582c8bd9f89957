//! The Cornell box, a metre a side, and the same with revolving point lights.

use super::{matte, place};
use crate::scene::rig::{Attachment, Node, Spin};
use crate::scene::{Camera, Material, Mesh, PunctualKind, PunctualLight, Scene, shapes};
use glam::{Mat4, Vec3};
use std::f32::consts::TAU;

const WHITE: Vec3 = Vec3::new(0.725, 0.71, 0.68);
const RED: Vec3 = Vec3::new(0.63, 0.065, 0.05);
const GREEN: Vec3 = Vec3::new(0.14, 0.45, 0.091);
const LIGHT: Vec3 = Vec3::new(46.0, 38.0, 28.0);
/// The ceiling light along x and z.
const LIGHT_SIZE: [f32; 2] = [0.24, 0.2];

/// Floor at y = 0, centre of the floor at the origin, open towards +Z.
pub(super) fn cornell() -> Scene {
    let [white, red, green, light] = [0, 1, 2, 3];
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
    let corner = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let [width, depth] = LIGHT_SIZE;
    let mut scene = Scene {
        name: "cornell".into(),
        materials: vec![
            matte("white", WHITE),
            matte("red", RED),
            matte("green", GREEN),
            Material { emissive: LIGHT, ..matte("light", WHITE) },
        ],
        cameras: vec![Camera::look_at("front", corner(0.0, 0.5, 1.88), corner(0.0, 0.5, 0.0), 40f32.to_radians())],
        ..Scene::default()
    };
    let walls = [
        shapes::parallelogram(corner(-0.5, 0.0, 0.5), x, -z, white), // floor
        shapes::parallelogram(corner(-0.5, 1.0, -0.5), x, z, white), // ceiling
        shapes::parallelogram(corner(-0.5, 0.0, -0.5), x, y, white), // back
        shapes::parallelogram(corner(-0.5, 0.0, 0.5), -z, y, red),   // left
        shapes::parallelogram(corner(0.5, 0.0, -0.5), z, y, green),  // right
        shapes::parallelogram(corner(-0.5 * width, 0.998, -0.5 * depth), x * width, z * depth, light),
    ];
    for wall in walls {
        place(&mut scene, wall, Mat4::IDENTITY);
    }
    for (size, at) in blocks() {
        place(&mut scene, Mesh { material: white, ..unit_block() }, at * size);
    }
    scene
}

/// (size, placement) of the tall and the short block.
pub(super) fn blocks() -> [(Mat4, Mat4); 2] {
    let block = |size: Vec3, x: f32, z: f32, turn: f32| {
        (Mat4::from_scale(size), Mat4::from_translation(Vec3::new(x, 0.0, z)) * Mat4::from_rotation_y(turn))
    };
    [
        block(Vec3::new(0.3, 0.6, 0.3), -0.167, -0.15, 17f32.to_radians()),
        block(Vec3::new(0.3, 0.3, 0.3), 0.186, 0.17, -18f32.to_radians()),
    ]
}

/// A metre a side, standing on the origin.
fn unit_block() -> Mesh {
    shapes::cuboid(Vec3::new(-0.5, 0.0, -0.5), Vec3::new(0.5, 1.0, 0.5), 0)
}

/// One circle of point lights: height and radius in metres, radians a second.
pub(super) struct Ring {
    pub height: f32,
    pub radius: f32,
    speed: f32,
}

/// Clear of the blocks and the walls.
pub(super) const RINGS: [Ring; 4] = [
    Ring { height: 0.12, radius: 0.475, speed: 0.6 },
    Ring { height: 0.5, radius: 0.475, speed: -0.45 },
    Ring { height: 0.68, radius: 0.38, speed: 0.8 },
    Ring { height: 0.84, radius: 0.25, speed: -1.0 },
];
const LIGHTS_PER_RING: usize = 16;

/// [`cornell`] and 64 coloured point lights that revolve round the vertical axis (report `003`, section 3.3). Together
/// they give as much light as the area light.
pub(super) fn cornell_64() -> Scene {
    let mut scene = Scene { name: "cornell-64".into(), ..cornell() };
    // A Lambertian emitter gives pi L A, a point light 4 pi I.
    let area_flux = LIGHT * (LIGHT_SIZE[0] * LIGHT_SIZE[1] * std::f32::consts::PI);
    let count = RINGS.len() * LIGHTS_PER_RING;
    let intensity = area_flux.element_sum() / 3.0 / (4.0 * std::f32::consts::PI) / count as f32;
    for (r, ring) in RINGS.iter().enumerate() {
        let hub = scene.rig.add_node(Node::default());
        scene.rig.spins.push(Spin { axis: Vec3::Y, angular_speed: ring.speed, node: hub });
        for i in 0..LIGHTS_PER_RING {
            let turn = (i as f32 + 0.25 * r as f32) / LIGHTS_PER_RING as f32;
            let (sin, cos) = (turn * TAU).sin_cos();
            let position = Vec3::new(ring.radius * sin, ring.height, ring.radius * cos);
            let node = scene.rig.add_node(Node { parent: hub, translation: position, ..Node::default() });
            scene.rig.lights.push(Attachment { target: scene.lights.len() as u32, node });
            scene.lights.push(PunctualLight {
                kind: PunctualKind::Point,
                position,
                direction: Vec3::NEG_Z,
                intensity: super::hue(5.0 * turn + 0.25 * r as f32) * (2.0 * intensity),
                range: f32::INFINITY,
            });
        }
    }
    scene
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn revolving_lights_never_meet_a_block() {
        for ring in &RINGS {
            for step in 0..3600 {
                let (sin, cos) = (step as f32 / 3600.0 * TAU).sin_cos();
                let p = Vec3::new(ring.radius * sin, ring.height, ring.radius * cos);
                assert!(p.x.abs() < 0.49 && p.z.abs() < 0.49);
                for (size, at) in blocks() {
                    let local = (at * size).inverse().transform_point3(p);
                    let inside = local.x.abs() < 0.51 && local.z.abs() < 0.51 && (0.0..1.01).contains(&local.y);
                    assert!(!inside, "{p}");
                }
            }
        }
    }
}
