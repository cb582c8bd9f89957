//! What surrounds a scene: the pyramid draws with the density it claims, either way of sampling gives the same picture,
//! a turning map is the map turned, a map that changes is the map it changes to, and the sun is its irradiance.

mod support;

use glam::{DVec3, Vec3};
use restir::Image;
use restir::gpu::shader::table;
use restir::scene::flat::FlatEnvironment;
use restir::scene::random::Random;
use restir::scene::{Environment, FlatScene, Instance, Material, Scene, Sun, shapes, sky::Sky};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use support::harness::{TestInput, eval_gpu, scene_functions};
use support::plate::{check_by, materials, plate, scattered};
use support::statistics::{chi_squared, significance};
use support::{assert_same, flatten, gpu, render, renderer};

const BOTH: [&str; 2] = ["alias", "pyramid"];
const SAMPLING: &str = "render.environment_sampling";

/// A dim noisy map with one bright texel, of one hue: colours that differ would be noise in estimates by luminance.
fn noise(width: u32, height: u32, seed: u64) -> Environment {
    let mut random = Random::new(seed);
    let hue = |value: f32| [value, 0.9 * value, 0.7 * value];
    let mut pixels: Vec<[f32; 3]> = (0..width * height).map(|_| hue(0.2 + random.unit())).collect();
    let bright = pixels.len() / 3;
    pixels[bright] = hue(20.0);
    Environment { width, height, pixels }
}

/// Under a map a plate of brushed metal, which tells directions apart: to a matte one a map that turns about its normal
/// is all the same.
fn under(environment: Environment) -> Scene {
    let (material, _) = materials().remove(1);
    Scene { environment: Some(environment), ..plate(material, 0.5) }
}

/// Solid angle of a texel.
fn solid_angle(row: u32, [width, height]: [u32; 2]) -> f64 {
    let edge = |row: u32| (PI * f64::from(row) / f64::from(height)).cos();
    TAU / f64::from(width) * (edge(row) - edge(row + 1))
}

/// The pyramid's draws and densities are those of the alias table, which has its own tests: by texel where there are few,
/// by blocks where there are many.
#[test]
fn the_pyramid_draws_with_its_density() {
    const DRAWS: u32 = 40_000;
    let gpu = gpu();
    let sizes = [[1, 1], [3, 7], [12, 6], [1000, 333], [8192, 16], [16, 512]];
    for size in sizes {
        let [width, height] = size;
        let scene = flatten(&under(noise(width, height, 3)));
        let alias = &scene.environment.as_ref().expect("an environment").alias;
        let pdf = |texel: usize| f64::from(f32::from_bits(alias[texel][2]));
        let inputs: Vec<_> = (0..DRAWS).map(|i| TestInput::new(&[[i & 0xffff, i >> 16, 11, 0]])).collect();
        let draws =
            eval_gpu(&gpu, &table::TESTS_SCENE_FUNCTIONS, Some(&scene), scene_functions::PYRAMID_SAMPLE, &inputs);

        let (columns, rows) = (width.min(16), height.min(16));
        let block = |x: u32, y: u32| ((y * rows / height) * columns + x * columns / width) as usize;
        let mut counts = vec![0.0; (columns * rows) as usize];
        for draw in draws {
            let [x, y, density, _] = draw.a;
            assert!(x < width && y < height, "{size:?}: texel {x} {y}");
            let (density, expected) = (f64::from(f32::from_bits(density)), pdf((y * width + x) as usize));
            assert!((density / expected - 1.0).abs() < 1e-5, "{size:?}: {density} at {x} {y}, should be {expected}");
            counts[block(x, y)] += 1.0;
        }
        let (mut expected, mut tilted) = (vec![0.0; counts.len()], vec![0.0; counts.len()]);
        for y in 0..height {
            for x in 0..width {
                let mass = pdf((y * width + x) as usize) * solid_angle(y, size) * f64::from(DRAWS);
                expected[block(x, y)] += mass;
                tilted[block(x, y)] += mass * (1.2 - 0.4 * f64::from(y) / f64::from(height));
            }
        }
        let p = chi_squared(&counts, &expected);
        assert!(p > significance(sizes.len()), "{size:?}: p = {p:e}");
        if counts.len() > 1 {
            let scale = f64::from(DRAWS) / tilted.iter().sum::<f64>();
            tilted.iter_mut().for_each(|count| *count *= scale);
            let p = chi_squared(&counts, &tilted);
            assert!(p < significance(sizes.len()), "{size:?}: a wrong density passed with p = {p:e}");
        }
    }
}

/// What the plate of `under` reflects of a map turned by `turn` radians, by quadrature.
fn reflected(environment: &Environment, turn: f64) -> DVec3 {
    let (_, brdf) = materials().remove(1);
    let [width, height] = [environment.width as usize, environment.height as usize];
    let texel = |x: i64, y: i64| {
        let (x, y) = (x.rem_euclid(width as i64) as usize, y.clamp(0, height as i64 - 1) as usize);
        Vec3::from(environment.pixels[y * width + x]).as_dvec3()
    };
    let (rings, sectors) = (240, 960);
    let mut sum = DVec3::ZERO;
    for i in 0..rings {
        let theta = (f64::from(i) + 0.5) / f64::from(rings) * FRAC_PI_2;
        for j in 0..sectors {
            // Clockwise from -Z as seen from above; the map turns the other way.
            let azimuth = (f64::from(j) + 0.5) / f64::from(sectors) * TAU;
            let wi = DVec3::new(theta.sin() * azimuth.sin(), theta.cos(), -theta.sin() * azimuth.cos());
            let (u, v) = (0.5 + (azimuth + turn) / TAU, theta / PI);
            let (x, y) = (u * width as f64 - 0.5, v * height as f64 - 0.5);
            let (i, j, fx, fy) = (x.floor() as i64, y.floor() as i64, x - x.floor(), y - y.floor());
            let top = texel(i, j).lerp(texel(i + 1, j), fx);
            let bottom = texel(i, j + 1).lerp(texel(i + 1, j + 1), fx);
            sum += scattered(&brdf, 0.5, wi) * top.lerp(bottom, fy) * theta.sin();
        }
    }
    sum * (FRAC_PI_2 / f64::from(rings)) * (TAU / f64::from(sectors))
}

#[test]
fn either_sampling_gives_the_integral_of_the_map_however_it_is_turned() {
    let map = noise(24, 12, 4);
    let scene = under(map.clone());
    let expected = reflected(&map, -283f64.to_radians());
    for (sampling, techniques) in [("alias", &["path-tracer", "ris"][..]), ("pyramid", &["path-tracer", "restir-di"])] {
        let settings = [(SAMPLING, sampling), ("render.environment_rotation", "-283")];
        check_by(techniques, &scene, &settings, expected, sampling);
    }
}

/// A whole number of texels: the camera sees the map that was turned beforehand.
#[test]
fn a_turned_map_is_seen_turned() {
    let map = noise(8, 4, 5);
    let turned = {
        let mut pixels = map.pixels.clone();
        // Counter-clockwise as seen from above: what was at the centre goes to the left.
        pixels.chunks_exact_mut(8).for_each(|row| row.rotate_left(2));
        Environment { pixels, ..map.clone() }
    };
    let seen = |map: &Environment, degrees: &str| {
        let mut scene = under(map.clone());
        scene.cameras[0] =
            restir::scene::Camera::look_at("away", Vec3::new(0.0, 50.0, 0.0), Vec3::new(3.0, 52.0, -9.0), 1.5);
        let settings = [("render.environment_rotation", degrees)];
        render(&mut renderer(&gpu(), flatten(&scene), [32, 32], "path-tracer", &settings), 1)
    };
    let (before, after) = (seen(&map, "90"), seen(&turned, "0"));
    for (a, b) in before.pixels.iter().flatten().zip(after.pixels.iter().flatten()) {
        assert!((a - b).abs() < 1e-4 * b, "{a} {b}");
    }
    assert_ne!(before.pixels, seen(&map, "0").pixels);
}

/// Frames that are not accumulated show the map as it has turned until then; and reuse over time follows it.
#[test]
fn a_turning_map_is_the_map_turned() {
    let scene = flatten(&under(noise(24, 12, 6)));
    // 60 frames a second: 6 degrees a frame, of which the first shows 0.
    let settings =
        |sampling| [(SAMPLING, sampling), ("render.environment_rotation_rate", "360"), ("render.max_depth", "1")];
    for sampling in BOTH {
        let mut turning = renderer(&gpu(), scene.clone(), [16, 16], "path-tracer", &settings(sampling));
        turning.set_accumulate(false);
        let turning = render(&mut turning, 8);
        let still = [(SAMPLING, sampling), ("render.environment_rotation", "42"), ("render.max_depth", "1")];
        let mut still = renderer(&gpu(), scene.clone(), [16, 16], "path-tracer", &still);
        still.set_accumulate(false);
        // 360 x 7 / 60 degrees are 42 but for rounding.
        let still = render(&mut still, 8);
        for (a, b) in turning.pixels.iter().flatten().zip(still.pixels.iter().flatten()) {
            assert!((a - b).abs() <= 1e-4 * b, "{sampling}: {a} and {b}");
        }
    }

    let map = noise(24, 12, 6);
    let expected = reflected(&map, 42f64.to_radians()).y;
    // The map as it stood a few frames ago gives another number.
    let stale = reflected(&map, 30f64.to_radians()).y;
    for (technique, setting, seeds) in
        [("restir-di", ("indirect", "no"), 48), ("restir-di-decoupled", ("visibility", "mis"), 192)]
    {
        let settings = [&settings("pyramid")[..], &[("indirect", "no"), setting]].concat();
        let mut restir = renderer(&gpu(), scene.clone(), [16, 16], technique, &settings);
        restir.set_accumulate(false);
        let runs: Vec<f64> = (0..seeds)
            .map(|seed| {
                restir.set_seed(seed);
                let image = render(&mut restir, 8);
                image.pixels.iter().map(|p| f64::from(p[1])).sum::<f64>() / image.pixels.len() as f64
            })
            .collect();
        let (mean, error) = mean_and_error(&runs);
        println!("{technique} under a turning map: {mean:.5} ± {error:.5}, expected {expected:.5}");
        assert!((mean - expected).abs() < 4.0 * error + 1e-3 * expected, "{mean} ± {error}, should be {expected}");
        assert!(error < 0.01 * expected, "{technique}: too noisy to tell");
        assert!((mean - stale).abs() > 8.0 * error, "{technique}: a map that lags would pass");
    }
}

fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n * (n - 1.0))).sqrt())
}

/// A map that is streamed in gives the picture of a scene that was loaded with it, byte for byte.
#[test]
fn a_live_map_is_the_map_it_has_become() {
    let (first, second) = (noise(24, 12, 7), noise(24, 12, 8));
    let picture = |scene: &Environment, updates: &[&Environment], settings: &[(&str, &str)]| -> Image {
        let mut renderer = renderer(&gpu(), flatten(&under(scene.clone())), [16, 16], "path-tracer", settings);
        for environment in updates {
            render(&mut renderer, 1);
            renderer.update_environment(environment).expect("the same size");
        }
        renderer.reset();
        render(&mut renderer, 2)
    };
    for sampling in BOTH {
        let settings = [(SAMPLING, sampling)];
        let fresh = picture(&second, &[], &settings);
        assert_same(&picture(&first, &[&second], &settings), &fresh, sampling);
        assert_same(&picture(&second, &[&first, &second], &settings), &fresh, sampling);
        assert_ne!(picture(&first, &[], &settings).pixels, fresh.pixels);
    }
    // Changed while the pyramid was in use, the alias table is built before it is used again.
    let mut renderer =
        renderer(&gpu(), flatten(&under(first.clone())), [16, 16], "path-tracer", &[(SAMPLING, "pyramid")]);
    renderer.update_environment(&second).expect("the same size");
    render(&mut renderer, 1);
    renderer.set(SAMPLING, "alias").expect("a setting");
    assert_same(&render(&mut renderer, 2), &picture(&second, &[], &[(SAMPLING, "alias")]), "switched");

    for (wrong, what) in [
        (noise(12, 6, 1), "24 x 12"),
        (Environment { pixels: vec![[0.0; 3]; 288], ..first.clone() }, "black"),
        (Environment { pixels: vec![[f32::NAN; 3]; 288], ..first.clone() }, "not finite"),
    ] {
        let error = renderer.update_environment(&wrong).expect_err(what);
        assert!(error.to_string().contains(what) && error.code() == "BAD_VALUE", "{error}");
    }
    assert!(FlatEnvironment::build(&first).expect("sound").is_some());
}

/// A plate under a sun alone reflects f cos E, however large the sun is: by quadrature over its disk.
#[test]
fn under_a_sun() {
    let (material, brdf) = materials().remove(1);
    let towards = DVec3::new(-0.45, 0.8, 0.2).normalize();
    let irradiance = DVec3::new(2.0, 1.5, 1.0);
    for angular_radius in [restir::scene::sky::SUN_ANGULAR_RADIUS, 0.2] {
        let mut scene = plate(material.clone(), 0.5);
        scene.sun = Some(Sun { direction: towards.as_vec3(), irradiance: irradiance.as_vec3(), angular_radius });
        let settings = [("render.environment_rotation", "60")];
        let turned = glam::DQuat::from_rotation_y(60f64.to_radians()) * towards;
        let frame = glam::DQuat::from_rotation_arc(DVec3::Z, turned);
        let radius = f64::from(angular_radius);
        let (rings, sectors) = (64, 128);
        let mut sum = DVec3::ZERO;
        for i in 0..rings {
            let theta = radius * (f64::from(i) + 0.5) / f64::from(rings);
            for j in 0..sectors {
                let (sin, cos) = ((f64::from(j) + 0.5) / f64::from(sectors) * TAU).sin_cos();
                let wi = frame * DVec3::new(theta.sin() * cos, theta.sin() * sin, theta.cos());
                sum += scattered(&brdf, 0.5, wi) * theta.sin();
            }
        }
        // Radiance is irradiance over pi sin^2.
        let solid_angle = radius / f64::from(rings) * (TAU / f64::from(sectors));
        let expected = sum * solid_angle * irradiance / (PI * radius.sin().powi(2));
        check_by(&["path-tracer", "restir-di"], &scene, &settings, expected, &format!("a sun of {angular_radius}"));
    }
}

/// Sun and map together are the sum of both.
#[test]
fn under_sun_and_sky() {
    let sky = Sky { elevation: 35.0, azimuth: 20.0, ..Sky::default() };
    let (material, brdf) = materials().remove(1);
    let mut scene = plate(material, 0.5);
    sky.surround(&mut scene);
    let sun = scene.sun.expect("a sun");
    let map = scene.environment.clone().expect("a map");
    let expected = reflected(&map, 0.0) + scattered(&brdf, 0.5, sun.direction.as_dvec3()) * sun.irradiance.as_dvec3();
    check_by(&["path-tracer", "ris"], &scene, &[], expected, "sun and sky");
}

#[test]
fn suns_that_cannot_be_are_refused() {
    let sun = |direction, irradiance, angular_radius| Sun { direction, irradiance, angular_radius };
    let build = |sun| {
        let meshes = vec![shapes::parallelogram(Vec3::ZERO, Vec3::X, Vec3::NEG_Z, 0)];
        let instances = vec![Instance { mesh: 0, transform: glam::Mat4::IDENTITY }];
        let scene =
            Scene { meshes, instances, materials: vec![Material::default()], sun: Some(sun), ..Scene::default() };
        FlatScene::build(&scene, &mut |_, _| ())
    };
    assert_eq!(build(sun(Vec3::Y, Vec3::ONE, 0.1)).expect("sound").lights.len(), 1);
    assert_eq!(build(sun(Vec3::Y, Vec3::ZERO, 0.1)).expect("dark").lights.len(), 0);
    for wrong in [
        sun(Vec3::ZERO, Vec3::ONE, 0.1),
        sun(Vec3::Y, Vec3::NAN, 0.1),
        sun(Vec3::Y, Vec3::NEG_ONE, 0.1),
        sun(Vec3::Y, Vec3::ONE, 0.0),
        sun(Vec3::Y, Vec3::ONE, 2.0),
        sun(Vec3::Y, Vec3::ONE, f32::NAN),
        sun(Vec3::Y, Vec3::splat(1e38), 1e-4),
    ] {
        assert_eq!(build(wrong).expect_err("refused").code(), "BAD_VALUE", "{wrong:?}");
    }
}
