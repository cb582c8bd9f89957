//! Animated files: good ones with exact poses, broken ones with the error they must give, and thousands of mutated ones
//! that must do no harm.

mod support;

use glam::{Mat4, Quat, Vec3};
use restir::scene::rig::deform::{self, Deformed};
use restir::scene::rig::{Motion, Rig};
use restir::scene::{Scene, gltf, random::Random};
use restir::{Error, FlatScene, Result};
use serde_json::json;
use std::time::{Duration, Instant};
use support::animated::{DURATION, HALF_WIDTH, animated, node};
use support::extensions::quad;
use support::gltf_writer::{U16, Writer};

fn load(bytes: &[u8]) -> Result<Scene> {
    gltf::load_bytes("test.glb", bytes, &mut |path| {
        Err(Error::Io { path: path.into(), source: std::io::Error::other("no such file") })
    })
}

fn near(a: Vec3, b: Vec3) -> bool {
    (a - b).length() < 1e-5
}

/// The vertices of rig instance `index` at `time` of clip 0, in world space.
fn shape(scene: &Scene, index: usize, time: f64) -> Vec<Deformed> {
    let rig = &scene.rig;
    let (placement, pose) = (&rig.instances[index], rig.pose(0, time));
    let mesh = &scene.meshes[scene.instances[placement.instance as usize].mesh as usize];
    let mut out = Vec::new();
    let (weights, joints) = (pose.morph_weights(placement), pose.joint_matrices(rig, placement.skin));
    deform::deform(&mesh.vertices(), &mesh.deformation.targets.concat(), weights, &joints, &mut out);
    let to_world = pose.instance(placement);
    out.iter_mut().for_each(|vertex| vertex.position = to_world.transform_point3(vertex.position));
    out
}

#[test]
fn a_lamp_that_grows_from_nothing_is_known_at_rest() {
    let mut scene = restir::scene::builtin::make("motion").unwrap();
    let lamp = *scene.rig.instances.last().unwrap();
    scene.rig.nodes[lamp.node as usize].scale = Vec3::ZERO;
    scene.instances[lamp.instance as usize].transform = Mat4::from_scale(Vec3::ZERO);
    let flat = FlatScene::build(&scene, &mut |_, _| ()).unwrap();
    assert!(flat.lights.iter().all(|light| light.pmf > 0.0), "a light that is never drawn");
    assert!(flat.bounds[1].max_element() < 10.0, "{:?}: what has no place is in the scene's box", flat.bounds);
    assert!(flat.stats.bvh_depth < 24 && flat.stats.bvh_cost < 1000.0, "{:?}", flat.stats);
}

#[test]
fn everything_moves_as_the_file_says() {
    let scene = load(&animated().glb()).unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let rig = &scene.rig;
    let moving = rig.moving_nodes();
    let motions: Vec<Motion> = rig.instances.iter().map(|placement| rig.motion(placement, &moving)).collect();
    assert_eq!(motions, [Motion::Deforming, Motion::Deforming, Motion::Rigid]);
    assert_eq!(rig.clips.iter().map(|clip| clip.name.as_str()).collect::<Vec<_>>(), ["all", "still moves"]);
    assert_eq!((rig.duration(0), rig.lights.len(), rig.cameras.len()), (DURATION, 1, 1));

    // The bar stands at its joints, not at its node; its upper half turns to the left.
    for (time, turn) in [(0.0, 0.0f32), (0.5, 45.0), (1.0, 90.0), (1.5, 45.0), (2.0, 0.0), (2.5, 45.0)] {
        let bar = shape(&scene, 0, time);
        let turn = Quat::from_rotation_z(turn.to_radians());
        for (i, x) in [-HALF_WIDTH, HALF_WIDTH].into_iter().enumerate() {
            let lower = Vec3::new(x, 0.0, 0.0);
            assert!(near(bar[i].position, lower), "{time}");
            assert!(near(bar[2 + i].position, Vec3::Y + 0.5 * (lower + turn * lower)), "{time}: half of both");
            assert!(near(bar[4 + i].position, Vec3::Y + turn * (lower + Vec3::Y)), "{time}: {}", bar[4 + i].position);
            assert!(near(bar[4 + i].normal, Vec3::Z));
        }
    }
    // Weights (0, 0.5), (1, 0), (0, 0.5) of +2 Z and +4 X, at a node at z = -1.
    for (time, expected) in [(0.0, Vec3::new(2.0, 0.0, -1.0)), (0.5, Vec3::new(1.0, 0.0, 0.0)), (1.0, Vec3::Z)] {
        assert!(near(shape(&scene, 1, time)[0].position, expected), "{time}");
    }
    for (time, expected) in [(0.999, Vec3::ZERO), (1.0, 2.0 * Vec3::X), (1.999, 2.0 * Vec3::X)] {
        let rigid = rig.pose(0, time).instance(&rig.instances[2]);
        assert!(near(rigid.w_axis.truncate(), expected), "a step, {time}");
    }
    let camera = scene.cameras[0].at(&rig.pose(0, 0.5).node(rig.cameras[0].node)).unwrap();
    assert!(near(camera.position, Vec3::new(0.0, 1.5, 5.0)) && near(camera.forward, Vec3::NEG_Z));
    let light = scene.lights[0].at(&rig.pose(0, 0.5).node(rig.lights[0].node)).unwrap();
    assert!(near(light.position, Vec3::new(0.0, 1.5, 5.0)) && near(light.direction, Vec3::NEG_Z));
    assert_eq!((rig.find_clip("still moves").unwrap(), rig.find_clip("0").unwrap()), (1, 0));
    assert!(rig.find_clip("2").unwrap_err().to_string().contains("all, still moves"));
}

#[test]
fn what_no_animation_moves_takes_its_shape_for_good() {
    let mut writer = animated();
    writer.json["animations"] = json!([]);
    writer.json["nodes"][node::UPPER_JOINT]["rotation"] = json!([0, 0, 1, 1]);
    let scene = load(&writer.glb()).unwrap();
    assert_eq!(scene.rig, Rig::default());
    let placed = |instance: usize, vertex: usize| {
        let instance = &scene.instances[instance];
        let mesh = &scene.meshes[instance.mesh as usize];
        assert!(mesh.deformation.influences.is_empty() && mesh.deformation.targets.is_empty());
        instance.transform.transform_point3(mesh.positions[vertex])
    };
    assert!(near(placed(0, 4), Vec3::new(-1.0, 1.0 - HALF_WIDTH, 0.0)), "{}", placed(0, 4));
    assert!(near(placed(1, 0), Vec3::new(2.0, 0.0, -1.0)), "the mesh's own weights");
    assert_eq!(scene.instances[2].transform, Mat4::IDENTITY);
    // The node's weights come before the mesh's.
    let mut writer = animated();
    writer.json["animations"] = json!([]);
    writer.json["nodes"][node::MORPH]["weights"] = json!([1, 0]);
    let scene = load(&writer.glb()).unwrap();
    let mesh = &scene.meshes[scene.instances[1].mesh as usize];
    assert_eq!(mesh.positions[0], Vec3::new(0.0, 0.0, 2.0));
}

#[test]
fn keyframes_of_every_type() {
    let mut writer = animated();
    let quarter = (32_767.0 * std::f32::consts::FRAC_1_SQRT_2) as i16;
    let turns: Vec<u8> = [[0, 0, 0, 32_767], [0, 0, quarter, quarter], [0, 0, 0, 32_767]]
        .iter()
        .flatten()
        .flat_map(|value: &i16| value.to_le_bytes())
        .collect();
    let turns = writer.accessor("VEC4", 5122, 3, &turns);
    writer.json["animations"][0]["samplers"][0]["output"] = json!(turns);
    let weights = writer.accessor("SCALAR", U16, 6, &[0, 0, 0, 128, 255, 255, 0, 0, 0, 0, 0, 128]);
    writer.json["accessors"][weights]["normalized"] = json!(true);
    writer.json["animations"][0]["samplers"][1]["output"] = json!(weights);
    let scene = load(&writer.glb()).unwrap();
    assert!((shape(&scene, 0, 1.0)[4].position - Vec3::new(-1.0, 1.0 - HALF_WIDTH, 0.0)).length() < 1e-4);
    assert!((shape(&scene, 1, 1.0)[0].position - Vec3::Z).length() < 1e-4);
}

/// What a file's spoiling must lead to.
fn refused(spoil: impl Fn(&mut Writer), place: &str, what: &str) {
    let mut writer = animated();
    spoil(&mut writer);
    match load(&writer.glb()) {
        Err(Error::BadFile { place: found, what: said, .. }) => {
            assert!(found.contains(place) && said.contains(what), "{place}, {what}: {found}: {said}");
        }
        other => panic!("{place}, {what}: {:?}", other.map(|scene| scene.warnings)),
    }
}

#[test]
fn broken_animations_are_refused() {
    let input = |values: &'static [f32]| {
        move |writer: &mut Writer| {
            let accessor = writer.floats("SCALAR", values);
            writer.json["animations"][0]["samplers"][0]["input"] = json!(accessor);
        }
    };
    let place = "animations[0].samplers[0].input";
    refused(input(&[0.0, f32::NAN, 2.0]), place, "time 1 is NaN");
    refused(input(&[0.0, f32::INFINITY, 2.0]), place, "time 1 is inf");
    refused(input(&[-1.0, 0.0, 2.0]), place, "time 0 is -1");
    refused(input(&[0.0, 2.0, 1.0]), place, "time 2 is 1, before the 2");
    refused(input(&[]), place, "no keyframes");
    refused(input(&[0.0, 1.0]), "animations[0].samplers[0].output", "3 elements, but 2 keyframes take 2");
    let cubic =
        |writer: &mut Writer| writer.json["animations"][0]["samplers"][1]["interpolation"] = json!("CUBICSPLINE");
    refused(cubic, "samplers[1].output", "6 elements, but 3 keyframes take 18");
    let output = |kind: &'static str, values: Vec<f32>| {
        move |writer: &mut Writer| {
            let accessor = writer.floats(kind, &values);
            writer.json["animations"][0]["samplers"][0]["output"] = json!(accessor);
        }
    };
    let place = "animations[0].samplers[0].output";
    refused(
        output("VEC4", [0.0, 0.0, 0.0, 1.0].repeat(2).into_iter().chain([0.0; 4]).collect()),
        place,
        "without length",
    );
    refused(output("VEC4", vec![f32::NAN; 12]), place, "not finite");
    refused(output("VEC3", vec![1.0; 9]), place, "elements are Vec3");
    let channel = |key: &'static str, value: serde_json::Value| {
        move |writer: &mut Writer| writer.json["animations"][0]["channels"][0][key] = value.clone()
    };
    refused(channel("sampler", json!(9)), "channels[0].sampler", "samplers[9] does not exist");
    refused(channel("target", json!({"node": 99, "path": "scale"})), "channels[0].target.node", "nodes[99]");
    let interpolation =
        |writer: &mut Writer| writer.json["animations"][0]["samplers"][0]["interpolation"] = json!("CUBE");
    refused(interpolation, "samplers[0].interpolation", "none of the values");
}

#[test]
fn broken_skins_and_targets_are_refused() {
    // In a file without anything that moves, too.
    let mut lone = quad(json!({}));
    lone.json["nodes"][0]["skin"] = json!(3);
    assert!(matches!(load(&lone.glb()), Err(Error::BadFile { .. })), "a skin that does not exist");
    let skin = |key: &'static str, value: serde_json::Value| {
        move |writer: &mut Writer| writer.json["skins"][0][key] = value.clone()
    };
    refused(skin("joints", json!([0, 77])), "skins[0].joints[1]", "nodes[77] does not exist");
    refused(skin("joints", json!([])), "skins[0]", "no joints");
    refused(skin("joints", json!([0, 1, 2])), "skins[0].inverseBindMatrices", "2 matrices for 3 joints");
    refused(skin("joints", json!([0])), "skins[0]", "names joint 1, but there are 1");
    refused(|writer| writer.json["nodes"][node::BAR]["skin"] = json!(3), "skin", "skins[3] does not exist");
    refused(|writer| writer.json["nodes"][1]["children"] = json!([0]), "nodes[0]", "its own ancestor");
    refused(|writer| writer.json["nodes"][1]["rotation"] = json!([0, 0, 0, 0]), "nodes[1].rotation", "no length");
    let nan = |writer: &mut Writer| {
        let accessor = writer.accessor("MAT4", 5126, 2, &f32::NAN.to_le_bytes().repeat(32));
        writer.json["skins"][0]["inverseBindMatrices"] = json!(accessor);
    };
    refused(nan, "skins[0].inverseBindMatrices, matrix 0", "");
    let alone = |writer: &mut Writer| {
        writer.json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("WEIGHTS_0");
    };
    refused(alone, "meshes[0].primitives[0].attributes", "come together");
    let short = |writer: &mut Writer| {
        let accessor = writer.floats("VEC3", &[0.0; 6]);
        writer.json["meshes"][1]["primitives"][0]["targets"][1]["POSITION"] = json!(accessor);
    };
    refused(short, "targets[1].POSITION", "2 elements, but POSITION has 3");
    refused(|writer| writer.json["meshes"][1]["weights"] = json!([1]), "nodes[3]", "1 weights for 2 morph targets");
}

#[test]
fn what_is_odd_is_said() {
    let warned = |spoil: &dyn Fn(&mut Writer), text: &str| {
        let mut writer = animated();
        spoil(&mut writer);
        let scene = load(&writer.glb()).unwrap();
        assert!(scene.warnings.iter().any(|warning| warning.contains(text)), "{text}: {:?}", scene.warnings);
        scene
    };
    let outside = warned(&|writer| writer.json["scenes"][0]["nodes"] = json!([2, 3, 4, 5, 6]), "the skin is left out");
    assert_eq!(outside.instances[0].transform.w_axis.x, 100.0, "without its skin it is where its node is");
    warned(&|writer| writer.json["animations"][0]["channels"][0]["target"]["path"] = json!("spin"), "path is unknown");
    let pointer = json!({"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": "/materials/0"}}});
    warned(&|writer| writer.json["animations"][0]["channels"][0]["target"] = pointer.clone(), "KHR_animation_pointer");
    warned(&|writer| writer.json["animations"][0]["channels"][1]["target"]["node"] = json!(0), "no morph targets");
    let weights = |values: [f32; 24]| {
        move |writer: &mut Writer| {
            let accessor = writer.floats("VEC4", &values);
            writer.json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] = json!(accessor);
        }
    };
    for bad in [0.0, f32::NAN, -1.0, f32::INFINITY] {
        let scene = warned(&weights([bad; 24]), "joint weights of 6 vertices");
        let influences = &scene.meshes[scene.instances[0].mesh as usize].deformation.influences;
        assert!(influences.iter().all(|influence| influence.weights == [1.0, 0.0, 0.0, 0.0]), "{bad}");
    }
    let nan = |writer: &mut Writer| {
        let accessor = writer.floats("VEC3", &[f32::NAN; 9]);
        writer.json["meshes"][1]["primitives"][0]["targets"][0]["POSITION"] = json!(accessor);
    };
    warned(&nan, "3 displacement(s)");
    let second = |writer: &mut Writer| {
        let attributes = &writer.json["meshes"][0]["primitives"][0]["attributes"];
        let (joints, weights) = (attributes["JOINTS_0"].clone(), attributes["WEIGHTS_0"].clone());
        let attributes = &mut writer.json["meshes"][0]["primitives"][0]["attributes"];
        (attributes["JOINTS_1"], attributes["WEIGHTS_1"]) = (joints, weights);
    };
    let mut writer = animated();
    second(&mut writer);
    assert!(load(&writer.glb()).unwrap().warnings.is_empty(), "four joints at most, in two sets");
}

/// Changes digits or bytes of a file.
fn mutate(file: &[u8], random: &mut Random) -> Vec<u8> {
    let mut file = file.to_vec();
    let digits: Vec<usize> = (0..file.len()).filter(|&i| file[i].is_ascii_digit()).collect();
    let mut below = |n: usize| random.next_u32() as usize % n;
    let only_digits = below(2) == 0;
    for _ in 0..=below(3) {
        if only_digits {
            file[digits[below(digits.len())]] = b'0' + below(10) as u8;
        } else {
            let at = below(file.len());
            file[at] = below(256) as u8;
        }
    }
    file
}

#[test]
fn mutated_files_do_no_harm() {
    let good = animated().glb();
    let mut random = Random::new(41);
    let (mut loaded, mut moved, mut slowest) = (0, 0, Duration::ZERO);
    for _ in 0..3000 {
        let file = mutate(&good, &mut random);
        let start = Instant::now();
        match load(&file) {
            Ok(scene) => {
                loaded += 1;
                for index in 0..scene.rig.instances.len() {
                    for time in [0.0, 0.7, 1e9] {
                        moved += usize::from(!shape(&scene, index, time).is_empty());
                    }
                }
                // A scene may have lights or vertices too far away; whatever the answer, it is no panic.
                if let Ok(flat) = FlatScene::build(&scene, &mut |_, _| ())
                    && let Err(error) = FlatScene::from_bytes(&flat.to_bytes())
                {
                    panic!("what was flattened is refused: {error}");
                }
            }
            Err(error) => assert!(!error.to_string().contains('\n')),
        }
        slowest = slowest.max(start.elapsed());
    }
    assert!(slowest < Duration::from_secs(5), "{slowest:?}");
    assert!((300..2700).contains(&loaded), "{loaded} of 3000 loaded: the mutations are too weak or too strong");
    assert!(moved > 3000, "{moved}");
}

#[test]
fn mutated_rigs_in_bytes_do_no_harm() {
    let scene = load(&animated().glb()).unwrap();
    let bytes = FlatScene::build(&scene, &mut |_, _| ()).unwrap().to_bytes();
    let mut random = Random::new(42);
    let mut refused = 0;
    for _ in 0..3000 {
        match FlatScene::from_bytes(&mutate(&bytes, &mut random)) {
            Err(error) => {
                refused += 1;
                assert!(matches!(error, Error::BadFile { .. }), "{error}");
            }
            Ok(flat) => {
                let pose = flat.rig.pose(0, 0.7);
                for placement in &flat.rig.instances {
                    let _ = (pose.instance(placement), pose.joint_matrices(&flat.rig, placement.skin));
                }
            }
        }
    }
    assert!(refused > 300, "{refused}");
}

#[test]
fn a_hundred_thousand_vertices_are_skinned_in_milliseconds() {
    let vertex = |i: u32| deform::Vertex {
        position: Vec3::new(i as f32 * 1e-3, 1.0, 0.0),
        normal: Vec3::Y,
        tangent: [1.0, 0.0, 0.0, 1.0],
        joints: [i % 60, i % 59, i % 58, i % 57].map(|joint| joint as u16),
        weights: [0.4, 0.3, 0.2, 0.1],
    };
    let vertices: Vec<_> = (0..100_000).map(vertex).collect();
    let joints: Vec<Mat4> = (0..60).map(|i| Mat4::from_rotation_z(i as f32 * 0.01)).collect();
    let mut out = Vec::new();
    let mut times: Vec<Duration> = (0..9)
        .map(|_| {
            let start = Instant::now();
            deform::deform(&vertices, &[], &[], &joints, &mut out);
            start.elapsed()
        })
        .collect();
    times.sort();
    println!("100,000 vertices with four joints each: {:?} (median of 9)", times[4]);
    // A hundred times what it takes: only an accident of complexity is worth a failure.
    assert!(times[4] < Duration::from_secs(1), "{times:?}");
}
