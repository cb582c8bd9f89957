//! Lights that change their power, appear and vanish: the table of the moment, what reuse knows of the frame before, files,
//! and how long the table takes.

mod support;

use glam::{Mat4, Vec3};
use restir::gpu_scene::GpuScene;
use restir::lab::median;
use restir::lab::truth::equivalence::{Comparison, Estimate, Margins};
use restir::scene::area_light::{AreaLight, Outline};
use restir::scene::gpu_types::{LIGHT_ENVIRONMENT, Light, NONE};
use restir::scene::rig::{Attachment, CUBIC_SPLINE, Dimmer, LINEAR, Node, Placement, STEP, TRANSLATION};
use restir::scene::stage::Stage;
use restir::scene::{Environment, Material, PunctualKind, PunctualLight, Scene, builtin as scenes, gltf, shapes};
use restir::{Error, FlatScene, Gpu, Renderer, Result};
use serde_json::{Value, json};
use std::time::Instant;
use support::above::{self, place};
use support::gltf_writer::Writer;
use support::*;

const SIZE: u32 = 64;
const TILE: u32 = 32;
/// A fifth of the least that a planted fault makes.
const MARGINS: Margins = Margins { picture: 0.01, tile: 0.02 };
/// Scene time of a frame in seconds, and the moments of the first and the last of a run.
const FRAME: f64 = 0.2;
const START: f64 = 0.3;
const FRAMES: u32 = 4;
const END: f64 = START + FRAME * (FRAMES - 1) as f64;

/// Powers in each frame of a run: of what is switched on in the last, of what is switched off, and of what is dimmed.
const HISTORIES: [[f32; FRAMES as usize]; 3] = [[1.0, 0.5, 0.0, 1.0], [0.0, 1.0, 1.0, 0.0], [0.2, 0.6, 1.0, 0.1]];
/// What every light weighs in the table at full power.
const WEIGHT: f32 = 0.3;

/// A floor seen straight from above.
fn floor() -> Scene {
    let mut scene = above::scene();
    place(&mut scene, above::floor(1.0));
    scene
}

fn point(position: Vec3) -> PunctualLight {
    PunctualLight {
        kind: PunctualKind::Point,
        position,
        direction: Vec3::NEG_Z,
        intensity: Vec3::splat(WEIGHT),
        range: f32::INFINITY,
    }
}

/// Lights of three kinds beside what is in view, three of each: one is switched on in the last frame of a run, one is switched
/// off, and one is dimmed. All weigh the same at full power, so that a table which was never rebuilt draws all alike.
fn lamps() -> Scene {
    let mut scene = floor();
    let times: Vec<f32> = (0..FRAMES).map(|i| (START + FRAME * (f64::from(i) - 0.5)) as f32).collect();
    // A clip starts again after its last keyframe.
    let times = [&times[..], &[2.0 * END as f32]].concat();
    for (i, history) in HISTORIES.iter().enumerate() {
        let power = scene.rig.add_power(1.0);
        let values = [&history[..], &history[FRAMES as usize - 1..]].concat();
        scene.rig.add_power_channel(power, STEP, &times, &values);
        // What is switched on is to the left, what is switched off or dimmed to the right.
        let at = |z: f32| Vec3::new([-1.2, 1.1, 1.2][i], 1.6, z + [0.0, -0.3, 0.3][i]);

        scene.rig.dimmed_lights.push(Dimmer { target: scene.lights.len() as u32, power });
        scene.lights.push(point(at(-0.6)));

        // A square of two triangles: half its area times its radiance is the weight.
        let (u, v) = (0.2 * Vec3::Z, 0.2 * Vec3::Y);
        let emissive = Vec3::splat(WEIGHT / 0.02);
        let material = scene.materials.len() as u32;
        scene.materials.push(Material { emissive, double_sided: true, ..scene.materials[0].clone() });
        let target = place(&mut scene, shapes::parallelogram(at(0.0) - 0.5 * (u + v), u, v, material));
        scene.rig.dimmed_instances.push(Dimmer { target, power });

        scene.rig.dimmed_instances.push(Dimmer { target: scene.instances.len() as u32, power });
        let (radius, area) = (0.08, 4.0 * std::f32::consts::PI * 0.08 * 0.08);
        let outline = Outline::Sphere { radius };
        let light = AreaLight { outline, radiance: Vec3::splat(WEIGHT / area), double_sided: false };
        scene.add_area_light(&light, Mat4::from_translation(at(0.6))).unwrap();
    }
    scene
}

/// A renderer whose fourth frame is at [`END`].
fn playing(gpu: &Gpu, scene: &FlatScene, technique: &str, settings: &[(&str, &str)]) -> Renderer {
    let settings = [&[("render.max_depth", "1"), ("indirect", "no"), ("history_cap", "10")], settings].concat();
    let mut renderer = renderer(gpu, scene.clone(), [SIZE; 2], technique, &settings);
    renderer.set_accumulate(false);
    renderer.set_speed(FRAME * 60.0);
    renderer.set_time(START);
    renderer
}

/// The path tracer's picture at [`END`].
fn still(scene: &FlatScene) -> Renderer {
    let mut renderer = renderer(&gpu(), scene.clone(), [SIZE; 2], "path-tracer", &[("render.max_depth", "1")]);
    renderer.set_accumulate(true);
    renderer.set_time(END);
    renderer
}

fn compare(what: &str, renderer: &mut Renderer, runs: u32, reference: &Estimate) -> Comparison {
    let estimate = Estimate::radiance(renderer, runs, FRAMES, TILE).unwrap();
    assert!((renderer.time() - END).abs() < 1e-9, "{}", renderer.time());
    let comparison = Comparison::new(&estimate, reference, MARGINS);
    println!("{what}: {comparison}");
    comparison
}

const RESTIR_DI: (&str, &[(&str, &str)]) = ("restir-di", &[("light_samples", "4"), ("spatial_reuse", "no")]);
const DECOUPLED: (&str, &[(&str, &str)]) = ("restir-di-decoupled", &[("visibility", "mis"), ("candidates", "8")]);
const REPORT: (&str, &[(&str, &str)]) = ("restir-report", &[("configuration", "c-temporal"), ("resample_count", "16")]);

#[test]
fn the_mean_is_right_while_lights_are_switched_and_dimmed() {
    let scene = flatten(&lamps());
    let reference = Estimate::radiance(&mut still(&scene), 8, 20, TILE).unwrap();
    for (technique, settings) in [RESTIR_DI, DECOUPLED, REPORT] {
        let comparison = compare(technique, &mut playing(&gpu(), &scene, technique, settings), 16, &reference);
        assert!(comparison.is_equivalent(), "{technique}");
    }
    // What is put in the place of what.
    let emitters =
        ("select(lights[light].intensity.x, lights[light].intensity.y, previous)", "lights[light].intensity.x");
    let points = ("lights[punctual].intensity * attenuation", "lights[light].intensity * attenuation");
    // All lights weigh the same at full power: a table that was not rebuilt keeps every bucket's own light.
    let table = ("bits_to_unit(bits.y) < lights[light].alias_threshold", "true");
    // Confidence dropped with the sample of a dead light.
    let confidence = (
        "    history.confidence_weight = min(history.confidence_weight,",
        "    if history.light != NONE && !is_switched_on(history.light) { history.confidence_weight = 0.0; }\n    \
         history.confidence_weight = min(history.confidence_weight,",
    );
    for (what, (technique, settings), (old, new)) in [
        ("emitters of the frame before are as bright as now", RESTIR_DI, emitters),
        ("points of the frame before are as bright as now", DECOUPLED, points),
        ("the alias table is not rebuilt, while the pmf is", RESTIR_DI, table),
        ("a history whose light is dead counts for nothing", RESTIR_DI, confidence),
    ] {
        let gpu = fresh_gpu();
        gpu.plant(old, new).unwrap();
        let wrong = compare(what, &mut playing(&gpu, &scene, technique, settings), 4, &reference);
        assert!(wrong.is_caught(), "'{what}' went unnoticed in {technique}");
    }
}

/// All lights go out in a frame with a history, and on again: nothing is left of them, and nothing is no number.
#[test]
fn the_dark_is_dark() {
    let mut scene = floor();
    scene.rig.dimmed_lights.push(Dimmer { target: 0, power: 0 });
    scene.lights.push(point(Vec3::Y));
    let power = scene.rig.add_power(1.0);
    scene.rig.add_power_channel(power, STEP, &[0.0, 1.0, 2.0, 3.0], &[1.0, 0.0, 1.0, 1.0]);
    let scene = flatten(&scene);
    for (technique, settings) in [RESTIR_DI, DECOUPLED, REPORT] {
        let mut renderer = playing(&gpu(), &scene, technique, settings);
        renderer.set_speed(60.0);
        renderer.set_time(0.5);
        let mut means = Vec::new();
        for _ in 0..3 {
            means.push(mean(&render(&mut renderer, 1)));
            let counters = pollster::block_on(renderer.counters()).unwrap();
            assert_eq!((counters.nan, counters.inf), (0, 0), "{technique}");
        }
        assert_eq!(means[1], 0.0, "{technique}");
        // One light and no shadow: no noise but that of the pixel filter.
        assert!(means[0] > 0.0 && (means[2] / means[0] - 1.0).abs() < 1e-3, "{technique}: {means:?}");
    }
}

/// A history that counts for nothing leaves the frame's own samples as they are.
#[test]
fn a_history_without_confidence_changes_nothing() {
    let scene = builtin("switching");
    let picture = |settings: &[(&str, &str)]| {
        let settings = [&[("render.max_depth", "1"), ("indirect", "no"), ("spatial_reuse", "no")], settings].concat();
        let mut renderer = renderer(&gpu(), scene.clone(), [32; 2], "restir-di", &settings);
        renderer.set_accumulate(false);
        render(&mut renderer, 3)
    };
    let alone = mean(&picture(&[("temporal_reuse", "no")]));
    for weights in ["balance", "pairwise", "defensive"] {
        let with_history = mean(&picture(&[("history_cap", "0"), ("reuse_weights", weights)]));
        assert!((with_history / alone - 1.0).abs() < 1e-5, "{weights}: {with_history}, should be {alone}");
    }
}

/// How often each light is drawn by the alias table, as shaders do it.
fn drawn(lights: &[Light]) -> Vec<f64> {
    let mut p = vec![0.0; lights.len()];
    for (i, light) in lights.iter().enumerate() {
        p[i] += f64::from(light.alias_threshold) / lights.len() as f64;
        p[light.alias_light as usize] += (1.0 - f64::from(light.alias_threshold)) / lights.len() as f64;
    }
    p
}

/// That both tables of a stage are those of `weights`, one a light.
fn check_table(scene: &FlatScene, stage: &Stage, weights: &[f64]) {
    let (lights, _) = stage.light_table(scene).unwrap();
    assert_eq!(lights.len(), weights.len());
    let total: f64 = weights.iter().sum();
    let ends = lights.iter().skip(1).map(|light| u64::from(light.cumulative)).chain([1 << 32]);
    for (i, ((light, end), drawn)) in lights.iter().zip(ends).zip(drawn(lights)).enumerate() {
        let expected = weights[i] / total;
        let part = (end - u64::from(light.cumulative)) as f64 / 2f64.powi(32);
        for p in [f64::from(light.pmf), drawn, part] {
            assert!((p - expected).abs() < 1e-6, "light {i}: {p}, should be {expected}");
        }
        assert!((light.pmf == 0.0) == (weights[i] == 0.0), "light {i}");
    }
}

#[test]
fn the_table_is_that_of_the_powers_of_the_moment() {
    let mut scene = lamps();
    for with_environment in [false, true] {
        scene.environment = with_environment.then(|| Environment::even(Vec3::ONE));
        let flat = flatten(&scene);
        // Six triangles, three spheres, three points, and the sky.
        assert_eq!(flat.lights.len(), 12 + usize::from(with_environment));
        let share = if with_environment { 0.5 } else { 1.0 } / 12.0;
        assert!(flat.lights.iter().take(12).all(|light| (f64::from(light.pmf) / share - 1.0).abs() < 1e-5));
        let powers =
            |frame: usize| flat.light_powers.iter().map(move |&power| HISTORIES.get(power as usize).map(|h| h[frame]));
        let weights = |frame: usize| -> Vec<f64> {
            let dimmed: Vec<f64> = powers(frame).flatten().map(f64::from).collect();
            let all: f64 = dimmed.iter().sum();
            dimmed.into_iter().chain(with_environment.then_some(all)).collect()
        };
        let mut stage = Stage::new(&flat, 0, START);
        check_table(&flat, &stage, &weights(0));
        for frame in 1..FRAMES as usize {
            let version = stage.light_table(&flat).unwrap().1;
            stage.step(&flat, 0, START + FRAME * frame as f64);
            assert!(stage.has_moved() && stage.light_table(&flat).unwrap().1 != version);
            check_table(&flat, &stage, &weights(frame));
            // Powers now and in the frame before.
            let now_and_before = powers(frame).zip(powers(frame - 1)).enumerate();
            for (i, (now, before)) in now_and_before.filter(|(i, _)| flat.lights[*i].kind != LIGHT_ENVIRONMENT) {
                let (now, before) = (now.unwrap(), before.unwrap());
                let first = flat.first_punctual as usize;
                if i < first {
                    let light = stage.emitter(&flat, i).unwrap();
                    assert_eq!([light.intensity.x, light.intensity.y], [now, before]);
                } else {
                    assert_eq!(stage.punctual_lights()[i - first].intensity, Vec3::splat(WEIGHT * now));
                    assert_eq!(stage.previous_lights[i - first].intensity, Vec3::splat(WEIGHT * before));
                }
            }
        }
        // Time stands still: the frame before becomes this one, and after that nothing changes any more.
        for _ in 0..2 {
            let time = stage.time();
            stage.step(&flat, 0, time);
        }
        let (lights, version) = stage.light_table(&flat).map(|(lights, version)| (lights.to_vec(), version)).unwrap();
        assert!(lights.iter().take(flat.first_punctual as usize).all(|light| light.intensity.x == light.intensity.y));
        let time = stage.time();
        stage.step(&flat, 0, time);
        assert_eq!((stage.light_table(&flat).unwrap().1, stage.has_moved()), (version, false));
    }
}

#[test]
fn where_all_is_dark_the_sky_has_everything() {
    let mut scene = floor();
    scene.lights.push(point(Vec3::Y));
    let power = scene.rig.add_power(0.0);
    scene.rig.dimmed_lights.push(Dimmer { target: 0, power });
    let flat = flatten(&scene);
    // With nothing to draw at all everything is drawn, and shines with 0.
    check_table(&flat, &Stage::new(&flat, 0, 0.0), &[1.0]);
    scene.environment = Some(Environment::even(Vec3::ONE));
    let flat = flatten(&scene);
    check_table(&flat, &Stage::new(&flat, 0, 0.0), &[0.0, 1.0]);
}

/// Lights that move and change their power at once, with a mesh of their own.
#[test]
fn lights_move_and_are_dimmed_at_once() {
    let mut scene = lamps();
    let node = scene.rig.add_node(Node::default());
    scene.rig.add_channel(node, TRANSLATION, LINEAR, &[0.0, 2.0], &[0.0, 0.0, 0.0, 2.0, 0.0, 0.0]);
    scene.rig.lights.push(Attachment { target: 1, node });
    let lamp = scene.rig.dimmed_instances[0].target;
    scene.rig.instances.push(Placement::rigid(lamp, node));
    let flat = flatten(&scene);
    assert!(flat.has_top_level());
    let stage = Stage::new(&flat, 0, 1.0);
    let moved = stage.punctual_lights()[1];
    assert_eq!((moved.position, moved.intensity), (Vec3::X, Vec3::ZERO));
    // The first lamp's triangles are the last emitters now, for its mesh is no longer merged.
    let powers: Vec<u32> = flat.light_powers.iter().copied().take(flat.first_punctual as usize).collect();
    assert_eq!(powers.iter().filter(|power| **power == 0).count(), 3);
    assert!(flat.lights.iter().zip(&powers).all(|(light, power)| light.instance != 1 || *power == 0));
}

#[test]
fn powers_come_back_from_bytes_and_bad_ones_are_refused() {
    let sound = flatten(&scenes::make("switching").unwrap());
    assert_eq!(FlatScene::from_bytes(&sound.to_bytes()).unwrap(), sound);
    type Fault = (&'static str, fn(&mut FlatScene));
    let first_value = |flat: &FlatScene| flat.rig.channels[3].first_value as usize;
    let faults: [Fault; 8] = [
        ("light_powers[5]", |flat| flat.light_powers[5] = 1000),
        ("light_powers", |flat| flat.light_powers.truncate(9)),
        ("light_powers", |flat| flat.light_powers.clear()),
        ("rig.powers", |flat| flat.rig.powers[0] = -1.0),
        ("rig.powers", |flat| flat.rig.powers[0] = f32::NAN),
        ("rig.channels[3]", |flat| flat.rig.channels[3].first_weight = 1000),
        ("rig.channels[3]", |flat| flat.rig.channels[3].width = 2),
        ("rig.channels[3]", |flat| flat.rig.channels[3].path = 5),
    ];
    let refused = |flat: &FlatScene, expected: &str| match FlatScene::from_bytes(&flat.to_bytes()) {
        Err(Error::BadFile { place, .. }) => assert_eq!(place, expected),
        other => panic!("{expected}: {:?}", other.map(|flat| flat.stats)),
    };
    for (expected, spoil) in faults {
        let mut flat = sound.clone();
        spoil(&mut flat);
        refused(&flat, expected);
    }
    let mut flat = sound.clone();
    let value = first_value(&flat);
    flat.rig.keys[value] = -0.1;
    refused(&flat, "rig.channels[3]");
    // A dimmer of something that is not there.
    let mut scene = lamps();
    scene.rig.dimmed_instances[0].target = 99;
    assert!(matches!(FlatScene::build(&scene, &mut |_, _| ()), Err(Error::BadValue { .. })));
}

fn load(writer: Writer) -> Result<Scene> {
    gltf::load_bytes("test.glb", &writer.glb(), &mut |path| {
        Err(Error::Io { path: path.into(), source: std::io::Error::other("no such file") })
    })
}

const INTENSITY: &str = "/extensions/KHR_lights_punctual/lights/0/intensity";
const STRENGTH: &str = "/materials/1/extensions/KHR_materials_emissive_strength/emissiveStrength";

/// A file with a light of the intensity 20, one of 0, and a mesh with two materials of which the second shines. The pointers
/// are animated by one sampler: 0, 40, 10 at 0, 1 and 2 s.
fn pointed(pointers: &[&str]) -> Writer {
    let mut writer = Writer::new(json!({"scene": 0, "scenes": [{"nodes": [0, 1, 2]}],
        "extensionsUsed": ["KHR_animation_pointer", "KHR_lights_punctual", "KHR_materials_emissive_strength"]}));
    let positions = writer.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let primitive = |material: usize| json!({"attributes": {"POSITION": positions}, "material": material});
    writer.push("meshes", json!({"primitives": [primitive(0), primitive(1)]}));
    writer.json["materials"] = json!([{}, {"emissiveFactor": [1, 0.5, 0],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 5}}}]);
    let lights =
        json!([{"type": "point", "intensity": 20, "color": [1, 1, 0.5]}, {"type": "directional", "intensity": 0}]);
    writer.json["extensions"] = json!({"KHR_lights_punctual": {"lights": lights}});
    let light = |index: usize| json!({"extensions": {"KHR_lights_punctual": {"light": index}}});
    writer.json["nodes"] = json!([{"mesh": 0}, light(0), light(1)]);
    let times = writer.floats("SCALAR", &[0.0, 1.0, 2.0]);
    let values = writer.floats("SCALAR", &[0.0, 40.0, 10.0]);
    let channels: Vec<Value> = pointers
        .iter()
        .map(|pointer| {
            let target = json!({"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": pointer}}});
            json!({"sampler": 0, "target": target})
        })
        .collect();
    writer.push("animations", json!({"samplers": [{"input": times, "output": values}], "channels": channels}));
    // Not animated: everything is as the file says.
    writer.push("animations", json!({"samplers": [{"input": times, "output": values}], "channels": []}));
    writer
}

#[test]
fn files_animate_intensities_and_emissive_strengths() {
    let dark = INTENSITY.replace("lights/0", "lights/1");
    let scene = load(pointed(&[INTENSITY, STRENGTH, &dark])).unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let flat = flatten(&scene);
    assert_eq!(flat.first_punctual, 1);
    for (clip, time, point, directional, strength) in [
        (0, 0.0, 0.0, 0.0, 0.0),
        (0, 0.5, 20.0, 20.0, 20.0),
        (0, 1.0, 40.0, 40.0, 40.0),
        (0, 1.5, 25.0, 25.0, 25.0),
        (1, 0.0, 20.0, 0.0, 5.0),
    ] {
        let stage = Stage::new(&flat, clip, time);
        let near = |a: Vec3, b: Vec3| assert!(a.distance(b) < 1e-4, "clip {clip}, {time} s: {a}, should be {b}");
        near(stage.punctual_lights()[0].intensity, point * Vec3::new(1.0, 1.0, 0.5));
        near(stage.punctual_lights()[1].intensity, Vec3::splat(directional));
        let shining = flat.triangles.iter().find(|triangle| triangle.light != NONE).unwrap().material;
        let full = flat.materials[shining as usize].emissive;
        near(full * stage.emitter(&flat, 0).unwrap().intensity.x, strength * Vec3::new(1.0, 0.5, 0.0));
    }
    // The other material's triangle is no light, and the file without animations is as before.
    let mut writer = pointed(&[]);
    writer.json["animations"] = json!([]);
    let scene = load(writer).unwrap();
    assert!(scene.rig.is_still());
    assert_eq!(scene.lights[0].intensity, Vec3::new(20.0, 20.0, 10.0));
    assert_eq!(scene.materials[1].emissive, Vec3::new(5.0, 2.5, 0.0));
}

#[test]
fn pointers_elsewhere_are_a_warning_and_broken_ones_are_refused() {
    let range = INTENSITY.replace("intensity", "range");
    let scene = load(pointed(&[&range, "/materials/1/emissiveFactor", INTENSITY])).unwrap();
    let warning = "2 channel(s) of animations target no node (KHR_animation_pointer): not played";
    assert_eq!(scene.warnings, [warning]);
    assert_eq!((scene.rig.powers.len(), scene.rig.dimmed_lights.len()), (1, 1));

    let refused = |pointer: &str, spoil: &dyn Fn(&mut Writer), place: &str, what: &str| {
        let mut writer = pointed(&[pointer]);
        spoil(&mut writer);
        match load(writer) {
            Err(Error::BadFile { place: found, what: said, .. }) => {
                assert!(found.contains(place) && said.contains(what), "{place}, {what}: {found}: {said}");
            }
            other => panic!("{place}, {what}: {:?}", other.map(|scene| scene.warnings)),
        }
    };
    let nothing = |_: &mut Writer| ();
    refused(&INTENSITY.replace('0', "7"), &nothing, "KHR_animation_pointer", "lights[7] does not exist");
    refused(&STRENGTH.replace('1', "7"), &nothing, "KHR_animation_pointer", "materials[7] does not exist");
    let sampler = |value: Value| {
        move |writer: &mut Writer| writer.json["animations"][0]["channels"][0]["sampler"] = value.clone()
    };
    refused(INTENSITY, &sampler(json!(3)), "animations[0].channels[0].sampler", "samplers[3] does not exist");
    refused(INTENSITY, &sampler(Value::Null), "animations[0].channels[0]", "no sampler");
    let output = |values: &'static [f32]| {
        move |writer: &mut Writer| {
            let accessor = writer.floats("SCALAR", values);
            writer.json["animations"][0]["samplers"][0]["output"] = json!(accessor);
        }
    };
    refused(INTENSITY, &output(&[0.0, -1.0, 0.0]), "animations[0].samplers[0].output", "a power of -1");
    refused(INTENSITY, &output(&[0.0, f32::INFINITY, 0.0]), "samplers[0].output", "not finite");
    refused(STRENGTH, &output(&[0.0, 1.0]), "samplers[0].output", "2 elements, but 3 keyframes take 3");

    // The tangents of a spline may be negative; what it comes to below 0 is 0.
    let mut writer = pointed(&[INTENSITY]);
    output(&[0.0, 0.0, -90.0, 0.0, 10.0, 0.0, 0.0, 10.0, 0.0])(&mut writer);
    writer.json["animations"][0]["samplers"][0]["interpolation"] = json!("CUBICSPLINE");
    let scene = load(writer).unwrap();
    assert_eq!(scene.rig.channels[0].interpolation, CUBIC_SPLINE);
    assert_eq!((scene.rig.pose(0, 0.2).powers[0], scene.rig.pose(0, 1.0).powers[0]), (0.0, 0.5));
}

/// Milliseconds of the table, and of a whole change on the device, for 1000, 100,000 and a million lights of which a sixteenth
/// is switched: `cargo test --test switching -- --ignored --nocapture`.
#[test]
#[ignore = "it measures"]
fn how_long_the_table_takes() {
    for count in [1000, 100_000, 1_000_000] {
        let mut scene = scenes::make(&format!("many-lights:{count}")).unwrap();
        let power = scene.rig.add_power(1.0);
        scene.rig.dimmed_instances.push(Dimmer { target: scene.instances.len() as u32 - 1, power });
        scene.rig.add_clip("blinking");
        scene.rig.add_power_channel(power, STEP, &[0.0, 1.0, 2.0], &[1.0, 0.0, 0.0]);
        let flat = flatten(&scene);
        let mut stage = Stage::new(&flat, 0, 0.0);
        let gpu = pollster::block_on(Gpu::headless(&restir::GpuOptions { default_limits: false })).unwrap();
        let mut device = GpuScene::new(&gpu, &flat).unwrap();
        let (mut table, mut upload) = (Vec::new(), Vec::new());
        for i in 0..41 {
            let start = Instant::now();
            stage.step(&flat, 0, f64::from(i % 2));
            let stepped = Instant::now();
            device.take_stage(&gpu, &flat, &stage);
            gpu.queue.submit([]);
            pollster::block_on(gpu.wait()).unwrap();
            table.push((stepped - start).as_secs_f64() * 1e3);
            upload.push(stepped.elapsed().as_secs_f64() * 1e3);
        }
        println!("{count} lights: table {:.3} ms, upload {:.3} ms (median of 41)", median(&table), median(&upload));
    }
}
