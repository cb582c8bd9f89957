//! An animated scene does not ghost: restir-di while camera, objects and lights move, against a reference of that moment.
//!
//! Two questions. Is the mean right? By two one-sided tests as in truth.rs, with faults planted in what is known of the frame
//! before. Is the history of use? By the error of single frames beside that of the same moment when nothing has moved.

mod support;

use glam::{Quat, Vec3};
use restir::lab::truth::equivalence::{Comparison, Estimate, Margins, Z_95, pictures};
use restir::scene::rig::{Attachment, LINEAR, Node, Placement, ROTATION, TRANSLATION};
use restir::scene::{Camera, Material, Mesh, Scene, shapes};
use restir::{FlatScene, Gpu, Image, Renderer};
use std::f32::consts::{FRAC_PI_2, TAU};
use support::above::{self, WHITE, floor, place};
use support::*;

const SIZE: u32 = 64;
/// A tile's mean is of a quarter as many pixels as in truth.rs.
const TILE: u32 = 16;
const MARGINS: Margins = Margins { picture: 0.004, tile: 0.015 };
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

/// A run of restir-di while time runs at `speed`: its last frame is at [`END`].
fn playing(gpu: &Gpu, scene: &FlatScene, speed: f64) -> Renderer {
    let mut renderer = renderer(gpu, scene.clone(), [SIZE; 2], "restir-di", REUSE);
    renderer.set_accumulate(false);
    renderer.set_speed(speed);
    renderer.follow_camera(0).unwrap();
    renderer.set_time(END - speed / 60.0 * f64::from(FRAMES - 1));
    renderer
}

/// The picture at [`END`], averaged over so many frames of the path tracer.
fn still(scene: &FlatScene) -> Renderer {
    let mut renderer = renderer(&gpu(), scene.clone(), [SIZE; 2], "path-tracer", DIRECT);
    renderer.set_accumulate(true);
    renderer.set_time(END);
    renderer.follow_camera(0).unwrap();
    renderer
}

/// What is put in the place of what.
type Plant = (&'static str, &'static str);

/// The renderer [`playing`] gives, on a device of its own, with a fault planted in its shaders.
fn planted(scene: &FlatScene, speed: f64, (old, new): Plant) -> Renderer {
    let gpu = fresh_gpu();
    gpu.plant(old, new).unwrap();
    playing(&gpu, scene, speed)
}

fn compare(what: &str, renderer: &mut Renderer, runs: u32, tile: u32, reference: &Estimate) -> Comparison {
    let estimate = Estimate::radiance(renderer, runs, FRAMES, tile).unwrap();
    assert!((renderer.time() - END).abs() < 1e-9, "{}", renderer.time());
    let comparison = Comparison::new(&estimate, reference, proof().margins(MARGINS));
    println!("{what}: {comparison}");
    comparison
}

#[test]
fn the_mean_is_right_while_everything_moves() {
    let mut scene = restir::scene::builtin::make("motion").unwrap();
    // All of it in view but its lights.
    scene.cameras[0] = Camera::look_at("still", [0.0, 1.2, 3.4].into(), [0.0, 0.35, -0.3].into(), 42f32.to_radians());
    let scene = flatten(&scene);
    let reference = Estimate::radiance(&mut still(&scene), 8, 100, TILE).unwrap();
    let comparison = compare("moving", &mut playing(&gpu(), &scene, SPEED), 128, TILE, &reference);
    assert!(comparison.is_equivalent());
}

const LAMP: u32 = 1;

/// The scene seen from above, with a second material that shines.
fn from_above() -> Scene {
    let mut scene = above::scene();
    scene.materials.push(Material { emissive: Vec3::splat(20.0), ..scene.materials[WHITE as usize].clone() });
    scene
}

/// A pose of a node.
type Pose = (Vec3, Quat);

/// A node that is in one pose in the first frame and in the other in the last.
fn mover(scene: &mut Scene, (p0, r0): Pose, (p1, r1): Pose) -> u32 {
    let node = scene.rig.add_node(Node { translation: p0, rotation: r0, ..Node::default() });
    // A clip starts again after its last keyframe.
    let times = [START as f32, END as f32, 2.0 * END as f32];
    let positions: Vec<f32> = [p0, p1, p1].iter().flat_map(Vec3::to_array).collect();
    let rotations: Vec<f32> = [r0, r1, r1].iter().flat_map(Quat::to_array).collect();
    scene.rig.add_channel(node, TRANSLATION, LINEAR, &times, &positions);
    scene.rig.add_channel(node, ROTATION, LINEAR, &times, &rotations);
    node
}

/// Places a mesh on a node.
fn hang(scene: &mut Scene, mesh: Mesh, node: u32) {
    let instance = place(scene, mesh);
    scene.rig.instances.push(Placement::rigid(instance, node));
}

fn slide(from: Vec3, to: Vec3) -> [Pose; 2] {
    [(from, Quat::IDENTITY), (to, Quat::IDENTITY)]
}

/// A turn about the z axis, in degrees.
fn turn(at: Vec3, from: f32, to: f32) -> [Pose; 2] {
    [from, to].map(|angle| (at, Quat::from_rotation_z(angle.to_radians())))
}

/// A square lamp about a point, beside what is in view, that shines towards -x.
fn lamp(center: Vec3, width: f32) -> Mesh {
    let (u, v) = (width * Vec3::Z, width * Vec3::Y);
    shapes::parallelogram(center - 0.5 * (u + v), u, v, LAMP)
}

/// A wall between lamp and floor slides away: in each frame light falls on a strip that was in the shadow before.
fn receding_shadow() -> Scene {
    let mut scene = from_above();
    place(&mut scene, floor(1.0));
    place(&mut scene, lamp(Vec3::new(1.6, 1.2, 0.0), 0.3));
    let [from, to] = slide(Vec3::new(0.9, 0.0, -0.23), Vec3::new(0.9, 0.0, 0.1));
    let node = mover(&mut scene, from, to);
    hang(&mut scene, shapes::cuboid(Vec3::ZERO, Vec3::new(0.01, 2.0, 3.0), WHITE), node);
    scene
}

/// The floor turns to a lamp that was below its horizon before.
fn floor_turning_to_the_light() -> Scene {
    let mut scene = from_above();
    place(&mut scene, lamp(Vec3::new(3.0, 0.15, 0.0), 0.4));
    let [from, to] = turn(Vec3::ZERO, 52.0, -8.0);
    let node = mover(&mut scene, from, to);
    hang(&mut scene, floor(1.0), node);
    scene
}

/// A lamp that shines to one side turns to the floor.
fn lamp_turning_to_the_floor() -> Scene {
    let mut scene = from_above();
    place(&mut scene, floor(1.0));
    let [from, to] = turn(Vec3::new(1.5, 1.0, 0.0), -175.0, -10.0);
    let node = mover(&mut scene, from, to);
    hang(&mut scene, lamp(Vec3::ZERO, 0.3), node);
    scene
}

#[test]
fn faults_in_what_is_known_of_the_frame_before_are_caught() {
    let cases: [(&str, Scene, Plant); 3] = [
        (
            "its shadow rays go through this frame's scene",
            receding_shadow(),
            ("select(frame.top_level, frame.previous_top_level, previous)", "frame.top_level"),
        ),
        (
            "its surfaces are rebuilt where they are now",
            floor_turning_to_the_light(),
            ("previous_instance(seen.x), seen.y,", "seen.x, seen.y,"),
        ),
        (
            "its lamps shine where they are now",
            lamp_turning_to_the_floor(),
            ("            instance = previous_instance(instance);", ""),
        ),
    ];
    for (what, scene, plant) in support::cases(&cases) {
        let scene = flatten(scene);
        let reference = Estimate::radiance(&mut still(&scene), 8, 50, SIZE).unwrap();
        // Without the plant the same test passes.
        let right = compare("no fault", &mut playing(&gpu(), &scene, SPEED), proof().effort(64), SIZE, &reference);
        assert!(right.is_equivalent(), "without the fault that '{what}'");
        let mut renderer = planted(&scene, SPEED, *plant);
        let wrong = compare(what, &mut renderer, 16, SIZE, &reference);
        assert!(wrong.is_caught(), "'{what}' went unnoticed");
    }
}

/// Length of a ridge's foot in metres, of which eight are in view.
const PERIOD: f32 = 0.12;

/// Ridges with a slope of 50 degrees, too steep for one face to be taken for the other.
fn ridges() -> Mesh {
    let half = 0.5 * PERIOD;
    let rise = half * 50f32.to_radians().tan();
    let (along, up, down) = (4.0 * Vec3::NEG_Z, Vec3::new(half, rise, 0.0), Vec3::new(half, -rise, 0.0));
    let mut mesh = Mesh { material: WHITE, ..Mesh::default() };
    for i in -12..12 {
        let foot = Vec3::new(PERIOD * i as f32, 0.0, 2.0);
        shapes::append(&mut mesh, &shapes::parallelogram(foot, up, along, WHITE));
        shapes::append(&mut mesh, &shapes::parallelogram(foot + up, down, along, WHITE));
    }
    mesh
}

/// A ring of lamps beside what is in view, of three kinds, each three times as bright as the one before.
fn lamps(scene: &mut Scene) -> Vec<Mesh> {
    const LAMPS: u16 = 24;
    let first = scene.materials.len() as u32;
    for radiance in [10.0, 30.0, 90.0] {
        scene.materials.push(Material { emissive: Vec3::splat(radiance), ..scene.materials[LAMP as usize].clone() });
    }
    let one = |i: u16| {
        let spin = Quat::from_rotation_y(f32::from(i) / f32::from(LAMPS) * TAU);
        let [corner, u, v] = [Vec3::new(0.85, 0.4, -0.05), Vec3::Z * 0.1, Vec3::new(0.05, 0.05, 0.0)].map(|e| spin * e);
        shapes::parallelogram(corner, u, v, first + u32::from(i) % 3)
    };
    (0..LAMPS).map(one).collect()
}

/// Half a ridge a frame.
const PATH: Vec3 = Vec3::new(0.5 * PERIOD * (FRAMES - 1) as f32, 0.0, 0.0);

fn ridges_that_slide() -> Scene {
    let mut scene = from_above();
    lamps(&mut scene).into_iter().for_each(|lamp| _ = place(&mut scene, lamp));
    let [from, to] = slide(-PATH, Vec3::ZERO);
    let node = mover(&mut scene, from, to);
    hang(&mut scene, ridges(), node);
    scene
}

fn camera_that_slides() -> Scene {
    let mut scene = from_above();
    lamps(&mut scene).into_iter().for_each(|lamp| _ = place(&mut scene, lamp));
    place(&mut scene, ridges());
    let position = scene.cameras[0].position;
    let down = Quat::from_rotation_x(-FRAC_PI_2);
    let node = mover(&mut scene, (position - PATH, down), (position, down));
    scene.rig.cameras.push(Attachment { target: 0, node });
    scene
}

/// The ring of lamps turns by 4 degrees a frame, a quarter of the way from one lamp to the next.
fn lamps_that_revolve() -> Scene {
    let mut scene = from_above();
    let turned = |degrees: f32| (Vec3::ZERO, Quat::from_rotation_y(degrees.to_radians()));
    let node = mover(&mut scene, turned(-4.0 * (FRAMES - 1) as f32), turned(0.0));
    lamps(&mut scene).into_iter().for_each(|lamp| hang(&mut scene, lamp, node));
    place(&mut scene, ridges());
    scene
}

/// Mean squared error of a picture's pixels, relative to the truth.
fn error(picture: &Image, truth: &Image) -> f64 {
    let value = |pixel: &[f32; 3]| pixel.iter().map(|c| f64::from(*c)).sum::<f64>() / 3.0;
    let pairs = picture.pixels.iter().zip(&truth.pixels).map(|(a, b)| (value(a), value(b)));
    pairs.map(|(a, b)| ((a - b) / (b + 0.05)).powi(2)).sum::<f64>() / truth.pixels.len() as f64
}

/// The error of a run's last frame, with its standard error.
fn last_error(renderer: &mut Renderer, truth: &Image) -> (f64, f64) {
    let samples: Vec<_> =
        pictures(renderer, 8, FRAMES).unwrap().iter().map(|picture| vec![error(picture, truth)]).collect();
    Estimate::of(&samples).0[0]
}

/// A quotient with its standard error.
fn ratio((a, error_a): (f64, f64), (b, error_b): (f64, f64)) -> (f64, f64) {
    (a / b, a / b * (error_a / a).hypot(error_b / b))
}

/// What motion may cost, as the squared error of a frame over that at rest. History is lost where something was hidden
/// before, and what it says is of a moment ago.
const MOST: f64 = 1.3;

#[test]
fn history_follows_what_moves() {
    let cases: [(&str, Scene, Plant); 3] = [
        // As if nothing but the camera ever moved.
        (
            "objects",
            ridges_that_slide(),
            ("let position = previous_position(pixel);", "let position = surface.position;"),
        ),
        // As if the camera never moved.
        (
            "camera",
            camera_that_slides(),
            ("project(frame.previous_camera, position)", "project(frame.camera, position)"),
        ),
        // As if there were no history.
        ("lights", lamps_that_revolve(), ("if reprojected.x < 0 {", "if true {")),
    ];
    for (what, scene, plant) in support::cases(&cases) {
        let scene = flatten(scene);
        let truth = render(&mut still(&scene), 400);
        let rest = last_error(&mut playing(&gpu(), &scene, 0.0), &truth);
        let moving = ratio(last_error(&mut playing(&gpu(), &scene, SPEED), &truth), rest);
        let mut renderer = planted(&scene, SPEED, *plant);
        let wrong = ratio(last_error(&mut renderer, &truth), rest);
        println!(
            "{what}: {:.2} ± {:.2} times the error at rest; {:.2} ± {:.2} with the plant",
            moving.0, moving.1, wrong.0, wrong.1
        );
        assert!(moving.0 + Z_95 * moving.1 < MOST, "{what}: the history is of little use");
        assert!(wrong.0 - Z_95 * wrong.1 > MOST, "{what}: the plant went unnoticed");
    }
}
