//! No ray gets out of a closed mesh, none hits the surface it starts on: millions of seeded rays, aimed at points,
//! edges and corners, and grazing ones from each hit, on meshes huge and tiny, far from the origin, and instanced.

mod support;

use glam::{Mat4, Quat, Vec3};
use restir::gpu::shader::table;
use restir::scene::{FlatScene, Instance, Material, Mesh, Scene, shapes};
use support::harness::{TestInput, eval_gpu};
use support::*;

/// Rays of one invocation. Few, for llvmpipe leaves all loops of an invocation after 65,536 steps, and one ray along the
/// needle takes a thousand. Hits send more rays, which are not counted.
const RAYS: u32 = 4;
/// Rays in all, unless `RESTIR_RAYS` says how many; docs/testing.md keeps the result for ten million.
const DEFAULT_RAYS: u64 = 1_000_000;

struct Case {
    name: &'static str,
    mesh: Mesh,
    transform: Mat4,
    /// A ball inside of the mesh, in its own space.
    radius: f32,
    /// Whether hardly anything outside may be hit from outside: plane faces, exactly. Not nothing: the triangle test lets
    /// rounding pass, so a ray that grazes its face and leaves it very near the edge beside may hit the face there; about one
    /// in ten thousand does.
    is_convex: bool,
}

/// A ball that is really closed: the first and last corner of each ring are the same, and so are those at a pole.
fn closed_ball(rings: u32) -> Mesh {
    let mut mesh = shapes::sphere(Vec3::ZERO, 1.0, rings, 0);
    let row = 2 * rings as usize + 1;
    for ring in 0..=rings as usize {
        let first = mesh.positions[ring * row];
        mesh.positions[ring * row + row - 1] = first;
        if ring == 0 || ring == rings as usize {
            mesh.positions[ring * row..(ring + 1) * row].fill(first);
        }
    }
    mesh
}

fn cases() -> Vec<Case> {
    let cube = || shapes::cuboid(Vec3::NEG_ONE, Vec3::ONE, 0);
    let ball = closed_ball;
    // A ball with bumps: ridges, valleys and slivers.
    let mut star = ball(60);
    for p in &mut star.positions {
        let q = *p * 7.3;
        *p *= 1.0 + 0.25 * (q.x.sin() * q.y.cos() + 0.3 * (3.1 * q.z + q.x).sin());
    }
    let scaled = |s: f32| Mat4::from_scale(Vec3::splat(s));
    let turned = |s: Vec3, at: Vec3| {
        Mat4::from_scale_rotation_translation(s, Quat::from_axis_angle(Vec3::new(0.6, 0.0, 0.8), 1.1), at)
    };
    vec![
        Case { name: "cube", mesh: cube(), transform: Mat4::IDENTITY, radius: 0.95, is_convex: true },
        Case { name: "ball", mesh: ball(50), transform: scaled(1.0), radius: 0.9, is_convex: false },
        Case { name: "star", mesh: star, transform: scaled(1.0), radius: 0.5, is_convex: false },
        Case { name: "huge ball", mesh: ball(30), transform: scaled(1e6), radius: 0.9, is_convex: false },
        Case { name: "tiny ball", mesh: ball(30), transform: scaled(1e-5), radius: 0.9, is_convex: false },
        Case {
            name: "cube far away",
            mesh: cube(),
            transform: Mat4::from_translation(Vec3::new(1e4, -2e4, 3e3)),
            radius: 0.9,
            is_convex: true,
        },
        Case {
            name: "ball far away",
            mesh: ball(20),
            transform: turned(Vec3::ONE, Vec3::new(5e3, 1e3, -7e3)),
            radius: 0.9,
            is_convex: false,
        },
        Case {
            name: "needle",
            mesh: ball(24),
            transform: turned(Vec3::new(100.0, 0.1, 1.0), Vec3::ONE),
            radius: 0.9,
            is_convex: false,
        },
    ]
}

fn scene_of(case: &Case, instances: Vec<Instance>) -> FlatScene {
    flatten(&Scene {
        meshes: vec![case.mesh.clone()],
        instances,
        materials: vec![Material { double_sided: true, ..Material::default() }],
        ..Scene::default()
    })
}

/// (first rays, leaks, leaks of second rays, second rays that hit where they began, rays out that hit something).
fn count(scene: &FlatScene, instance: u32, centre: Vec3, radius: f32, seed: u32, rays: u64) -> [u64; 5] {
    let invocations = rays.div_ceil(RAYS.into()) as u32;
    let mesh = &scene.meshes[scene.instances[instance as usize].mesh as usize];
    let ball = centre.extend(radius).to_array().map(f32::to_bits);
    let inputs: Vec<_> =
        (0..invocations).map(|i| TestInput::new(&[[(seed << 24) + i, RAYS, mesh.triangles, instance], ball])).collect();
    let outputs = eval_gpu(&gpu(), &table::TESTS_LEAKS, Some(scene), 0, &inputs);
    let sum = |k: usize| outputs.iter().map(|o| u64::from(o.a[k])).sum();
    [u64::from(RAYS * invocations), sum(0), sum(1), sum(2), sum(3)]
}

#[test]
fn no_ray_leaves_a_closed_mesh() {
    let wanted = std::env::var("RESTIR_RAYS").map_or(DEFAULT_RAYS, |n| n.parse().expect("a number of rays"));
    let (mut rays, mut faults) = (0, Vec::new());
    let each = wanted.div_ceil(cases().len() as u64 + 1);
    for (case, seed) in cases().iter().zip(1..) {
        let scene = scene_of(case, vec![Instance { mesh: 0, transform: case.transform }]);
        assert_eq!(scene.stats.dropped_triangles, 0, "{} is not closed", case.name);
        // The largest ball inside a stretched one is as wide as it is thin.
        let scale = case.transform.to_scale_rotation_translation().0.abs().min_element();
        let centre = case.transform.transform_point3(Vec3::ZERO);
        let [traced, leaks, back, own, out] = count(&scene, 0, centre, case.radius * scale, seed, each);
        println!(
            "{}: {traced} rays, {leaks} leaks, {back} from a surface, {own} self-hits, {out} hits outside",
            case.name
        );
        rays += traced;
        if leaks + back + own > 0 || case.is_convex && out > traced / 1000 {
            faults.push(case.name);
        }
    }
    // The same ball many times over: its rays go through the top level.
    let case = &cases()[1];
    let place = |i: usize| Vec3::new(3.0 * (i % 8) as f32, 3.0 * (i / 8) as f32, -5.0);
    let stretch = Vec3::new(0.7, 1.3, 1.0);
    let copies = (0..60).map(|i| {
        let turn = Quat::from_axis_angle(Vec3::new(0.36, 0.48, 0.8), i as f32);
        Instance { mesh: 0, transform: Mat4::from_scale_rotation_translation(stretch, turn, place(i)) }
    });
    let scene = scene_of(case, copies.collect());
    assert!(scene.has_top_level(), "the balls share a bottom level");
    let [traced, leaks, back, own, out] = count(&scene, 17, place(17), 0.6, 99, each);
    println!("instances: {traced} rays, {leaks} leaks, {back} from a surface, {own} self-hits, {out} hits outside");
    rays += traced;
    if leaks + back + own > 0 {
        faults.push("instances");
    }
    assert!(rays >= wanted, "{rays}");
    assert!(faults.is_empty(), "{faults:?}");
}

/// The count can fail: a ball with a hole at its pole leaks.
#[test]
fn a_hole_is_noticed() {
    let mut case = cases().remove(1);
    case.mesh.indices.truncate(case.mesh.indices.len() - 3 * 50);
    let scene = scene_of(&case, vec![Instance { mesh: 0, transform: Mat4::IDENTITY }]);
    let [_, leaks, back, ..] = count(&scene, 0, Vec3::ZERO, 0.9, 1, 50_000);
    assert!(leaks > 0 && back > 0, "{leaks} {back}");
}
