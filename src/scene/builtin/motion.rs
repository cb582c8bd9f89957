//! Everything that can move, in four seconds: a column that bends by its skin, a ball that morphs, a box and a lamp that
//! move as a whole, a point light and a camera.

use super::{matte, place};
use crate::scene::rig::deform::Displacement;
use crate::scene::rig::{
    Attachment, CUBIC_SPLINE, Joint, LINEAR, Node, Placement, ROTATION, Skin, TRANSLATION, WEIGHTS,
};
use crate::scene::{Camera, Influence, Material, Mesh, PunctualKind, PunctualLight, Scene, shapes};
use glam::{Mat4, Quat, Vec2, Vec3, Vec4};
use std::f32::consts::TAU;

/// Length of the loop in seconds.
const DURATION: f32 = 4.0;
/// Keyframes of what swings; lines between them are close enough to a sine.
const KEYS: usize = 16;

const WHITE: u32 = 0;
const RED: u32 = 1;
const GREEN: u32 = 2;
const BLUE: u32 = 3;
const PANEL: u32 = 4;
const LAMP: u32 = 5;

/// Floor at y = 0, the back wall at z = -1.5, open towards +Z; the first camera stands still, the second moves.
pub(super) fn motion() -> Scene {
    let mut scene = Scene {
        name: "motion".into(),
        materials: vec![
            matte("white", Vec3::splat(0.7)),
            matte("red", Vec3::new(0.65, 0.12, 0.08)),
            matte("green", Vec3::new(0.15, 0.5, 0.12)),
            Material { roughness: 0.4, ..matte("blue", Vec3::new(0.1, 0.2, 0.6)) },
            Material { emissive: Vec3::splat(6.0), ..matte("panel", Vec3::ONE) },
            Material { emissive: Vec3::new(30.0, 18.0, 8.0), ..matte("lamp", Vec3::ONE) },
        ],
        ..Scene::default()
    };
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
    place(&mut scene, shapes::parallelogram(Vec3::new(-3.0, 0.0, 2.0), 6.0 * x, -3.5 * z, WHITE), Mat4::IDENTITY);
    place(&mut scene, shapes::parallelogram(Vec3::new(-3.0, 0.0, -1.5), 6.0 * x, 3.0 * y, WHITE), Mat4::IDENTITY);
    place(&mut scene, shapes::parallelogram(Vec3::new(-0.5, 2.8, -0.5), x, z, PANEL), Mat4::IDENTITY);
    scene.rig.add_clip("everything");
    column(&mut scene);
    ball(&mut scene);
    rigid(&mut scene);
    lights_and_cameras(&mut scene);
    scene
}

/// Times from 0 to the end, with phases in turns.
fn beats() -> impl Iterator<Item = (f32, f32)> {
    (0..=KEYS).map(|i| (i as f32 / KEYS as f32 * DURATION, i as f32 / KEYS as f32))
}

fn times() -> Vec<f32> {
    beats().map(|(time, _)| time).collect()
}

/// Hangs the scene's last instance on a node.
fn hang(scene: &mut Scene, node: u32, skin: u32, weight_count: u32) {
    let first_weight = scene.rig.weights.len() as u32;
    scene.rig.weights.resize((first_weight + weight_count) as usize, 0.0);
    let instance = scene.instances.len() as u32 - 1;
    let offset = Mat4::IDENTITY;
    scene.rig.instances.push(Placement { offset, instance, node, skin, first_weight, weight_count, padding: [0; 3] });
}

/// A column of three joints that bends to and fro.
fn column(scene: &mut Scene) {
    const JOINTS: u16 = 3;
    const BONE: f32 = 0.5;
    const RINGS: u32 = 24;
    const SEGMENTS: u32 = 24;
    scene.rig.skins.push(Skin { first_joint: scene.rig.joints.len() as u32, joint_count: JOINTS.into() });
    let root = Vec3::new(-1.1, 0.0, -0.4);
    let mut parent = scene.rig.add_node(Node { translation: root, ..Node::default() });
    for j in 0..JOINTS {
        let height = if j == 0 { 0.0 } else { BONE };
        let node = scene.rig.add_node(Node { parent, translation: Vec3::Y * height, ..Node::default() });
        let inverse_bind = Mat4::from_translation(Vec3::NEG_Y * f32::from(j) * BONE);
        scene.rig.joints.push(Joint { inverse_bind, node, padding: [0; 3] });
        if j > 0 {
            let bend = |phase: f32| Quat::from_rotation_z(0.7 * (phase * TAU).sin());
            let values: Vec<f32> = beats().flat_map(|(_, phase)| bend(phase).to_array()).collect();
            scene.rig.add_channel(node, ROTATION, LINEAR, &times(), &values);
        }
        parent = node;
    }
    let height = BONE * f32::from(JOINTS);
    let mut mesh = Mesh { material: RED, ..Mesh::default() };
    for ring in 0..=RINGS {
        let y = ring as f32 / RINGS as f32 * height;
        for segment in 0..=SEGMENTS {
            let u = segment as f32 / SEGMENTS as f32;
            let (sin, cos) = (u * TAU).sin_cos();
            let normal = Vec3::new(sin, 0.0, cos);
            mesh.positions.push(normal * 0.16 + Vec3::Y * y);
            mesh.normals.push(normal);
            mesh.uvs[0].push(Vec2::new(u, y / height));
            // Half a bone up a joint has taken over from the one below.
            let along = (y / BONE).clamp(0.0, f32::from(JOINTS) - 1.0);
            let low = (along.floor() as u16).min(JOINTS - 2);
            let upper = along - f32::from(low);
            mesh.deformation
                .influences
                .push(Influence { joints: [low, low + 1, 0, 0], weights: [1.0 - upper, upper, 0.0, 0.0] });
        }
    }
    for ring in 0..RINGS {
        for segment in 0..SEGMENTS {
            let a = ring * (SEGMENTS + 1) + segment;
            let (right, above) = (a + 1, a + SEGMENTS + 1);
            mesh.indices.extend([a, right, above, right, above + 1, above]);
        }
    }
    cap(&mut mesh, height, JOINTS - 1, SEGMENTS);
    place(scene, mesh, Mat4::from_translation(root));
    let skin = scene.rig.skins.len() as u32 - 1;
    hang(scene, 0, skin, 0);
}

/// Closes the top of the column.
fn cap(mesh: &mut Mesh, height: f32, joint: u16, segments: u32) {
    let base = mesh.positions.len() as u32;
    for i in 0..=segments {
        let (sin, cos) = (i as f32 / segments as f32 * TAU).sin_cos();
        let rim = if i == segments { Vec3::ZERO } else { Vec3::new(sin, 0.0, cos) * 0.16 };
        mesh.positions.push(rim + Vec3::Y * height);
        mesh.normals.push(Vec3::Y);
        mesh.uvs[0].push(Vec2::ZERO);
        mesh.deformation.influences.push(Influence { joints: [joint, 0, 0, 0], weights: [1.0, 0.0, 0.0, 0.0] });
    }
    for i in 0..segments {
        mesh.indices.extend([base + segments, base + i, base + (i + 1) % segments]);
    }
}

/// A ball with one morph target, in which it has bumps.
fn ball(scene: &mut Scene) {
    let mut mesh = shapes::sphere(Vec3::ZERO, 0.42, 24, GREEN);
    let bump = |n: Vec3| 0.14 * (5.0 * n.x).sin() * (5.0 * n.y).cos() * (5.0 * n.z).cos();
    let target = mesh.normals.iter().map(|&normal| {
        // The normal of the bumpy ball, from the slopes of its radius along two tangents.
        let tangent = normal.any_orthonormal_vector();
        let slope = |t: Vec3| (bump((normal + 1e-2 * t).normalize()) - bump((normal - 1e-2 * t).normalize())) / 2e-2;
        let radius = 0.42 + bump(normal);
        let other = normal.cross(tangent);
        let bent = (normal - (tangent * slope(tangent) + other * slope(other)) / radius).normalize();
        Displacement { position: normal * bump(normal), normal: bent - normal, tangent: Vec3::ZERO }
    });
    mesh.deformation.targets = vec![target.collect()];
    let translation = Vec3::new(0.1, 0.6, -0.5);
    let node = scene.rig.add_node(Node { translation, ..Node::default() });
    place(scene, mesh, Mat4::from_translation(translation));
    hang(scene, node, crate::scene::gpu_types::NONE, 1);
    let weights: Vec<f32> = beats().map(|(_, phase)| 0.5 - 0.5 * (phase * TAU).cos()).collect();
    scene.rig.add_channel(node, WEIGHTS, LINEAR, &times(), &weights);
}

/// A box that glides and turns, and a lamp that swings over everything.
fn rigid(scene: &mut Scene) {
    let mut glide = |mesh: Mesh, at: &dyn Fn(f32) -> Vec3, turn: &dyn Fn(f32) -> Quat| {
        let (translation, rotation) = (at(0.0), turn(0.0));
        let node = scene.rig.add_node(Node { translation, rotation, ..Node::default() });
        place(scene, mesh, Mat4::from_rotation_translation(rotation, translation));
        hang(scene, node, crate::scene::gpu_types::NONE, 0);
        let path: Vec<f32> = beats().flat_map(|(_, phase)| at(phase).to_array()).collect();
        scene.rig.add_channel(node, TRANSLATION, LINEAR, &times(), &path);
        let turns: Vec<f32> = beats().flat_map(|(_, phase)| turn(phase).to_array()).collect();
        scene.rig.add_channel(node, ROTATION, LINEAR, &times(), &turns);
    };
    glide(
        shapes::cuboid(Vec3::splat(-0.22), Vec3::splat(0.22), BLUE),
        &|phase| Vec3::new(1.2, 0.4 + 0.15 * (2.0 * phase * TAU).sin(), -0.3 + 0.5 * (phase * TAU).sin()),
        &|phase| Quat::from_rotation_y(phase * TAU),
    );
    glide(
        shapes::sphere(Vec3::ZERO, 0.07, 8, LAMP),
        &|phase| Vec3::new(1.3 * (phase * TAU).cos(), 1.75, 0.3 + 0.2 * (phase * TAU).sin()),
        &|_| Quat::IDENTITY,
    );
}

fn lights_and_cameras(scene: &mut Scene) {
    let hub = scene.rig.add_node(Node { translation: Vec3::new(0.0, 1.1, -0.2), ..Node::default() });
    let arm = Node { parent: hub, translation: Vec3::new(0.0, 0.0, 0.9), ..Node::default() };
    let arm = scene.rig.add_node(arm);
    scene.rig.lights.push(Attachment { target: 0, node: arm });
    let turn = |phase: f32| Quat::from_rotation_y(-phase * TAU);
    let turns: Vec<f32> = beats().flat_map(|(_, phase)| turn(phase).to_array()).collect();
    scene.rig.add_channel(hub, ROTATION, LINEAR, &times(), &turns);
    scene.lights.push(PunctualLight {
        kind: PunctualKind::Point,
        position: scene.rig.rest().node(arm).w_axis.truncate(),
        direction: Vec3::NEG_Z,
        intensity: Vec3::new(0.5, 0.9, 1.6),
        range: f32::INFINITY,
    });

    let still = Camera::look_at("still", Vec3::new(0.0, 1.2, 3.6), Vec3::new(0.0, 0.85, 0.0), 45f32.to_radians());
    // To the right and back again, at rest at both ends: a cubic through three keyframes.
    let sides = [-0.9f32, 0.9, -0.9].map(|x| Vec3::new(x, 1.25, 3.2));
    let facing = |eye: Vec3| {
        let camera = Camera::look_at("moving", eye, Vec3::new(0.0, 0.8, 0.0), 45f32.to_radians());
        let right = camera.forward.cross(camera.up);
        let axes = [right, camera.up, -camera.forward].map(|axis| axis.extend(0.0));
        (camera, Quat::from_mat4(&Mat4::from_cols(axes[0], axes[1], axes[2], Vec4::W)))
    };
    let (moving, rotation) = facing(sides[0]);
    let node = scene.rig.add_node(Node { translation: sides[0], rotation, ..Node::default() });
    scene.rig.cameras.push(Attachment { target: 1, node });
    let spline = |values: &[&[f32]]| -> Vec<f32> {
        values
            .iter()
            .flat_map(|value| [vec![0.0; value.len()], value.to_vec(), vec![0.0; value.len()]].concat())
            .collect()
    };
    let keys = [0.0, 0.5 * DURATION, DURATION];
    let path = sides.map(|side| side.to_array());
    scene.rig.add_channel(node, TRANSLATION, CUBIC_SPLINE, &keys, &spline(&[&path[0], &path[1], &path[2]]));
    let turns = sides.map(|side| facing(side).1.to_array());
    scene.rig.add_channel(node, ROTATION, CUBIC_SPLINE, &keys, &spline(&[&turns[0], &turns[1], &turns[2]]));
    scene.cameras = vec![still, moving];
}
