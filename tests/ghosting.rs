//! An animated scene does not ghost: restir-di while camera, objects and lights move, against a reference of that moment.
//!
//! Two questions. Is the mean right? By two one-sided tests as in truth.rs, with faults planted in what is known of the frame
//! before. Is the history of use? By the error of single frames beside that of the same moment when nothing has moved.

mod support;

use restir::scene::{Camera, Scene};
use restir::{FlatScene, Gpu, Image, Renderer};
use std::sync::OnceLock;
use support::plants::ShaderCopy;
use support::*;

const SIZE: u32 = 64;
const TILE: u32 = 16;
const GLOBAL_MARGIN: f64 = 0.004;
/// Of a tile a quarter as large as there.
const TILE_MARGIN: f64 = 0.015;
const Z_95: f64 = 1.645;
/// Scene time of a frame in seconds, and the moments of the first and the last of a run.
const STEP: f64 = 0.2;
const START: f64 = 0.3;
const FRAMES: u32 = 4;
const END: f64 = START + STEP * (FRAMES - 1) as f64;
/// Speed at which a frame takes [`STEP`].
const SPEED: f64 = STEP * 60.0;

const DIRECT: &[(&str, &str)] = &[("render.max_depth", "1")];
const REUSE: &[(&str, &str)] = &[
    ("render.max_depth", "1"),
    ("indirect", "no"),
    ("light_samples", "8"),
    ("history_cap", "10"),
    ("temporal_position_threshold", "0.2"),
    ("temporal_normal_threshold", "0.5"),
];

/// `builtin:motion`, all of it in view but its lights.
fn scene() -> Scene {
    let mut scene = restir::scene::builtin::make("motion").unwrap();
    scene.cameras[0] = Camera::look_at("still", [0.0, 1.2, 3.4].into(), [0.0, 0.35, -0.3].into(), 42f32.to_radians());
    scene
}

/// A run of restir-di while time runs at `speed`: its last frame is at [`END`].
fn playing(gpu: &Gpu, scene: &FlatScene, camera: usize, speed: f64) -> Renderer {
    let mut renderer = renderer(gpu, scene.clone(), [SIZE; 2], "restir-di", REUSE);
    renderer.set_accumulate(false);
    renderer.set_speed(speed);
    renderer.follow_camera(camera).unwrap();
    renderer.set_time(END - speed / 60.0 * f64::from(FRAMES - 1));
    renderer
}

/// The picture at [`END`], averaged over so many frames of the path tracer.
fn still(scene: &FlatScene, camera: usize) -> Renderer {
    let mut renderer = renderer(&gpu(), scene.clone(), [SIZE; 2], "path-tracer", DIRECT);
    renderer.set_accumulate(true);
    renderer.set_time(END);
    renderer.follow_camera(camera).unwrap();
    renderer
}

/// Mean radiance of the picture, then of each tile.
fn means(image: &Image) -> Vec<f64> {
    let tiles = SIZE / TILE;
    let mut sums = vec![0.0; 1 + (tiles * tiles) as usize];
    for (i, pixel) in image.pixels.iter().enumerate() {
        let value: f64 = pixel.iter().map(|c| f64::from(*c)).sum::<f64>() / 3.0;
        let (x, y) = (i as u32 % SIZE / TILE, i as u32 / SIZE / TILE);
        sums[0] += value / f64::from(SIZE * SIZE);
        sums[1 + (y * tiles + x) as usize] += value / f64::from(TILE * TILE);
    }
    sums
}

/// Mean and standard error of each number over runs.
fn statistics(samples: &[Vec<f64>]) -> Vec<(f64, f64)> {
    let n = samples.len() as f64;
    let column = |i: usize| {
        let mean = samples.iter().map(|s| s[i]).sum::<f64>() / n;
        let variance = samples.iter().map(|s| (s[i] - mean).powi(2)).sum::<f64>() / (n * (n - 1.0));
        (mean, variance.sqrt())
    };
    (0..samples[0].len()).map(column).collect()
}

fn runs(renderer: &mut Renderer, count: u32, frames: u32) -> Vec<Image> {
    (0..count)
        .map(|run| {
            renderer.set_seed(500 + run);
            render(renderer, frames)
        })
        .collect()
}

fn estimate(renderer: &mut Renderer, count: u32, frames: u32) -> Vec<(f64, f64)> {
    statistics(&runs(renderer, count, frames).iter().map(means).collect::<Vec<_>>())
}

fn reference() -> &'static Vec<(f64, f64)> {
    static REFERENCE: OnceLock<Vec<(f64, f64)>> = OnceLock::new();
    REFERENCE.get_or_init(|| estimate(&mut still(&flatten(&scene()), 0), 8, 100))
}

/// Relative difference and its standard error, region by region, with the region's margin.
fn differences(what: &str, estimate: &[(f64, f64)]) -> Vec<(f64, f64, f64)> {
    let pairs = estimate.iter().zip(reference()).enumerate();
    let differences: Vec<_> = pairs
        .map(|(i, ((mean, error), (truth, noise)))| {
            (mean / truth - 1.0, error.hypot(*noise) / truth, if i == 0 { GLOBAL_MARGIN } else { TILE_MARGIN })
        })
        .collect();
    let parts: Vec<_> = differences.iter().map(|(d, e, _)| format!("{:+.2}±{:.2} %", 100.0 * d, 100.0 * e)).collect();
    println!("{what}: {}", parts.join(", "));
    differences
}

#[test]
fn the_mean_is_right_while_everything_moves() {
    let mut renderer = playing(&gpu(), &flatten(&scene()), 0, SPEED);
    let differences = differences("moving", &estimate(&mut renderer, RUNS, FRAMES));
    assert!((renderer.time() - END).abs() < 1e-9, "{}", renderer.time());
    assert!(differences.iter().all(|(d, e, margin)| d.abs() + Z_95 * e < *margin), "not equivalent");
}

const RUNS: u32 = 128;

/// What, the file, what stands there, what is put in its place.
type Plant = (&'static str, &'static str, &'static str, &'static str);

#[test]
fn faults_in_what_is_known_of_the_frame_before_are_caught() {
    let plants: &[Plant] = &[(
        "its shadow rays go through this frame's scene",
        "techniques/common/resampling.wgsl",
        "select(frame.top_level, frame.previous_top_level, previous)",
        "frame.top_level",
    )];
    check_plants(plants);
}

#[test]
#[ignore = "not yet told from noise: rebuilt surfaces shift a tile by -0.63 ± 0.41 % at most in 32 runs; lamps are unmeasured"]
fn smaller_faults_are_caught() {
    check_plants(&[
        (
            "its surfaces are rebuilt where they are now",
            "techniques/restir-di/temporal.wgsl",
            "previous_instance(seen.x), seen.y,",
            "seen.x, seen.y,",
        ),
        (
            "its lamps shine where they are now",
            "scene/lights.wgsl",
            "            instance = previous_instance(instance);",
            "",
        ),
    ]);
}

fn check_plants(plants: &[Plant]) {
    for &(what, file, old, new) in plants {
        let folder = ShaderCopy::new();
        let gpu = fresh_gpu();
        let mut renderer = playing(&gpu, &flatten(&scene()), 0, SPEED);
        render(&mut renderer, 1);
        gpu.watch_shaders(&folder.0);
        folder.edit(file, old, new);
        let differences = differences(what, &estimate(&mut renderer, RUNS / 4, FRAMES));
        assert_eq!(renderer.shader_problems, Vec::<String>::new());
        assert!(differences.iter().any(|(d, e, margin)| d.abs() - Z_95 * e > *margin), "'{what}' went unnoticed");
    }
}

/// Mean squared relative error of the pixels that `mask` picks, a number a run.
fn errors(pictures: &[Image], truth: &Image, mask: &[bool]) -> Vec<Vec<f64>> {
    let error = |(a, b): (&[f32; 3], &[f32; 3])| {
        let [a, b] = [a, b].map(|p| p.iter().map(|c| f64::from(*c)).sum::<f64>() / 3.0);
        ((a - b) / (b + 0.05)).powi(2)
    };
    let of = |picture: &Image| {
        let picked = picture.pixels.iter().zip(&truth.pixels).zip(mask).filter(|(_, picked)| **picked);
        vec![picked.map(|(pair, _)| error(pair)).sum::<f64>() / mask.iter().filter(|m| **m).count() as f64]
    };
    pictures.iter().map(of).collect()
}

/// Which pixels see something that has moved in the picture.
fn moving_pixels(scene: &FlatScene, camera: usize) -> Vec<bool> {
    let mut renderer = playing(&gpu(), scene, camera, SPEED);
    render(&mut renderer, FRAMES);
    let motion = pollster::block_on(renderer.read_auxiliary()).unwrap().motion;
    motion.iter().map(|[x, y]| x.hypot(*y) > 0.5).collect()
}

/// The error of the last frame while things move over that when they have stood still, with its standard error.
fn error_ratio(gpu: &Gpu, scene: &FlatScene, camera: usize, mask: &[bool], plant: Option<&str>) -> (f64, f64) {
    let truth = render(&mut still(scene, camera), 400);
    let folder = plant.map(|_| ShaderCopy::new());
    let measure = |speed: f64| {
        let mut renderer = playing(gpu, scene, camera, speed);
        if let (Some(folder), Some(plant)) = (&folder, plant) {
            render(&mut renderer, 1);
            gpu.watch_shaders(&folder.0);
            if speed > 0.0 {
                folder.edit("techniques/restir-di/temporal.wgsl", "let position = previous_position(pixel);", plant);
            }
        }
        statistics(&errors(&runs(&mut renderer, 8, FRAMES), &truth, mask))[0]
    };
    let ((still, s0), (moving, s1)) = (measure(0.0), measure(SPEED));
    let ratio = moving / still;
    (ratio, ratio * (s0 / still).hypot(s1 / moving))
}

/// History is lost where something was hidden before, and what it says is old; beyond that motion may cost nothing.
const MOST: f64 = 2.0;

#[test]
#[ignore = "too few moving pixels to tell: error 1.47 ± 0.13 times that at rest, 1.68 ± 0.16 with the plant"]
fn history_follows_what_moves() {
    let objects = |scene: &mut Scene| {
        scene.rig.lights.clear();
        scene.rig.cameras.clear();
        scene.rig.instances.pop();
    };
    let lights = |scene: &mut Scene| {
        scene.rig.cameras.clear();
        scene.rig.instances.drain(..3);
    };
    let camera = |scene: &mut Scene| {
        scene.rig.lights.clear();
        scene.rig.instances.clear();
    };
    type Kind<'a> = (&'a str, usize, &'a dyn Fn(&mut Scene));
    let kinds: [Kind; 3] = [("objects", 0, &objects), ("lights", 0, &lights), ("camera", 1, &camera)];
    for (what, index, keep) in kinds {
        let mut moving = scene();
        keep(&mut moving);
        let flat = flatten(&moving);
        let mask = if what == "lights" { vec![true; (SIZE * SIZE) as usize] } else { moving_pixels(&flat, index) };
        let count = mask.iter().filter(|moves| **moves).count();
        assert!(count > 100, "{what}: {count} pixels move");
        let (ratio, error) = error_ratio(&gpu(), &flat, index, &mask, None);
        println!("{what}: error {ratio:.2} ± {error:.2} times that at rest, in {count} pixels");
        assert!(ratio + Z_95 * error < MOST, "{what}: the history is of little use");
        if what == "objects" {
            // As if nothing but the camera ever moved.
            let plant = Some("let position = surface.position;");
            let (planted, planted_error) = error_ratio(&fresh_gpu(), &flat, index, &mask, plant);
            println!("{what}, reprojected from where they are now: {planted:.2} ± {planted_error:.2}");
            assert!(planted - Z_95 * planted_error > ratio + Z_95 * error, "the plant went unnoticed");
        }
    }
}
