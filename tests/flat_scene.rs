//! Flattening, seen from outside: geometry against brute force, built-in scenes, bytes and hostile bytes.

use glam::{Mat4, Vec2, Vec3, Vec3A, Vec4};
use obvhs::bvh2::Bvh2;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use obvhs::ray::{Ray, RayHit};
use restir::Error;
use restir::scene::gpu_types::{
    BITANGENT_SHIFT, LIGHT_ENVIRONMENT, NONE, TRIANGLE_DOUBLE_SIDED, TRIANGLE_TANGENTS, Triangle,
};
use restir::scene::intersect::{Hit, intersect_cpu, intersect_triangle};
use restir::scene::random::Random;
use restir::scene::{
    Camera, Environment, FlatScene, Instance, Material, Mesh, PunctualKind, PunctualLight, Scene, Texture, TextureRef,
    Wrap, builtin, octahedral, shapes,
};

fn flatten(scene: &Scene) -> FlatScene {
    FlatScene::build(scene, &mut |_, _| ()).expect("a sound scene")
}

/// Where a fault must be found, and how to plant it.
type Fault<T> = (&'static str, fn(&mut T));

fn scene_of(meshes: Vec<(Mesh, Mat4)>) -> Scene {
    let mut scene = Scene { materials: vec![Material::default()], ..Scene::default() };
    for (i, (mesh, transform)) in meshes.into_iter().enumerate() {
        scene.meshes.push(mesh);
        scene.instances.push(Instance { mesh: i as u32, transform });
    }
    scene
}

/// `count` triangles of all sizes, every third double-sided.
fn soup(count: u32, seed: u64) -> Scene {
    let mut random = Random::new(seed);
    let mut meshes = [Mesh::default(), Mesh { material: 1, ..Mesh::default() }];
    for i in 0..count {
        let center = random.in_box(Vec3::NEG_ONE, Vec3::ONE);
        let size = 1.2 * random.unit().powi(3) + 1e-2;
        let mesh = &mut meshes[usize::from(i % 3 == 0)];
        let base = mesh.positions.len() as u32;
        mesh.positions.extend([0; 3].map(|_| center + size * random.direction()));
        mesh.indices.extend([base, base + 1, base + 2]);
    }
    let mut scene = scene_of(meshes.map(|mesh| (mesh, Mat4::IDENTITY)).to_vec());
    scene.materials.push(Material { double_sided: true, ..Material::default() });
    scene
}

fn brute_force(scene: &FlatScene, origin: Vec3, direction: Vec3, t_max: f32) -> Option<Hit> {
    let mut closest: Option<Hit> = None;
    for (triangle, i) in scene.triangles.iter().zip(0..) {
        let limit = closest.map_or(t_max, |hit| hit.t);
        if let Some((t, u, v)) = intersect_triangle(triangle, origin, direction, limit) {
            closest = Some(Hit { t, triangle: i, u, v, instance: 0 });
        }
    }
    closest
}

#[test]
fn closest_hits_equal_brute_force() {
    let mut hits = 0;
    for (seed, count) in [(1, 1), (2, 7), (3, 300), (4, 3000)] {
        let flat = flatten(&soup(count, seed));
        let mut random = Random::new(seed + 100);
        for i in 0..1500 {
            let origin = random.in_box(Vec3::splat(-1.5), Vec3::splat(1.5));
            // Some rays along the axes, where slabs are parallel to the ray.
            let direction = if i % 10 == 0 { [Vec3::X, Vec3::NEG_Y, Vec3::Z][i / 10 % 3] } else { random.direction() };
            let t_max = if i % 4 == 0 { random.unit() } else { f32::MAX };
            let found = intersect_cpu(&flat, origin, direction, t_max);
            let expected = brute_force(&flat, origin, direction, t_max);
            assert_eq!(found.map(|h| h.t), expected.map(|h| h.t), "{origin} {direction}");
            hits += u32::from(found.is_some());
        }
    }
    assert!(hits > 1000, "{hits} hits test little");
}

/// obvhs's own tree over the same triangles, walked and intersected by obvhs.
fn obvhs_closest(tree: &Bvh2, triangles: &[obvhs::triangle::Triangle], origin: Vec3, direction: Vec3) -> Option<f32> {
    let mut hit = RayHit::none();
    let ray = Ray::new_inf(origin.into(), direction.into());
    let triangle = |i: usize| &triangles[tree.primitive_indices[i] as usize];
    tree.ray_traverse(ray, &mut hit, |ray, i| triangle(i).intersect(ray));
    hit.t.is_finite().then_some(hit.t)
}

#[test]
fn closest_hits_equal_those_of_obvhs() {
    let mut scene = soup(20_000, 5);
    scene.materials[0].double_sided = true;
    let flat = flatten(&scene);
    let corners = |t: &Triangle| [t.p0, t.p1, t.p2].map(Vec3A::from);
    let triangles: Vec<_> =
        flat.triangles.iter().map(corners).map(|[v0, v1, v2]| obvhs::triangle::Triangle { v0, v1, v2 }).collect();
    let boxes: Vec<_> = triangles.iter().map(obvhs::triangle::Triangle::aabb).collect();
    let indices = (0..boxes.len() as u32).collect();
    let tree = PlocBuilder::new().build(PlocSearchDistance::Low, &boxes, indices, SortPrecision::U64, 0);

    let mut random = Random::new(6);
    let (mut hits, mut mismatches) = (0, 0);
    for i in 0..20_000 {
        let (origin, direction) = (random.in_box(Vec3::splat(-2.0), Vec3::splat(2.0)), random.direction());
        let found = intersect_cpu(&flat, origin, direction, f32::MAX).map(|hit| hit.t);
        let expected = obvhs_closest(&tree, &triangles, origin, direction);
        if i % 20 == 0 {
            assert_eq!(found, brute_force(&flat, origin, direction, f32::MAX).map(|hit| hit.t), "{origin} {direction}");
        }
        hits += u32::from(found.is_some());
        mismatches += u32::from(match (found, expected) {
            (Some(a), Some(b)) => (a - b).abs() > 1e-4 * a.max(0.1),
            (a, b) => a.is_some() != b.is_some(),
        });
    }
    // The two round differently: a ray through an edge may go either way.
    assert!(mismatches <= 2, "{mismatches} of {hits}");
    assert!(hits > 5000 && hits < 20_000, "{hits} hits test little");
}

#[test]
fn backs_are_culled_unless_double_sided() {
    let mut scene = scene_of(vec![(shapes::parallelogram(Vec3::ZERO, Vec3::X, Vec3::Y, 0), Mat4::IDENTITY)]);
    let at = Vec3::new(0.4, 0.3, 0.0);
    let hit = |scene: &Scene, z: f32| intersect_cpu(&flatten(scene), at + Vec3::Z * z, Vec3::NEG_Z * z.signum(), 9.0);
    assert_eq!(hit(&scene, 2.0).map(|h| h.t), Some(2.0));
    assert_eq!(hit(&scene, -2.0), None);
    scene.materials[0].double_sided = true;
    assert_eq!(hit(&scene, -2.0).map(|h| h.t), Some(2.0));
    assert_eq!(flatten(&scene).triangles[0].flags & TRIANGLE_DOUBLE_SIDED, TRIANGLE_DOUBLE_SIDED);
}

/// A parallelogram in the XY plane with tangents along X, bitangents along Y.
fn mapped() -> Mesh {
    Mesh { tangents: vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 4], ..shapes::parallelogram(Vec3::ZERO, Vec3::X, Vec3::Y, 0) }
}

#[test]
fn mirrored_instances_keep_their_front_and_bitangent() {
    for scale in [Vec3::ONE, Vec3::new(-1.0, 1.0, 1.0), Vec3::new(1.0, 1.0, -1.0), Vec3::new(-2.0, -0.5, -3.0)] {
        let transform = Mat4::from_rotation_y(0.4) * Mat4::from_scale(scale);
        let flat = flatten(&scene_of(vec![(mapped(), transform)]));
        let front = transform.inverse().transpose().transform_vector3(Vec3::Z).normalize();
        for (triangle, attributes) in flat.triangles.iter().zip(&flat.attributes) {
            let face = (triangle.p1 - triangle.p0).cross(triangle.p2 - triangle.p0).normalize();
            assert!(face.distance(front) < 1e-5, "{scale}");
            assert_eq!(triangle.flags & TRIANGLE_TANGENTS, TRIANGLE_TANGENTS);
            let normal = octahedral::unpack(attributes.normals[1]);
            assert!(normal.distance(front) < 1e-3);
            let (b1, b2) = octahedral::orthonormal_basis(normal);
            let (sin, cos) = ((attributes.tangents_01 >> 16) as f32 / 65536.0 * std::f32::consts::TAU).sin_cos();
            let tangent = b1 * cos + b2 * sin;
            assert!(tangent.distance(transform.transform_vector3(Vec3::X).normalize()) < 1e-3);
            let sign = if attributes.tangent_2 >> (BITANGENT_SHIFT + 1) & 1 == 1 { -1.0 } else { 1.0 };
            let bitangent = sign * normal.cross(tangent);
            assert!(bitangent.distance(transform.transform_vector3(Vec3::Y).normalize()) < 1e-3, "{scale}");
        }
    }
}

#[test]
fn normals_follow_the_inverse_transpose() {
    let mesh = shapes::sphere(Vec3::ZERO, 1.0, 16, 0);
    let transform = Mat4::from_scale(Vec3::new(1.0, 4.0, 0.5));
    let flat = flatten(&scene_of(vec![(mesh, transform)]));
    for (triangle, attributes) in flat.triangles.iter().zip(&flat.attributes) {
        // The gradient of the ellipsoid.
        let expected = (triangle.p0 / Vec3::new(1.0, 16.0, 0.25)).normalize();
        assert!(octahedral::unpack(attributes.normals[0]).distance(expected) < 1e-3);
    }
}

#[test]
fn corners_keep_their_attributes_in_a_mirror() {
    let mesh = Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        uvs: [vec![Vec2::ZERO, Vec2::X, Vec2::Y], vec![Vec2::splat(3.0), Vec2::splat(4.0), Vec2::splat(5.0)]],
        colors: vec![Vec4::ZERO, Vec4::new(1.0, 0.5, 0.0, 1.0), Vec4::splat(9.0)],
        indices: vec![0, 1, 2],
        ..Mesh::default()
    };
    let flat = flatten(&scene_of(vec![(mesh, Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0)))]));
    let (triangle, attributes) = (flat.triangles[0], flat.attributes[0]);
    assert_eq!((triangle.p1, triangle.p2), (Vec3::Y, Vec3::NEG_X));
    assert_eq!(attributes.uv_a, Vec4::new(0.0, 0.0, 0.0, 1.0));
    assert_eq!(attributes.uv_b, Vec4::new(1.0, 0.0, 3.0, 3.0));
    assert_eq!(attributes.uv_c, Vec4::new(5.0, 5.0, 4.0, 4.0));
    assert_eq!(attributes.colors, [0, u32::MAX, 0xff00_80ff]);
    assert!(octahedral::unpack(attributes.normals[0]).distance(Vec3::Z) < 1e-4, "missing normals are the face's");
}

#[test]
fn useless_triangles_are_dropped_and_counted() {
    let mesh = Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::NAN, Vec3::splat(1e30), Vec3::X * 2.0],
        normals: vec![Vec3::ZERO; 6],
        indices: vec![0, 1, 2, 0, 1, 3, 0, 1, 4, 0, 1, 5, 1, 1, 2],
        ..Mesh::default()
    };
    let flat = flatten(&scene_of(vec![(mesh, Mat4::IDENTITY)]));
    assert_eq!((flat.triangles.len(), flat.stats.dropped_triangles, flat.warnings.len()), (1, 4, 1));
    assert!(octahedral::unpack(flat.attributes[0].normals[0]).distance(Vec3::Z) < 1e-4, "zero normals are the face's");
}

#[test]
fn an_empty_scene_is_a_point_that_nothing_hits() {
    let flat = flatten(&Scene::default());
    assert_eq!((flat.nodes.len(), flat.nodes[0].count, flat.triangles.len()), (1, 1, 1));
    assert_eq!(flat.stats.triangles, 0, "the point is no triangle of the scene");
    assert!(flat.lights.is_empty() && flat.environment.is_none());
    assert_eq!(intersect_cpu(&flat, Vec3::Z, Vec3::NEG_Z, 9.0), None);
    assert!(flat.bounds.iter().all(|corner| corner.is_finite()));
    assert_eq!(flat.cameras.len(), 1);
    assert!(flat.cameras[0].position.is_finite());
    FlatScene::from_bytes(&flat.to_bytes()).expect("sound");
}

#[test]
fn bad_scenes_are_errors_with_a_name() {
    let sound = || scene_of(vec![(mapped(), Mat4::IDENTITY)]);
    let faults: [Fault<Scene>; 9] = [
        ("instance 0", |scene| scene.instances[0].mesh = 1),
        ("mesh 0", |scene| scene.meshes[0].indices[2] = 4),
        ("mesh 0", |scene| scene.meshes[0].indices.truncate(5)),
        ("mesh 0", |scene| scene.meshes[0].material = 1),
        ("mesh 0", |scene| scene.meshes[0].normals.truncate(3)),
        ("mesh 0", |scene| scene.meshes[0].uvs[1] = vec![Vec2::ZERO]),
        ("material 0 ''", |scene| scene.materials[0].roughness = f32::NAN),
        ("light 0", |scene| scene.lights.push(point(Vec3::splat(f32::NAN), 1.0))),
        ("environment", |scene| scene.environment = Some(Environment { width: 2, height: 2, pixels: Vec::new() })),
    ];
    for (place, spoil) in faults {
        let mut scene = sound();
        spoil(&mut scene);
        match FlatScene::build(&scene, &mut |_, _| ()) {
            Err(Error::BadValue { name, .. }) => assert_eq!(name, place),
            other => panic!("{place}: {:?}", other.map(|flat| flat.stats)),
        }
    }
    let mut huge = sound();
    huge.instances = vec![huge.instances[0]; 10_000_000];
    assert!(matches!(FlatScene::build(&huge, &mut |_, _| ()), Err(Error::Limit { .. })));
}

fn point(position: Vec3, intensity: f32) -> PunctualLight {
    PunctualLight {
        kind: PunctualKind::Point,
        position,
        direction: Vec3::NEG_Z,
        intensity: Vec3::splat(intensity),
        range: f32::INFINITY,
    }
}

#[test]
fn lights_are_weighed_and_found_from_their_triangles() {
    let mut scene = scene_of(vec![
        (shapes::parallelogram(Vec3::ZERO, Vec3::X, Vec3::Y, 1), Mat4::IDENTITY),
        (shapes::parallelogram(Vec3::ZERO, Vec3::X, Vec3::Y, 0), Mat4::IDENTITY),
        (shapes::parallelogram(Vec3::ZERO, Vec3::X, Vec3::Y, 1), Mat4::from_scale(Vec3::splat(2.0))),
    ]);
    scene.materials.push(Material { emissive: Vec3::splat(2.0), ..Material::default() });
    scene.lights = vec![point(Vec3::ONE, 4.0), point(Vec3::X, 0.0)];
    scene.environment = Some(Environment::even(Vec3::ONE));
    let flat = flatten(&scene);
    assert_eq!((flat.lights.len(), flat.first_punctual, flat.stats.emissive_triangles), (7, 4, 4));
    for (triangle, i) in flat.triangles.iter().zip(0..) {
        assert_eq!(triangle.light != NONE, triangle.material == 1);
        if let Some(light) = flat.lights.get(triangle.light as usize) {
            assert_eq!(light.triangle, i);
            // Weights: two triangles of 1, two of 4, a point of 4, all that again for the sky.
            let area = 0.5 * (triangle.p1 - triangle.p0).cross(triangle.p2 - triangle.p0).length();
            assert!((light.pmf - 2.0 * area / 28.0).abs() < 1e-6);
        }
    }
    assert!((flat.lights[4].pmf - 4.0 / 28.0).abs() < 1e-6);
    assert_eq!((flat.lights[5].pmf, flat.lights[5].alias_threshold), (0.0, 0.0));
    assert_eq!(flat.lights[4].range, 0.0);
    assert_eq!((flat.lights[6].kind, flat.lights[6].pmf), (LIGHT_ENVIRONMENT, 0.5));
}

#[test]
fn builtin_scenes_flatten_with_lights() {
    for info in builtin::ALL {
        assert!(info.example.starts_with(info.name));
        let scene = builtin::make(info.example).expect("a known name");
        let flat = flatten(&scene);
        assert!(!flat.lights.is_empty() && flat.warnings.is_empty(), "{}: {:?}", info.name, flat.warnings);
        assert!(flat.stats.dropped_triangles == 0 && flat.stats.bvh_depth <= 60, "{}", info.name);
        assert!(flat.bounds.iter().all(|corner| corner.is_finite()));
        assert!((flat.lights.iter().map(|light| f64::from(light.pmf)).sum::<f64>() - 1.0).abs() < 1e-5);
        assert_eq!(FlatScene::from_bytes(&flat.to_bytes()).expect("sound"), flat, "{}", info.name);
        assert!(sees_something(&flat), "{}", info.name);
    }
    assert!(matches!(builtin::make("teapot"), Err(Error::Unknown { .. })));
    assert!(matches!(builtin::make("many-lights"), Err(Error::BadValue { .. })));
}

/// Whether most of nine rays through camera 0's picture hit a front: the middle one may end in the sky at the end of a street.
fn sees_something(flat: &FlatScene) -> bool {
    let Camera { position, forward, up, .. } = &flat.cameras[0];
    let right = forward.cross(*up);
    let offsets = [-0.2, 0.0, 0.2];
    let rays = offsets.iter().flat_map(|x| offsets.map(|y| *forward + right * *x + *up * y));
    rays.filter(|ray| intersect_cpu(flat, *position, ray.normalize(), f32::MAX).is_some()).count() > 4
}

#[test]
fn a_million_lights_fit() {
    let scene = builtin::make("many-lights:1000000").expect("in range");
    let start = std::time::Instant::now();
    let flat = flatten(&scene);
    assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
    assert_eq!(flat.stats.emissive_triangles, 1_000_000);
    for bytes in [size_of_val(&flat.triangles[..]), size_of_val(&flat.nodes[..]), size_of_val(&flat.lights[..])] {
        assert!(bytes <= 128 << 20, "{bytes}");
    }
}

/// Something of everything: textures, environment, revolving lights, double-sided and masked materials.
fn rich() -> FlatScene {
    let mut scene = builtin::make("cornell-64").expect("known");
    scene.textures.push(Texture {
        name: "checker".into(),
        width: 2,
        height: 2,
        pixels: std::sync::Arc::new((0..16).collect()),
        wrap: [Wrap::Repeat; 2],
        linear_filter: false,
    });
    let texture = TextureRef { texture: 0, uv_set: 0, offset: Vec2::ZERO, rotation: 0.0, scale: Vec2::ONE };
    scene.materials[0].base_color_texture = Some(texture);
    scene.environment = Some(Environment { width: 4, height: 2, pixels: vec![[0.5, 1.0, 2.0]; 8] });
    scene.warnings.push("a \"warning\"".into());
    flatten(&scene)
}

#[test]
fn bytes_round_trip() {
    let flat = rich();
    let bytes = flat.to_bytes();
    assert_eq!(FlatScene::from_bytes(&bytes).expect("sound"), flat);
    // Bytes that do not begin at an aligned address.
    let shifted = [&[0u8][..], &bytes].concat();
    assert_eq!(FlatScene::from_bytes(&shifted[1..]).expect("sound"), flat);
}

#[test]
fn truncated_or_longer_bytes_are_errors() {
    let bytes = rich().to_bytes();
    for length in (0..bytes.len()).step_by(7).chain(bytes.len() - 40..bytes.len()) {
        assert!(matches!(FlatScene::from_bytes(&bytes[..length]), Err(Error::BadFile { .. })), "{length}");
    }
    assert!(FlatScene::from_bytes(&[&bytes[..], &[0]].concat()).is_err());
}

#[test]
fn mutated_bytes_never_panic_and_what_passes_can_be_traced() {
    let bytes = rich().to_bytes();
    let mut random = Random::new(11);
    let mut refused = 0;
    for _ in 0..4000 {
        let mut mutated = bytes.clone();
        for _ in 0..1 + random.next_u32() % 4 {
            let at = random.next_u32() as usize % mutated.len();
            mutated[at] = random.next_u32() as u8;
        }
        match FlatScene::from_bytes(&mutated) {
            Err(Error::BadFile { .. }) => refused += 1,
            Err(other) => panic!("{other}"),
            Ok(flat) => {
                let _ = intersect_cpu(&flat, Vec3::new(0.0, 0.5, 0.0), random.direction(), f32::MAX);
            }
        }
    }
    assert!(refused > 1000, "{refused}");
}

#[test]
fn planted_faults_are_found() {
    let sound = rich();
    let faults: [Fault<FlatScene>; 20] = [
        ("nodes[0]", |flat| flat.nodes[0].first = 0),
        ("nodes[0]", |flat| flat.nodes[0].first = flat.nodes.len() as u32 - 1),
        ("nodes[0]", |flat| (flat.nodes[0].first, flat.nodes[0].count) = (0, u32::MAX)),
        ("nodes[0]", |flat| flat.nodes[0].min.x = f32::NAN),
        ("meshes[0]", |flat| flat.nodes.clear()),
        ("meshes", |flat| flat.meshes.clear()),
        ("instances", |flat| flat.instances.clear()),
        ("instances[0]", |flat| flat.instances[0].mesh = 1),
        ("instances[0]", |flat| flat.instances[0].transform.x_axis.x = f32::NAN),
        ("attributes", |flat| flat.attributes.truncate(2)),
        ("attributes[2]", |flat| flat.attributes[2].uv_b.x = f32::INFINITY),
        ("triangles[3]", |flat| flat.triangles[3].material = 4),
        ("triangles[3]", |flat| flat.triangles[3].light = 1000),
        ("triangles[3]", |flat| flat.triangles[3].p1.y = f32::INFINITY),
        ("materials[0]", |flat| flat.materials[0].base_color_texture.place |= 1 << 20),
        ("lights[0]", |flat| flat.lights[0].alias_light = 1000),
        ("lights[9]", |flat| flat.lights[9].kind = 9),
        ("rig.lights[2]", |flat| flat.rig.lights[2].target = 66),
        ("environment", |flat| flat.environment.as_mut().expect("there").alias[0][1] = 8),
        ("scene", |flat| flat.cameras.clear()),
    ];
    for (expected, spoil) in faults {
        let mut flat = sound.clone();
        spoil(&mut flat);
        match FlatScene::from_bytes(&flat.to_bytes()) {
            Err(Error::BadFile { place, .. }) => assert_eq!(place, expected),
            other => panic!("{expected}: {:?}", other.map(|flat| flat.stats)),
        }
    }
}

#[test]
fn progress_is_told_in_order_and_not_too_often() {
    let mut scene = builtin::make("cornell").expect("a built-in scene");
    let instance = scene.instances[0];
    scene.instances.extend(vec![instance; 5000]);
    let mut told = Vec::new();
    FlatScene::build(&scene, &mut |fraction, _| told.push(fraction)).expect("a sound scene");
    assert!((50..=110).contains(&told.len()), "{}", told.len());
    assert!(told.is_sorted() && told.last() == Some(&1.0), "{told:?}");
}
