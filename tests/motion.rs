//! Scenes that move: motion vectors of known points, both levels of the BVH after refitting, the frame before as a scene of
//! its own, and restir-di's history, which must not ghost.

mod support;

use glam::{Mat4, Vec2, Vec3};
use restir::frame::camera_view;
use restir::scene::rig;
use restir::scene::stage::Stage;
use restir::scene::{Camera, Scene, bvh, gpu_types::NONE, intersect};
use restir::{FlatScene, Renderer};
use support::*;

const SIZE: [u32; 2] = [96, 64];

/// Renders two moments, and gives the camera of each and what the second frame says of motion.
fn two_moments(scene: &FlatScene, camera: usize, times: [f64; 2]) -> (Renderer, [Camera; 2], Vec<[f32; 2]>) {
    let mut renderer = renderer(&gpu(), scene.clone(), SIZE, "normals", &[("render.pixel_filter", "center")]);
    renderer.set_accumulate(true);
    renderer.follow_camera(camera).unwrap();
    let cameras = times.map(|time| {
        renderer.set_time(time);
        renderer.render_frame().unwrap();
        renderer.camera().clone()
    });
    let motion = pollster::block_on(renderer.read_auxiliary()).unwrap().motion;
    (renderer, cameras, motion)
}

/// Shapes, places and both top levels reach the device wherever the adapter's kernels look for them.
#[test]
fn kernels_for_gpus_and_for_software_show_the_same_moments() {
    let flat = flatten(&restir::scene::builtin::make("motion").unwrap());
    let pictures = [gpu(), gpu().posing_as_hardware()].map(|gpu| {
        let mut renderer = renderer(&gpu, flat.clone(), SIZE, "path-tracer", &[("render.max_depth", "2")]);
        [0.2, 0.7].map(|time| {
            renderer.set_time(time);
            render(&mut renderer, 2)
        })
    });
    for (own, for_gpus) in pictures[0].iter().zip(&pictures[1]) {
        let differ =
            own.pixels.iter().zip(&for_gpus.pixels).filter(|(a, b)| (0..3).any(|i| (a[i] - b[i]).abs() > 1e-3));
        let differ = differ.count();
        assert!(differ * 200 < own.pixels.len(), "{differ} of {} pixels differ", own.pixels.len());
    }
}

fn project(camera: &Camera, p: Vec3) -> Vec2 {
    let clip = camera_view(camera, SIZE.into()).world_to_clip * p.extend(1.0);
    (Vec2::new(clip.x, -clip.y) / clip.w * 0.5 + 0.5) * Vec2::new(SIZE[0] as f32, SIZE[1] as f32)
}

/// The world-space triangles of instance `index` of the rig at a moment, by vertex numbers: from the scene, not from what
/// was flattened.
fn corners_at(scene: &Scene, index: usize, time: f64) -> Vec<[Vec3; 3]> {
    let (placement, pose) = (&scene.rig.instances[index], scene.rig.pose(0, time));
    let mesh = &scene.meshes[scene.instances[placement.instance as usize].mesh as usize];
    let mut vertices = Vec::new();
    rig::deform::deform(
        &mesh.vertices(),
        &mesh.deformation.targets.concat(),
        pose.morph_weights(placement),
        &pose.joint_matrices(&scene.rig, placement.skin),
        &mut vertices,
    );
    let to_world = pose.instance(placement);
    let corner = |&i: &u32| to_world.transform_point3(vertices[i as usize].position);
    mesh.indices.as_chunks::<3>().0.iter().map(|corners| corners.each_ref().map(corner)).collect()
}

/// Where a ray meets a triangle's front: distance and barycentrics.
fn meet(corners: [Vec3; 3], origin: Vec3, direction: Vec3) -> Option<(f32, f32, f32)> {
    let [p0, p1, p2] = corners;
    let triangle = restir::scene::gpu_types::Triangle { p0, p1, p2, flags: 0, material: 0, light: NONE };
    intersect::intersect_triangle(&triangle, origin, direction, f32::INFINITY)
}

/// Every pixel that sees rig instance `index` must say how far its point has moved, to within 0.05 pixels. Returns how
/// many pixels there were, and the mean length of their motion.
fn check_vectors(scene: &Scene, index: usize, camera: usize, times: [f64; 2]) -> (usize, f32) {
    let flat = flatten(scene);
    let (renderer, cameras, motion) = two_moments(&flat, camera, times);
    let [before, now] = times.map(|time| corners_at(scene, index, time));
    let depth = pollster::block_on(renderer.read_auxiliary()).unwrap().depth;
    let view = camera_view(&cameras[1], SIZE.into());
    let (mut seen, mut total, mut worst) = (0, 0.0, 0f32);
    for y in 0..SIZE[1] {
        for x in 0..SIZE[0] {
            let film = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
            let ndc = (film / Vec2::new(SIZE[0] as f32, SIZE[1] as f32) * 2.0 - 1.0) * Vec2::new(1.0, -1.0);
            let direction = (view.forward + view.right * ndc.x + view.up * ndc.y).normalize();
            let hits =
                now.iter().enumerate().filter_map(|(i, &corners)| Some((i, meet(corners, view.position, direction)?)));
            let Some((i, (t, u, v))) = hits.min_by(|a, b| a.1.0.total_cmp(&b.1.0)) else { continue };
            let pixel = (y * SIZE[0] + x) as usize;
            // Something else may stand before it.
            if (depth[pixel] - t * direction.dot(view.forward)).abs() > 1e-3 * t {
                continue;
            }
            let [a, b, c] = before[i];
            let expected = film - project(&cameras[0], a * (1.0 - u - v) + b * u + c * v);
            let error = (Vec2::from(motion[pixel]) - expected).length();
            worst = worst.max(error);
            assert!(error < 0.05, "pixel {x} {y}: {:?}, should be {expected}", motion[pixel]);
            (seen, total) = (seen + 1, total + expected.length());
        }
    }
    println!(
        "instance {index}, camera {camera}: {seen} pixels, worst {worst:.5}, mean motion {:.2}",
        total / seen as f32
    );
    (seen, total / seen as f32)
}

/// Instances of the rig of `builtin:motion`.
const COLUMN: usize = 0;
const BALL: usize = 1;
const BOX: usize = 2;

#[test]
fn motion_vectors_find_known_points() {
    let scene = restir::scene::builtin::make("motion").unwrap();
    for (what, index) in [("skinned", COLUMN), ("morphed", BALL), ("rigid", BOX)] {
        for (camera, times) in [(0, [0.2, 0.9]), (1, [0.2, 0.9]), (0, [3.0, 2.2])] {
            let (pixels, motion) = check_vectors(&scene, index, camera, times);
            assert!(pixels > 50, "{what}: {pixels} pixels are too few to tell");
            // The bumps of the ball are small.
            assert!(motion > 0.1, "{what} has hardly moved: {motion}");
        }
    }
}

#[test]
fn still_things_and_the_background_move_with_the_camera() {
    let mut scene = restir::scene::builtin::make("motion").unwrap();
    scene.environment = Some(restir::scene::Environment::even(Vec3::splat(0.1)));
    // The walls go: the background shows round everything.
    scene.instances.iter_mut().take(2).for_each(|wall| wall.transform = Mat4::from_translation(Vec3::splat(500.0)));
    let (renderer, cameras, motion) = two_moments(&flatten(&scene), 1, [0.9, 1.1]);
    let depth = pollster::block_on(renderer.read_auxiliary()).unwrap().depth;
    let view = camera_view(&cameras[1], SIZE.into());
    let mut background = 0;
    for (pixel, motion) in motion.iter().enumerate().filter(|(pixel, _)| depth[*pixel] == 0.0) {
        let film = Vec2::new((pixel as u32 % SIZE[0]) as f32 + 0.5, (pixel as u32 / SIZE[0]) as f32 + 0.5);
        let ndc = (film / Vec2::new(SIZE[0] as f32, SIZE[1] as f32) * 2.0 - 1.0) * Vec2::new(1.0, -1.0);
        let far = view.position + (view.forward + view.right * ndc.x + view.up * ndc.y) * 1e6;
        assert!((Vec2::from(*motion) - (film - project(&cameras[0], far))).length() < 0.05, "{film}");
        background += 1;
    }
    assert!(background > 1000, "{background}");
    // A camera that stands still sees still things at rest, and the first frame has nothing to compare with.
    let (_, _, motion) = two_moments(&flatten(&scene), 0, [0.9, 0.9]);
    assert!(motion.iter().flatten().all(|motion| motion.abs() < 1e-3));
}

#[test]
fn refitted_levels_hold_every_triangle() {
    let scene = restir::scene::builtin::make("motion").unwrap();
    let flat = flatten(&scene);
    assert_eq!((flat.deformers.list.len(), flat.rig.instances.len()), (2, 4));
    let mut stage = Stage::new(&flat, 0, 0.0);
    for step in 1..40 {
        stage.step(&flat, 0, f64::from(step) * 0.1);
        for body in &stage.bodies {
            assert!(bvh::cost(&body.nodes) < 200.0);
            for node in body.nodes.iter().filter(|node| node.count > 0) {
                for triangle in &body.triangles[node.first as usize..(node.first + node.count) as usize] {
                    for p in [triangle.p0, triangle.p1, triangle.p2] {
                        assert!(p.cmpge(node.min).all() && p.cmple(node.max).all(), "step {step}");
                    }
                }
            }
            for node in body.nodes.iter().filter(|node| node.count == 0) {
                for child in &body.nodes[node.first as usize..node.first as usize + 2] {
                    assert!(child.min.cmpge(node.min).all() && child.max.cmple(node.max).all(), "step {step}");
                }
            }
        }
    }
}

#[test]
fn what_hangs_on_nodes_that_stand_still_is_merged() {
    let mut scene = restir::scene::builtin::make("motion").unwrap();
    scene.rig.channels.retain(|channel| channel.node == scene.rig.instances[BOX].node);
    scene.rig.clips[0].channel_count = scene.rig.channels.len() as u32;
    let flat = flatten(&scene);
    assert_eq!((flat.rig.instances.len(), flat.deformers.list.len(), flat.instances.len()), (1, 0, 2));
    check_vectors(&scene, BOX, 0, [0.9, 1.0]);
    scene.rig.channels.clear();
    scene.rig.clips.clear();
    let flat = flatten(&scene);
    assert!(!flat.has_top_level() && flat.rig.instances.is_empty());
}
