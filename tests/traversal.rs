//! `traverse` finds what the CPU finds: the same BVH walked on the CPU, and brute force over all triangles. Rays through
//! edges may go either way; they are counted, printed, and must be fewer than one in a hundred thousand or two.

mod support;

use glam::{Mat4, Vec2, Vec3, Vec4};
use restir::Gpu;
use restir::gpu::shader::table;
use restir::scene::bvh;
use restir::scene::gpu_types::TRIANGLE_ALPHA_MASK;
use restir::scene::intersect::{Hit, intersect_cpu, intersect_triangle};
use restir::scene::random::Random;
use restir::scene::{AlphaMode, FlatScene, Instance, Material, Mesh, Scene, Shape, Texture, TextureRef, Wrap, shapes};
use std::f32::consts::FRAC_PI_2;
use std::sync::Arc;
use support::harness::{TestInput, eval_gpu};
use support::{builtin, flatten};

/// Farther than anything.
const FAR: f32 = 3e38;
/// Relative difference of distances that rounding explains.
const TOLERANCE: f32 = 1e-5;
/// Mismatches that are always allowed, however few the rays.
const ALLOWED: usize = 2;

#[derive(Debug, Clone, Copy)]
struct Ray {
    origin: Vec3,
    direction: Vec3,
    t_max: f32,
}

impl Ray {
    fn new(origin: Vec3, direction: Vec3) -> Self {
        Ray { origin, direction, t_max: FAR }
    }
}

/// What the shader finds, closest or any: the kernel that this adapter runs, after that for GPUs has found the same.
fn traverse(scene: &FlatScene, rays: &[Ray], any_hit: bool) -> Vec<Option<Hit>> {
    let own = traverse_on(&support::gpu(), scene, rays, any_hit);
    let for_gpus = traverse_on(&support::gpu().posing_as_hardware(), scene, rays, any_hit);
    let is_same = |(a, b): &(&Option<Hit>, &Option<Hit>)| match (a, b) {
        (Some(a), Some(b)) => any_hit || (a.t - b.t).abs() <= TOLERANCE * a.t,
        (None, None) => true,
        _ => false,
    };
    let others = own.iter().zip(&for_gpus).filter(|pair| !is_same(pair)).count();
    assert!(others <= ALLOWED + rays.len() / 100_000, "{others} of {} rays end elsewhere on a GPU", rays.len());
    own
}

fn traverse_on(gpu: &Gpu, scene: &FlatScene, rays: &[Ray], any_hit: bool) -> Vec<Option<Hit>> {
    let inputs: Vec<_> = rays
        .iter()
        .map(|r| {
            let bits = |v: Vec4| v.to_array().map(f32::to_bits);
            TestInput::new(&[bits(r.origin.extend(r.t_max)), bits(r.direction.extend(0.0)), [any_hit.into(), 0, 0, 0]])
        })
        .collect();
    eval_gpu(gpu, &table::TESTS_TRAVERSE, Some(scene), 0, &inputs)
        .iter()
        .zip(rays)
        .map(|(output, ray)| {
            let [t, _, u, v] = output.a();
            if output.a[1] == u32::MAX {
                assert_eq!(t, ray.t_max, "a miss says t_max");
                return None;
            }
            let is_triangle = scene.triangles[output.a[1] as usize].shape() == Shape::Triangles;
            let is_within = !is_triangle || (u >= 0.0 && v >= 0.0 && u + v <= 1.0);
            assert!(t > 0.0 && t < ray.t_max && is_within, "{ray:?}: {t} {u} {v}");
            Some(Hit { t, triangle: output.a[1], u, v, instance: output.b[0] })
        })
        .collect()
}

fn brute_force(scene: &FlatScene, ray: &Ray, exists: &dyn Fn(u32, Vec2) -> bool) -> Option<Hit> {
    let mut closest: Option<Hit> = None;
    for (placed, instance) in scene.instances.iter().zip(0..) {
        let mesh = &scene.meshes[placed.mesh as usize];
        let to_object = placed.transform.inverse();
        let (origin, direction) = (to_object.transform_point3(ray.origin), to_object.transform_vector3(ray.direction));
        for i in mesh.first_triangle..mesh.first_triangle + mesh.triangles {
            let limit = closest.map_or(ray.t_max, |h| h.t);
            if let Some((t, u, v)) = intersect_triangle(&scene.triangles[i as usize], origin, direction, limit)
                && exists(i, Vec2::new(u, v))
            {
                closest = Some(Hit { t, triangle: i, u, v, instance });
            }
        }
    }
    closest
}

/// Whether two answers are the same but for rounding: the same triangle, or another at the same distance.
fn agree(a: &Option<Hit>, b: &Option<Hit>) -> bool {
    match (a, b) {
        (None, None) => true,
        (Some(a), Some(b)) => (a.t - b.t).abs() <= TOLERANCE * a.t.abs().max(1e-3),
        _ => false,
    }
}

/// Compares the closest hits with the CPU's, any hits with the closest, and some of both with brute force.
fn check(name: &str, scene: &FlatScene, rays: &[Ray]) {
    let closest = traverse(scene, rays, false);
    let any = traverse(scene, rays, true);
    let hits = closest.iter().flatten().count();
    let mut mismatches = 0;
    for ((ray, closest), any) in rays.iter().zip(&closest).zip(&any) {
        assert_eq!(any.is_some(), closest.is_some(), "{name}: any hit and closest hit differ for {ray:?}");
        let cpu = intersect_cpu(scene, ray.origin, ray.direction, ray.t_max);
        mismatches += usize::from(!agree(closest, &cpu));
    }
    let every = (rays.len() * scene.stats.placed_triangles as usize).div_ceil(4_000_000).max(1);
    let mut brute_mismatches = 0;
    for (ray, closest) in rays.iter().zip(&closest).step_by(every) {
        let expected = brute_force(scene, ray, &|_, _| true);
        brute_mismatches += usize::from(!agree(closest, &expected));
    }
    let allowed = ALLOWED.max(rays.len() / 100_000);
    println!(
        "{name}: {} rays, {hits} hits, mismatches {mismatches} (BVH), {brute_mismatches} (brute force)",
        rays.len()
    );
    assert!(mismatches <= allowed && brute_mismatches <= allowed, "{name}");
    assert!(hits > rays.len() / 20 && hits <= rays.len(), "{name}: {hits} hits test little");
}

/// Rays from in and around a scene's box, half of them aimed at triangles.
fn rays_of(scene: &FlatScene, count: usize, seed: u64) -> Vec<Ray> {
    let mut random = Random::new(seed);
    let [low, high] = scene.bounds;
    let margin = 0.3 * (high - low);
    (0..count)
        .map(|i| {
            let origin = random.in_box(low - margin, high + margin);
            let mut direction = random.direction();
            if i % 2 == 0 {
                let placed = &scene.instances[random.next_u32() as usize % scene.instances.len()];
                let mesh = &scene.meshes[placed.mesh as usize];
                let triangle = &scene.triangles[(mesh.first_triangle + random.next_u32() % mesh.triangles) as usize];
                let (u, v) = (random.unit(), random.unit());
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                let target = triangle.p0 + u * (triangle.p1 - triangle.p0) + v * (triangle.p2 - triangle.p0);
                direction = (placed.transform.transform_point3(target) - origin).normalize_or(Vec3::Z);
            }
            // Every third ray is cut short somewhere.
            let t_max = if i % 3 == 0 { random.unit() * (high - low).length() } else { FAR };
            Ray { origin, direction, t_max }
        })
        .collect()
}

fn scene_of(mesh: Mesh, material: Material) -> Scene {
    Scene {
        meshes: vec![mesh],
        instances: vec![Instance { mesh: 0, transform: Mat4::IDENTITY }],
        materials: vec![material],
        ..Scene::default()
    }
}

/// A soup of single triangles whose corners are made by `corner` round random centres.
fn soup(count: u32, seed: u64, double_sided: bool, corner: impl Fn(&mut Random, f32) -> Vec3) -> FlatScene {
    let mut random = Random::new(seed);
    let mut mesh = Mesh::default();
    for _ in 0..count {
        let center = random.in_box(Vec3::NEG_ONE, Vec3::ONE);
        let size = 0.4 * random.unit().powi(2) + 0.02;
        mesh.positions.extend((0..3).map(|_| center + corner(&mut random, size)));
    }
    mesh.normals = vec![Vec3::Y; mesh.positions.len()];
    mesh.indices = (0..3 * count).collect();
    flatten(&scene_of(mesh, Material { double_sided, ..Material::default() }))
}

/// The comparison can fail: one triangle of 300 moved a little is noticed.
#[test]
fn a_wrong_scene_is_noticed() {
    let scene = soup(300, 3, true, |random, size| random.direction() * size);
    let mut moved = scene.clone();
    moved.triangles[7].p0 += Vec3::splat(1e-2);
    let rays = rays_of(&scene, 20_000, 13);
    let found = traverse(&moved, &rays, false);
    let cpu = rays.iter().map(|r| intersect_cpu(&scene, r.origin, r.direction, r.t_max));
    let mismatches = found.iter().zip(cpu).filter(|(a, b)| !agree(a, b)).count();
    assert!(mismatches > ALLOWED, "{mismatches}");
}

#[test]
fn random_soups() {
    for (seed, count) in [(1, 1), (2, 7), (3, 300), (4, 5000)] {
        for double_sided in [true, false] {
            let scene = soup(count, seed, double_sided, |random, size| random.direction() * size);
            // A ray has to be aimed to meet a single triangle.
            check(&format!("soup of {count}"), &scene, &rays_of(&scene, 20_000, seed + 10));
        }
    }
}

#[test]
fn long_thin_triangles() {
    let scene = soup(2000, 5, true, |random, size| random.direction() * size * Vec3::new(5.0, 0.02, 0.02));
    check("needles along an axis", &scene, &rays_of(&scene, 20_000, 15));
    let scene = soup(2000, 6, true, |random, size| {
        (Vec3::new(1.0, 0.7, -0.4) * random.range(-3.0, 3.0) + 0.02 * random.direction()) * size
    });
    check("needles across", &scene, &rays_of(&scene, 20_000, 16));
}

/// 60 copies of a ball of 5000 triangles, stretched, turned and mirrored, share one bottom level; a floor is merged.
fn shared_balls() -> Scene {
    let mut random = Random::new(21);
    let ball = shapes::sphere(Vec3::ZERO, 1.0, 50, 0);
    let mut scene = scene_of(ball, Material::default());
    scene.meshes.push(shapes::parallelogram(Vec3::new(-30.0, -3.0, 30.0), Vec3::X * 60.0, Vec3::Z * -60.0, 0));
    scene.instances = vec![Instance { mesh: 1, transform: Mat4::IDENTITY }];
    for i in 0..60 {
        let mirror = if i % 3 == 0 { -1.0 } else { 1.0 };
        let size = Vec3::new(mirror * random.range(0.3, 1.5), random.range(0.3, 1.5), random.range(0.3, 1.5));
        let turn = glam::Quat::from_axis_angle(random.direction(), random.range(0.0, 6.0));
        let place = random.in_box(Vec3::new(-9.0, -2.0, -9.0), Vec3::new(9.0, 6.0, 9.0));
        scene.instances.push(Instance { mesh: 0, transform: Mat4::from_scale_rotation_translation(size, turn, place) });
    }
    scene
}

#[test]
fn instances_share_a_bottom_level() {
    let scene = flatten(&shared_balls());
    assert_eq!((scene.meshes.len(), scene.instances.len()), (2, 61), "the floor is merged, the balls are shared");
    assert!(scene.stats.placed_triangles > 50 * scene.stats.triangles / 2, "{:?}", scene.stats);
    check("instances", &scene, &rays_of(&scene, 20_000, 22));
}

#[test]
fn built_in_scenes() {
    for info in restir::scene::builtin::ALL {
        let scene = builtin(info.example);
        check(info.example, &scene, &rays_of(&scene, 10_000, 7));
    }
}

#[test]
fn rays_along_axes() {
    let scene = builtin("cornell");
    let mut random = Random::new(8);
    let mut rays = Vec::new();
    for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
        for direction in [axis, -axis] {
            for _ in 0..2000 {
                rays.push(Ray::new(random.in_box(Vec3::new(-0.6, -0.1, -0.6), Vec3::new(0.6, 1.1, 0.6)), direction));
            }
        }
    }
    // One component zero.
    for _ in 0..4000 {
        let mut direction = random.direction();
        direction[random.next_u32() as usize % 3] = 0.0;
        rays.push(Ray::new(random.in_box(Vec3::new(-0.4, 0.1, -0.4), Vec3::new(0.4, 0.9, 0.4)), direction.normalize()));
    }
    check("rays along axes and planes", &scene, &rays);
    // Negative zeros are zeros.
    let signed = Ray::new(Vec3::new(0.1, 0.5, 0.1), Vec3::new(-0.0, -1.0, -0.0));
    let plain = Ray { direction: Vec3::NEG_Y, ..signed };
    let hits = traverse(&scene, &[signed, plain], false);
    assert!(hits[0].is_some() && hits[0] == hits[1], "{hits:?}");
}

#[test]
fn grazing_rays() {
    let scene = builtin("cornell");
    let mut random = Random::new(9);
    // From just above the floor, almost along it, and along it exactly.
    let rays: Vec<Ray> = (0..20_000)
        .map(|i| {
            let height = [1e-3, 1e-5, 0.01][i % 3];
            let origin = Vec3::new(random.range(-0.45, 0.45), height, random.range(-0.45, 0.45));
            let slope = if i % 4 == 0 { 0.0 } else { random.range(-1e-2, 1e-3) };
            let across = Vec2::from_angle(random.range(0.0, 4.0 * FRAC_PI_2));
            Ray::new(origin, Vec3::new(across.x, slope, across.y).normalize())
        })
        .collect();
    check("grazing rays", &scene, &rays);
    // Within the plane of a triangle there is nothing to hit.
    let floor = flatten(&scene_of(shapes::parallelogram(Vec3::ZERO, Vec3::Z, Vec3::X, 0), Material::default()));
    let within = Ray::new(Vec3::new(-1.0, 0.0, 0.3), Vec3::X);
    assert_eq!(traverse(&floor, &[within], false), [None]);
}

#[test]
fn backs_are_missed_unless_double_sided() {
    let quad = || shapes::parallelogram(Vec3::new(-1.0, 0.0, -1.0), Vec3::Z * 2.0, Vec3::X * 2.0, 0);
    let from_front = Ray::new(Vec3::new(0.2, 1.0, 0.1), Vec3::NEG_Y);
    let from_back = Ray::new(Vec3::new(0.2, -1.0, 0.1), Vec3::Y);
    for (double_sided, transform) in
        [(false, Mat4::IDENTITY), (true, Mat4::IDENTITY), (false, Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0)))]
    {
        let mut scene = scene_of(quad(), Material { double_sided, ..Material::default() });
        scene.instances[0].transform = transform;
        let hits = traverse(&flatten(&scene), &[from_front, from_back], false);
        assert!(hits[0].is_some_and(|h| (h.t - 1.0).abs() < 1e-6), "{hits:?}");
        assert_eq!(hits[1].is_some(), double_sided, "a mirrored instance keeps its front");
    }
}

#[test]
fn masked_holes_let_rays_through() {
    let (width, height) = (4u32, 4u32);
    // A chequerboard of alpha 1 and 0.25, read without filtering, cut at 0.5.
    let opaque = |x: u32, y: u32| (x + y).is_multiple_of(2);
    let alpha = |x, y| if opaque(x, y) { 255 } else { 64 };
    let pixels = (0..width * height).flat_map(|i| [255, 255, 255, alpha(i % width, i / width)]).collect();
    let reference = TextureRef { texture: 0, uv_set: 0, offset: Vec2::ZERO, rotation: 0.0, scale: Vec2::ONE };
    let texture = Texture {
        name: "chequers".into(),
        width,
        height,
        pixels: Arc::new(pixels),
        wrap: [Wrap::Repeat; 2],
        linear_filter: false,
    };
    let cut = Material {
        alpha: AlphaMode::Mask(0.5),
        double_sided: true,
        base_color_texture: Some(reference),
        ..Material::default()
    };
    let mut scene = scene_of(Mesh::default(), cut);
    scene.textures.push(texture);
    scene.meshes.clear();
    scene.instances.clear();
    // Sheets one behind the other, turned so that holes do not line up, and a solid wall behind them all.
    scene.materials.push(Material { double_sided: true, ..Material::default() });
    for layer in 0..5u32 {
        let z = -(layer as f32);
        let material = u32::from(layer == 4);
        scene.meshes.push(shapes::parallelogram(Vec3::new(-1.0, -1.0, z), Vec3::X * 2.0, Vec3::Y * 2.0, material));
        let turn = Mat4::from_rotation_z(0.4 * layer as f32);
        scene.instances.push(Instance { mesh: layer, transform: turn });
    }
    let flat = flatten(&scene);
    let uv_of = |triangle: u32, b: Vec2| {
        let t = &flat.attributes[triangle as usize];
        let uv = |x: f32, y: f32| Vec2::new(x, y);
        (1.0 - b.x - b.y) * uv(t.uv_a.x, t.uv_a.y) + b.x * uv(t.uv_a.z, t.uv_a.w) + b.y * uv(t.uv_b.x, t.uv_b.y)
    };
    let exists = |triangle: u32, b: Vec2| {
        let p = uv_of(triangle, b) * width as f32;
        let masked = flat.triangles[triangle as usize].flags & TRIANGLE_ALPHA_MASK != 0;
        !masked || opaque(p.x.rem_euclid(4.0) as u32, p.y.rem_euclid(4.0) as u32)
    };
    let mut random = Random::new(10);
    let rays: Vec<Ray> = (0..20_000)
        .map(|_| Ray::new(Vec3::new(random.range(-0.7, 0.7), random.range(-0.7, 0.7), 1.0), Vec3::NEG_Z))
        .collect();
    let (closest, any) = (traverse(&flat, &rays, false), traverse(&flat, &rays, true));
    let mut depths = [0; 5];
    let mut mismatches = 0;
    for ((ray, closest), any) in rays.iter().zip(&closest).zip(&any) {
        assert_eq!(closest.is_some(), any.is_some(), "{ray:?}");
        let expected = brute_force(&flat, ray, &exists);
        mismatches += usize::from(!agree(closest, &expected));
        if let Some(hit) = closest {
            depths[(hit.t - 1.0).round() as usize] += 1;
        }
    }
    println!("chequered sheets: hits by layer {depths:?}, mismatches {mismatches}");
    // The border of a texel is an edge, too, and there are many: one ray in a thousand.
    assert!(mismatches <= rays.len() / 1000, "{mismatches}");
    assert!(depths.iter().all(|n| *n > 100), "every layer is seen through the ones before: {depths:?}");
}

/// The traversal's stack is as deep as the builder's bound; a chain of boxes comes near it.
#[test]
fn deep_trees_lose_nothing() {
    let mut mesh = Mesh::default();
    for i in 0..400 {
        let size = 1.1f32.powi(i) * 1e-6;
        let z = -0.1 * size;
        mesh.positions.extend([Vec3::new(-size, -size, z), Vec3::new(size, -size, z), Vec3::new(0.0, size, z)]);
    }
    mesh.normals = vec![Vec3::Z; mesh.positions.len()];
    mesh.indices = (0..mesh.positions.len() as u32).collect();
    let scene = flatten(&scene_of(mesh, Material { double_sided: true, ..Material::default() }));
    println!("a chain of 400 boxes: {} deep, at most {}", scene.stats.bvh_depth, bvh::MAX_DEPTH);
    let mut random = Random::new(11);
    let rays: Vec<Ray> = (0..5000)
        .map(|_| {
            let scale = 1.1f32.powi(random.next_u32() as i32 % 200) * 1e-6;
            let origin = Vec3::new(random.range(-1.0, 1.0) * scale, random.range(-1.0, 1.0) * scale, scale);
            Ray::new(origin, (Vec3::NEG_Z + 0.3 * random.direction()).normalize())
        })
        .collect();
    check("a chain of boxes", &scene, &rays);
}

#[test]
fn a_scene_without_triangles_is_never_hit() {
    let scene = flatten(&Scene::default());
    let rays = [Ray::new(Vec3::Z, Vec3::NEG_Z), Ray::new(Vec3::ZERO, Vec3::X), Ray::new(Vec3::ONE, Vec3::NEG_ONE)];
    assert_eq!(traverse(&scene, &rays, false), [None; 3]);
    assert_eq!(traverse(&scene, &rays, true), [None; 3]);
}
