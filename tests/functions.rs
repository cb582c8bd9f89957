//! Shader functions equal their Rust twins: random numbers bit for bit, everything else to the accuracy of f32.

mod support;

use glam::{DVec2, DVec3, Vec2, Vec3};
use restir::gpu::shader::table;
use restir::scene::gpu_types::{BITANGENT_SHIFT, TRIANGLE_TANGENTS};
use restir::scene::random::Random;
use restir::scene::{
    AlphaMode, Environment, FlatScene, Instance, Material, PunctualKind, PunctualLight, Scene, Texture, TextureRef,
    Wrap, octahedral, shapes,
};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;
use support::harness::{TestInput, TestOutput, eval_gpu, functions, scene_functions};
use support::statistics::{chi_squared, significance};
use support::{flatten, twins};

/// Relative accuracy asked of f32 arithmetic.
const TOLERANCE: f64 = 1e-4;

fn functions(operation: u32, inputs: &[TestInput]) -> Vec<TestOutput> {
    eval_gpu(&support::gpu(), &table::TESTS_FUNCTIONS, None, operation, inputs)
}

fn scene_functions(scene: &FlatScene, operation: u32, inputs: &[TestInput]) -> Vec<TestOutput> {
    eval_gpu(&support::gpu(), &table::TESTS_SCENE_FUNCTIONS, Some(scene), operation, inputs)
}

fn xyz(v: [f32; 4]) -> Vec3 {
    Vec3::new(v[0], v[1], v[2])
}

fn d(v: Vec3) -> DVec3 {
    v.as_dvec3()
}

#[track_caller]
fn assert_close(actual: impl Into<f64>, expected: f64, absolute: f64, what: impl std::fmt::Debug) {
    let actual = actual.into();
    let allowed = absolute + TOLERANCE * expected.abs();
    assert!((actual - expected).abs() <= allowed, "{actual} is not {expected} ({what:?})");
}

/// Directions all over the sphere, the axes and the equator among them.
fn directions(random: &mut Random, count: usize) -> Vec<Vec3> {
    let mut all: Vec<Vec3> = (0..count).map(|_| random.direction()).collect();
    for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
        all.extend([axis, -axis]);
    }
    all.extend((0..64).map(|i| Vec2::from_angle(0.1 * i as f32).extend(0.0)));
    all
}

#[test]
fn random_numbers_are_bit_exact() {
    let mut random = Random::new(1);
    let mut seeds: Vec<[u32; 4]> = (0..4096).map(|_| [0; 4].map(|_| random.next_u32())).collect();
    seeds.extend([[0; 4], [u32::MAX; 4], [1, 0, 0, 0]]);
    let inputs: Vec<_> = seeds.iter().map(|s| TestInput::new(&[*s])).collect();
    for (seed, output) in seeds.iter().zip(functions(functions::PCG4D, &inputs)) {
        assert_eq!(output.a, twins::pcg4d(*seed), "{seed:?}");
    }

    let inputs: Vec<_> = seeds
        .iter()
        .map(|s| TestInput::new(&[[s[0] & 0xffff, s[1] & 0xffff, s[2], s[3]], [s[0] % 12, 0, 0, 0]]))
        .collect();
    for (input, output) in inputs.iter().zip(functions(functions::RANDOM, &inputs)) {
        let [x, y, frame, seed] = input.a;
        let draw = |dimension: u32| {
            twins::pcg4d([x | y << 16, frame, seed, (input.b[0] << 20) + dimension])
                .map(|bits| ((bits >> 8) as f32 * (0.5f32).powi(24)).to_bits())
        };
        assert_eq!((output.a, output.b), (draw(0), draw(1)), "{input:?}");
    }
}

#[test]
fn words_below_a_bound_are_exact() {
    let mut random = Random::new(16);
    let mut cases: Vec<[u32; 2]> = (0..4096).map(|i| [random.next_u32(), random.next_u32() >> (i % 32)]).collect();
    cases.extend([[u32::MAX; 2], [u32::MAX, 1], [0, u32::MAX], [u32::MAX, 1 << 20], [1 << 31, 3]]);
    let inputs: Vec<_> = cases.iter().map(|[bits, n]| TestInput::new(&[[*bits, *n, 0, 0]])).collect();
    for ([bits, n], output) in cases.iter().zip(functions(functions::BITS_BELOW, &inputs)) {
        assert_eq!(u64::from(output.a[0]), (u64::from(*bits) * u64::from(*n)) >> 32, "{bits} below {n}");
    }
}

#[test]
fn octahedral_map_equals_its_twin() {
    let all = directions(&mut Random::new(2), 4096);
    let inputs: Vec<_> = all.iter().map(|n| TestInput::floats(&[n.extend(0.0).to_array()])).collect();
    for (n, output) in all.iter().zip(functions(functions::OCTAHEDRAL, &inputs)) {
        let p = Vec2::new(output.a()[0], output.a()[1]);
        // On the fold two points of the square are one direction.
        assert!(p.distance(octahedral::encode(*n)) < 1e-5 || n.z.abs() < 1e-6, "{n}: {p}");
        assert!(xyz(output.b()).distance(octahedral::decode(p)) < 1e-5, "{n}");
        assert!(xyz(output.b()).distance(*n) < 1e-5, "{n} does not come back");
    }
}

#[test]
fn orthonormal_basis_equals_its_twin() {
    let all = directions(&mut Random::new(3), 4096);
    let inputs: Vec<_> = all.iter().map(|n| TestInput::floats(&[n.extend(0.0).to_array()])).collect();
    for (n, output) in all.iter().zip(functions(functions::BASIS, &inputs)) {
        let (tangent, bitangent) = (xyz(output.a()), xyz(output.b()));
        let (expected_tangent, expected_bitangent) = octahedral::orthonormal_basis(*n);
        assert!(tangent.distance(expected_tangent) < 1e-5 && bitangent.distance(expected_bitangent) < 1e-5, "{n}");
        assert!(tangent.cross(bitangent).distance(*n) < 1e-5, "{n}: not right-handed");
        assert!(tangent.dot(bitangent).abs() < 1e-5 && (tangent.length() - 1.0).abs() < 1e-5, "{n}");
    }
}

#[test]
fn warps_equal_their_twins() {
    let mut random = Random::new(4);
    let mut all: Vec<[f32; 2]> = (0..4096).map(|_| [random.unit(), random.unit()]).collect();
    let largest = 1.0 - 0.5f32.powi(24);
    all.extend([[0.0; 2], [0.5; 2], [largest; 2], [0.0, largest], [0.25, 0.75], [0.5, 0.0]]);
    let inputs: Vec<_> = all.iter().map(|u| TestInput::floats(&[[u[0], u[1], 0.0, 0.0]])).collect();
    for (u, output) in all.iter().zip(functions(functions::WARPS, &inputs)) {
        let u = DVec2::new(u[0].into(), u[1].into());
        let disk = twins::sample_disk(u);
        let [x, y, b1, b2] = output.a();
        assert!(DVec2::new(x.into(), y.into()).distance(disk) < 1e-5, "{u}");
        assert!((f64::from(b1) - u.x.sqrt() * (1.0 - u.y)).abs() < 1e-5, "{u}");
        assert!((f64::from(b2) - u.x.sqrt() * u.y).abs() < 1e-5, "{u}");
        let up = xyz(output.b());
        // The rim is where a rounding error of 1e-7 in the disk is 3e-4 in height.
        assert!((f64::from(up.z) - (1.0 - disk.length_squared()).max(0.0).sqrt()).abs() < 1e-3, "{u}");
        assert!((up.length() - 1.0).abs() < 1e-5 && up.z >= 0.0, "{u}");
    }
}

#[test]
fn warps_come_back() {
    let steps = (0..16).map(|i| (i as f32 + 0.5) / 16.0);
    let all: Vec<[f32; 2]> = steps.clone().flat_map(|x| steps.clone().map(move |y| [x, y])).collect();
    let inputs: Vec<_> = all.iter().map(|u| TestInput::floats(&[[u[0], u[1], 0.0, 0.0]])).collect();
    for (u, output) in all.iter().zip(functions(functions::UNWARPED, &inputs)) {
        let [disk_x, disk_y, triangle_x, triangle_y] = output.a();
        for (back, there) in [(disk_x, u[0]), (disk_y, u[1]), (triangle_x, u[0]), (triangle_y, u[1])] {
            assert_close(back, f64::from(there), 2e-6, u);
        }
    }
}

/// A reservoir in three words: what is rounded, how far, and what is not.
#[test]
fn packed_weights_come_back_rounded() {
    let mut all: Vec<[f32; 2]> = vec![[0.0, 0.0], [f32::MAX, 8e9], [1e-37, 1e-9]];
    all.extend((0..=128).map(|c| [1.37f32.powi(c - 64), c as f32]));
    let inputs: Vec<_> = all.iter().map(|u| TestInput::floats(&[[u[0], u[1], 0.0, 0.0]])).collect();
    for ([w, c], output) in all.iter().zip(functions(functions::PACKED, &inputs)) {
        let [w_back, c_back, ..] = output.a();
        assert!(
            w_back.is_finite() && (w_back / w.max(1e-38) - w / w.max(1e-38)).abs() <= 1.0 / 8192.0,
            "{w_back} for {w}"
        );
        let tolerance = if c.fract() == 0.0 && *c <= 128.0 { 0.0 } else { c / 128.0 };
        assert!((c_back - c).abs() <= tolerance, "{c_back} for {c}");
    }
}

#[test]
fn srgb_equals_the_standard_and_comes_back() {
    let values: Vec<f32> = (0..=1000).map(|i| i as f32 / 1000.0).collect();
    let input = |x: f32| TestInput::floats(&[[x, x, x, 0.0]]);
    let encoded = functions(functions::SRGB, &values.iter().map(|&x| input(x)).collect::<Vec<_>>());
    for (x, output) in values.iter().zip(&encoded) {
        assert_close(output.a()[0], twins::srgb_encode(f64::from(*x)), 1e-6, x);
        assert_close(output.b()[0], twins::srgb_decode(f64::from(*x)), 1e-6, x);
    }
    let back: Vec<_> = encoded.iter().map(|o| input(o.a()[1])).collect();
    for (x, output) in values.iter().zip(functions(functions::SRGB, &back)) {
        assert_close(output.b()[2], f64::from(*x), 1e-5, x);
    }
    let outside = functions(functions::SRGB, &[input(-1.0), input(7.0)]);
    assert_eq!(outside[0].a()[0], 0.0, "encoding clamps");
    assert_close(outside[1].a()[0], 1.0, 1e-6, "encoding clamps");
}

#[test]
fn tone_maps_equal_their_sources() {
    let mut random = Random::new(6);
    let mut colors: Vec<Vec3> = (0..500).map(|_| random.in_box(Vec3::ZERO, Vec3::ONE) * 8.0 * random.unit()).collect();
    colors.extend([0.0, 0.04, 0.18, 0.5, 1.0, 100.0].map(Vec3::splat));
    colors.extend([Vec3::X * 0.9, Vec3::Y * 5.0, Vec3::new(1.0, 0.01, 0.0)]);
    let mapped = |kind: u32, colors: &[Vec3]| -> Vec<Vec3> {
        let input = |c: &Vec3| TestInput::new(&[[c.x.to_bits(), c.y.to_bits(), c.z.to_bits(), kind]]);
        let outputs = functions(functions::TONE_MAP, &colors.iter().map(input).collect::<Vec<_>>());
        outputs.iter().map(|o| xyz(o.a())).collect()
    };
    let [linear, aces, agx, neutral] = [0, 1, 2, 3].map(|kind| mapped(kind, &colors));
    for (i, &color) in colors.iter().enumerate() {
        assert_eq!(linear[i], color);
        assert!(d(aces[i]).distance(twins::tone_map_aces(d(color))) < 1e-4, "ACES of {color}");
        assert!(d(neutral[i]).distance(twins::tone_map_neutral(d(color))) < 1e-4, "neutral of {color}");
        assert!(neutral[i].max_element() <= 1.0 && agx[i].min_element() >= 0.0 && agx[i].max_element() < 1.05);
    }
    // By hand, from the published formulas.
    let points = mapped(3, &[Vec3::splat(0.5), Vec3::splat(0.04), Vec3::ONE, Vec3::X * 0.9]);
    for (point, expected) in points.iter().zip([
        Vec3::splat(0.46),
        Vec3::splat(0.01),
        Vec3::splat(0.869_091),
        Vec3::new(0.848_421, 0.006_514, 0.006_514),
    ]) {
        assert!(point.distance(expected) < 1e-4, "neutral: {point}, expected {expected}");
    }
    assert!((mapped(1, &[Vec3::splat(0.18)])[0] - 0.105_591).abs().max_element() < 1e-4);
    assert!((mapped(2, &[Vec3::splat(0.18)])[0] - 0.2145).abs().max_element() < 2e-3);
    // Brighter never comes out darker.
    let greys: Vec<Vec3> = (0..400).map(|i| Vec3::splat(1e-3 * 1.03f32.powi(i))).collect();
    for kind in [1, 2, 3] {
        for pair in mapped(kind, &greys).windows(2) {
            assert!(pair[1].x >= pair[0].x - 1e-5, "tone map {kind}: {} after {}", pair[1], pair[0]);
        }
    }
}

#[test]
fn mis_weights_sum_to_one() {
    let pairs = [[1.0f32, 1.0], [0.2, 3.0], [1e-6, 1e6], [1e30, 1e30], [5.0, 0.0]];
    for heuristic in [0u32, 1] {
        let weight = |a: f32, b: f32| TestInput::new(&[[a.to_bits(), b.to_bits(), heuristic, 0]]);
        let inputs: Vec<_> = pairs.iter().flat_map(|p| [weight(p[0], p[1]), weight(p[1], p[0])]).collect();
        for (pair, w) in pairs.iter().zip(functions(functions::MIS_WEIGHT, &inputs).chunks(2)) {
            let power = |x: f32| f64::from(x).powi(heuristic as i32 + 1);
            let expected = power(pair[0]) / (power(pair[0]) + power(pair[1]));
            assert_close(w[0].a()[0], expected, 1e-6, pair);
            assert_close(w[0].a()[0] + w[1].a()[0], 1.0, 1e-6, pair);
        }
    }
}

/// How often each of four weights is selected, over `draws` streams; every stream's weight sum is checked.
fn selections(operation: u32, weights: [f32; 4], draws: u32) -> Vec<f64> {
    let inputs: Vec<_> =
        (0..draws).map(|i| TestInput::new(&[weights.map(f32::to_bits), [i & 0xffff, i >> 16, 77, 0]])).collect();
    let mut counts = vec![0.0; 4];
    let total: f32 = weights.iter().sum();
    for output in functions(operation, &inputs) {
        let [light, point, sum, _] = output.a;
        assert_close(f32::from_bits(sum), total.into(), 1e-6, weights);
        if light != u32::MAX {
            assert_eq!(point, 10 * light, "the sample is kept whole");
            counts[light as usize] += 1.0;
        }
    }
    counts
}

#[test]
fn reservoir_streams_follow_the_exact_pmf() {
    const DRAWS: u32 = 60_000;
    let all = [
        [1.0, 1.0, 1.0, 1.0],
        [0.1, 0.2, 0.3, 0.4],
        [5.0, 0.0, 1.0, 0.5],
        [1e-3, 1e3, 1.0, 10.0],
        [0.0, 0.0, 2.0, 0.0],
    ];
    for operation in [functions::STREAM_OF_FOUR, functions::STREAM_MERGED] {
        for weights in all {
            let counts = selections(operation, weights, DRAWS);
            let total: f64 = weights.iter().copied().map(f64::from).sum();
            let expected: Vec<f64> = weights.iter().map(|w| f64::from(*w) / total * f64::from(DRAWS)).collect();
            let p = chi_squared(&counts, &expected);
            assert!(p > significance(10), "{weights:?}: {counts:?}, p = {p:e}");
        }
    }
    assert_eq!(selections(functions::STREAM_OF_FOUR, [0.0; 4], 100), [0.0; 4], "nothing is selected from nothing");
    // The test can fail: these are not the frequencies of these weights.
    let counts = selections(functions::STREAM_OF_FOUR, [0.1, 0.2, 0.3, 0.4], DRAWS);
    let wrong: Vec<f64> = [0.105, 0.2, 0.3, 0.395].map(|p| p * f64::from(DRAWS)).to_vec();
    assert!(chi_squared(&counts, &wrong) < significance(10));
}

#[test]
fn points_survive_packing() {
    let mut random = Random::new(8);
    let mut all: Vec<[f32; 2]> = (0..1000).map(|_| [random.unit(), random.unit()]).collect();
    all.extend([[0.0, 0.0], [1.0, 1.0], [0.5, 1.0 - 0.5f32.powi(24)]]);
    let inputs: Vec<_> = all.iter().map(|u| TestInput::floats(&[[u[0], u[1], 0.0, 0.0]])).collect();
    for (u, output) in all.iter().zip(functions(functions::POINTS, &inputs)) {
        for (u, back) in u.iter().zip(output.b()) {
            assert!((u - back).abs() <= 0.501 / 65536.0 && back > 0.0 && back < 1.0, "{u} became {back}");
        }
    }
}

#[test]
fn numbers_are_classified_by_their_bits() {
    let cases = [
        (f32::NAN.to_bits(), [1, 0]),
        (0xffc0_0001, [1, 0]),
        (0x7f80_0001, [1, 0]),
        (f32::INFINITY.to_bits(), [0, 1]),
        (f32::NEG_INFINITY.to_bits(), [0, 1]),
        (f32::MAX.to_bits(), [0, 0]),
        (0f32.to_bits(), [0, 0]),
        (1, [0, 0]),
    ];
    let inputs = cases.map(|(bits, _)| TestInput::new(&[[bits, 0, 0, 0]]));
    for ((bits, expected), output) in cases.iter().zip(functions(functions::CLASSIFY, &inputs)) {
        assert_eq!(output.a[..2], expected[..], "{bits:#x}");
    }
}

/// A scene with one floor, so that there is something to upload.
fn floor(material: Material) -> Scene {
    Scene {
        meshes: vec![shapes::parallelogram(Vec3::new(-1.0, 0.0, 1.0), Vec3::X * 2.0, Vec3::Z * -2.0, 0)],
        instances: vec![Instance { mesh: 0, transform: glam::Mat4::IDENTITY }],
        materials: vec![material],
        ..Scene::default()
    }
}

const TEXTURE_SIZE: [u32; 2] = [5, 3];

fn noise_texture(wrap: [Wrap; 2], linear_filter: bool) -> Texture {
    let mut random = Random::new(9);
    let pixels = (0..TEXTURE_SIZE[0] * TEXTURE_SIZE[1] * 4).map(|_| random.next_u32() as u8).collect();
    let [width, height] = TEXTURE_SIZE;
    Texture { name: "noise".into(), width, height, pixels: Arc::new(pixels), wrap, linear_filter }
}

/// The glTF sampler on the CPU: RGBA with sRGB decoded before filtering.
fn sample_texture(texture: &Texture, uv: DVec2) -> [f64; 4] {
    let wrap = |i: i64, size: i64, wrap: Wrap| match wrap {
        Wrap::Repeat => i.rem_euclid(size),
        Wrap::Clamp => i.clamp(0, size - 1),
        Wrap::Mirror => {
            let m = i.rem_euclid(2 * size);
            if m < size { m } else { 2 * size - 1 - m }
        }
    };
    let (width, height) = (i64::from(texture.width), i64::from(texture.height));
    let texel = |x: i64, y: i64| -> [f64; 4] {
        let index = (wrap(y, height, texture.wrap[1]) * width + wrap(x, width, texture.wrap[0])) as usize * 4;
        let [r, g, b, a] = [0, 1, 2, 3].map(|c| f64::from(texture.pixels[index + c]) / 255.0);
        [twins::srgb_decode(r), twins::srgb_decode(g), twins::srgb_decode(b), a]
    };
    let p = uv * DVec2::new(width as f64, height as f64);
    if !texture.linear_filter {
        return texel(p.x.floor() as i64, p.y.floor() as i64);
    }
    let base = (p - 0.5).floor();
    let f = p - 0.5 - base;
    let (x, y) = (base.x as i64, base.y as i64);
    let corners = [texel(x, y), texel(x + 1, y), texel(x, y + 1), texel(x + 1, y + 1)];
    let weights = [(1.0 - f.x) * (1.0 - f.y), f.x * (1.0 - f.y), (1.0 - f.x) * f.y, f.x * f.y];
    [0, 1, 2, 3].map(|c| corners.iter().zip(weights).map(|(t, w)| t[c] * w).sum())
}

#[test]
fn textures_are_read_as_the_specification_says() {
    let wraps = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];
    let mut scene = floor(Material::default());
    let mut transforms = Vec::new();
    for linear_filter in [false, true] {
        for (i, u) in wraps.into_iter().enumerate() {
            for (j, v) in wraps.into_iter().enumerate() {
                let texture = scene.textures.len() as u32;
                let transformed = (i + j) % 2 == 1;
                let (offset, rotation, scale) = if transformed {
                    (Vec2::new(0.3, -0.2), 0.7f32, Vec2::new(1.5, 0.6))
                } else {
                    (Vec2::ZERO, 0.0, Vec2::ONE)
                };
                let uv_set = u32::from(transformed);
                let reference = TextureRef { texture, uv_set, offset, rotation, scale };
                scene.textures.push(noise_texture([u, v], linear_filter));
                scene.materials.push(Material { base_color_texture: Some(reference), ..Material::default() });
                transforms.push(reference);
            }
        }
    }
    let flat = flatten(&scene);
    let mut random = Random::new(10);
    let uvs: Vec<Vec2> = (0..300)
        .map(|_| random.in_box(Vec3::splat(-3.0), Vec3::splat(3.0)).truncate())
        .chain([Vec2::ZERO, Vec2::ONE, Vec2::new(0.999, 0.001)])
        .collect();
    let mut inputs = Vec::new();
    let mut expected = Vec::new();
    for (i, reference) in transforms.iter().enumerate() {
        for uv in &uvs {
            // What the other UV set holds must not matter.
            let (a, b) = if reference.uv_set == 0 { (*uv, Vec2::splat(0.4)) } else { (Vec2::splat(0.4), *uv) };
            let words = [a.x, a.y, b.x, b.y].map(f32::to_bits);
            inputs.push(TestInput::new(&[words, [i as u32 + 1, 0, 0, 0]]));
            // KHR_texture_transform: T x R x S, R as the extension's GLSL has it: mat3(c, s, 0, -s, c, 0, 0, 0, 1) by
            // columns is a turn of the transposed matrix, u' = c u + s v and v' = -s u + c v.
            let (s, c) = f64::from(reference.rotation).sin_cos();
            let scaled = uv.as_dvec2() * reference.scale.as_dvec2();
            let turned = DVec2::new(c * scaled.x + s * scaled.y, c * scaled.y - s * scaled.x);
            expected.push((i, turned + reference.offset.as_dvec2()));
        }
    }
    let mut near_edges = 0;
    for (output, (i, uv)) in scene_functions(&flat, scene_functions::TEXTURE_READ, &inputs).iter().zip(&expected) {
        let texture = &scene.textures[*i];
        let p = *uv * DVec2::new(TEXTURE_SIZE[0].into(), TEXTURE_SIZE[1].into());
        if !texture.linear_filter && (p - p.round()).abs().min_element() < 1e-4 {
            near_edges += 1;
            continue;
        }
        for (actual, expected) in output.a().into_iter().zip(sample_texture(texture, *uv)) {
            assert!((f64::from(actual) - expected).abs() < 1e-4, "{:?} {uv}: {actual} {expected}", texture.wrap);
        }
    }
    assert!(near_edges < expected.len() / 20);
    let plain = scene_functions(&flat, scene_functions::TEXTURE_READ, &[TestInput::new(&[[0; 4], [0; 4]])]);
    assert_eq!(plain[0].a(), [1.0; 4], "no texture is white");
}

#[test]
fn huge_texture_coordinates_are_finite() {
    let reference = TextureRef { texture: 0, uv_set: 0, offset: Vec2::ZERO, rotation: 0.0, scale: Vec2::ONE };
    let mut scene = floor(Material { base_color_texture: Some(reference), ..Material::default() });
    scene.textures.push(noise_texture([Wrap::Repeat, Wrap::Clamp], true));
    let inputs: Vec<_> = [1e9f32, -1e9, 1e30, -1e30, 3e38]
        .into_iter()
        .map(|x| TestInput::floats(&[[x, x, 0.0, 0.0], [0.0; 4]]))
        .collect();
    for output in scene_functions(&flatten(&scene), scene_functions::TEXTURE_READ, &inputs) {
        assert!(output.a().iter().all(|c| (0.0..=1.0).contains(c)), "{:?}", output.a());
    }
}

fn light(kind: PunctualKind, intensity: f32) -> PunctualLight {
    PunctualLight {
        kind,
        position: Vec3::new(0.5, 2.0, -0.5),
        direction: Vec3::new(0.2, -1.0, 0.1).normalize(),
        intensity: Vec3::new(1.0, 0.5, 0.25) * intensity,
        range: f32::INFINITY,
    }
}

/// An emissive floor, punctual lights as unequal as may be (one black), and a sky.
fn unequal_lights() -> Scene {
    let mut scene = floor(Material { emissive: Vec3::new(3.0, 2.0, 1.0), ..Material::default() });
    scene.lights = [1.0, 0.0, 10.0, 0.3, 4.0, 4.0].map(|i| light(PunctualKind::Point, i)).to_vec();
    scene.environment = Some(Environment::even(Vec3::ONE));
    scene
}

#[test]
fn lights_are_picked_by_their_probability() {
    const DRAWS: u32 = 200_000;
    let flat = flatten(&unequal_lights());
    let inputs: Vec<_> = (0..DRAWS).map(|i| TestInput::new(&[[i & 0xffff, i >> 16, 5, 0]])).collect();
    let mut counts = vec![0.0; flat.lights.len()];
    let mut inverse = 0.0;
    for output in scene_functions(&flat, scene_functions::LIGHT_SAMPLE, &inputs) {
        let [index, _, pdf, pmf] = output.a;
        let (pdf, pmf) = (f32::from_bits(pdf), f32::from_bits(pmf));
        assert_eq!(pmf, flat.lights[index as usize].pmf);
        assert!(pdf > 0.0, "light {index} was drawn with density {pdf}");
        counts[index as usize] += 1.0;
        inverse += 1.0 / f64::from(pmf);
    }
    let expected: Vec<f64> = flat.lights.iter().map(|l| f64::from(l.pmf) * f64::from(DRAWS)).collect();
    let p = chi_squared(&counts, &expected);
    assert!(p > 0.001, "{counts:?} for {expected:?}, p = {p:e}");
    assert_eq!(expected.iter().filter(|e| **e == 0.0).count(), 1, "the black light is in the table, and never drawn");

    // The mean of 1 / p counts the lights that can be drawn; its variance is sum of 1 / p less the square of their number.
    let possible: Vec<f64> = flat.lights.iter().map(|l| f64::from(l.pmf)).filter(|p| *p > 0.0).collect();
    let n = possible.len() as f64;
    let deviation = ((possible.iter().map(|p| 1.0 / p).sum::<f64>() - n * n) / f64::from(DRAWS)).sqrt();
    let mean = inverse / f64::from(DRAWS);
    assert!((mean - n).abs() < 4.0 * deviation, "{mean} lights, there are {n} (+- {deviation})");

    let mut wrong = expected.clone();
    wrong[3] *= 1.1;
    wrong[4] -= expected[3] * 0.1;
    assert!(chi_squared(&counts, &wrong) < 0.001 || expected[3] < 500.0, "the test can fail");
}

#[test]
fn punctual_lights_follow_their_extension() {
    let (inner, outer) = (0.3f32, 0.6f32);
    let mut scene = floor(Material::default());
    scene.lights = vec![
        light(PunctualKind::Point, 7.0),
        PunctualLight { range: 2.5, ..light(PunctualKind::Point, 7.0) },
        light(PunctualKind::Spot { inner, outer }, 5.0),
        light(PunctualKind::Directional, 3.0),
    ];
    let flat = flatten(&scene);
    let mut random = Random::new(11);
    let points: Vec<Vec3> =
        (0..500).map(|_| random.in_box(Vec3::new(-1.5, 0.0, -1.5), Vec3::new(1.5, 1.5, 1.5))).collect();
    let cases: Vec<(usize, Vec3)> = (0..4).flat_map(|i| points.iter().map(move |p| (i, *p))).collect();
    let inputs: Vec<_> = cases
        .iter()
        .map(|(i, p)| TestInput::new(&[p.extend(0.0).to_array().map(f32::to_bits), [*i as u32, 0, 0, 0]]))
        .collect();
    let mut partly = 0;
    for ((i, point), output) in cases.iter().zip(scene_functions(&flat, scene_functions::LIGHT_CONTRIBUTION, &inputs)) {
        let light = &scene.lights[*i];
        let to_light = d(light.position) - d(*point);
        let distance = to_light.length();
        let direction = d(light.direction);
        let (expected, expected_direction) = match light.kind {
            PunctualKind::Directional => (1.0, -direction),
            _ => {
                let x = distance / f64::from(light.range);
                let window = (1.0 - x.powi(4)).clamp(0.0, 1.0);
                let cone = match light.kind {
                    PunctualKind::Spot { inner, outer } => {
                        let scale = 1.0 / (f64::from(inner).cos() - f64::from(outer).cos()).max(0.001);
                        let offset = -f64::from(outer).cos() * scale;
                        let cosine = direction.dot(-to_light / distance);
                        (cosine * scale + offset).clamp(0.0, 1.0).powi(2)
                    }
                    _ => 1.0,
                };
                partly += i32::from(cone > 0.01 && cone < 0.99);
                (window * cone / (distance * distance), to_light / distance)
            }
        };
        let value = xyz(output.a());
        for (actual, intensity) in value.to_array().into_iter().zip(light.intensity.to_array()) {
            // Near the edge of a cone a rounding error of the cosine is all there is.
            assert_close(actual, expected * f64::from(intensity), 2e-5, (i, point));
        }
        assert!(d(xyz(output.b())).distance(expected_direction) < 1e-5);
        assert_eq!(output.b()[3], 0.0, "a point mass has no solid angle");
    }
    assert!(partly > 20, "the penumbra was hit {partly} times");
}

#[test]
fn emissive_triangles_send_radiance_from_their_front() {
    let emissive = Vec3::new(3.0, 2.0, 1.0);
    let mut inputs = Vec::new();
    let mut random = Random::new(12);
    for _ in 0..500 {
        let point = random.in_box(Vec3::new(-2.0, -2.0, -2.0), Vec3::new(2.0, 2.0, 2.0));
        inputs.push((point, random.next_u32() % 2, random.next_u32()));
    }
    let words: Vec<_> = inputs
        .iter()
        .map(|(p, light, point)| TestInput::new(&[p.extend(0.0).to_array().map(f32::to_bits), [*light, *point, 0, 0]]))
        .collect();
    for double_sided in [false, true] {
        let flat = flatten(&floor(Material { emissive, double_sided, ..Material::default() }));
        let contributions = scene_functions(&flat, scene_functions::LIGHT_CONTRIBUTION, &words);
        let pdfs = scene_functions(&flat, scene_functions::LIGHT_PDFS, &words);
        for (((position, light, packed), output), pdf) in inputs.iter().zip(contributions).zip(pdfs) {
            let triangle = &flat.triangles[flat.lights[*light as usize].triangle as usize];
            let u = [packed & 0xffff, packed >> 16].map(|q| (f64::from(q) + 0.5) / 65536.0);
            let (b1, b2) = (u[0].sqrt() * (1.0 - u[1]), u[0].sqrt() * u[1]);
            let (p0, p1, p2) = (d(triangle.p0), d(triangle.p1), d(triangle.p2));
            let to_light = p0 + b1 * (p1 - p0) + b2 * (p2 - p0) - d(*position);
            let normal = (p1 - p0).cross(p2 - p0).normalize();
            let cosine = normal.dot(-to_light.normalize());
            let cosine = if double_sided { cosine.abs() } else { cosine.max(0.0) };
            let geometry = cosine / to_light.length_squared();
            for (actual, emitted) in output.a().into_iter().zip(emissive.to_array()).take(3) {
                assert_close(actual, geometry * f64::from(emitted), 1e-5, position);
            }
            if cosine > 1e-2 {
                assert!(f64::from(output.a()[3]) < to_light.length(), "a light must not shadow itself");
                // The hit's density is the sample's, in solid angle.
                assert_close(pdf.a()[0], pdf.a()[1].into(), 1e-6, position);
                let area = 0.5 * (p1 - p0).cross(p2 - p0).length();
                assert_close(pdf.a()[1], f64::from(flat.lights[*light as usize].pmf) / area / geometry, 1e-6, position);
            }
        }
    }
}

/// A rectangle light a metre wide, anywhere and turned any way, with a blocker in front of it if one is wanted: the
/// fraction of shadow rays that arrive from points `distance` away (at least that far off the light's plane, times the
/// cosine).
fn shadow_rays(random: &mut Random, distance: f32, blocker: Option<f32>) -> (usize, usize) {
    let centre = random.direction() * 16.0;
    let turn = glam::Quat::from_rotation_arc(Vec3::Z, random.direction());
    let (u, v, normal) = (turn * Vec3::X, turn * Vec3::Y, turn * Vec3::Z);
    let corner = centre - 0.5 * (u + v);
    let mut scene = floor(Material { emissive: Vec3::ONE, ..Material::default() });
    scene.meshes = vec![shapes::parallelogram(corner, u, v, 0)];
    if let Some(gap) = blocker {
        scene.materials.push(Material { double_sided: true, ..Material::default() });
        scene.meshes.push(shapes::parallelogram(corner + normal * gap - 0.5 * (u + v), 2.0 * u, 2.0 * v, 1));
        scene.instances.push(Instance { mesh: 1, transform: glam::Mat4::IDENTITY });
    }
    let inputs: Vec<_> = (0..2000)
        .map(|_| {
            // Towards a point of the light, at cosines down to 0.05.
            let cosine = random.range(0.05, 1.0);
            let across = Vec2::from_angle(random.range(0.0, TAU as f32)) * (1.0 - cosine * cosine).sqrt();
            let wi = u * across.x + v * across.y + normal * cosine;
            let at = corner + u * random.unit() + v * random.unit();
            let point = at + wi * distance;
            // A surface that faces the light, more or less.
            let facing = (random.direction() * 0.7 - wi).normalize();
            let words = |x: Vec3| x.extend(0.0).to_array().map(f32::to_bits);
            TestInput::new(&[words(point), words(facing), [random.next_u32() % 2, random.next_u32(), 0, 0]])
        })
        .collect();
    let outputs = scene_functions(&flatten(&scene), scene_functions::SHADOW_RAY, &inputs);
    let lit: Vec<_> = outputs.iter().filter(|o| o.a()[0] > 0.0).collect();
    (lit.iter().filter(|o| o.b[0] == 1).count(), lit.len())
}

#[test]
fn lights_do_not_shadow_themselves() {
    let mut random = Random::new(19);
    let mut tried = 0;
    for exponent in -6..6 {
        for _ in 0..4 {
            let distance = 4f32.powi(exponent);
            let (arrived, all) = shadow_rays(&mut random, distance, None);
            assert_eq!(arrived, all, "from {distance} m");
            tried += all;
        }
    }
    assert!(tried > 80_000, "{tried}");
}

#[test]
fn what_hangs_just_below_a_light_shadows_it() {
    let mut random = Random::new(20);
    for _ in 0..8 {
        let (arrived, all) = shadow_rays(&mut random, 16.0, Some(0.0015));
        assert!(all > 1500 && arrived == 0, "{arrived} of {all} pass through the blocker");
    }
}

#[test]
fn environment_directions_follow_the_convention() {
    // u = 0.5 + atan2(x, -z) / 2 pi, v = acos(y) / pi: the centre of the map is -Z, its right quarter +X.
    let (width, height) = (8u32, 4u32);
    let mut random = Random::new(13);
    let pixels: Vec<[f32; 3]> = (0..width * height).map(|_| [0; 3].map(|_| random.unit())).collect();
    let mut scene = floor(Material::default());
    scene.environment = Some(Environment { width, height, pixels: pixels.clone() });
    let flat = flatten(&scene);
    let known = [
        (Vec3::NEG_Z, [0.5, 0.5]),
        (Vec3::X, [0.75, 0.5]),
        (Vec3::NEG_X, [0.25, 0.5]),
        (Vec3::new(0.0, 0.5f32.sqrt(), -0.5f32.sqrt()), [0.5, 0.25]),
    ];
    let mut all: Vec<Vec3> = known.iter().map(|(direction, _)| *direction).collect();
    all.extend((0..2000).map(|_| random.direction()));
    let inputs: Vec<_> = all.iter().map(|w| TestInput::floats(&[w.extend(0.0).to_array()])).collect();
    let outputs = scene_functions(&flat, scene_functions::ENVIRONMENT, &inputs);
    for ((direction, uv), output) in known.iter().zip(&outputs) {
        let [u, v, ..] = output.b();
        // WGSL promises no more of acos and atan2 than 4096 ulp.
        assert!((u - uv[0]).abs() < 1e-4 && (v - uv[1]).abs() < 1e-4, "{direction}: {u} {v}");
    }
    let texel = |x: i64, y: i64| {
        let (x, y) = (x.rem_euclid(width.into()), y.clamp(0, i64::from(height) - 1));
        DVec3::from_array(pixels[(y * i64::from(width) + x) as usize].map(f64::from))
    };
    let mut worst = DVec2::ZERO;
    for (direction, output) in all.iter().zip(outputs) {
        let w = d(*direction);
        let uv = DVec2::new(0.5 + w.x.atan2(-w.z) / TAU, w.y.clamp(-1.0, 1.0).acos() / PI);
        let p = uv * DVec2::new(width.into(), height.into()) - 0.5;
        let (base, f) = (p.floor(), p - p.floor());
        let (x, y) = (base.x as i64, base.y as i64);
        let top = texel(x, y).lerp(texel(x + 1, y), f.x);
        let expected = top.lerp(texel(x, y + 1).lerp(texel(x + 1, y + 1), f.x), f.y);
        let error = (DVec2::new(output.b()[0].into(), output.b()[1].into()) - uv).abs();
        worst = worst.max(error);
        // Eight texels round, hence at most eight times the error of the coordinates.
        assert!(d(xyz(output.a())).distance(expected) < 2e-3, "{direction}");
    }
    println!("largest error of environment coordinates: {worst}");
    assert!(worst.max_element() < 1e-4, "{worst}");
    scene.environment = None;
    let none = scene_functions(&flatten(&scene), scene_functions::ENVIRONMENT, &inputs[..1]);
    assert_eq!(none[0].a()[..3], [0.0; 3], "no environment is black");
}

#[test]
fn the_poles_of_the_environment_are_defined() {
    let mut scene = floor(Material::default());
    scene.environment = Some(Environment { width: 1, height: 2, pixels: vec![[1.0; 3], [2.0; 3]] });
    let directions = [Vec3::Y, Vec3::NEG_Y, Vec3::new(-0.0, 1.0, -0.0), Vec3::new(-0.0, -1.0, -0.0)];
    let inputs: Vec<_> = directions.iter().map(|w| TestInput::floats(&[w.extend(0.0).to_array()])).collect();
    for (w, output) in directions.iter().zip(scene_functions(&flatten(&scene), scene_functions::ENVIRONMENT, &inputs)) {
        let (v, radiance) = if w.y > 0.0 { (0.0, 1.0) } else { (1.0, 2.0) };
        let [r, g, b, pdf] = output.a();
        assert_eq!([r, g, b], [radiance; 3], "{w}");
        assert!(pdf > 0.0 && pdf.is_finite(), "{w}: density {pdf}");
        assert!((output.b()[0] - 0.5).abs() < 1e-6 && (output.b()[1] - v).abs() < 1e-4, "{w}: {:?}", output.b());
    }
}

#[test]
fn masked_light_shines_only_where_it_is() {
    let reference = TextureRef { texture: 0, uv_set: 0, offset: Vec2::ZERO, rotation: 0.0, scale: Vec2::ONE };
    let mut scene = floor(Material {
        emissive: Vec3::ONE,
        alpha: AlphaMode::Mask(0.5),
        base_color_texture: Some(reference),
        ..Material::default()
    });
    // Left half there, right half cut away.
    scene.textures.push(Texture {
        name: "mask".into(),
        width: 2,
        height: 1,
        pixels: Arc::new(vec![255, 255, 255, 255, 255, 255, 255, 0]),
        wrap: [Wrap::Clamp; 2],
        linear_filter: false,
    });
    let flat = flatten(&scene);
    let mut random = Random::new(17);
    let cases: Vec<(u32, u32)> = (0..1000).map(|_| (random.next_u32() % 2, random.next_u32())).collect();
    let above = Vec3::new(0.1, 2.0, 0.2).extend(0.0).to_array().map(f32::to_bits);
    let inputs: Vec<_> = cases.iter().map(|(light, point)| TestInput::new(&[above, [*light, *point, 0, 0]])).collect();
    let mut lit = 0;
    for ((light, point), output) in
        cases.iter().zip(scene_functions(&flat, scene_functions::LIGHT_CONTRIBUTION, &inputs))
    {
        let triangle = &flat.attributes[flat.lights[*light as usize].triangle as usize];
        let [r, v] = [point & 0xffff, point >> 16].map(|q| (f64::from(q) + 0.5) / 65536.0);
        let (b1, b2) = (r.sqrt() * (1.0 - v), r.sqrt() * v);
        let u = (1.0 - b1 - b2) * f64::from(triangle.uv_a.x)
            + b1 * f64::from(triangle.uv_a.z)
            + b2 * f64::from(triangle.uv_b.x);
        if (u - 0.5).abs() > 1e-4 {
            assert_eq!(output.a()[0] > 0.0, u < 0.5, "u = {u}");
            lit += i32::from(u < 0.5);
        }
    }
    assert!((400..600).contains(&lit), "half of the floor is lit: {lit}");
}

/// The combination of MikkTSpace: interpolated normal, tangent and bitangent, none of them normalised, weighted by the
/// texel.
#[test]
fn mapped_normals_follow_mikktspace() {
    let reference = TextureRef { texture: 0, uv_set: 0, offset: Vec2::ZERO, rotation: 0.0, scale: Vec2::ONE };
    let texel = [220u8, 90, 180, 255];
    let mut scene = floor(Material { normal_texture: Some(reference), normal_scale: 0.7, ..Material::default() });
    scene.textures.push(Texture {
        name: "normal".into(),
        width: 1,
        height: 1,
        pixels: Arc::new(texel.to_vec()),
        wrap: [Wrap::Repeat; 2],
        linear_filter: false,
    });
    let mut flat = flatten(&scene);
    // Corner normals far apart, so that their mean is much shorter than 1; tangents as they come.
    let mut random = Random::new(18);
    let triangle = &mut flat.attributes[0];
    let [n0, n1, n2] = [Vec3::new(0.9, 0.4, 0.0), Vec3::new(-0.7, 0.5, 0.5), Vec3::new(-0.1, 0.4, -0.9)];
    triangle.normals = [n0, n1, n2].map(|n| octahedral::pack(n.normalize()));
    triangle.tangents_01 = random.next_u32();
    // The bitangent of corner 1 turned, the angle of corner 2.
    triangle.tangent_2 = 1 << (BITANGENT_SHIFT + 1) | 0x5a3c;
    let angles = [triangle.tangents_01 & 0xffff, triangle.tangents_01 >> 16, triangle.tangent_2 & 0xffff];
    let corners = triangle.normals.map(octahedral::unpack);
    let flags = triangle.tangent_2;
    flat.triangles[0].flags |= TRIANGLE_TANGENTS;

    let uvs: Vec<Vec2> = (0..200)
        .map(|_| {
            let u = random.unit();
            Vec2::new(u, random.unit() * (1.0 - u))
        })
        .collect();
    let inputs: Vec<_> =
        uvs.iter().map(|uv| TestInput::new(&[[0; 4], [uv.x.to_bits(), uv.y.to_bits(), 0, 0]])).collect();
    let mut told_apart = 0;
    for (uv, output) in uvs.iter().zip(scene_functions(&flat, scene_functions::SHADING_NORMAL, &inputs)) {
        let weights = [1.0 - uv.x - uv.y, uv.x, uv.y].map(f64::from);
        let (mut n, mut t, mut b) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        for corner in 0..3 {
            let (tangent, bitangent) = octahedral::orthonormal_basis(corners[corner]);
            let (sin, cos) = (f64::from(angles[corner]) * TAU / 65536.0).sin_cos();
            let tangent = d(tangent) * cos + d(bitangent) * sin;
            let sign = if flags >> (BITANGENT_SHIFT as usize + corner) & 1 == 0 { 1.0 } else { -1.0 };
            n += weights[corner] * d(corners[corner]);
            t += weights[corner] * tangent;
            b += weights[corner] * sign * d(corners[corner]).cross(tangent);
        }
        let [x, y, z, _] = texel.map(|c| f64::from(c) / 255.0 * 2.0 - 1.0);
        let expected = (t * (0.7 * x) + b * (0.7 * y) + n * z).normalize();
        let actual = d(xyz(output.a()));
        assert!(actual.distance(expected) < 1e-4, "{uv}: {actual} is not {expected}");
        let wrong = (t * (0.7 * x) + b * (0.7 * y) + n.normalize() * z).normalize();
        told_apart += i32::from(wrong.distance(expected) > 0.05);
    }
    assert!(told_apart > 100, "a normalised normal would pass: {told_apart}");
}

#[test]
fn a_film_point_comes_back_from_its_ray() {
    use restir::scene::{Camera, Projection};
    let [width, height] = support::harness::SIZE.map(|s| s as f32);
    let mut random = Random::new(14);
    let mut scene = floor(Material::default());
    let mut camera = Camera::look_at("c", Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO, 0.8);
    for projection in [camera.projection, Projection::Orthographic { half_height: 1.5 }] {
        camera.projection = projection;
        scene.cameras = vec![camera.clone()];
        let films: Vec<[f32; 2]> = (0..300).map(|_| [width * random.unit(), height * random.unit()]).collect();
        let inputs: Vec<_> =
            films.iter().map(|f| TestInput::floats(&[[f[0], f[1], random.range(0.1, 20.0), 0.0]])).collect();
        let outputs = scene_functions(&flatten(&scene), scene_functions::CAMERA, &inputs);
        for (film, output) in films.iter().zip(outputs) {
            let [x, y, ..] = output.a();
            assert!((x - film[0]).abs() < 1e-2 && (y - film[1]).abs() < 1e-2, "{film:?} came back as {x} {y}");
            let ray = xyz(output.b());
            assert!((ray.length() - 1.0).abs() < 1e-5);
            let (right, up) = (camera.forward.cross(camera.up), camera.up);
            match projection {
                Projection::Orthographic { .. } => assert!(ray.distance(camera.forward) < 1e-5),
                // Right on the film is right in the world, up on the film (a small y) is up.
                Projection::Perspective { .. } => {
                    assert_eq!(ray.dot(right) > 0.0, film[0] > 0.5 * width, "{film:?}");
                    assert_eq!(ray.dot(up) > 0.0, film[1] < 0.5 * height, "{film:?}");
                }
            }
        }
    }
}
