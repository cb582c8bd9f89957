//! A scene whose instances share a bottom level looks like its twin in which every copy is merged in world space, and a
//! scene that was moved like one that was built there.

mod support;

use glam::{Mat4, Quat, Vec3};
use restir::scene::random::Random;
use restir::scene::{Camera, Environment, Instance, Material, PunctualKind, PunctualLight, Scene, shapes};
use restir::{Image, Renderer};
use support::*;

const SIZE: [u32; 2] = [64, 48];

/// 60 balls of 5000 triangles, stretched, turned and mirrored, half of them glowing, over a floor. `copies` gives each
/// ball a mesh of its own, which is then merged.
fn balls(copies: bool, glow: f32) -> Scene {
    let mut random = Random::new(5);
    let mut scene = Scene {
        materials: vec![
            Material { metallic: 0.0, roughness: 0.4, ..Material::default() },
            Material { emissive: Vec3::splat(glow), metallic: 0.0, ..Material::default() },
        ],
        meshes: vec![shapes::parallelogram(Vec3::new(-30.0, -3.0, 30.0), Vec3::X * 60.0, Vec3::Z * -60.0, 0)],
        instances: vec![Instance { mesh: 0, transform: Mat4::IDENTITY }],
        environment: Some(Environment::even(Vec3::new(0.3, 0.4, 0.5))),
        lights: vec![PunctualLight {
            kind: PunctualKind::Point,
            position: Vec3::new(1.0, 9.0, 2.0),
            direction: Vec3::NEG_Y,
            intensity: Vec3::splat(60.0),
            range: f32::INFINITY,
        }],
        cameras: vec![Camera::look_at("test", Vec3::new(2.0, 4.0, 16.0), Vec3::ZERO, 0.9)],
        ..Scene::default()
    };
    for material in 0..2 {
        let ball = shapes::sphere(Vec3::ZERO, 1.0, 50, material);
        scene.meshes.push(ball.clone());
        for i in 0..60u32 {
            let mirror = if i.is_multiple_of(3) { -1.0 } else { 1.0 };
            let size = Vec3::new(mirror * random.range(0.3, 1.2), random.range(0.3, 1.2), random.range(0.3, 1.2));
            let turn = Quat::from_axis_angle(random.direction(), random.range(0.0, 6.0));
            let place = random.in_box(Vec3::new(-9.0, -2.0, -9.0), Vec3::new(9.0, 6.0, 9.0));
            if copies {
                scene.meshes.push(ball.clone());
            }
            let mesh = scene.meshes.len() as u32 - 1;
            let transform = Mat4::from_scale_rotation_translation(size, turn, place);
            scene.instances.push(Instance { mesh, transform });
        }
    }
    scene
}

fn renderer_of(scene: &Scene, technique: &str) -> Renderer {
    renderer(&gpu(), flatten(scene), SIZE, technique, &[("render.max_depth", "2"), ("render.pixel_filter", "center")])
}

/// The share of pixels that differ by more than a hundredth, and the relative difference of means.
fn difference(a: &Image, b: &Image) -> (f64, f64) {
    let differs = |(a, b): &(&[f32; 3], &[f32; 3])| a.iter().zip(b.iter()).any(|(a, b)| (a - b).abs() > 0.01);
    let count = a.pixels.iter().zip(&b.pixels).filter(differs).count();
    (count as f64 / a.pixels.len() as f64, mean(a) / mean(b) - 1.0)
}

#[test]
fn shared_and_merged_look_alike() {
    let [shared, merged] = [false, true].map(|copies| balls(copies, 0.0));
    let flat = flatten(&shared);
    assert_eq!((flat.meshes.len(), flatten(&merged).meshes.len()), (3, 1));
    // The same light table, so the same random numbers: only rounding differs, and that at edges and shadow borders.
    for (technique, frames, allowed) in [("normals", 1, 0.01), ("path-tracer", 4, 0.05), ("restir-di", 2, 0.05)] {
        let pictures = [&shared, &merged].map(|scene| render(&mut renderer_of(scene, technique), frames));
        let (share, relative) = difference(&pictures[0], &pictures[1]);
        println!("{technique}: {share:.4} of the pixels differ, means by {relative:.5}");
        assert!(share < allowed && relative.abs() < 0.01, "{technique}: {share} {relative}");
    }
}

/// With lamps among the balls, whose order in the table differs: equal means within four standard errors.
#[test]
fn shared_lamps_shine_as_merged_ones() {
    let estimate = |copies: bool| {
        let mut renderer = renderer_of(&balls(copies, 3.0), "path-tracer");
        let means: Vec<f64> = (0..12)
            .map(|seed| {
                renderer.set_seed(seed);
                mean(&render(&mut renderer, 4))
            })
            .collect();
        let n = means.len() as f64;
        let average = means.iter().sum::<f64>() / n;
        let variance = means.iter().map(|m| (m - average).powi(2)).sum::<f64>() / (n * (n - 1.0));
        (average, variance)
    };
    let ((shared, v0), (merged, v1)) = (estimate(false), estimate(true));
    let error = (v0 + v1).sqrt();
    println!("shared {shared:.5}, merged {merged:.5}, standard error {error:.5}");
    assert!(error < 0.01 * merged, "too noisy to tell: {error}");
    assert!((shared - merged).abs() < 4.0 * error, "{shared} {merged} {error}");
}
