//! `restir-report`, beside what it claims (lab/truth): each of the report's faults in other configurations, on polished metal, while
//! lights revolve and the camera slides; NaNs are counted. What this prints stands on the technique's page.

mod support;

use glam::Vec3;
use restir::lab::truth::equivalence::{Comparison, Estimate, Margins};
use restir::scene::builtin::make;
use restir::scene::{Camera, Scene};
use restir::{FlatScene, Renderer};
use std::sync::OnceLock;
use support::*;

const SIZE: u32 = 64;
const TILE: u32 = 32;
const MARGINS: Margins = Margins { picture: 0.002, tile: 0.01 };
const DIRECT: &[(&str, &str)] = &[("render.max_depth", "1")];

/// The report's scene from inside, without the area light in view, so that the mean is all scattered light. The circles of lights
/// are drawn together between the blocks and the ceiling: spots of light where one nearly touches a wall would be most of the
/// noise.
fn scene() -> Scene {
    let mut scene = make("cornell-64").expect("a built-in scene");
    for spin in &scene.rig.spins {
        let hub = &mut scene.rig.nodes[spin.node as usize];
        (hub.scale, hub.translation) = (Vec3::new(0.75, 0.2, 0.75), Vec3::new(0.0, 0.7, 0.0));
    }
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
        let frames = proof().effort(256);
        let reference = Estimate::radiance(&mut path_tracer(flatten(&scene())), 16, frames, TILE).unwrap();
        let (mean, error) = reference.0[0];
        println!("reference: mean {mean:.5} ± {:.3} %", 100.0 * error / mean);
        reference
    })
}

fn compare(what: &str, settings: &[(&str, &str)], runs: u32) -> Comparison {
    let estimate = Estimate::radiance(&mut report(flatten(&scene()), settings), runs, FRAMES, TILE).unwrap();
    let comparison = Comparison::new(&estimate, reference(), proof().margins(MARGINS));
    println!("{what}: {comparison}");
    comparison
}

/// Settings that switch these faults on.
fn with_faults<'a>(configuration: &'a str, faults: &[&'a str]) -> Vec<(&'a str, &'a str)> {
    let faults = faults.iter().map(|fault| (*fault, "yes"));
    std::iter::once(("configuration", configuration)).chain(faults).collect()
}

const SAMPLE_COUNT: &str = "fault_sample_count";
const TARGET: &str = "fault_target_not_reevaluated";
const COUNT_WEIGHTS: &str = "fault_count_weights";
const NO_REPROJECTION: &str = "fault_no_reprojection";
const NO_SIMILARITY: &str = "fault_no_similarity";
const UNGUARDED: &str = "fault_unguarded_pdf";

/// As lab/truth has it of `cornell-64` itself, which takes ten times as long.
#[test]
fn configurations_equal_the_path_tracer() {
    let configurations = [("e-both", 96), ("a-naive", RUNS), ("b-ris", 40), ("c-temporal", 40), ("d-spatial", 40)];
    for &(configuration, runs) in cases(&configurations) {
        let comparison = compare(configuration, &[("configuration", configuration)], proof().effort(runs));
        assert!(comparison.is_equivalent(), "{configuration} is not equivalent");
    }
}

#[test]
fn faults_are_caught() {
    for &(faults, configuration) in cases(&[
        (&[SAMPLE_COUNT][..], "c-temporal"),
        (&[SAMPLE_COUNT], "d-spatial"),
        (&[TARGET, NO_SIMILARITY], "d-spatial"),
        (&[COUNT_WEIGHTS, NO_SIMILARITY], "d-spatial"),
        (&[UNGUARDED], "e-both"),
        (&[UNGUARDED, NO_SIMILARITY], "e-both"),
    ]) {
        let settings = with_faults(configuration, faults);
        let comparison = compare(&format!("{faults:?}, {configuration}"), &settings, RUNS / 4);
        assert!(comparison.is_caught(), "{faults:?} went unnoticed with {configuration}");
    }
}

/// On rough walls neighbours that pass the checks have nearly the same target function, and a merge that does not evaluate it
/// again is hardly biased. On polished metal they have not.
#[test]
#[ignore = "minutes: npm run prove"]
fn on_polished_metal_checks_do_not_hide_the_target() {
    let mut scene = scene();
    for material in &mut scene.materials {
        (material.metallic, material.roughness) = (1.0, 0.4);
    }
    let flat = flatten(&scene);
    // Highlights are noise: the mean over the picture alone, and less sharply than elsewhere.
    let margins = Margins { picture: 0.004, tile: 0.004 };
    let reference = Estimate::radiance(&mut path_tracer(flat.clone()), 16, 256, SIZE).unwrap();
    for (faults, runs) in [(&[][..], RUNS), (&[TARGET], RUNS / 2)] {
        let mut renderer = report(flat.clone(), &with_faults("e-both", faults));
        let comparison =
            Comparison::new(&Estimate::radiance(&mut renderer, runs, FRAMES, SIZE).unwrap(), &reference, margins);
        println!("{faults:?}, e-both, polished: {comparison}");
        assert!(if faults.is_empty() { comparison.is_equivalent() } else { comparison.is_caught() }, "{faults:?}");
    }
}

/// The last frames of runs in which each frame's `step` goes before it, from `FRAMES - 1` to 0 frames before the last.
fn last_frames(renderer: &mut Renderer, runs: u32, step: impl Fn(&mut Renderer, u32)) -> Estimate {
    renderer.set_accumulate(false);
    let run = |seed| {
        renderer.set_seed(1000 + seed);
        for before in (0..MOVING_FRAMES).rev() {
            step(renderer, before);
            renderer.render_frame().expect("a frame");
        }
        pollster::block_on(renderer.read_image()).expect("a picture")
    };
    Estimate::of_pictures(&(0..runs).map(run).collect::<Vec<_>>(), TILE)
}

const MOVING_FRAMES: u32 = 4;

/// The camera slides by five centimetres a frame to where the reference has it.
fn compare_sliding(faults: &[&str], runs: u32) -> Comparison {
    let mut renderer = report(flatten(&scene()), &with_faults("c-temporal", faults));
    renderer.set_speed(0.0);
    let slide = |renderer: &mut Renderer, before| renderer.set_camera(&from_inside(-0.05 * before as f32));
    let comparison = Comparison::new(&last_frames(&mut renderer, runs, slide), reference(), MARGINS);
    println!("{faults:?}, c-temporal, camera sliding: {comparison}");
    comparison
}

/// The checks that the report lacks change noise; the weights decide about bias.
#[test]
#[ignore = "minutes: npm run prove"]
fn missing_checks_are_biased_with_count_weights_alone() {
    assert!(compare("[], d-spatial", &with_faults("d-spatial", &[NO_SIMILARITY]), RUNS).is_equivalent());
    assert!(compare_sliding(&[NO_REPROJECTION], 4 * RUNS).is_equivalent());
    assert!(compare_sliding(&[NO_REPROJECTION, COUNT_WEIGHTS], RUNS).is_caught());
}

#[test]
#[ignore = "minutes: npm run prove"]
fn the_mean_is_right_while_lights_revolve() {
    // A tenth of a second a frame: the fastest ring turns by a tenth of a radian.
    let (step, end) = (0.1, 0.3);
    let mut still = path_tracer(flatten(&scene()));
    still.set_time(end);
    let reference = Estimate::radiance(&mut still, 16, 256, TILE).unwrap();
    for (faults, runs) in [(&[][..], 4 * RUNS), (&[COUNT_WEIGHTS, NO_SIMILARITY], RUNS)] {
        let mut renderer = report(flatten(&scene()), &with_faults("e-both", faults));
        renderer.set_speed(60.0 * step);
        renderer.set_time(end - step * f64::from(MOVING_FRAMES - 1));
        let estimate = last_frames(&mut renderer, runs, |_, _| ());
        assert!((renderer.time() - end).abs() < 1e-9, "{}", renderer.time());
        let comparison = Comparison::new(&estimate, &reference, MARGINS);
        println!("{faults:?}, e-both, lights revolving: {comparison}");
        assert!(if faults.is_empty() { comparison.is_equivalent() } else { comparison.is_caught() });
    }
}

/// NaN and infinite pixels of the film.
fn broken(renderer: &Renderer) -> u64 {
    pollster::block_on(renderer.counters()).expect("counters").not_finite()
}

/// On the ceiling no proposal of the area light counts. Checks keep the NaNs there; without them they are merged everywhere.
#[test]
fn the_unguarded_pdf_makes_nans_that_spread() {
    let count = |faults: &[&str]| {
        let mut renderer = report(builtin("cornell-64"), &with_faults("e-both", faults));
        renderer.set_accumulate(false);
        render(&mut renderer, 1);
        let first = broken(&renderer);
        render(&mut renderer, 20);
        (first, broken(&renderer))
    };
    let (checked, spread) = (count(&[UNGUARDED]), count(&[UNGUARDED, NO_SIMILARITY]));
    println!("pixels that are not finite, of {}: {checked:?} with checks, {spread:?} without", SIZE * SIZE);
    assert!(checked.0 > 500 && 2 * spread.1 > 3 * checked.1);
    assert_eq!(count(&[]), (0, 0));
    assert_eq!(count(&[SAMPLE_COUNT, TARGET, COUNT_WEIGHTS, NO_REPROJECTION, NO_SIMILARITY]), (0, 0));
}

/// Each strategy alone and both together, under every kind of light that the table has.
#[test]
#[ignore = "minutes: npm run prove"]
fn any_lights_do() {
    let box_64 = || make("cornell-64").expect("a built-in scene");
    let without_points = |mut scene: Scene| {
        scene.lights.clear();
        scene.rig = Default::default();
        scene
    };
    let without_lamp = |mut scene: Scene| {
        scene.materials.iter_mut().for_each(|material| material.emissive = Vec3::ZERO);
        scene
    };
    let under_sky = |mut scene: Scene| {
        assert!(scene.surround("sky").expect("a sky"));
        scene
    };
    for (what, scene) in [
        ("an area light", without_points(box_64())),
        ("point lights", without_lamp(box_64())),
        ("sun and sky", under_sky(without_points(without_lamp(box_64())))),
        ("all of them", under_sky(box_64())),
    ] {
        let flat = flatten(&scene);
        let reference = Estimate::radiance(&mut path_tracer(flat.clone()), 16, 64, SIZE).unwrap();
        let estimate = Estimate::radiance(&mut report(flat, &[]), 32, FRAMES, SIZE).unwrap();
        let comparison = Comparison::new(&estimate, &reference, Margins { picture: 0.01, tile: 0.01 });
        println!("{what}: {comparison}");
        assert!(comparison.is_equivalent(), "{what}");
    }
}

#[test]
fn any_size_does() {
    for size in [[1, 1], [1, 9], [1030, 2]] {
        let mut renderer = renderer(&gpu(), builtin("cornell-64"), size, "restir-report", &[("spatial_radius", "1")]);
        let image = render(&mut renderer, 3);
        assert_eq!(image.pixels.len(), (size[0] * size[1]) as usize);
        assert_eq!(broken(&renderer), 0, "{size:?}");
    }
}
