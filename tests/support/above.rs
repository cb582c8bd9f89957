//! A scene of nothing yet, seen straight from above: a square metre about the origin is in view, and what gives light can stand
//! beside it.

use glam::{Mat4, Vec3};
use restir::scene::{Camera, Instance, Material, Mesh, Scene, shapes};

/// The first material of the scene, a matt one.
pub const WHITE: u32 = 0;

/// The scene, with a clip of animation to add to.
pub fn scene() -> Scene {
    let white =
        Material { base_color: Vec3::splat(0.7).extend(1.0), metallic: 0.0, roughness: 1.0, ..Material::default() };
    let mut camera = Camera::look_at("above", Vec3::new(0.0, 3.0, 0.0), Vec3::X, 2.0 * (0.5f32 / 3.0).atan());
    (camera.forward, camera.up) = (Vec3::NEG_Y, Vec3::NEG_Z);
    let mut scene = Scene { materials: vec![white], cameras: vec![camera], ..Scene::default() };
    scene.rig.add_clip("motion");
    scene
}

/// Puts a mesh where its vertices are; its instance.
pub fn place(scene: &mut Scene, mesh: Mesh) -> u32 {
    let instance = scene.instances.len() as u32;
    scene.instances.push(Instance { mesh: scene.meshes.len() as u32, transform: Mat4::IDENTITY });
    scene.meshes.push(mesh);
    instance
}

/// A white square about the origin that faces the camera.
pub fn floor(half: f32) -> Mesh {
    shapes::parallelogram(Vec3::new(-half, 0.0, -half), 2.0 * half * Vec3::Z, 2.0 * half * Vec3::X, WHITE)
}
