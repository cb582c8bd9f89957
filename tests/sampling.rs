//! Every sampler draws with the density it claims: chi-squared of samples, binned over the domain, against the density
//! integrated over the same bins. Seeds are fixed; all tests together raise a false alarm once in a thousand seeds. Each
//! kind of sampler is also compared with a wrong density, which the same test must reject.

mod support;

use glam::{DVec2, DVec3, Vec3};
use restir::Gpu;
use restir::gpu::shader::table;
use restir::scene::random::Random;
use restir::scene::{Environment, FlatScene, Instance, Material, Scene, shapes};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use support::harness::{TestInput, eval_gpu, functions, scene_functions};
use support::statistics::{chi_squared, significance, upper_gamma};
use support::{flatten, gpu};

const SAMPLES: usize = 40_000;
/// Comparisons in this file, for the significance of each.
const TESTS: usize = 64;

/// Direction bins: polar angle from +z times azimuth.
const POLAR: usize = 16;
const AZIMUTH: usize = 16;
/// Steps of the midpoint rule in a bin: more along the azimuth, where lobes at grazing angles are narrow.
const POLAR_STEPS: usize = 16;
const AZIMUTH_STEPS: usize = 64;

/// `count` points of the unit cube, stratified in nothing: plain random numbers of a fixed seed.
fn uniform(count: usize, seed: u64) -> Vec<[f32; 4]> {
    let mut random = Random::new(seed);
    (0..count).map(|_| [0; 4].map(|_| random.unit())).collect()
}

fn functions_of(gpu: &Gpu, operation: u32, inputs: &[TestInput]) -> Vec<([f32; 4], [f32; 4])> {
    let outputs = eval_gpu(gpu, &table::TESTS_FUNCTIONS, None, operation, inputs);
    outputs.iter().map(|o| (o.a(), o.b())).collect()
}

fn direction(v: [f32; 4]) -> DVec3 {
    Vec3::new(v[0], v[1], v[2]).as_dvec3()
}

/// Bin of a direction of the upper hemisphere; the last one is for all below.
fn bin_of(w: DVec3) -> usize {
    if w.z <= 1e-6 {
        return POLAR * AZIMUTH;
    }
    let polar = (w.z.min(1.0).acos() / FRAC_PI_2 * POLAR as f64) as usize;
    let azimuth = ((w.y.atan2(w.x) / TAU).rem_euclid(1.0) * AZIMUTH as f64) as usize;
    polar.min(POLAR - 1) * AZIMUTH + azimuth.min(AZIMUTH - 1)
}

fn histogram(bins: usize, samples: impl Iterator<Item = usize>) -> Vec<f64> {
    let mut counts = vec![0.0; bins];
    for bin in samples {
        counts[bin] += 1.0;
    }
    counts
}

/// The integral of `f` over every bin of the hemisphere, by the midpoint rule.
fn quadrature(f: impl Fn(DVec3) -> f64) -> Vec<f64> {
    let (polar_steps, azimuth_steps) = (POLAR * POLAR_STEPS, AZIMUTH * AZIMUTH_STEPS);
    let (d_theta, d_phi) = (FRAC_PI_2 / polar_steps as f64, TAU / azimuth_steps as f64);
    let mut bins = vec![0.0; POLAR * AZIMUTH];
    for i in 0..polar_steps {
        let (sin_theta, cos_theta) = ((i as f64 + 0.5) * d_theta).sin_cos();
        for j in 0..azimuth_steps {
            let (sin_phi, cos_phi) = ((j as f64 + 0.5) * d_phi).sin_cos();
            let w = DVec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta);
            bins[(i / POLAR_STEPS) * AZIMUTH + j / AZIMUTH_STEPS] += f(w) * sin_theta * d_theta * d_phi;
        }
    }
    bins
}

/// The probability of every bin under a density; what is missing to 1 lies below the horizon.
fn integrate(pdf: impl Fn(DVec3) -> f64) -> Vec<f64> {
    let mut bins = quadrature(pdf);
    let above: f64 = bins.iter().sum();
    assert!(above < 1.002, "the density integrates to {above}");
    bins.push((1.0 - above).max(0.0));
    bins
}

/// p-value of samples against probabilities of their bins.
fn p_value(counts: &[f64], probabilities: &[f64]) -> f64 {
    let n: f64 = counts.iter().sum();
    chi_squared(counts, &probabilities.iter().map(|p| p * n).collect::<Vec<_>>())
}

#[track_caller]
fn assert_fits(counts: &[f64], probabilities: &[f64], what: &str) {
    let p = p_value(counts, probabilities);
    assert!(p > significance(TESTS), "{what}: p = {p:e}");
}

#[track_caller]
fn assert_rejected(counts: &[f64], probabilities: &[f64], what: &str) {
    let p = p_value(counts, probabilities);
    assert!(p < significance(TESTS), "{what}: a wrong density passed with p = {p:e}");
}

#[test]
fn chi_squared_knows_the_tables() {
    // Critical values of the chi-squared distribution (Abramowitz and Stegun, table 26.8).
    for (degrees, critical, p) in
        [(1.0, 3.841_459, 0.05), (2.0, 13.815_511, 0.001), (15.0, 37.697_298, 0.001), (100.0, 118.498, 0.1)]
    {
        let q = upper_gamma(0.5 * degrees, 0.5 * critical);
        assert!((q / p - 1.0).abs() < 1e-4, "{degrees} degrees of freedom: {q} is not {p}");
    }
    assert_eq!(upper_gamma(2.0, 0.0), 1.0);
    assert_eq!(chi_squared(&[5.0, 1.0], &[6.0, 0.0]), 0.0, "the impossible happened");
    assert_eq!(chi_squared(&[10.0, 20.0], &[10.0, 20.0]), 1.0);
    assert!(chi_squared(&[100.0, 0.0, 0.0], &[97.0, 1.5, 1.5]) > 0.05, "small bins are pooled");
    assert!((1.0 - significance(1) - 0.999).abs() < 1e-12 && significance(100) < 1.1e-5);
    // p-values of true samples are uniform: of 200, about 20 lie below 0.1.
    let mut random = Random::new(1);
    let below = (0..200)
        .filter(|_| {
            let counts = histogram(10, (0..1000).map(|_| (random.unit() * 10.0) as usize));
            chi_squared(&counts, &[100.0; 10]) < 0.1
        })
        .count();
    assert!((8..=36).contains(&below), "{below} of 200 below 0.1");
}

#[test]
fn warps_are_uniform_or_cosine() {
    let gpu = gpu();
    let inputs: Vec<_> = uniform(SAMPLES, 2).iter().map(|u| TestInput::floats(&[*u])).collect();
    let outputs = functions_of(&gpu, functions::WARPS, &inputs);

    let cosine = histogram(POLAR * AZIMUTH + 1, outputs.iter().map(|(_, b)| bin_of(direction(*b))));
    assert_fits(&cosine, &integrate(|w| w.z / PI), "cosine hemisphere");
    assert_rejected(&cosine, &integrate(|_| 1.0 / TAU), "cosine hemisphere against a uniform one");

    // Rings of equal area times sectors.
    let disk = |[x, y, ..]: [f32; 4]| {
        let p = DVec2::new(x.into(), y.into());
        let ring = (p.length_squared() * 16.0) as usize;
        let sector = ((p.y.atan2(p.x) / TAU).rem_euclid(1.0) * 16.0) as usize;
        ring.min(15) * 16 + sector.min(15)
    };
    let counts = histogram(256, outputs.iter().map(|(a, _)| disk(*a)));
    assert_fits(&counts, &[1.0 / 256.0; 256], "disk");
    let rings: Vec<f64> = (0..256).map(|i| (2.0 * f64::from(i / 16) + 1.0) / 4096.0).collect();
    assert_rejected(&counts, &rings, "disk against rings of equal width");

    // Strips between lines through a corner, cut by lines parallel to the opposite side: equal areas both ways.
    let triangle = |[_, _, b1, b2]: [f32; 4]| {
        let sum = b1 + b2;
        let (across, along) = ((sum * sum * 16.0) as usize, (b2 / sum.max(1e-9) * 16.0) as usize);
        across.min(15) * 16 + along.min(15)
    };
    let counts = histogram(256, outputs.iter().map(|(a, _)| triangle(*a)));
    assert_fits(&counts, &[1.0 / 256.0; 256], "triangle");
    assert_rejected(&counts, &rings, "triangle without the square root");
}

/// A dim noisy sky with one texel of sun, over a floor.
fn sunny() -> FlatScene {
    let (width, height) = (12u32, 6u32);
    let mut random = Random::new(4);
    let mut pixels: Vec<[f32; 3]> = (0..width * height).map(|_| [0; 3].map(|_| 0.2 + random.unit())).collect();
    pixels[width as usize + 3] = [100.0; 3];
    pixels[4 * width as usize] = [0.0; 3];
    flatten(&Scene { environment: Some(Environment { width, height, pixels }), ..floor() })
}

fn floor() -> Scene {
    Scene {
        meshes: vec![shapes::parallelogram(Vec3::new(-1.0, 0.0, 1.0), Vec3::X * 2.0, Vec3::Z * -2.0, 0)],
        instances: vec![Instance { mesh: 0, transform: glam::Mat4::IDENTITY }],
        materials: vec![Material::default()],
        ..Scene::default()
    }
}

/// Direction of a point of the map (docs/conventions.md).
fn of_map(u: f64, v: f64) -> DVec3 {
    let (sin, cos) = (TAU * (u - 0.5)).sin_cos();
    let r = (PI * v).sin();
    DVec3::new(r * sin, (PI * v).cos(), -r * cos)
}

#[test]
fn the_environment_is_sampled_with_its_density() {
    const COLUMNS: usize = 24;
    const ROWS: usize = 24;
    const FINE: usize = 4;
    let gpu = gpu();
    let scene = sunny();
    let eval = |operation, inputs: &[TestInput]| -> Vec<[f32; 4]> {
        let outputs = eval_gpu(&gpu, &table::TESTS_SCENE_FUNCTIONS, Some(&scene), operation, inputs);
        outputs.iter().map(|o| o.a()).collect()
    };
    let mut random = Random::new(5);
    let inputs: Vec<_> = (0..SAMPLES)
        .map(|_| TestInput::new(&[[0; 4].map(|_| random.unit().to_bits()), [0; 4].map(|_| random.next_u32())]))
        .collect();
    let samples: Vec<DVec3> = eval(scene_functions::ENVIRONMENT_SAMPLE, &inputs).into_iter().map(direction).collect();
    assert!(samples.iter().all(|w| (w.length() - 1.0).abs() < 1e-5));
    let bin = |w: &DVec3| {
        let u = (0.5 + w.x.atan2(-w.z) / TAU).clamp(0.0, 1.0);
        let v = w.y.clamp(-1.0, 1.0).acos() / PI;
        ((v * ROWS as f64) as usize).min(ROWS - 1) * COLUMNS + ((u * COLUMNS as f64) as usize).min(COLUMNS - 1)
    };
    let counts = histogram(COLUMNS * ROWS, samples.iter().map(bin));

    // The shader's own density, at the midpoints of a grid finer than the bins.
    let (columns, rows) = (COLUMNS * FINE, ROWS * FINE);
    let middle = |i: usize| ((i % columns) as f64 + 0.5, (i / columns) as f64 + 0.5);
    let points: Vec<_> = (0..columns * rows)
        .map(|i| {
            let (x, y) = middle(i);
            let w = of_map(x / columns as f64, y / rows as f64).as_vec3();
            TestInput::floats(&[w.extend(0.0).to_array()])
        })
        .collect();
    let mut probabilities = vec![0.0; COLUMNS * ROWS];
    let mut tilted = probabilities.clone();
    for (i, value) in eval(scene_functions::ENVIRONMENT, &points).into_iter().enumerate() {
        let row = i / columns;
        let edge = |y: usize| (PI * y as f64 / rows as f64).cos();
        let mass = f64::from(value[3]) * (edge(row) - edge(row + 1)) * TAU / columns as f64;
        let at = row / FINE * COLUMNS + i % columns / FINE;
        probabilities[at] += mass;
        tilted[at] += mass * (1.0 + 0.2 * edge(row));
        assert!(value[3] > 0.0 || value[..3] == [0.0; 3], "light where no sample can fall");
    }
    let total: f64 = probabilities.iter().sum();
    assert!((total - 1.0).abs() < 1e-3, "the density integrates to {total}");
    assert_fits(&counts, &probabilities, "environment");
    let total: f64 = tilted.iter().sum();
    tilted.iter_mut().for_each(|p| *p /= total);
    assert_rejected(&counts, &tilted, "environment, the zenith taken for 20 % more likely");

    // E[1 / pdf] is the whole sphere.
    let inputs: Vec<_> = samples.iter().map(|w| TestInput::floats(&[w.as_vec3().extend(0.0).to_array()])).collect();
    let pdfs = eval(scene_functions::ENVIRONMENT, &inputs);
    assert!(pdfs.iter().all(|v| v[3] > 0.0), "a sample of density 0");
    let sphere = pdfs.iter().map(|v| 1.0 / f64::from(v[3])).sum::<f64>() / SAMPLES as f64;
    assert!((sphere / (2.0 * TAU) - 1.0).abs() < 0.03, "{sphere}");
}

/// A dim sky with a sun of 2 x 2 texels, a thousand times as bright as the rest together: the mean of radiance / density
/// over samples is the integral of the map, by quadrature. Samples are the light table's own, so that the rounding of a
/// stored point is part of what is tested.
#[test]
fn a_small_sun_is_estimated_without_bias() {
    const DRAWS: u32 = 400_000;
    let (width, height) = (1024usize, 512usize);
    let gpu = gpu();
    for (column, row) in [(200, 130), (641, 300), (1023, 57), (511, 1)] {
        let mut pixels = vec![[1e-3f32; 3]; width * height];
        for (x, y) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            pixels[(row + y) * width + (column + x) % width] = [1e6; 3];
        }
        let mut scene = floor();
        // The integral of the bilinear map is that of tents: texels weighted by the solid angle under them.
        let tent = |y: usize| {
            let steps = 64;
            let middle = |i: usize| (y as f64 - 0.5 + (i as f64 + 0.5) * 2.0 / f64::from(steps as u32)) / height as f64;
            (0..steps)
                .filter(|i| (0.0..1.0).contains(&middle(*i)))
                .map(|i| {
                    let weight = 1.0 - (middle(i) * height as f64 - (y as f64 + 0.5)).abs();
                    weight.max(0.0) * (PI * middle(i)).sin() * PI / height as f64 * 2.0 / f64::from(steps as u32)
                })
                .sum::<f64>()
                * TAU
                / width as f64
        };
        let expected = 1e-3 * 2.0 * TAU + 2.0 * (1e6 - 1e-3) * (tent(row) + tent(row + 1));
        scene.environment = Some(Environment { width: width as u32, height: height as u32, pixels });
        let scene = flatten(&scene);
        let eval = |operation, inputs: &[TestInput]| {
            eval_gpu(&gpu, &table::TESTS_SCENE_FUNCTIONS, Some(&scene), operation, inputs)
        };
        let seeds: Vec<_> = (0..DRAWS).map(|i| TestInput::new(&[[i & 0xffff, i >> 16, 7, 0]])).collect();
        let samples = eval(scene_functions::LIGHT_SAMPLE, &seeds);
        let points: Vec<_> = samples.iter().map(|s| TestInput::new(&[[0; 4], [s.a[0], s.a[1], 0, 0]])).collect();
        let values: Vec<f64> = eval(scene_functions::LIGHT_CONTRIBUTION, &points)
            .iter()
            .zip(&samples)
            .map(|(contribution, sample)| f64::from(contribution.a()[0]) / f64::from(sample.a()[2]))
            .collect();
        let n = f64::from(DRAWS);
        let mean = values.iter().sum::<f64>() / n;
        let deviation = (values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / (n * (n - 1.0))).sqrt();
        let error = (mean - expected) / expected;
        println!("sun at {column}, {row}: off by {error:.5} (± {:.5})", deviation / expected);
        assert!((mean - expected).abs() < 4.0 * deviation, "sun at {column}, {row}: {mean}, should be {expected}");
        assert!(deviation < 2e-3 * expected, "too noisy to tell");
    }
}

/// Every sample of the environment has the density of the texel it was drawn from, whatever the size of the map and the
/// numbers drawn: sides that are no powers of two, rows at the poles, and the largest map there can be.
#[test]
fn environment_samples_stay_in_their_texel() {
    let gpu = gpu();
    for (width, height) in [(1u32, 1u32), (3, 7), (1000, 333), (8192, 16), (16, 4096)] {
        // Only one texel in a block of 8 x 8 shines, so that most neighbours have another density.
        let bright = |i: u32| (i % width).is_multiple_of(8) && (i / width).is_multiple_of(8);
        let pixels = (0..width * height).map(|i| if bright(i) { [1.0 + i as f32; 3] } else { [0.0; 3] }).collect();
        let scene = flatten(&Scene { environment: Some(Environment { width, height, pixels }), ..floor() });
        let environment = scene.environment.as_ref().expect("an environment");
        let mut random = Random::new(8);
        let edge = [0.0, 0.5, 1.0 - 0.5f32.powi(24)];
        let inputs: Vec<_> = (0..SAMPLES)
            .map(|i| {
                let u = |pick: usize, random: &mut Random| edge.get(pick % 8).copied().unwrap_or(random.unit());
                let u = [random.unit(), u(i, &mut random), u(i / 8, &mut random), 0.0];
                TestInput::new(&[u.map(f32::to_bits), [random.next_u32(), random.next_u32(), 0, 0]])
            })
            .collect();
        let outputs =
            eval_gpu(&gpu, &table::TESTS_SCENE_FUNCTIONS, Some(&scene), scene_functions::ENVIRONMENT_SAMPLE, &inputs);
        for (input, output) in inputs.iter().zip(outputs) {
            let [bits_x, bits_y, ..] = input.b.map(u64::from);
            let bucket = ((bits_x * u64::from(width)) >> 32) + u64::from(width) * ((bits_y * u64::from(height)) >> 32);
            let [threshold, alias, ..] = environment.alias[bucket as usize];
            let keep = f32::from_bits(input.a[0]) < f32::from_bits(threshold);
            let texel = if keep { bucket as u32 } else { alias };
            let centre = |q: u32, side: u32| (f64::from(q) + 0.5) / 65536.0 * f64::from(side);
            let (x, y) = (centre(output.b[0] & 0xffff, width) as u32, centre(output.b[0] >> 16, height) as u32);
            assert_eq!((x, y), (texel % width, texel / width), "{width}x{height}, {input:?}");
            assert_eq!(output.a[3], environment.alias[texel as usize][2], "{width}x{height}, {input:?}");
        }
    }
}

/// In the row at a pole solid angle grows with the square of the distance from it.
#[test]
fn the_polar_rows_are_uniform_in_solid_angle() {
    let gpu = gpu();
    let (width, height) = (4u32, 512u32);
    for row in [0, height - 1] {
        let pixels = (0..width * height).map(|i| [f32::from(u8::from(i / width == row)); 3]).collect();
        let scene = flatten(&Scene { environment: Some(Environment { width, height, pixels }), ..floor() });
        let mut random = Random::new(9);
        let inputs: Vec<_> = (0..SAMPLES)
            .map(|_| TestInput::new(&[[0; 4].map(|_| random.unit().to_bits()), [0; 4].map(|_| random.next_u32())]))
            .collect();
        let outputs =
            eval_gpu(&gpu, &table::TESTS_SCENE_FUNCTIONS, Some(&scene), scene_functions::ENVIRONMENT_SAMPLE, &inputs);
        let cells = 65536 / height;
        let counts = histogram(
            cells as usize,
            outputs.iter().filter_map(|o| {
                let from_pole = if row == 0 { o.b[0] >> 16 } else { 65535 - (o.b[0] >> 16) };
                (from_pole < cells).then_some(from_pole as usize)
            }),
        );
        let cosine = |cell: u32| (PI * f64::from(cell) / 65536.0).cos();
        let whole = 1.0 - cosine(cells);
        let probabilities: Vec<f64> = (0..cells).map(|i| (cosine(i) - cosine(i + 1)) / whole).collect();
        assert_fits(&counts, &probabilities, "polar row");
        assert_rejected(&counts, &vec![1.0 / f64::from(cells); cells as usize], "polar row, uniform in angle");
    }
}
