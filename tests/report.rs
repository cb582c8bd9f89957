//! `restir-report`: the corrected form has the path tracer's expectation in all five configurations, and each of the report's
//! faults is caught as a bias by the same test (support/equivalence.rs; docs/testing.md). What this prints stands on the
//! technique's page.

mod support;

use glam::Vec3;
use restir::scene::{Camera, Environment, Scene, builtin, sky::Sky};
use restir::{FlatScene, Image, Renderer, techniques};
use std::sync::OnceLock;
use support::equivalence::{Comparison, Estimate, Margins};
use support::*;

const SIZE: u32 = 64;
const TILE: u32 = 32;
const MARGINS: Margins = Margins { picture: 0.002, tile: 0.01 };
const DIRECT: &[(&str, &str)] = &[("render.max_depth", "1")];

/// The report's scene from inside, without the area light in view, so that the mean is all scattered light.
fn scene() -> Scene {
    let mut scene = builtin::make("cornell-64").expect("a built-in scene");
    scene.cameras = vec![from_inside(0.0)];
    scene
}

/// The camera of [`scene`], so many metres to the side.
fn from_inside(aside: f32) -> Camera {
    let aside = Vec3::new(aside, 0.0, 0.5 * aside);
    let (eye, target) = (Vec3::new(-0.35, 0.85, 0.45), Vec3::new(0.12, 0.05, -0.1));
    Camera::look_at("test", eye + aside, target + aside, 60f32.to_radians())
}

fn report(scene: FlatScene, settings: &[(&str, &str)]) -> Renderer {
    // A short memory, so that frames of a run are less correlated.
    let base = [("indirect", "no"), ("history_cap", "4")];
    let mut renderer = renderer(&gpu(), scene, [SIZE; 2], "restir-report", &[&base, DIRECT, settings].concat());
    renderer.set_accumulate(true);
    renderer
}

fn path_tracer(scene: FlatScene) -> Renderer {
    let mut renderer = renderer(&gpu(), scene, [SIZE; 2], "path-tracer", DIRECT);
    renderer.set_accumulate(true);
    renderer
}

const RUNS: u32 = 64;
const FRAMES: u32 = 16;

fn reference() -> &'static Estimate {
    static REFERENCE: OnceLock<Estimate> = OnceLock::new();
    REFERENCE.get_or_init(|| {
        let reference = Estimate::radiance(&mut path_tracer(flatten(&scene())), 16, 256, TILE);
        let (mean, error) = reference.0[0];
        println!("reference: mean {mean:.5} ± {:.3} %", 100.0 * error / mean);
        reference
    })
}

fn compare(what: &str, settings: &[(&str, &str)], runs: u32) -> Comparison {
    let mut renderer = report(flatten(&scene()), settings);
    let comparison = Comparison::new(&Estimate::radiance(&mut renderer, runs, FRAMES, TILE), reference(), MARGINS);
    println!("{what}: {comparison}");
    comparison
}

#[test]
fn configurations_equal_the_path_tracer() {
    for (configuration, runs) in
        [("a-naive", 4 * RUNS), ("b-ris", RUNS), ("c-temporal", RUNS), ("d-spatial", RUNS), ("e-both", RUNS)]
    {
        let comparison = compare(configuration, &[("configuration", configuration)], runs);
        assert!(comparison.is_equivalent(), "{configuration} is not equivalent");
    }
}

#[test]
fn faults_are_caught() {
    for (fault, configuration) in [
        ("fault_sample_count", "c-temporal"),
        ("fault_sample_count", "d-spatial"),
        ("fault_target_not_reevaluated", "d-spatial"),
        ("fault_target_not_reevaluated", "e-both"),
        ("fault_count_weights", "d-spatial"),
        ("fault_count_weights", "e-both"),
        ("fault_unguarded_pdf", "b-ris"),
        ("fault_unguarded_pdf", "e-both"),
    ] {
        let settings = [("configuration", configuration), (fault, "yes")];
        let comparison = compare(&format!("{fault}, {configuration}"), &settings, RUNS / 4);
        assert!(comparison.is_caught(), "{fault} went unnoticed with {configuration}");
    }
}
