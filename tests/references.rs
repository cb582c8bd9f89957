//! The path tracer agrees with another renderer: Mitsuba 3, on six built-in scenes made matte, by two one-sided tests.
//!
//! One rule differs and is put in place for the comparison: what is seen from behind its interpolated normal, at the outlines of
//! coarse meshes, is black in Mitsuba. Here it is shaded as if seen from its horizon.
//!
//! `tests/references/make.py` rendered the files in `tests/references` from what this writes:
//! `EXPORT_REFERENCES=FOLDER cargo test --test references -- --ignored`.

mod support;

use restir::Scene;
use restir::lab::truth::equivalence::{Comparison, Estimate, Margins, region_means};
use restir::output::read_exr;
use restir::scene::{Camera, Material, Projection, PunctualKind, Specular, builtin};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use support::*;

/// Each: the scene, its camera, the name of its files.
const SCENES: [(&str, usize, &str); 6] = [
    ("cornell", 0, "cornell"),
    ("cornell-64", 0, "cornell-64"),
    ("many-lights:100", 0, "many-lights"),
    ("arcade:80", 1, "arcade"),
    ("hall:10000", 0, "hall"),
    ("glossy-spheres", 0, "glossy-spheres"),
];
/// Longest path in scattering events, which Mitsuba calls a depth of one more.
const DEPTH: &str = "3";
const SIZE: u32 = 64;
const TILE: u32 = 32;
/// How far renderers that share no code may differ.
const MARGINS: Margins = Margins { picture: 0.005, tile: 0.02 };
const RUNS: u32 = 24;
const FRAMES: u32 = 96;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/references")
}

/// A built-in scene, every surface of it Lambert's, without what surrounds it: what every renderer knows. A specular strength
/// of 0 leaves nothing but the diffuse lobe.
fn matte(name: &str, camera: usize) -> Scene {
    let mut scene = builtin::make(name).expect("a built-in scene");
    for material in &mut scene.materials {
        *material = Material {
            name: material.name.clone(),
            base_color: material.base_color,
            emissive: material.emissive,
            metallic: 0.0,
            specular: Specular { strength: 0.0, ..Specular::default() },
            ..Material::default()
        };
    }
    (scene.environment, scene.sun) = (None, None);
    scene.cameras = vec![scene.cameras[camera].clone()];
    scene
}

/// The scene in world space, as `make.py` reads it.
fn description(scene: &Scene) -> Value {
    let meshes = scene.instances.iter().map(|instance| {
        let mesh = &scene.meshes[instance.mesh as usize];
        let material = &scene.materials[mesh.material as usize];
        let normal_matrix = instance.transform.inverse().transpose();
        let positions = mesh.positions.iter().map(|p| instance.transform.transform_point3(*p).to_array());
        let normals = mesh.normals.iter().map(|n| normal_matrix.transform_vector3(*n).normalize().to_array());
        json!({
            "positions": positions.collect::<Vec<_>>(), "normals": normals.collect::<Vec<_>>(),
            "indices": mesh.indices, "color": material.base_color.truncate().to_array(),
            "emission": material.emissive.to_array(),
        })
    });
    let points = scene.lights.iter().map(|light| {
        assert_eq!(light.kind, PunctualKind::Point, "make.py knows no other");
        json!({"position": light.position.to_array(), "intensity": light.intensity.to_array()})
    });
    let Camera { position, forward, up, projection, .. } = &scene.cameras[0];
    let Projection::Perspective { vertical_fov } = projection else { panic!("make.py knows no other") };
    json!({
        "meshes": meshes.collect::<Vec<_>>(), "points": points.collect::<Vec<_>>(), "size": SIZE,
        "depth": DEPTH.parse::<u32>().expect("a number"),
        "camera": {"position": position.to_array(), "forward": forward.to_array(), "up": up.to_array(),
                   "fov": vertical_fov.to_degrees()},
    })
}

/// What makes `viewed_normal` (shaders/scene/surface.wgsl) leave a normal that faces away as it is; the BSDF is 0 there.
const BLACK_FROM_BEHIND: (&str, &str) = ("if facing < 1e-3 {", "if false {");

/// The scenes in which the two disagree.
fn disagreements(scenes: &[(&str, usize, &str)]) -> Vec<String> {
    let gpu = fresh_gpu();
    gpu.plant(BLACK_FROM_BEHIND.0, BLACK_FROM_BEHIND.1).expect("its place is there");
    let mut failed = Vec::new();
    for (name, camera, file) in scenes {
        let read = |kind: &str| read_exr(&folder().join(format!("{file}{kind}.exr"))).expect("a reference");
        let means = region_means(&read(""), TILE);
        // Pixels are independent: the variance of a mean over n of them is the mean of their variances over n. Channels of
        // a pixel are not, and are taken to be fully correlated, which is on the safe side.
        let deviations = region_means(&read("-variance"), TILE);
        let pixels = |i: usize| f64::from(if i == 0 { SIZE * SIZE } else { TILE * TILE });
        let noise = deviations.iter().enumerate().map(|(i, variance)| (variance / pixels(i)).sqrt());
        let reference = Estimate(means.into_iter().zip(noise).collect());
        let settings = [("render.max_depth", DEPTH)];
        let mut renderer = renderer(&gpu, flatten(&matte(name, *camera)), [SIZE; 2], "path-tracer", &settings);
        renderer.set_accumulate(true);
        let estimate = Estimate::radiance(&mut renderer, RUNS, proof().effort(FRAMES), TILE).expect("pictures");
        let comparison = Comparison::new(&estimate, &reference, proof().margins(MARGINS));
        println!("{name}: {comparison}");
        if !comparison.is_equivalent() {
            failed.push(format!("{name}: {comparison}"));
        }
    }
    failed
}

#[test]
fn the_path_tracer_agrees_with_mitsuba() {
    let failed = disagreements(&SCENES[..1]);
    assert!(failed.is_empty(), "{failed:#?}");
}

#[test]
#[ignore = "minutes long"]
fn the_path_tracer_agrees_with_mitsuba_in_all_six() {
    if let Some(folder) = std::env::var_os("EXPORT_REFERENCES") {
        for (name, camera, file) in SCENES {
            let path = Path::new(&folder).join(format!("{file}.json"));
            std::fs::write(&path, description(&matte(name, camera)).to_string()).expect("a writable folder");
        }
        return;
    }
    let failed = disagreements(&SCENES);
    assert!(failed.is_empty(), "{failed:#?}");
}
