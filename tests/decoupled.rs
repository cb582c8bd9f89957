//! `restir-di-decoupled`: its unbiased modes have the same expectation as the path tracer's direct light, by two one-sided
//! tests (TOST) on means over independent runs, and the same test catches planted biases; what it refuses; and scenes that
//! have little or nothing to draw.
//!
//! Margins (docs/testing.md): 0.2 % of the mean over the picture, 1 % over each 32x32 tile, at 95 % confidence. A plant
//! counts as caught only if its measured bias lies so far outside a margin that a repetition of the test would fail with
//! probability 0.9 or more.

mod support;

use glam::{Mat4, Quat, Vec3};
use restir::scene::area_light::{AreaLight, Outline};
use restir::scene::{Camera, Environment, Projection, PunctualKind, PunctualLight, Scene, Sun};
use restir::{FlatScene, Gpu, Renderer};
use std::sync::OnceLock;
use support::equivalence::{Comparison, Estimate, Margins};
use support::plants::ShaderCopy;
use support::plate::{materials, plate};
use support::*;

const SIZE: u32 = 64;
const TILE: u32 = 32;
const MARGINS: Margins = Margins { picture: 0.002, tile: 0.01 };
const TECHNIQUE: &str = "restir-di-decoupled";
const DIRECT: &[(&str, &str)] = &[("render.max_depth", "1")];
const RUNS: u32 = 64;
const FRAMES: u32 = 16;

/// The Cornell box from inside: blocks, shadows and no light source in view, so that the mean is all scattered light.
fn scene() -> FlatScene {
    let mut scene = builtin("cornell");
    scene.cameras =
        vec![Camera::look_at("test", [-0.35, 0.85, 0.45].into(), [0.12, 0.05, -0.1].into(), 60f32.to_radians())];
    scene
}

fn reference() -> &'static Estimate {
    static REFERENCE: OnceLock<Estimate> = OnceLock::new();
    REFERENCE.get_or_init(|| {
        let mut renderer = renderer(&gpu(), scene(), [SIZE; 2], "path-tracer", DIRECT);
        Estimate::radiance(&mut renderer, 16, 160, TILE)
    })
}

/// With a short memory, so that frames of a run are less correlated, and tiles small enough for many of them to meet.
fn decoupled(gpu: &Gpu, settings: &[(&str, &str)]) -> Renderer {
    let base = [
        ("indirect", "no"),
        ("visibility", "mis"),
        ("candidates", "4"),
        ("history_cap", "4"),
        ("spatiotemporal_radius", "10"),
        ("tile_subsets", "32"),
        ("tile_lights", "256"),
    ];
    renderer(gpu, scene(), [SIZE; 2], TECHNIQUE, &[&base[..], DIRECT, settings].concat())
}

/// The renderer's means beside the reference's, printed.
fn compare(what: &str, renderer: &mut Renderer, runs: u32) -> Comparison {
    let comparison = Comparison::new(&Estimate::radiance(renderer, runs, FRAMES, TILE), reference(), MARGINS);
    println!("{what}: {comparison}");
    comparison
}

#[test]
fn unbiased_modes_equal_the_path_tracer() {
    let gpu = gpu();
    let unbiased = [
        &[][..],
        // Other shapes of tiles, more pixels without a like neighbour, longer memory.
        &[("tile_size", "2"), ("spatiotemporal_tries", "1"), ("history_cap", "8"), ("candidates", "7")],
        &[("bias_correction", "1/z")],
        // Fig. 15 (b): without visibility in resampling supports are told apart by target functions alone.
        &[("visibility", "shading")],
    ];
    for settings in unbiased {
        let comparison = compare(&format!("unbiased {settings:?}"), &mut decoupled(&gpu, settings), RUNS);
        assert!(comparison.is_equivalent(), "{settings:?} is not equivalent");
    }
}

#[test]
fn planted_biases_are_caught() {
    let gpu = gpu();
    // Biased settings are plants that need no edit.
    for settings in [
        [("visibility", "none"), ("bias_correction", "mis")],
        [("visibility", "candidate"), ("bias_correction", "mis")],
        [("visibility", "decoupled"), ("bias_correction", "mis")],
        [("visibility", "decoupled"), ("bias_correction", "none")],
    ] {
        let comparison = compare(&format!("{settings:?}"), &mut decoupled(&gpu, &settings), RUNS / 4);
        assert!(comparison.is_caught(), "{settings:?} went unnoticed");
    }
    // Each: what, the file, what stands there, what is put in its place.
    let plants = [
        (
            "the tile's density left out of the candidate's weight",
            "techniques/restir-di-decoupled/select.wgsl",
            "* tile_inverse_pdfs[selected];",
            "* select(1.0, tile_inverse_pdfs[selected], params.candidates == 0u);",
        ),
        (
            "1/M in place of MIS weights",
            "techniques/restir-di-decoupled/shade.wgsl",
            "    if params.bias_correction == REUSE_WEIGHT_NONE {\n        numerators",
            "    if true {\n        numerators",
        ),
        (
            "visibility left out of the weights",
            "techniques/restir-di-decoupled/shade.wgsl",
            "            if params.visibility == VISIBILITY_MIS && (selection",
            "            if j > 0u && params.visibility == 9u && (selection",
        ),
        (
            "visibility of the previous frame's pixel in place of this one's",
            "techniques/restir-di-decoupled/trace.wgsl",
            "if params.visibility == VISIBILITY_CANDIDATE {",
            "if params.visibility == VISIBILITY_MIS {",
        ),
        (
            "history offered above its weight",
            "techniques/restir-di-decoupled/shade.wgsl",
            "samples.weights[i] = reservoir.unbiased_contribution_weight;",
            "samples.weights[i] = reservoir.unbiased_contribution_weight * (1.0 + 0.1 * state.confidence_weight);",
        ),
        (
            "samples shaded by chance of being selected, not by weight",
            "techniques/restir-di-decoupled/shade.wgsl",
            "shaded.contributions[i] = share * light.value",
            "shaded.contributions[i] = select(samples.weights[i] / 3.0, share, false) * light.value",
        ),
    ];
    for (what, file, old, new) in plants {
        let folder = ShaderCopy::new();
        let gpu = fresh_gpu();
        let mut renderer = decoupled(&gpu, &[]);
        render(&mut renderer, 1);
        gpu.watch_shaders(&folder.0);
        folder.edit(file, old, new);
        let comparison = compare(what, &mut renderer, RUNS / 4);
        assert_eq!(renderer.shader_problems, Vec::<String>::new());
        assert!(comparison.is_caught(), "'{what}' went unnoticed");
    }
}

/// A plate under one light of each kind, all mixed in the same subsets: a density that is wrong for one of them is seen.
fn every_kind_of_light() -> FlatScene {
    let (material, _) = materials().remove(0);
    let mut scene = plate(material, 0.5);
    scene.cameras[0].projection = Projection::Orthographic { half_height: 0.2 };
    let punctual = |kind, position: Vec3, intensity: f32, range| PunctualLight {
        kind,
        position,
        direction: -position.normalize(),
        intensity: Vec3::new(1.0, 0.8, 0.6) * intensity,
        range,
    };
    scene.lights.push(punctual(PunctualKind::Point, Vec3::new(-0.7, 1.1, 0.4), 0.5, 3.0));
    let cone = PunctualKind::Spot { inner: 0.1, outer: 0.5 };
    scene.lights.push(punctual(cone, Vec3::new(0.5, 1.5, -0.2), 0.8, f32::INFINITY));
    scene.lights.push(punctual(PunctualKind::Directional, Vec3::new(0.3, 1.0, 0.2), 0.4, f32::INFINITY));
    let down = Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    let mut add = |outline, at: Vec3, double_sided| {
        let light = AreaLight { outline, radiance: Vec3::new(6.0, 5.0, 4.0), double_sided };
        scene.add_area_light(&light, Mat4::from_rotation_translation(down, at)).expect("a light");
    };
    add(Outline::Sphere { radius: 0.2 }, Vec3::new(-0.6, 0.9, -0.5), false);
    add(Outline::Rectangle { width: 0.4, height: 0.3 }, Vec3::new(0.7, 0.9, 0.5), true);
    add(Outline::Disk { radius: 0.2 }, Vec3::new(0.1, 0.8, 0.7), false);
    scene.environment = Some(Environment::even(Vec3::new(0.3, 0.25, 0.2)));
    let direction = Vec3::new(-0.4, 0.8, 0.3).normalize();
    scene.sun = Some(Sun { direction, irradiance: Vec3::new(0.5, 0.4, 0.3), angular_radius: 0.1 });
    flatten(&scene)
}

#[test]
fn every_kind_of_light_is_drawn_as_often_as_it_says() {
    let gpu = gpu();
    let estimate = |gpu: &Gpu, technique: &str, settings: &[(&str, &str)], frames, plant: Option<&ShaderCopy>| {
        let settings = [DIRECT, settings].concat();
        let mut renderer = renderer(gpu, every_kind_of_light(), [48; 2], technique, &settings);
        render(&mut renderer, 1);
        if let Some(folder) = plant {
            gpu.watch_shaders(&folder.0);
            folder.edit("scene/light_tiles.wgsl", "light.pmf / (4.0 * PI", "light.pmf / (2.0 * PI");
        }
        Estimate::radiance(&mut renderer, 48, frames, 48)
    };
    let truth = estimate(&gpu, "path-tracer", &[], 64, None);
    let settings = [("indirect", "no"), ("visibility", "mis"), ("candidates", "32"), ("history_cap", "4")];
    let comparison = Comparison::new(&estimate(&gpu, TECHNIQUE, &settings, 32, None), &truth, MARGINS);
    println!("every kind of light: {comparison}");
    assert!(comparison.is_equivalent());
    // A plant: spheres as if half of each were drawn.
    let planted = estimate(&fresh_gpu(), TECHNIQUE, &settings, 8, Some(&ShaderCopy::new()));
    let comparison = Comparison::new(&planted, &truth, MARGINS);
    println!("half spheres: {comparison}");
    assert!(comparison.is_caught());
}

/// Scenes with little or nothing to draw, pictures of one pixel, and every switch: no sample may be lost.
#[test]
fn small_things_work() {
    let gpu = gpu();
    let dark = |material: restir::scene::Material| flatten(&plate(material, 0.5));
    let mut sky = plate(materials().remove(0).0, 0.5);
    sky.environment = Some(Environment::even(Vec3::ONE));
    let scenes: [(&str, FlatScene, bool); 4] = [
        ("no light", dark(materials().remove(0).0), false),
        ("environment alone", flatten(&sky), true),
        ("one light", builtin("many-lights:1"), true),
        ("nothing at all", flatten(&Scene { cameras: sky.cameras.clone(), ..Scene::default() }), false),
    ];
    for (what, scene, is_lit) in scenes {
        for size in [[1, 1], [17, 9]] {
            for checkerboard in ["no", "yes"] {
                let settings =
                    [("checkerboard", checkerboard), ("candidates", "3"), ("tile_lights", "5"), ("tile_subsets", "1")];
                let mut renderer = renderer(&gpu, scene.clone(), size, TECHNIQUE, &settings);
                let image = render(&mut renderer, 4);
                assert!(image.pixels.iter().flatten().all(|c| c.is_finite() && *c >= 0.0), "{what}");
                // A single pixel of a larger scene may well be dark.
                assert!((mean(&image) > 0.0) == is_lit || size == [1, 1], "{what}, {size:?}: {}", mean(&image));
            }
        }
    }
}

#[test]
fn contradictions_are_refused_by_both_names() {
    let gpu = gpu();
    let mut renderer = renderer(&gpu, builtin("cornell"), [8, 8], TECHNIQUE, &[]);
    for (name, good, bad) in
        [("bias_correction", "mis", "none"), ("visibility_reuse_radius", "0", "15"), ("checkerboard", "no", "yes")]
    {
        renderer.set("visibility", "mis").expect("alone it is fine");
        let error = renderer.set(name, bad).expect_err("a contradiction");
        assert_eq!(error.code(), "BAD_VALUE");
        assert!(error.to_string().contains("visibility") && error.to_string().contains(name), "{error}");
        // The other way round.
        renderer.set("visibility", "decoupled").expect("fine");
        renderer.set(name, bad).expect("fine");
        let error = renderer.set("visibility", "mis").expect_err("a contradiction");
        assert!(error.to_string().contains("visibility") && error.to_string().contains(name), "{error}");
        renderer.set(name, good).expect("fine");
        render(&mut renderer, 1);
    }
    for (name, value) in [("tile_lights", "0"), ("candidates", "1025"), ("visibility", "some"), ("history_cap", "NaN")]
    {
        let error = renderer.set(name, value).expect_err("out of range");
        assert!(error.code() == "BAD_VALUE" && error.to_string().contains(name), "{error}");
    }
    // More lights than any buffer of WebGPU's default size holds, with both numbers.
    renderer.set("tile_subsets", "4096").expect("in range");
    let error = renderer.set("tile_lights", "32768").expect_err("too much");
    assert!(error.code() == "LIMIT" && error.to_string().contains("tile_subsets"), "{error}");
}
