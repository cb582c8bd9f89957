//! A renderer's life: the same seed gives the same bytes, and neither resizing, switching scenes or techniques, nor any
//! value of any parameter leaves it broken, or a number on the film that is none.

mod support;

use glam::{Mat4, Vec3};
use restir::params::{FilmParams, ParamKind, ParamSpec, Params, RenderParams};
use restir::scene::flat::TextureArray;
use restir::scene::{Camera, Environment, Instance, Material, Scene, builtin, shapes};
use restir::{Error, FlatScene, Renderer, techniques};
use support::*;

/// Small. Software drivers compile a kernel anew when the sides of its textures become or cease to be powers of two, so
/// all tests but the one of sizes keep to one kind.
const SIZE: [u32; 2] = [32, 16];

/// Renders, and checks that nothing was left out of the film.
#[track_caller]
fn render_clean(renderer: &mut Renderer, frames: u32, what: &str) -> restir::Image {
    let image = render(renderer, frames);
    let counters = pollster::block_on(renderer.counters()).expect("counters");
    assert_eq!((counters.nan, counters.inf), (0, 0), "{what}");
    assert!(image.pixels.iter().flatten().all(|c| c.is_finite() && *c >= 0.0), "{what}: not finite, or negative");
    renderer.gpu().check().unwrap_or_else(|e| panic!("{what}: {e}"));
    image
}

/// Small versions of the built-in scenes.
fn builtins() -> impl Iterator<Item = &'static str> {
    builtin::ALL.iter().map(|info| if info.name == "many-lights" { "many-lights:50" } else { info.example })
}

#[test]
fn the_same_seed_gives_the_same_bytes() {
    let other_device = fresh_gpu();
    for info in techniques::ALL {
        // One scene at rest and one in motion.
        for scene in ["cornell", "cornell-64"] {
            let what = format!("{} of {scene}", info.id);
            let picture = |gpu: &restir::Gpu, seed: u32| {
                let mut renderer = renderer(gpu, support::builtin(scene), SIZE, info.id, &[]);
                renderer.set_seed(seed);
                let first = render(&mut renderer, 3);
                renderer.reset();
                assert_same(&render(&mut renderer, 3), &first, &format!("{what}, started again"));
                first
            };
            let first = picture(&gpu(), 7);
            assert_same(&picture(&gpu(), 7), &first, &format!("{what}, another renderer"));
            assert_same(&picture(&other_device, 7), &first, &format!("{what}, another device"));
            assert!(picture(&gpu(), 8) != first, "{what}: another seed gives the same picture");
        }
    }
}

#[test]
fn frames_of_one_run_differ_from_each_other() {
    for info in techniques::ALL.iter().filter(|info| info.id != "normals") {
        let mut renderer = renderer(&gpu(), support::builtin("cornell"), SIZE, info.id, &[]);
        renderer.set_accumulate(false);
        let same = render(&mut renderer, 1) == render(&mut renderer, 1);
        assert!(!same, "{}: a seed is used twice", info.id);
    }
}

#[test]
fn accumulation_is_the_mean_of_its_frames() {
    let mut alone = renderer(&gpu(), support::builtin("cornell"), SIZE, "path-tracer", &[]);
    alone.set_accumulate(false);
    let frames = [0; 4].map(|_| render(&mut alone, 1));
    let mut together = renderer(&gpu(), support::builtin("cornell"), SIZE, "path-tracer", &[]);
    let image = render(&mut together, 4);
    assert_eq!(together.accumulated_frames(), 4);
    for (i, pixel) in image.pixels.iter().enumerate() {
        for (c, value) in pixel.iter().enumerate() {
            let mean = frames.iter().map(|f| f.pixels[i][c]).sum::<f32>() / 4.0;
            assert!((mean - value).abs() <= 1e-5 * mean.max(1.0), "pixel {i}: {value}, should be {mean}");
        }
    }
}

#[test]
fn any_size_works_and_the_way_there_does_not_matter() {
    let mut renderer = renderer(&gpu(), support::builtin("cornell"), SIZE, "restir-di", &[("light_samples", "4")]);
    let before = render_clean(&mut renderer, 2, "before");
    for size in [[1, 1], [33, 17], [4097, 3], [3, 1025], [8, 8], [1, 1]] {
        renderer.resize(size.into()).expect("a size");
        let image = render_clean(&mut renderer, 2, &format!("{size:?}"));
        assert_eq!(([image.width, image.height], image.pixels.len()), (size, (size[0] * size[1]) as usize));
        let display = pollster::block_on(renderer.read_display()).expect("a display");
        assert_eq!(display.len(), image.pixels.len() * 4);
        assert!(display.chunks(4).all(|rgba| rgba[3] == 255));
        let auxiliary = pollster::block_on(renderer.read_auxiliary()).expect("auxiliary pictures");
        assert_eq!(auxiliary.depth.len(), image.pixels.len());
    }
    renderer.resize(SIZE.into()).expect("a size");
    assert_same(&render_clean(&mut renderer, 2, "after"), &before, "after all sizes");
}

#[test]
fn sizes_beyond_the_device_are_refused_with_numbers() {
    let mut renderer = renderer(&gpu(), support::builtin("cornell"), SIZE, "restir-di", &[("light_samples", "2")]);
    let before = render(&mut renderer, 1);
    // A side too long; a film buffer too large; reservoirs too large where the film would do.
    for (size, setting) in [([8193, 1], "1"), ([4096, 2049], "1"), ([1920, 1100], "4")] {
        renderer.set("reservoir_size", setting).expect("a setting");
        match renderer.resize(size.into()) {
            Err(error @ Error::Limit { wanted, had, .. }) => {
                assert!(wanted > had, "{error}");
                let words = error.to_string();
                assert!(words.contains(&wanted.to_string()) && words.contains(&had.to_string()), "{words}");
            }
            other => panic!("{size:?}: expected Error::Limit, got {other:?}"),
        }
        assert_eq!(renderer.size(), SIZE.into(), "the old size stays");
        renderer.set("reservoir_size", "1").expect("a setting");
        assert_same(&render_clean(&mut renderer, 1, "after a refusal"), &before, "after a refusal");
    }
    match renderer.resize([0, 5].into()) {
        Err(Error::BadValue { .. }) => {}
        other => panic!("expected Error::BadValue, got {other:?}"),
    }
    assert!(matches!(
        Renderer::new(gpu(), support::builtin("cornell"), [8193, 1].into()).map(|_| ()),
        Err(Error::Limit { .. })
    ));
    renderer.reset();
    assert_same(&render_clean(&mut renderer, 1, "after all refusals"), &before, "after all refusals");
}

#[test]
fn scenes_switch_and_come_back() {
    for info in techniques::ALL {
        let mut renderer = renderer(&gpu(), support::builtin("cornell"), SIZE, info.id, &[]);
        let before = render_clean(&mut renderer, 2, info.id);
        for scene in builtins() {
            renderer.set_scene(support::builtin(scene)).expect("a scene");
            let image = render_clean(&mut renderer, 2, &format!("{} of {scene}", info.id));
            assert!(mean(&image) > 1e-3, "{} of {scene} is black", info.id);
        }
        renderer.set_scene(support::builtin("cornell")).expect("a scene");
        assert_same(&render_clean(&mut renderer, 2, info.id), &before, info.id);
    }
}

#[test]
fn techniques_switch_and_come_back() {
    let mut renderer = renderer(&gpu(), support::builtin("glossy-spheres"), SIZE, "restir-di", &[]);
    let mut pictures = Vec::new();
    for round in 0..2 {
        for (i, info) in techniques::ALL.iter().enumerate() {
            renderer.set_technique(info.id).expect("a technique");
            assert_eq!(renderer.technique(), info.id);
            let image = render_clean(&mut renderer, 2, info.id);
            match round {
                0 => pictures.push(image),
                _ => assert_same(&image, &pictures[i], info.id),
            }
        }
    }
    assert!(matches!(renderer.set_technique("nonesuch"), Err(Error::Unknown { .. })));
    assert_eq!(renderer.technique(), techniques::ALL[techniques::ALL.len() - 1].id);
}

/// Both ends of a range, or every choice.
fn extremes(spec: &ParamSpec) -> Vec<String> {
    match spec.kind {
        ParamKind::Uint { min, max } => vec![min.to_string(), max.to_string()],
        ParamKind::Float { min, max } => vec![min.to_string(), max.to_string()],
        ParamKind::Flag => vec!["false".into(), "true".into()],
        ParamKind::Choice(names) => names.iter().map(|n| (*n).to_owned()).collect(),
    }
}

#[test]
fn every_parameter_renders_at_its_extremes() {
    for info in techniques::ALL {
        // Fewer pixels, for some extremes are a thousand samples a pixel.
        let mut renderer = renderer(&gpu(), support::builtin("cornell-64"), [16, 8], info.id, &[]);
        let own = info.params.iter().map(|spec| (spec.name.to_owned(), spec));
        let render = RenderParams::SPECS.iter().map(|spec| (format!("render.{}", spec.name), spec));
        let film = FilmParams::SPECS.iter().map(|spec| (format!("film.{}", spec.name), spec));
        for (key, spec) in own.chain(render).chain(film) {
            let default = spec.value_json(spec.default).to_string().trim_matches('"').to_owned();
            for value in extremes(spec) {
                // Its purpose is to make NaNs (tests/report.rs sees that it does).
                if (key.as_str(), value.as_str()) == ("fault_unguarded_pdf", "true") {
                    continue;
                }
                renderer.set(&key, &value).unwrap_or_else(|e| panic!("{} {key}={value}: {e}", info.id));
                render_clean(&mut renderer, 2, &format!("{} with {key}={value}", info.id));
                if key.starts_with("film.") {
                    let display = pollster::block_on(renderer.read_display()).expect("a display");
                    assert_eq!(display.len(), 16 * 8 * 4);
                }
            }
            renderer.set(&key, &default).unwrap_or_else(|e| panic!("{} {key}={default}: {e}", info.id));
        }
        assert!(matches!(renderer.set("nonesuch", "1"), Err(Error::Unknown { .. })));
    }
}

/// All switches of restir-di at once, where each allows most.
#[test]
fn restir_di_renders_with_everything_at_most() {
    let settings = [
        ("reservoir_size", "4"),
        ("spatial_iterations", "4"),
        ("spatial_neighbors", "16"),
        ("spatial_depth_threshold", "10"),
        ("spatial_normal_threshold", "-1"),
        ("temporal_position_threshold", "10"),
        ("temporal_normal_threshold", "-1"),
        ("temporal_albedo_threshold", "1"),
        ("history_cap", "1000"),
    ];
    for scene in ["cornell-64", "glossy-spheres"] {
        let mut renderer = renderer(&gpu(), support::builtin(scene), SIZE, "restir-di", &settings);
        render_clean(&mut renderer, 4, scene);
    }
}

/// Where a reservoir lies in memory is no part of the picture. 40 is no divisor of the sides, and the picture less than a tile.
#[test]
fn pixel_orders_give_the_same_picture() {
    let picture = |order: &str| {
        let settings = [("pixel_order", order), ("spatial_feedback", "yes"), ("reservoir_size", "4")];
        let mut renderer = renderer(&gpu(), support::builtin("cornell"), [36, 20], "restir-di", &settings);
        render_clean(&mut renderer, 3, order)
    };
    let rows = picture("rows");
    for order in ["columns", "tiles-2", "tiles-4", "tiles-8", "tiles-16", "tiles-40"] {
        assert_same(&picture(order), &rows, order);
    }
}

/// The first frame's picture differs by one rounding of the contribution weight, 1/8192 of itself at most.
#[test]
fn packed_reservoirs_give_the_same_picture_but_for_rounding() {
    let picture = |format: &str| {
        let settings = [("reservoir_format", format), ("spatial_reuse", "no"), ("indirect", "no")];
        let mut renderer = renderer(&gpu(), support::builtin("cornell"), SIZE, "restir-di", &settings);
        renderer.set_accumulate(false);
        render_clean(&mut renderer, 1, format)
    };
    let (exact, packed) = (picture("f32"), picture("packed"));
    assert!(exact != packed, "nothing is rounded");
    for (a, b) in exact.pixels.iter().flatten().zip(packed.pixels.iter().flatten()) {
        assert!((a - b).abs() <= a / 8192.0 * 1.01, "{b} for {a}");
    }
}

#[test]
fn film_parameters_do_not_touch_the_radiance() {
    let mut renderer = renderer(&gpu(), support::builtin("cornell"), SIZE, "path-tracer", &[]);
    let radiance = render(&mut renderer, 2);
    let dark = pollster::block_on(renderer.read_display()).expect("a display");
    renderer.set("film.exposure", "2").expect("a setting");
    let bright = pollster::block_on(renderer.read_display()).expect("a display");
    assert_same(&pollster::block_on(renderer.read_image()).expect("a picture"), &radiance, "radiance");
    assert!(bright.iter().zip(&dark).all(|(b, d)| b >= d) && bright != dark);
}

fn floor(material: Material) -> Scene {
    Scene {
        meshes: vec![shapes::parallelogram(Vec3::new(-1.0, 0.0, 1.0), Vec3::X * 2.0, Vec3::Z * -2.0, 0)],
        instances: vec![Instance { mesh: 0, transform: Mat4::IDENTITY }],
        materials: vec![material],
        cameras: vec![Camera::look_at("above", Vec3::new(0.0, 1.5, 2.0), Vec3::ZERO, 0.9)],
        ..Scene::default()
    }
}

#[test]
fn scenes_with_little_in_them_render() {
    let dark = floor(Material::default());
    let sky_only = Scene { environment: Some(Environment::even(Vec3::splat(0.5))), ..Scene::default() };
    for info in techniques::ALL {
        let mut renderer = renderer(&gpu(), flatten(&dark), SIZE, info.id, &[]);
        assert!(renderer.scene().lights.is_empty());
        let image = render_clean(&mut renderer, 3, &format!("{} without lights", info.id));
        assert_eq!(mean(&image) > 0.0, info.id == "normals", "{} without lights", info.id);

        renderer.set_scene(flatten(&Scene::default())).expect("an empty scene");
        let image = render_clean(&mut renderer, 3, &format!("{} of nothing", info.id));
        assert_eq!(mean(&image), 0.0, "{} of nothing", info.id);

        renderer.set_scene(flatten(&sky_only)).expect("a sky");
        let image = render_clean(&mut renderer, 3, &format!("{} of a sky", info.id));
        if info.id != "normals" {
            assert!(image.pixels.iter().flatten().all(|c| (c - 0.5).abs() < 1e-5), "{} of a sky", info.id);
        }
    }
}

/// Materials at the ends of their ranges under every kind of light.
#[test]
fn extreme_materials_render() {
    use restir::scene::{PunctualKind, PunctualLight};
    let light = |kind, intensity: f32| PunctualLight {
        kind,
        position: Vec3::new(0.2, 0.7, 0.1),
        direction: Vec3::new(0.1, -1.0, 0.0).normalize(),
        intensity: Vec3::splat(intensity),
        range: f32::INFINITY,
    };
    for (metallic, roughness) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
        let mut scene = floor(Material { metallic, roughness, emissive: Vec3::splat(0.1), ..Material::default() });
        let spot = |inner, outer| PunctualKind::Spot { inner, outer };
        scene.lights = vec![
            light(PunctualKind::Point, 1.0),
            // On the surface itself, and without a cone.
            PunctualLight { position: Vec3::ZERO, ..light(PunctualKind::Point, 1.0) },
            light(spot(0.0, 0.0), 1.0),
            light(spot(0.4, 0.4), 1.0),
            light(PunctualKind::Directional, 1e6),
            PunctualLight { range: 1e-6, ..light(PunctualKind::Point, 1e-6) },
        ];
        scene.environment = Some(Environment::even(Vec3::splat(1e-3)));
        let flat: FlatScene = flatten(&scene);
        for info in techniques::ALL {
            let mut renderer = renderer(&gpu(), flat.clone(), SIZE, info.id, &[]);
            render_clean(&mut renderer, 3, &format!("{} metallic {metallic} roughness {roughness}", info.id));
        }
    }
}

/// A camera that moves while history is kept: no frame may read beyond the picture or meet a number that is none.
#[test]
fn cameras_move_through_everything() {
    for info in techniques::ALL {
        let mut renderer = renderer(&gpu(), support::builtin("cornell"), SIZE, info.id, &[]);
        let eyes = [
            (Vec3::new(0.0, 0.5, 1.88), Vec3::new(0.0, 0.5, 0.0)),
            (Vec3::new(0.3, 0.5, 1.0), Vec3::new(0.0, 0.2, 0.0)),
            // In a block, behind a wall, on a wall, straight down, and away from everything.
            (Vec3::new(-0.167, 0.2, -0.15), Vec3::ZERO),
            (Vec3::new(0.0, 0.5, -3.0), Vec3::new(0.0, 0.5, 0.0)),
            (Vec3::new(-0.5, 0.5, 0.0), Vec3::new(0.5, 0.5, 0.0)),
            (Vec3::new(0.0, 0.9, 0.0), Vec3::ZERO),
            (Vec3::new(0.0, 0.5, 5.0), Vec3::new(0.0, 0.5, 9.0)),
            (Vec3::new(0.0, 0.5, 1.88), Vec3::new(0.0, 0.5, 0.0)),
        ];
        for (eye, target) in eyes {
            renderer.set_camera(&Camera::look_at("moving", eye, target, 0.9));
            render_clean(&mut renderer, 2, &format!("{} from {eye}", info.id));
        }
    }
}

/// Where the first moving light is now, and where it was in the frame before.
fn moving_light(renderer: &Renderer) -> [Vec3; 2] {
    let (stage, light) = (renderer.stage(), renderer.scene().rig.lights[0].target as usize);
    [stage.punctual_lights()[light].position, stage.previous_lights[light].position]
}

#[test]
fn lights_move_on_from_where_they_stood_still() {
    let mut renderer = renderer(&gpu(), support::builtin("cornell-64"), SIZE, "normals", &[]);
    render(&mut renderer, 1);
    let [start, before] = moving_light(&renderer);
    assert_eq!(start, before, "nothing is before the first frame");
    render(&mut renderer, 2);
    let [moved, before] = moving_light(&renderer);
    assert!(moved != before && before != start, "time goes on");

    renderer.set_accumulate(true);
    for frame in 0..2 {
        render(&mut renderer, 1);
        assert_eq!(moving_light(&renderer), [moved, moved], "time stands still, frame {frame}");
    }
    renderer.set_accumulate(false);
    render(&mut renderer, 1);
    let [further, before] = moving_light(&renderer);
    assert!(further != moved && before == moved, "time goes on from where it stood");

    renderer.reset();
    render(&mut renderer, 1);
    assert_eq!(moving_light(&renderer), [start, start], "reset is the beginning");
}

#[test]
fn history_is_not_used_across_a_common_view() {
    let last_of_four = |temporal: &str, view_between: &str| {
        let settings = [("temporal_reuse", temporal)];
        let mut renderer = renderer(&gpu(), support::builtin("cornell"), SIZE, "restir-di", &settings);
        renderer.set_accumulate(false);
        render(&mut renderer, 2);
        renderer.set_view(view_between).expect("a view");
        render(&mut renderer, 1);
        renderer.set_view("radiance").expect("a view");
        render(&mut renderer, 1)
    };
    let without = last_of_four("false", "radiance");
    assert!(last_of_four("true", "radiance") != without, "history is used");
    assert!(last_of_four("true", "direct") != without, "history is used across the technique's own views");
    assert_same(&last_of_four("true", "albedo"), &without, "after the albedo");
}

#[test]
fn history_is_not_used_across_a_cut() {
    let mut scene = support::builtin("cornell");
    scene.cameras.push(Camera::look_at("other", Vec3::new(0.2, 0.6, 1.8), Vec3::new(0.0, 0.5, 0.0), 0.7));
    // Frames later than the same one without history, for the random numbers are the frame's.
    let after_two = |temporal: &str, camera: usize| {
        let mut renderer = renderer(&gpu(), scene.clone(), SIZE, "restir-di", &[("temporal_reuse", temporal)]);
        renderer.set_accumulate(false);
        render(&mut renderer, 2);
        renderer.follow_camera(camera).expect("a camera");
        render(&mut renderer, 1)
    };
    assert!(after_two("true", 0) != after_two("false", 0), "the camera that is followed already is no cut");
    assert_same(&after_two("true", 1), &after_two("false", 1), "after a cut");
}

#[test]
fn what_does_not_fit_leaves_what_there_was() {
    let mut renderer = renderer(&gpu(), support::builtin("cornell"), SIZE, "restir-di", &[("light_samples", "2")]);
    let before = render_clean(&mut renderer, 2, "before");
    let settings = renderer.parameters();

    // The film would do, four reservoirs a pixel would not.
    renderer.resize([1920, 1100].into()).expect("a size");
    assert!(matches!(renderer.set("reservoir_size", "4"), Err(Error::Limit { .. })));
    assert_eq!(renderer.parameters(), settings);
    renderer.resize(SIZE.into()).expect("a size");
    assert_same(&render_clean(&mut renderer, 2, "after a setting"), &before, "after a setting");

    let mut large = support::builtin("cornell-64");
    large.textures.push(TextureArray { width: 1 << 20, height: 1, layers: 1, levels: 1, texels: Vec::new() });
    assert!(matches!(renderer.set_scene(large), Err(Error::Limit { .. })));
    assert_eq!(renderer.scene().name, "cornell");
    renderer.reset();
    assert_same(&render_clean(&mut renderer, 2, "after a scene"), &before, "after a scene");
}

#[test]
fn pass_times_include_the_display() {
    if !gpu().has_timestamps {
        return skip("pass_times_include_the_display", "this device cannot time passes");
    }
    let mut renderer = renderer(&gpu(), support::builtin("cornell"), SIZE, "normals", &[]);
    let displayed = |renderer: &Renderer| {
        let times = pollster::block_on(renderer.pass_times()).expect("pass times");
        times.iter().filter(|time| time.name == "film/display").count()
    };
    render(&mut renderer, 1);
    assert_eq!(displayed(&renderer), 0);
    for _ in 0..2 {
        renderer.render_display().expect("a display");
    }
    assert_eq!(displayed(&renderer), 1);
    render(&mut renderer, 1);
    assert_eq!(displayed(&renderer), 0, "the display was of the frame before");
}

/// What a technique says of its defaults is what `biases` says of them, and each bias names a parameter that there is.
#[test]
fn biases_are_those_of_the_settings_as_they_are() {
    let keys = |renderer: &Renderer| renderer.biases().iter().map(|bias| bias.parameter).collect::<Vec<_>>();
    for info in techniques::ALL {
        let mut renderer = renderer(&gpu(), support::builtin("cornell"), SIZE, info.id, &[]);
        let own: Vec<_> = keys(&renderer).into_iter().filter(|key| !key.contains('.')).collect();
        assert_eq!(own.is_empty(), info.unbiased, "{}: {own:?}", info.id);
        let mut seen = own;
        for spec in info.params {
            let standard = spec.value_json(spec.default).to_string().trim_matches('"').to_owned();
            let values: Vec<String> = match spec.kind {
                ParamKind::Uint { min, max } => vec![min.to_string(), max.to_string()],
                ParamKind::Float { min, max } => vec![min.to_string(), max.to_string()],
                ParamKind::Flag => vec!["true".into(), "false".into()],
                ParamKind::Choice(names) => names.iter().map(ToString::to_string).collect(),
            };
            for value in values {
                if renderer.set(spec.name, &value).is_ok() {
                    seen.extend(keys(&renderer));
                }
            }
            renderer.set(spec.name, &standard).expect("the default");
        }
        for key in &seen {
            info.spec(key).unwrap_or_else(|error| panic!("{}: {error}", info.id));
        }
        // A flag called indirect leaves light out wherever there is one.
        assert!(info.params.iter().all(|spec| spec.name != "indirect") || seen.contains(&"indirect"), "{}", info.id);
    }
    let mut renderer =
        renderer(&gpu(), support::builtin("cornell"), SIZE, "restir-di", &[("render.max_depth", "1024")]);
    renderer.set("render.texture_levels", "finest").expect("a choice");
    assert!(renderer.biases().is_empty(), "{:?}", renderer.biases());
    for (name, value, biased) in [
        ("visibility_in_weights", "no", true),
        ("visibility_reuse", "no", false),
        ("reuse_weights", "heuristics", true),
        ("spatial_reuse", "no", true),
        ("temporal_reuse", "no", false),
        ("boiling_filter", "0.5", true),
    ] {
        renderer.set(name, value).expect("a setting");
        assert_eq!(!renderer.biases().is_empty(), biased, "{name} = {value}: {:?}", renderer.biases());
    }
}

/// A frame that is begun, whose pipelines are made one by one, and that is finished, is the same as one at once; and the pipelines are as many
/// as was said.
#[test]
fn a_frame_in_parts_is_the_same_frame() {
    let mut whole = renderer(&gpu(), support::builtin("cornell"), SIZE, "restir-di", &[]);
    let expected = render(&mut whole, 3);
    let gpu = fresh_gpu();
    let mut parts = renderer(&gpu, support::builtin("cornell"), SIZE, "restir-di", &[]);
    let mut unmade = Vec::new();
    for _ in 0..3 {
        let count = parts.begin_frame().expect("a frame");
        for _ in 0..count {
            pollster::block_on(parts.make_pipeline());
        }
        parts.finish_frame().expect("a frame");
        unmade.push(count);
    }
    // Primary rays, candidates, spatial reuse, indirect light, shading, film, display; then temporal reuse; then none.
    assert_eq!(unmade, [7, 1, 0]);
    assert_eq!(parts.accumulated_frames(), 3);
    assert_same(&pollster::block_on(parts.read_image()).expect("a picture"), &expected, "in parts");
    let times = pollster::block_on(parts.pass_times()).expect("times");
    assert_eq!(times.last().map(|time| time.name), Some("film/display"));
}

/// What a renderer says it holds on the device is what the allocator of the device has given it: how it grows with the picture, and that
/// nothing stays of another technique or size.
#[test]
fn memory_is_what_the_device_has_given() {
    let gpu = fresh_gpu();
    let given = |gpu: &restir::Gpu| {
        let report = gpu.device.generate_allocator_report().expect("Vulkan tells");
        report.allocations.iter().map(|allocation| allocation.size).sum::<u64>()
    };
    let mut renderer = renderer(&gpu, support::builtin("cornell"), SIZE, "normals", &[]);
    for info in techniques::ALL {
        let mut seen = Vec::new();
        for side in [64, 512, 64] {
            renderer.set_technique(info.id).expect("a technique");
            renderer.resize([side, side].into()).expect("a size");
            // What was let go of is freed by a device that is idle; a frame is not needed, for all is made before.
            pollster::block_on(renderer.wait()).expect("a device that is idle");
            seen.push((renderer.memory(), given(&gpu)));
        }
        let [(small, given_small), (large, given_large), (again, _)] = seen[..] else { panic!("three sizes") };
        assert_eq!(small, again, "{}", info.id);
        assert_eq!((small.scene, small.inspector), (large.scene, 0), "{}", info.id);
        // Radiance, sum and count, display, two visibility buffers, three pictures of first surfaces.
        assert_eq!(large.film - small.film, (512 * 512 - 64 * 64) * (16 + 16 + 4 + 2 * 16 + 3 * 16), "{}", info.id);
        let [grown, given] = [large.total() - small.total(), given_large - given_small].map(|bytes| bytes as f64);
        assert!((grown / given - 1.0).abs() < 0.02, "{}: {grown} bytes more, the device gave {given}", info.id);
    }
    renderer.inspect(Some([1, 1].into())).expect("a pixel");
    assert!(renderer.memory().inspector > 100_000);
}
