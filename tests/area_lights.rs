//! Spheres, rectangles and disks of light: a plate under each has the radiance that can be written down, rays and samples
//! agree on where they are, and files place them.

mod support;

use glam::{DVec3, Mat4, Quat, Vec3};
use restir::gpu::shader::table;
use restir::lab::mean;
use restir::scene::area_light::{AreaLight, Outline};
use restir::scene::intersect::intersect_cpu;
use restir::scene::random::Random;

use restir::scene::stage::Stage;
use restir::scene::{Camera, Scene, gltf};
use serde_json::json;
use std::f64::consts::{PI, TAU};
use support::gltf_writer::Writer;
use support::harness::{TestInput, eval_gpu, scene_functions};
use support::plate::{check_by, from_rectangle, materials, plate, scattered};
use support::statistics::{chi_squared, significance};
use support::{flatten, gpu, render, renderer};

const ALL: &[&str] = &["path-tracer", "ris", "restir-di"];

fn light(outline: Outline) -> AreaLight {
    AreaLight { outline, radiance: Vec3::new(6.0, 5.0, 4.0), double_sided: false }
}

/// Turns a light that shines along -Z so that it shines down.
fn down() -> Quat {
    Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2)
}

fn under(outline: Outline, transform: Mat4) -> Scene {
    let (material, _) = materials().remove(0);
    let mut scene = plate(material, 0.5);
    scene.add_area_light(&light(outline), transform).expect("a light");
    scene
}

/// The integral of f cos over directions to a cone round `axis` of half angle `radius`.
fn from_cone(axis: DVec3, radius: f64) -> DVec3 {
    let (_, brdf) = materials().remove(0);
    let frame = glam::DQuat::from_rotation_arc(DVec3::Z, axis.normalize());
    let (rings, sectors) = (300, 600);
    let mut sum = DVec3::ZERO;
    for i in 0..rings {
        let theta = radius * (f64::from(i) + 0.5) / f64::from(rings);
        for j in 0..sectors {
            let (sin, cos) = ((f64::from(j) + 0.5) / f64::from(sectors) * TAU).sin_cos();
            let wi = frame * DVec3::new(theta.sin() * cos, theta.sin() * sin, theta.cos());
            sum += scattered(&brdf, 0.5, wi) * theta.sin();
        }
    }
    sum * (radius / f64::from(rings)) * (TAU / f64::from(sectors))
}

/// Under a sphere, near and far, and where the horizon cuts it.
#[test]
fn under_a_sphere() {
    for (center, radius, techniques) in [
        (DVec3::new(-0.3, 0.8, 0.2), 0.25, ALL),
        (DVec3::new(-0.6, 0.75, 0.1), 0.7, &["ris"][..]),
        (DVec3::new(30.0, 40.0, -10.0), 0.5, &["ris"]),
        (DVec3::new(1.0, 0.1, 0.0), 0.4, &["path-tracer"]),
    ] {
        // Of the last the plate hides nothing: it lies under the surface where it is not seen.
        let scene = under(Outline::Sphere { radius: radius as f32 }, Mat4::from_translation(center.as_vec3()));
        let expected = from_cone(center, (radius / center.length()).asin()) * light_radiance();
        check_by(techniques, &scene, &[], expected, &format!("a sphere of {radius} at {center}"));
    }
}

fn light_radiance() -> DVec3 {
    DVec3::new(6.0, 5.0, 4.0)
}

#[test]
fn under_a_rectangle() {
    let (_, brdf) = materials().remove(0);
    for (center, width, height, techniques) in
        [(DVec3::new(-0.4, 0.9, 0.1), 0.6, 0.3, ALL), (DVec3::new(0.0, 0.3, 0.0), 1.5, 1.0, &["path-tracer"])]
    {
        let transform = Mat4::from_rotation_translation(down(), center.as_vec3());
        let scene = under(Outline::Rectangle { width: width as f32, height: height as f32 }, transform);
        let corner = center - DVec3::new(0.5 * width, 0.0, 0.5 * height);
        let expected = from_rectangle(&brdf, 0.5, corner, DVec3::X * width, DVec3::Z * height) * light_radiance();
        check_by(techniques, &scene, &[], expected, &format!("a rectangle of {width} x {height}"));
    }
}

/// A disk, and an ellipse that a matrix makes of it; above the plate's middle the irradiance of a disk is
/// pi L r^2 / (r^2 + h^2), which the quadrature has to give too.
#[test]
fn under_a_disk() {
    let (_, brdf) = materials().remove(0);
    for (center, radii, techniques) in
        [(DVec3::new(-0.3, 0.8, 0.2), [0.4, 0.4], ALL), (DVec3::new(0.2, 0.5, 0.1), [0.6, 0.2], &["path-tracer"])]
    {
        let scale = Vec3::new(1.0, (radii[1] / radii[0]) as f32, 1.0);
        let transform = Mat4::from_scale_rotation_translation(scale, down(), center.as_vec3());
        let scene = under(Outline::Disk { radius: radii[0] as f32 }, transform);
        let over_disk = |f: &dyn Fn(DVec3) -> DVec3, center: DVec3, radii: [f64; 2]| -> DVec3 {
            let (rings, sectors) = (200, 400);
            let mut sum = DVec3::ZERO;
            for i in 0..rings {
                let r = (f64::from(i) + 0.5) / f64::from(rings);
                for j in 0..sectors {
                    let (sin, cos) = ((f64::from(j) + 0.5) / f64::from(sectors) * TAU).sin_cos();
                    let p = center + DVec3::new(radii[0] * r * cos, 0.0, radii[1] * r * sin);
                    let wi = p.normalize();
                    sum += f(wi) * (wi.y / p.length_squared() * r);
                }
            }
            sum * radii[0] * radii[1] / f64::from(rings) * TAU / f64::from(sectors)
        };
        let (r, h) = (radii[0], center.y);
        let form_factor = over_disk(&|wi| DVec3::splat(wi.y), DVec3::Y * h, [r, r]).x;
        assert!((form_factor / (PI * r * r / (r * r + h * h)) - 1.0).abs() < 1e-3, "{form_factor}");
        let expected = over_disk(&|wi| scattered(&brdf, 0.5, wi), center, radii) * light_radiance();
        check_by(techniques, &scene, &[], expected, &format!("a disk of {radii:?}"));
    }
}

/// The camera sees each light as its outline, with its radiance, and nothing from behind a flat one.
#[test]
fn lights_are_seen() {
    let outlines = [
        (Outline::Sphere { radius: 0.5 }, PI * 0.25, PI * 0.25),
        (Outline::Rectangle { width: 1.0, height: 0.5 }, 0.5, 0.0),
        (Outline::Disk { radius: 0.5 }, PI * 0.25, 0.0),
    ];
    for (outline, front, back) in outlines {
        let mut scene = Scene::default();
        let turned = Mat4::from_rotation_translation(Quat::from_rotation_z(0.4), Vec3::new(3.0, -2.0, 1.0));
        scene.add_area_light(&light(outline), turned).expect("a light");
        for (side, area) in [(-5.0, front), (5.0, back)] {
            let eye = turned.transform_point3(Vec3::Z * side);
            let mut camera = Camera::look_at("eye", eye, turned.transform_point3(Vec3::ZERO), 1.0);
            camera.projection = restir::scene::Projection::Orthographic { half_height: 1.0 };
            scene.cameras = vec![camera];
            let mut renderer = renderer(&gpu(), flatten(&scene), [96, 96], "path-tracer", &[]);
            let image = render(&mut renderer, 4);
            let seen = image.pixels.iter().map(|p| f64::from(p[0])).sum::<f64>() / 6.0 * 4.0 / f64::from(96 * 96);
            assert!((seen - area).abs() < 0.01, "{outline:?} from {side}: {seen} m² shine, should be {area}");
        }
    }
}

/// What is sampled lies on the light where rays find it, with the density of the ray: for spheres drawn uniformly over
/// the cone that is seen.
#[test]
fn samples_lie_where_rays_hit() {
    const DRAWS: u32 = 20_000;
    let gpu = gpu();
    let turn = Mat4::from_scale_rotation_translation(
        Vec3::splat(0.8),
        Quat::from_rotation_x(0.6) * Quat::from_rotation_y(1.1),
        Vec3::new(0.4, 1.5, -0.3),
    );
    let position = Vec3::new(0.2, 0.1, 0.4);
    for outline in
        [Outline::Sphere { radius: 0.5 }, Outline::Rectangle { width: 1.0, height: 0.6 }, Outline::Disk { radius: 0.5 }]
    {
        let mut scene = Scene::default();
        let two_sided = AreaLight { double_sided: true, ..light(outline) };
        scene.add_area_light(&two_sided, turn).expect("a light");
        let scene = flatten(&scene);
        let eval = |operation, inputs: &[TestInput]| {
            eval_gpu(&gpu, &table::TESTS_SCENE_FUNCTIONS, Some(&scene), operation, inputs)
        };
        let at = position.extend(0.0).to_array().map(f32::to_bits);
        let inputs: Vec<_> = (0..DRAWS).map(|i| TestInput::new(&[[i & 0xffff, i >> 16, 5, 0], at])).collect();
        let samples = eval(scene_functions::LIGHT_SAMPLE, &inputs);
        let points: Vec<_> = samples.iter().map(|s| TestInput::new(&[at, [s.a[0], s.a[1], 0, 0]])).collect();
        let lit = eval(scene_functions::LIGHT_CONTRIBUTION, &points);
        let densities = eval(scene_functions::LIGHT_PDFS, &points);
        let mut counts = vec![0.0; 64];
        for ((contribution, densities), sample) in lit.iter().zip(&densities).zip(&samples) {
            let [x, y, z, jacobian] = contribution.b();
            let direction = Vec3::new(x, y, z);
            let hit = intersect_cpu(&scene, position, direction, f32::INFINITY);
            let [by_area, by_ray, ..] = densities.a();
            if jacobian <= 0.0 {
                // The rim of a sphere, which rounding puts on the other side.
                assert!(matches!(outline, Outline::Sphere { .. }), "{outline:?} is not seen");
                continue;
            }
            let grazing = by_area / jacobian < 1e-3 * by_ray;
            assert!(grazing || hit.is_some(), "{outline:?}: a sample at {direction} is not on the light");
            assert!(grazing || (by_area / by_ray - 1.0).abs() < 2e-2, "{outline:?}: {by_area} and {by_ray}");
            assert!((f32::from_bits(sample.a[2]) * jacobian / by_area - 1.0).abs() < 1e-4);
            if let Outline::Sphere { radius } = outline {
                let axis = (turn.transform_point3(Vec3::ZERO) - position).as_dvec3();
                let sin = f64::from(radius) * 0.8 / axis.length();
                let height = 1.0 - (1.0 - sin * sin).sqrt();
                let along = 1.0 - direction.as_dvec3().dot(axis.normalize());
                let frame = glam::DQuat::from_rotation_arc(axis.normalize(), DVec3::Z);
                let flat = frame * direction.as_dvec3();
                let sector = ((flat.y.atan2(flat.x) / TAU).rem_euclid(1.0) * 8.0) as usize;
                counts[((along / height * 8.0) as usize).min(7) * 8 + sector.min(7)] += 1.0;
            }
        }
        if matches!(outline, Outline::Sphere { .. }) {
            let n: f64 = counts.iter().sum();
            let p = chi_squared(&counts, &vec![n / 64.0; 64]);
            assert!(p > significance(1), "uniform over the cone: p = {p:e}");
            let rings: Vec<f64> = (0..64).map(|i| n / 64.0 * (0.8 + 0.05 * f64::from(i / 8))).collect();
            assert!(chi_squared(&counts, &rings) < significance(1), "a wrong density passed");
        }
    }
}

/// Rays through a crowd of all shapes: GPU traversal and brute force on the CPU find the same.
#[test]
fn rays_find_every_shape() {
    let mut random = Random::new(12);
    let mut scene = Scene::default();
    for i in 0..60 {
        let outline = match i % 3 {
            0 => Outline::Sphere { radius: 0.05 + 0.3 * random.unit() },
            1 => Outline::Rectangle { width: 0.1 + random.unit(), height: 0.1 + random.unit() },
            _ => Outline::Disk { radius: 0.1 + 0.5 * random.unit() },
        };
        let axis = random.in_box(Vec3::NEG_ONE, Vec3::ONE).normalize();
        let turn = Quat::from_axis_angle(axis, 6.0 * random.unit());
        let position = random.in_box(Vec3::splat(-2.0), Vec3::splat(2.0));
        let place = Mat4::from_rotation_translation(turn, position);
        scene.add_area_light(&light(outline), place).expect("a light");
    }
    let scene = flatten(&scene);
    let rays: Vec<(Vec3, Vec3)> = (0..4000)
        .map(|_| {
            let origin = random.in_box(Vec3::splat(-5.0), Vec3::splat(5.0));
            (origin, (random.in_box(Vec3::splat(-2.0), Vec3::splat(2.0)) - origin).normalize())
        })
        .collect();
    let inputs: Vec<_> = rays
        .iter()
        .map(|(origin, direction)| {
            TestInput::floats(&[origin.extend(100.0).to_array(), direction.extend(0.0).to_array()])
        })
        .collect();
    let found = eval_gpu(&gpu(), &table::TESTS_TRAVERSE, Some(&scene), 0, &inputs);
    let mut hits = [0; 4];
    for ((origin, direction), output) in rays.iter().zip(&found) {
        let brute = scene
            .triangles
            .iter()
            .zip(0u32..)
            .filter_map(|(triangle, i)| {
                let hit = restir::scene::intersect::intersect_triangle(triangle, *origin, *direction, 100.0)?;
                Some((hit.0, i))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let (t, triangle) = (f32::from_bits(output.a[0]), output.a[1]);
        match brute {
            None => assert_eq!(triangle, u32::MAX, "{origin} {direction}"),
            Some((expected, index)) => {
                assert!((t - expected).abs() < 1e-4, "{origin} {direction}: {t}, should be {expected}");
                assert_eq!(triangle, index);
                hits[scene.triangles[index as usize].shape() as usize] += 1;
            }
        }
    }
    assert!(hits[0] == 0 && hits[1..].iter().all(|&n| n > 100), "{hits:?}");
}

#[test]
fn files_place_area_lights() {
    let file = |light: serde_json::Value, scale: [f32; 3]| {
        let node =
            json!({"translation": [1, 2, 3], "scale": scale, "extras": {"restir_area_light": light, "other": 1}});
        Writer::new(json!({"scenes": [{"nodes": [0]}], "scene": 0, "nodes": [node]})).glb()
    };
    let load = |light, scale| gltf::load_bytes("light.glb", &file(light, scale), &mut |_| unreachable!());
    let sphere = json!({"type": "sphere", "radius": 0.5, "color": [1, 0.5, 0.25], "radiance": 8});
    let scene = flatten(&load(sphere.clone(), [2.0; 3]).expect("a scene"));
    assert_eq!((scene.triangles.len(), scene.lights.len()), (1, 1));
    let triangle = &scene.triangles[0];
    assert!((triangle.p0 - Vec3::new(1.0, 2.0, 3.0)).length() < 1e-6);
    assert!(((triangle.p1 - triangle.p0).length() - 1.0).abs() < 1e-6);
    assert_eq!(scene.materials[triangle.material as usize].emissive, Vec3::new(8.0, 4.0, 2.0));

    let rectangle = json!({"type": "rectangle", "width": 2, "height": 1});
    let scene = flatten(&load(rectangle, [1.0, 3.0, 1.0]).expect("a scene"));
    let hit = |x: f32, y: f32| intersect_cpu(&scene, Vec3::new(1.0 + x, 2.0 + y, 0.0), Vec3::Z, 9.0).is_some();
    assert!(hit(0.9, 1.4) && hit(-0.9, -1.4) && !hit(1.1, 0.0) && !hit(0.0, 1.6));

    // A sphere that its node squeezes is left out with a warning.
    let squeezed = load(sphere, [1.0, 2.0, 1.0]).expect("a scene");
    assert!(squeezed.meshes.is_empty() && squeezed.warnings.iter().any(|w| w.contains("nodes[0]")));
    for (light, what) in [
        (json!({"type": "sphere"}), "radius is missing"),
        (json!({"type": "rectangle", "width": 1}), "height is missing"),
        (json!({"type": "cube", "radius": 1}), "cube"),
        (json!({"type": "disk", "radius": 1, "size": 2}), "size"),
        (json!({"type": "disk", "radius": "1"}), "invalid type"),
        (json!(3), "invalid type"),
    ] {
        let error = load(light, [1.0; 3]).expect_err(what);
        assert_eq!(error.code(), "BAD_FILE", "{error}");
        assert!(error.to_string().contains(what) && error.to_string().contains("restir_area_light"), "{error}");
    }
}

/// A file whose lights with a shape hang on animated nodes shows at a moment what a file shows where they stand there.
#[test]
fn area_lights_follow_their_nodes() {
    // Held by one node each: (extras, translation at 0 s and at 2 s).
    let lights = [
        (json!({"type": "sphere", "radius": 0.2, "radiance": 20}), [[-0.6, 1.7, 0.0], [-0.2, 0.5, 0.2]]),
        (
            json!({"type": "rectangle", "width": 0.4, "height": 0.3, "radiance": 30}),
            [[0.5, 1.6, -0.4], [0.3, 0.6, 0.4]],
        ),
        (json!({"type": "disk", "radius": 0.25, "radiance": 25}), [[0.0, 1.8, 0.5], [0.6, 0.9, 0.0]]),
    ];
    let down = [-std::f32::consts::FRAC_1_SQRT_2, 0.0, 0.0, std::f32::consts::FRAC_1_SQRT_2];
    let file = |still_at: Option<f32>| {
        let mut writer = Writer::new(json!({"scene": 0, "scenes": [{"nodes": [0, 1, 2, 3]}]}));
        let corners = [-1.0, 0.0, -1.0, -1.0, 0.0, 1.0, 1.0, 0.0, 1.0, 1.0, 0.0, -1.0];
        let positions = writer.floats("VEC3", &corners);
        let indices = writer.indices(&[0, 1, 2, 0, 2, 3]);
        let floor = json!({"attributes": {"POSITION": positions}, "indices": indices});
        writer.push("meshes", json!({"primitives": [floor]}));
        writer.push("nodes", json!({"mesh": 0}));
        let times = writer.floats("SCALAR", &[0.0, 2.0]);
        let (mut samplers, mut channels) = (Vec::new(), Vec::new());
        for (i, (light, [from, to])) in lights.iter().enumerate() {
            let at = still_at.map_or(*from, |t| [0, 1, 2].map(|k| from[k] + (to[k] - from[k]) * t / 2.0));
            let extras = json!({"restir_area_light": light});
            writer.push("nodes", json!({"translation": at, "rotation": down, "extras": extras}));
            let path = writer.floats("VEC3", &[*from, *to].concat());
            samplers.push(json!({"input": times, "output": path}));
            channels.push(json!({"sampler": i, "target": {"node": i + 1, "path": "translation"}}));
        }
        if still_at.is_none() {
            writer.push("animations", json!({"samplers": samplers, "channels": channels}));
        }
        let mut scene = gltf::load_bytes("lights.glb", &writer.glb(), &mut |_| unreachable!()).expect("a scene");
        let eye = Camera::look_at("eye", [0.0, 2.0, 2.5].into(), [0.0, 0.3, 0.0].into(), 0.9);
        scene.cameras = vec![eye];
        scene
    };
    let moving = file(None);
    assert_eq!(moving.rig.instances.len(), 3);
    let settings = [("render.max_depth", "1")];
    for technique in ALL {
        let picture = |scene: &Scene, time: f64| {
            let mut renderer = renderer(&gpu(), flatten(scene), [48, 32], technique, &settings);
            renderer.set_accumulate(true);
            // Not from the first moment on: what is shown is where the lights have moved to.
            for time in [0.0, time] {
                renderer.set_time(time);
                renderer.render_frame().expect("a frame");
            }
            mean(&render(&mut renderer, 64)).map(|c| c as f32)
        };
        let (seen, expected) = (picture(&moving, 1.5), picture(&file(Some(1.5)), 0.0));
        let before = picture(&file(Some(0.0)), 0.0);
        for c in 0..3 {
            assert!((seen[c] / expected[c] - 1.0).abs() < 0.01, "{technique}: {seen:?}, should be {expected:?}");
        }
        assert!((before[0] / expected[0] - 1.0).abs() > 0.05, "{technique}: {before:?} at rest, {expected:?} moved");
    }
}

/// A scale that changes by axis would make it something that is neither drawn nor sampled as a sphere.
#[test]
fn a_sphere_that_is_squeezed_stays_as_it_was() {
    let mut writer = Writer::new(json!({"scene": 0, "scenes": [{"nodes": [0]}]}));
    let light = json!({"type": "sphere", "radius": 0.5});
    writer.push("nodes", json!({"extras": {"restir_area_light": light}}));
    let (times, scales) =
        (writer.floats("SCALAR", &[0.0, 1.0]), writer.floats("VEC3", &[1.0, 1.0, 1.0, 3.0, 1.0, 1.0]));
    let channel = json!({"sampler": 0, "target": {"node": 0, "path": "scale"}});
    writer.push("animations", json!({"samplers": [{"input": times, "output": scales}], "channels": [channel]}));
    let scene = flatten(&gltf::load_bytes("light.glb", &writer.glb(), &mut |_| unreachable!()).expect("a scene"));
    assert_eq!(scene.rig.instances.len(), 1);
    let stage = Stage::new(&scene, 0, 0.5);
    assert_eq!(stage.transforms, [Mat4::IDENTITY]);
}
