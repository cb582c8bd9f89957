//! Candidates of every kind, from every kind of light, have the path tracer's expectation: `ris` by two one-sided tests as
//! in truth.rs, on a scene of metal and clay under a sphere, a rectangle, a disk, triangles, a point light, a sun and a map.
//! The same tests catch planted faults.

mod support;

use glam::{Mat4, Vec3};
use restir::lab::truth::equivalence::{Comparison, Estimate, Margins};
use restir::scene::{Environment, Instance, Material, PunctualKind, PunctualLight, Sun, shapes};
use restir::{FlatScene, Gpu, Renderer};
use std::sync::OnceLock;
use support::*;

const SIZE: u32 = 64;
const TILE: u32 = 32;
const MARGINS: Margins = Margins { picture: 0.003, tile: 0.01 };
const RUNS: u32 = 16;
const FRAMES: u32 = 24;
/// Nothing is asked of pixels that a light's edge goes through.
const DIRECT: &[(&str, &str)] = &[("render.max_depth", "1"), ("render.pixel_filter", "center")];

fn scene() -> &'static FlatScene {
    static SCENE: OnceLock<FlatScene> = OnceLock::new();
    SCENE.get_or_init(|| {
        let mut scene = restir::scene::builtin::make("area-lights").expect("a built-in scene");
        let glow = scene.materials.len() as u32;
        scene.materials.push(Material { emissive: Vec3::splat(6.0), ..Material::default() });
        let lamp = shapes::cuboid(Vec3::new(0.9, 0.0, 1.2), Vec3::new(1.2, 0.4, 1.5), glow);
        scene.instances.push(Instance { mesh: scene.meshes.len() as u32, transform: Mat4::IDENTITY });
        scene.meshes.push(lamp);
        scene.lights.push(PunctualLight {
            kind: PunctualKind::Point,
            position: Vec3::new(-0.6, 1.4, 1.5),
            direction: Vec3::NEG_Y,
            intensity: Vec3::splat(2.0),
            range: f32::INFINITY,
        });
        // A map that is not even, so that its texels differ in density.
        let pixels = (0..16 * 8).map(|i| [0.1 + 0.3 * (i % 5) as f32; 3]).collect();
        scene.environment = Some(Environment { width: 16, height: 8, pixels });
        scene.sun =
            Some(Sun { direction: Vec3::new(0.4, 0.8, 0.5), irradiance: Vec3::splat(1.5), angular_radius: 0.05 });
        flatten(&scene)
    })
}

fn reference() -> &'static Estimate {
    static REFERENCE: OnceLock<Estimate> = OnceLock::new();
    REFERENCE.get_or_init(|| {
        let mut renderer = renderer(&gpu(), scene().clone(), [SIZE; 2], "path-tracer", DIRECT);
        Estimate::radiance(&mut renderer, 16, proof().effort(200), TILE).unwrap()
    })
}

fn ris(gpu: &Gpu, settings: &[(&str, &str)]) -> Renderer {
    let base = [("candidates", "8"), ("samples", "2")];
    renderer(gpu, scene().clone(), [SIZE; 2], "ris", &[&base[..], DIRECT, settings].concat())
}

fn compare(what: &str, renderer: &mut Renderer, (runs, frames): (u32, u32), margins: Margins) -> Comparison {
    let comparison = Comparison::new(&Estimate::radiance(renderer, runs, frames, TILE).unwrap(), reference(), margins);
    println!("{what}: {comparison}");
    comparison
}

#[test]
fn every_choice_of_candidates_equals_the_path_tracer() {
    for settings in cases(&[
        &[("bsdf_samples", "3"), ("candidates", "2"), ("stratified", "yes")][..],
        &[("bsdf_samples", "1")],
        &[("light_choice", "cdf"), ("bsdf_samples", "1")],
        &[("light_choice", "uniform"), ("bsdf_samples", "1")],
    ]) {
        let comparison = compare(
            &format!("{settings:?}"),
            &mut ris(&gpu(), settings),
            (RUNS, proof().effort(FRAMES)),
            proof().margins(MARGINS),
        );
        assert!(comparison.is_equivalent(), "{settings:?} is not equivalent");
    }
}

#[test]
fn planted_faults_of_candidates_are_caught() {
    // Each: what, with which light choice, what stands in a shader, what is put in its place.
    for (what, choice, old, new) in cases(&[
        ("rays weighed as if only lights were sampled", "alias", "density += f32(bsdf_samples) *", "density += 0.0 *"),
        (
            "a ray's density not taken to the light's measure",
            "alias",
            "return pdf / light.solid_angle_jacobian;",
            "return pdf;",
        ),
        ("a light's part of the distribution taken for another's", "cdf", "return first;", "return first / 2u;"),
        ("lights drawn alike with the density of power", "uniform", "return 1.0 / f32(frame.light_count);", ""),
    ]) {
        let gpu = fresh_gpu();
        gpu.plant(old, new).unwrap();
        let mut renderer = ris(&gpu, &[("bsdf_samples", "1"), ("light_choice", choice)]);
        let comparison = compare(what, &mut renderer, (RUNS / 4, FRAMES), MARGINS);
        assert!(comparison.is_caught(), "'{what}' went unnoticed");
    }
}
