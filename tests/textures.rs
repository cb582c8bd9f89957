//! Mip chains and ray cones: what is stored, what is read at every level, how wide a ray is, and that far textures are
//! still.

mod support;

use glam::{DVec2, Mat4, Vec2, Vec3};
use restir::gpu::shader::table;
use restir::gpu_scene::GpuScene;
use restir::scene::flat::TextureArray;
use restir::scene::gpu_types::TextureRead;
use restir::scene::random::Random;
use restir::scene::{AlphaMode, Camera, FlatScene, Instance, Material, Mesh, Scene, Texture, TextureRef, Wrap, shapes};
use restir::{Error, Renderer};
use std::sync::Arc;
use support::harness::{TestInput, TestOutput, eval_gpu, scene_functions};
use support::{flatten, twins};

const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];

fn reference(texture: usize) -> TextureRef {
    TextureRef { texture: texture as u32, uv_set: 0, offset: Vec2::ZERO, rotation: 0.0, scale: Vec2::ONE }
}

fn texture(size: [u32; 2], wrap: [Wrap; 2], pixel: impl FnMut(u32) -> [u8; 4]) -> Texture {
    let pixels = (0..size[0] * size[1]).flat_map(pixel).collect();
    Texture {
        name: format!("{}x{}", size[0], size[1]),
        width: size[0],
        height: size[1],
        pixels: Arc::new(pixels),
        wrap,
        linear_filter: true,
    }
}

fn noise(size: [u32; 2], wrap: [Wrap; 2], seed: u64) -> Texture {
    let mut random = Random::new(seed);
    texture(size, wrap, |_| random.next_u32().to_le_bytes())
}

/// A floor of two metres a side, seen from above, whose base colour is each texture in turn.
fn floor(textures: Vec<Texture>) -> Scene {
    let materials = (0..textures.len())
        .map(|i| Material { base_color_texture: Some(reference(i)), ..Material::default() })
        .collect();
    Scene {
        meshes: vec![shapes::parallelogram(Vec3::new(-1.0, 0.0, 1.0), Vec3::X * 2.0, Vec3::Z * -2.0, 0)],
        instances: vec![Instance { mesh: 0, transform: Mat4::IDENTITY }],
        materials,
        textures,
        ..Scene::default()
    }
}

fn run(scene: &FlatScene, operation: u32, inputs: &[TestInput]) -> Vec<TestOutput> {
    eval_gpu(&support::gpu(), &table::TESTS_SCENE_FUNCTIONS, Some(scene), operation, inputs)
}

/// How a material reads its base colour, and the array it lies in.
fn image(scene: &FlatScene, material: usize) -> (TextureRead, &TextureArray) {
    let read = scene.materials[material].base_color_texture.read().expect("a texture");
    (read, &scene.textures[read.array as usize])
}

fn levels(read: &TextureRead) -> u32 {
    read.size[0].max(read.size[1]).ilog2() + 1
}

/// Linear RGBA of a stored texel of a level.
fn texel(scene: &FlatScene, material: usize, level: u32, x: u32, y: u32) -> [f64; 4] {
    let (read, array) = image(scene, material);
    let at = array.offset(level, read.layer, (read.origin[0] >> level) + x, (read.origin[1] >> level) + y);
    let [r, g, b, a] = [0, 1, 2, 3].map(|c| f64::from(array.texels[at + c]) / 255.0);
    if read.srgb { [twins::srgb_decode(r), twins::srgb_decode(g), twins::srgb_decode(b), a] } else { [r, g, b, a] }
}

/// One level of the stored chain, filtered on the CPU.
fn bilinear(scene: &FlatScene, material: usize, level: u32, uv: DVec2) -> [f64; 4] {
    let (read, _) = image(scene, material);
    let size = read.size.map(|side| i64::from((side >> level).max(1)));
    let wrap = |i: i64, axis: usize| {
        let size = size[axis];
        (match read.wrap[axis] {
            0 => i.rem_euclid(size),
            1 => Some(i.rem_euclid(2 * size)).map(|m| if m < size { m } else { 2 * size - 1 - m }).unwrap_or_default(),
            _ => i.clamp(0, size - 1),
        }) as u32
    };
    let p = uv * DVec2::new(size[0] as f64, size[1] as f64) - 0.5;
    let (base, f) = (p.floor(), p - p.floor());
    let mut sum = [0.0; 4];
    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let weight = (if dx == 1 { f.x } else { 1.0 - f.x }) * (if dy == 1 { f.y } else { 1.0 - f.y });
        let value = texel(scene, material, level, wrap(base.x as i64 + dx, 0), wrap(base.y as i64 + dy, 1));
        for (sum, value) in sum.iter_mut().zip(value) {
            *sum += weight * value;
        }
    }
    sum
}

const SIZES: [[u32; 2]; 6] = [[1, 1], [3, 5], [64, 64], [4097, 33], [8, 100], [255, 129]];

/// Every size with every pair of wraps.
fn many() -> Scene {
    let pairs = || WRAPS.into_iter().flat_map(|u| WRAPS.map(|v| [u, v]));
    let textures = SIZES.into_iter().flat_map(|size| pairs().map(move |wrap| noise(size, wrap, u64::from(size[0]))));
    floor(textures.collect())
}

#[test]
fn every_level_is_read_as_it_is_stored_however_it_wraps() {
    let scene = flatten(&many());
    let mut random = Random::new(4);
    let (mut inputs, mut expected) = (Vec::new(), Vec::new());
    for material in 0..scene.materials.len() {
        let (read, _) = image(&scene, material);
        for _ in 0..60 {
            let uv = random.in_box(Vec3::splat(-2.5), Vec3::splat(2.5)).truncate();
            // Past the last level too, where there is nothing smaller to read.
            let level = random.unit() * (levels(&read) as f32 + 0.5) - 0.25;
            let level = if random.unit() < 0.3 { level.floor() } else { level };
            let area = 4f32.powf(level) / (read.size[0] * read.size[1]) as f32;
            inputs.push(TestInput::new(&[
                [uv.x, uv.y, 0.0, 0.0].map(f32::to_bits),
                [material as u32, area.to_bits(), 0, 0],
            ]));
            let level = f64::from(level).clamp(0.0, f64::from(levels(&read) - 1));
            let (finer, f) = (level.floor() as u32, level.fract());
            let coarser = (finer + 1).min(levels(&read) - 1);
            let [a, b] = [finer, coarser].map(|k| bilinear(&scene, material, k, uv.as_dvec2()));
            expected.push([0, 1, 2, 3].map(|c| a[c] + f * (b[c] - a[c])));
        }
    }
    for ((output, expected), input) in
        run(&scene, scene_functions::TEXTURE_READ, &inputs).iter().zip(&expected).zip(&inputs)
    {
        for (actual, expected) in output.a().into_iter().zip(expected) {
            assert!((f64::from(actual) - expected).abs() < 3e-4, "{:?}: {actual} is not {expected}", input.b[0]);
        }
    }
}

#[test]
fn the_transform_and_the_uv_set_scale_the_level() {
    let mut scene = floor(vec![noise([64, 32], [Wrap::Repeat; 2], 5)]);
    let turned = TextureRef { rotation: 0.8, scale: Vec2::new(4.0, 0.25), uv_set: 1, ..reference(0) };
    let larger = TextureRef { scale: Vec2::splat(8.0), ..reference(0) };
    for reference in [turned, larger] {
        scene.materials.push(Material { base_color_texture: Some(reference), ..Material::default() });
    }
    let scene = flatten(&scene);
    // Means of the levels 2 and 5: at coordinates scaled by eight, 3 levels coarser.
    let uv = Vec2::new(0.37, 0.81);
    let input = |material: u32, uv: Vec2, areas: [f32; 2]| {
        let words = [uv.x, uv.y, uv.x, uv.y].map(f32::to_bits);
        TestInput::new(&[words, [material, areas[0].to_bits(), areas[1].to_bits(), 0]])
    };
    let area = |level: i32| 4f32.powi(level) / (64.0 * 32.0);
    let outputs = run(
        &scene,
        scene_functions::TEXTURE_READ,
        &[input(1, uv, [0.0, area(2)]), input(1, uv, [area(5), 0.0]), input(2, uv / 8.0, [area(2), 0.0])],
    );
    let (sin, cos) = 0.8f64.sin_cos();
    let scaled = uv.as_dvec2() * DVec2::new(4.0, 0.25);
    let at = DVec2::new(cos * scaled.x + sin * scaled.y, cos * scaled.y - sin * scaled.x);
    let cases = [(1, 2, at), (1, 0, at), (2, 5, uv.as_dvec2())];
    for (output, (material, level, uv)) in outputs.iter().zip(cases) {
        for (actual, expected) in output.a().into_iter().zip(bilinear(&scene, material, level, uv)) {
            assert!((f64::from(actual) - expected).abs() < 1e-3, "level {level}: {actual} is not {expected}");
        }
    }
}

#[test]
fn levels_are_means_in_linear_light() {
    let scene = flatten(&many());
    for material in (0..scene.materials.len()).step_by(9) {
        let (read, _) = image(&scene, material);
        let mean = |level: u32| {
            let [width, height] = read.size.map(|side| (side >> level).max(1));
            let mut sum = [0.0; 4];
            for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
                for (sum, value) in sum.iter_mut().zip(texel(&scene, material, level, x, y)) {
                    *sum += value / f64::from(width * height);
                }
            }
            sum
        };
        let expected = mean(0);
        for level in 1..levels(&read) {
            let texels: u32 = read.size.map(|side| (side >> level).max(1)).iter().product();
            // Rounding a texel to a byte of sRGB moves it by at most 0.5 / 255 times the slope there, 2.3 near white.
            let allowed = 0.5 / 255.0 * 2.3 / f64::from(texels).sqrt() * 3.0 + 1e-6;
            for (actual, expected) in mean(level).iter().zip(expected) {
                let most = allowed.min(0.5 / 255.0 * 2.3 + 1e-6);
                assert!((actual - expected).abs() < most, "{:?} level {level}: {actual} {expected}", read.size);
            }
        }
    }
}

/// The floor's footprint: (areas, spread after a bounce) for a cone of `width` that meets triangle `triangle` from `wo`.
fn footprint(scene: &FlatScene, cases: &[(u32, Vec3, f32, f32, f32)]) -> Vec<([f32; 2], f32)> {
    let input = |&(triangle, wo, width, spread, pdf): &(u32, Vec3, f32, f32, f32)| {
        let [x, y, z] = wo.to_array().map(f32::to_bits);
        TestInput::new(&[[x, y, z, width.to_bits()], [triangle, spread.to_bits(), pdf.to_bits(), 0]])
    };
    let inputs: Vec<_> = cases.iter().map(input).collect();
    let outputs = run(scene, scene_functions::FOOTPRINT, &inputs);
    outputs.iter().map(|output| ([output.a()[0], output.a()[1]], output.a()[2])).collect()
}

#[test]
fn footprints_follow_distance_slant_and_the_density_of_texels() {
    let mut scene = floor(vec![noise([64, 64], [Wrap::Repeat; 2], 6)]);
    scene.meshes[0].uvs = [
        [[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 2.0]].map(Vec2::from).to_vec(),
        [[0.0, 0.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]].map(Vec2::from).to_vec(),
    ];
    let scene = flatten(&scene);
    let slanted = |cosine: f32| Vec3::new((1.0 - cosine * cosine).sqrt(), cosine, 0.0);
    let cases: Vec<_> = [(1.0, 0.01f32), (1.0, 0.5), (0.5, 0.01), (0.1, 0.02), (1.0 / 16.0, 0.1), (0.01, 0.1)]
        .into_iter()
        .flat_map(|(cosine, width)| [0, 1].map(|triangle| (triangle, slanted(cosine), width, 0.0, 1.0)))
        .collect();
    for ((areas, _), (_, wo, width, ..)) in footprint(&scene, &cases).into_iter().zip(&cases) {
        // 4 x 2 and 1/2 x 1/2 of the units over 2 x 2 metres; no longer than 16 times its width.
        let square_metres = width * width / wo.y.max(1.0 / 16.0);
        for (area, density) in areas.into_iter().zip([2.0, 1.0 / 16.0]) {
            let expected = square_metres * density;
            assert!((area / expected - 1.0).abs() < 1e-4, "{wo} {width}: {area} is not {expected}");
        }
    }
}

#[test]
fn cones_widen_by_curvature_and_by_the_lobe() {
    const RADIUS: f32 = 2.0;
    let mut scene = floor(vec![noise([4, 4], [Wrap::Repeat; 2], 7)]);
    scene.meshes.push(shapes::sphere(Vec3::Y * 9.0, RADIUS, 48, 0));
    scene.instances.push(Instance { mesh: 1, transform: Mat4::IDENTITY });
    let scene = flatten(&scene);
    let flat = |triangle: u32| scene.triangles[triangle as usize].p0.y == 0.0;
    let spread = 0.001;
    let width = 0.01;
    let lobe = |pdf: f32| 4.0 / std::f32::consts::PI / 16.0 / pdf;
    let mut cases = Vec::new();
    let mut expected = Vec::new();
    for triangle in 0..scene.triangles.len() as u32 {
        let turn = if flat(triangle) { 0.0 } else { 2.0 * width / RADIUS };
        for pdf in [1e12f32, 100.0, 1.0 / std::f32::consts::PI] {
            cases.push((triangle, Vec3::Y, width, spread, pdf));
            expected.push(((spread + turn).powi(2) + lobe(pdf)).sqrt());
        }
        cases.push((triangle, Vec3::Y, width, spread, 1e-6));
        expected.push(0.5);
    }
    let (mut flats, mut rounds) = (0, 0);
    for (((_, found), expected), (triangle, .., pdf)) in footprint(&scene, &cases).iter().zip(expected).zip(&cases) {
        *if flat(*triangle) { &mut flats } else { &mut rounds } += 1;
        // 16-bit normals and chords for arcs.
        assert!((found / expected - 1.0).abs() < 0.03, "triangle {triangle}, pdf {pdf}: {found} is not {expected}");
    }
    assert!(flats == 8 && rounds > 1000);
}

const SIZE: [u32; 2] = [48, 32];

/// A floor with a checkerboard, far away: `squares` a side, each of 8 x 8 texels.
fn checkerboard(squares: u32, camera: Camera) -> FlatScene {
    let square = |i: u32| [[0, 0, 0, 255], [255; 4]][((i % 16 / 8) ^ (i / 128)) as usize & 1];
    let mut scene = floor(vec![texture([16, 16], [Wrap::Repeat; 2], square)]);
    let scale = Vec2::splat(squares as f32 / 2.0);
    scene.materials[0].base_color_texture = Some(TextureRef { scale, ..reference(0) });
    scene.instances[0].transform = Mat4::from_scale(Vec3::splat(20.0));
    scene.cameras = vec![camera];
    scene.ensure_light(0, 0);
    flatten(&scene)
}

/// Base colours of the pixels' centres under `count` shifts of the camera by parts of a pixel: (mean over all, mean
/// variance of a pixel over the shifts).
fn shimmer(scene: FlatScene, levels: &str, count: u32) -> (f64, f64) {
    let camera = scene.cameras[0].clone();
    let settings = [("render.pixel_filter", "center"), ("render.texture_levels", levels)];
    let mut renderer: Renderer = support::renderer(&support::gpu(), scene, SIZE, "normals", &settings);
    let right = camera.forward.cross(camera.up);
    let mut random = Random::new(8);
    let mut sums = vec![[0.0f64; 2]; (SIZE[0] * SIZE[1]) as usize];
    for _ in 0..count {
        // By up to 0.4 m: several squares, and about a pixel.
        let shift = right * random.unit() + camera.up * random.unit();
        renderer.set_camera(&Camera { position: camera.position + 0.4 * shift, ..camera.clone() });
        renderer.render_frame().expect("a frame");
        let albedo = pollster::block_on(renderer.read_auxiliary()).expect("a picture").albedo;
        for (sum, albedo) in sums.iter_mut().zip(albedo) {
            let value = f64::from(albedo[1]);
            *sum = [sum[0] + value, sum[1] + value * value];
        }
    }
    let n = f64::from(count);
    let pixels = sums.len() as f64;
    let mean = sums.iter().map(|[sum, _]| sum / n).sum::<f64>() / pixels;
    let variance = sums.iter().map(|[sum, squares]| (squares - sum * sum / n) / (n - 1.0)).sum::<f64>() / pixels;
    (mean, variance)
}

#[test]
fn a_far_checkerboard_does_not_shimmer() {
    const SHIFTS: u32 = 24;
    let above = || Camera::look_at("above", Vec3::new(0.0, 30.0, 0.0), Vec3::ZERO, 0.6);
    let along = || Camera::look_at("along", Vec3::new(0.0, 3.0, 18.0), Vec3::new(0.0, -0.64, 8.0), 0.35);
    // Squares of 0.1 m where a pixel is 0.6 m wide; squares of 0.05 m where it is 0.07 x 0.13 m in front and 0.2 x 1.1 m
    // far away.
    for (name, camera, squares, factor) in [("above", above(), 400, 1000.0), ("along", along(), 800, 100.0)] {
        let [cone, finest] =
            ["cone", "finest"].map(|levels| shimmer(checkerboard(squares, camera.clone()), levels, SHIFTS));
        println!("{name}: mean {:.4} and {:.4}, variance {:.2e} and {:.2e}", cone.0, finest.0, cone.1, finest.1);
        // Level 0 is black or white by chance; its mean over 36864 reads has a standard error of 0.0026.
        assert!((cone.0 - finest.0).abs() < 0.012, "{name}: the mean is {} and not {}", cone.0, finest.0);
        assert!(finest.1 > 0.15, "{name}: level 0 shimmers, or this tests nothing: {}", finest.1);
        assert!(cone.1 * factor < finest.1, "{name}: variance {} is not {factor} times below {}", cone.1, finest.1);
    }
}

#[test]
fn near_textures_are_as_sharp_as_ever() {
    // Squares of 26 pixels a side: wherever a pixel is smaller than a texel, level 0 is read and nothing changes.
    let near = || Camera::look_at("near", Vec3::new(0.0, 2.0, 0.0), Vec3::ZERO, 0.6);
    let albedo = |levels: &str| {
        let settings = [("render.texture_levels", levels)];
        let mut renderer = support::renderer(&support::gpu(), checkerboard(40, near()), SIZE, "normals", &settings);
        renderer.render_frame().expect("a frame");
        pollster::block_on(renderer.read_auxiliary()).expect("a picture").albedo
    };
    assert_eq!(albedo("cone"), albedo("finest"));
}

#[test]
fn memory_is_told_and_shared_images_cost_nothing() {
    let one = noise([64, 64], [Wrap::Repeat; 2], 1);
    let same = Texture { pixels: Arc::new(one.pixels.to_vec()), wrap: [Wrap::Clamp; 2], ..one.clone() };
    let scene = flatten(&floor(vec![one.clone(), same, noise([64, 64], [Wrap::Repeat; 2], 2)]));
    let [array] = scene.stats.texture_arrays[..] else { panic!("{:?}", scene.stats.texture_arrays) };
    let chain = 4 * (0..7).map(|k| 4u64.pow(k)).sum::<u64>();
    assert_eq!((array.images, array.layers, array.levels), (2, 2, 7));
    assert_eq!((array.bytes, array.used_bytes), (2 * chain, 2 * chain));
    // The same image as a mask and as a colour is averaged in two ways.
    let mut both = floor(vec![one]);
    let mask = Material { alpha: AlphaMode::Mask(0.5), ..both.materials[0].clone() };
    both.materials.push(mask);
    let both = flatten(&both);
    assert_eq!(both.stats.texture_arrays[0].images, 2);
    let without = flatten(&Scene { meshes: vec![Mesh::default()], ..Scene::default() });
    assert!(without.stats.texture_arrays.is_empty() && without.textures.is_empty());
}

#[test]
fn devices_that_are_too_small_say_the_number() {
    let mut scene = flatten(&floor(vec![noise([4, 4], [Wrap::Repeat; 2], 1)]));
    let large = |width, layers| TextureArray { width, height: 1, layers, levels: 1, texels: Vec::new() };
    for (array, wanted, had) in [(large(8193, 1), 8193, 8192), (large(1, 257), 257, 256)] {
        scene.textures = vec![array];
        match GpuScene::new(&support::gpu(), &scene) {
            Err(Error::Limit { wanted: w, had: h, what, .. }) => {
                assert_eq!((w, h, what.as_str()), (wanted, had, "texture array 0"));
            }
            other => panic!("{:?}", other.err()),
        }
    }
}

/// The file of the benchmarks: 63 images of 1024 x 1024 texels.
#[test]
fn sponza_wastes_nothing() {
    let Some(path) = support::shared_file("sponza_wastes_nothing", "assets/bench/sponza.glb") else { return };
    let scene = restir::scene::gltf::load_file(&path, &Default::default()).expect("a sound file");
    let stats = flatten(&scene).stats.texture_arrays;
    let bytes: u64 = stats.iter().map(|array| array.bytes).sum();
    let used: u64 = stats.iter().map(|array| array.used_bytes).sum();
    assert!(stats.len() == 1 && used == bytes && bytes > 200 << 20, "{stats:?}");
}
