//! Formats beyond plain glTF. What a decoder gives is compared with what the reference decoder of the format gave
//! (tests/data, made by tests/data/make.mjs), and a scene that uses an extension with its twin that does without.

mod support;

use glam::{Mat4, Quat, Vec2, Vec3};
use restir::scene::flat::cooked;
use restir::scene::{FlatScene, Scene, gltf, obj};
use restir::{Error, Result};
use restir_decoders::picture::Limits;
use restir_decoders::{Fault, draco, meshopt, picture};
use serde_json::{Value, json};
use support::extensions::*;
use support::gltf_writer::{F32, U8, Writer, image_file};

const LIMITS: Limits = Limits { side: 16_384, bytes: 1 << 20 };

fn nothing(path: &str) -> Result<Vec<u8>> {
    Err(Error::Io { path: path.into(), source: std::io::Error::other("no such file") })
}

fn load(bytes: &[u8]) -> Result<Scene> {
    gltf::load_bytes("test.glb", bytes, &mut nothing)
}

fn load_with(bytes: &[u8], options: &gltf::Options) -> Result<Scene> {
    gltf::load_bytes_with("test.glb", bytes, options, &mut nothing)
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|word| f32::from_le_bytes(word.try_into().unwrap())).collect()
}

/// Flattened, with what may differ between twins removed.
fn flat(scene: &Scene) -> FlatScene {
    let mut flat = support::flatten(scene);
    flat.warnings.clear();
    flat
}

#[track_caller]
fn assert_twins(with: &Scene, without: &Scene) {
    assert!(!without.meshes.is_empty());
    assert_eq!(with.warnings, Vec::<String>::new());
    assert!(flat(with) == flat(without), "the scene differs from its twin without the extension");
}

/// The error must be one line, with this code, and say this.
#[track_caller]
fn assert_refused<T>(result: Result<T>, code: &str, parts: &[&str]) {
    let error = result.err().expect("it is refused");
    let message = error.to_string();
    assert_eq!(error.code(), code, "{message}");
    assert!(!message.contains('\n') && parts.iter().all(|part| message.contains(part)), "{message}");
}

// Draco

#[test]
fn draco_decodes_as_the_reference() {
    for case in cases("draco.json") {
        let name = case["name"].as_str().unwrap();
        let mesh = draco::decode(&unbase64(&case["encoded"]), 1 << 20).unwrap();
        assert_eq!(u64::from(mesh.vertices), case["vertices"].as_u64().unwrap(), "{name}");
        let indices: Vec<u8> = mesh.indices.iter().flat_map(|index| index.to_le_bytes()).collect();
        assert_eq!(indices, unbase64(&case["indices"]), "{name}");
        for (semantic, id) in case["ids"].as_object().unwrap() {
            let attribute =
                mesh.attributes.iter().find(|attribute| Some(u64::from(attribute.id)) == id.as_u64()).unwrap();
            let reference = unbase64(&case[semantic]);
            if attribute.component_type == U8 {
                assert_eq!(attribute.values, reference, "{name} {semantic}");
            } else {
                let pairs = floats(&attribute.values).into_iter().zip(floats(&reference));
                assert_eq!((attribute.component_type, attribute.values.len()), (F32, reference.len()));
                assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() <= 1e-6), "{name} {semantic}");
            }
        }
    }
}

#[test]
fn draco_scenes_are_as_their_twins() {
    for case in cases("draco.json") {
        let (with, without) = draco_twins(&case);
        let (with, without) = (load(&with.glb()).unwrap(), load(&without.glb()).unwrap());
        // The decoders' last bits of a normal may differ: they are compared above.
        let close = |a: &Vec3, b: &Vec3| a.distance(*b) < 1e-5;
        let (a, b) = (&with.meshes[0], &without.meshes[0]);
        assert_eq!((&a.indices, &a.colors, &a.uvs), (&b.indices, &b.colors, &b.uvs));
        assert!(a.positions.iter().zip(&b.positions).all(|(a, b)| close(a, b)));
        assert!(a.normals.len() == b.normals.len() && a.normals.iter().zip(&b.normals).all(|(a, b)| close(a, b)));
        assert_eq!(with.warnings, Vec::<String>::new());
    }
}

#[test]
fn broken_draco_is_refused() {
    let case = &cases("draco.json")[0];
    let changed = |change: &dyn Fn(&mut Value)| {
        let (mut with, _) = draco_twins(case);
        change(&mut with.json);
        load(&with.glb())
    };
    let extension = "/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression";
    let at =
        |json: &mut Value, path: &str, value: Value| *json.pointer_mut(&format!("{extension}{path}")).unwrap() = value;
    assert_refused(changed(&|json| at(json, "/bufferView", json!(99))), "BAD_FILE", &["bufferViews[99]"]);
    assert_refused(changed(&|json| at(json, "/bufferView", json!("x"))), "BAD_FILE", &["KHR_draco_mesh_compression"]);
    assert_refused(
        changed(&|json| at(json, "/attributes/POSITION", json!(77))),
        "BAD_FILE",
        &["POSITION", "no such attribute"],
    );
    assert_refused(changed(&|json| json["bufferViews"][0]["byteLength"] = json!(40)), "BAD_FILE", &["Draco"]);
    // Positions that are not compressed, and fewer than the vertices that are.
    let few = changed(&|json| {
        json.pointer_mut(&format!("{extension}/attributes")).unwrap().as_object_mut().unwrap().remove("POSITION");
        for accessor in json["accessors"].as_array_mut().unwrap() {
            accessor["count"] = json!(5);
        }
        json["meshes"][0]["primitives"][0]["attributes"] = json!({"POSITION": 0});
    });
    assert_refused(few, "BAD_FILE", &["more vertices than the 5 positions"]);
    // More than is allowed, told before it is there.
    let bytes = unbase64(&case["encoded"]);
    assert!(draco::decode(&bytes, 500).is_err());
}

// meshopt

/// Rounding may differ by one in what these filters give (specification, appendix B).
fn within_one(filter: &str, stride: usize, a: &[u8], b: &[u8]) -> bool {
    if !["OCTAHEDRAL", "QUATERNION", "COLOR"].contains(&filter) {
        return a == b;
    }
    let width = stride / 4;
    let number = |bytes: &[u8]| bytes.iter().rev().fold(0i32, |n, &byte| n << 8 | i32::from(byte));
    let range = 1 << (8 * width);
    a.len() == b.len()
        && a.chunks(width)
            .zip(b.chunks(width))
            .all(|(a, b)| [0, 1, range - 1].contains(&((number(a) - number(b)) & (range - 1))))
}

#[test]
fn meshopt_decodes_as_the_reference() {
    for case in cases("meshopt.json") {
        let [name, mode, filter] = ["name", "mode", "filter"].map(|key| case[key].as_str().unwrap());
        let [count, stride] = ["count", "stride"].map(|key| case[key].as_u64().unwrap() as usize);
        let layout = meshopt::Layout::new(mode, filter, count, stride).unwrap();
        let (encoded, expected) = (unbase64(&case["encoded"]), unbase64(&case["decoded"]));
        let decoded = meshopt::decode(&encoded, &layout).unwrap_or_else(|fault| panic!("{name}: {fault:?}"));
        assert!(within_one(filter, stride, &decoded, &expected), "{name}");
        for wrong in [&encoded[..encoded.len() - 1], &[&encoded[..], &[0]].concat()] {
            // What is cut off may lie in padding; what is added never does.
            assert!(wrong.len() < encoded.len() || meshopt::decode(wrong, &layout) != Ok(decoded.clone()), "{name}");
        }
        // Lying counts are refused before anything is allocated for them.
        let absurd = meshopt::Layout { count: 3_000_000_000, ..layout };
        assert!(meshopt::decode(&encoded, &absurd).is_err(), "{name}");
    }
}

#[test]
fn meshopt_scenes_are_as_their_twins() {
    let cases = cases("meshopt.json");
    for (extension, version) in [("EXT_meshopt_compression", 0), ("KHR_meshopt_compression", 1)] {
        let (positions, normals) = (format!("exponential v{version}"), format!("octahedral 8 v{version}"));
        let names = [positions.as_str(), normals.as_str(), "sheet TRIANGLES"];
        for fallback in [
            json!({"byteLength": 4000}),
            json!({"byteLength": 4000, "uri": "gone.bin", "extensions": {extension: {"fallback": true}}}),
        ] {
            let (with, without) = meshopt_twins(extension, &cases, names);
            let (with, without) = (load(&with_placeholder(with, fallback)).unwrap(), load(&without.glb()).unwrap());
            assert_twins(&with, &without);
        }
    }
}

#[test]
fn broken_meshopt_is_refused() {
    let cases = cases("meshopt.json");
    let name = "EXT_meshopt_compression";
    let changed = |key: &str, value: Value| {
        let (mut with, _) = meshopt_twins(name, &cases, ["exponential v0", "octahedral 8 v0", "sheet TRIANGLES"]);
        with.json["bufferViews"][1]["extensions"][name][key] = value;
        load(&with_placeholder(with, json!({"byteLength": 4000})))
    };
    for (key, value, what) in [
        ("mode", json!("CUBES"), "mode"),
        ("filter", json!("BLUR"), "filter"),
        ("filter", json!("QUATERNION"), "elements of 12 bytes"),
        ("count", json!(64), "are not the"),
        ("count", json!(-1), "count"),
        ("buffer", json!(7), "buffers[7]"),
        ("buffer", json!(1), "only stands for"),
        ("byteLength", json!(1 << 30), "outside"),
        ("byteLength", json!(20), "early"),
        ("byteStride", json!(1u64 << 60), "are not the"),
    ] {
        assert_refused(changed(key, value), "BAD_FILE", &["bufferViews[1]", what]);
    }
    let (with, _) = meshopt_twins(name, &cases, ["exponential v0", "octahedral 8 v0", "sheet TRIANGLES"]);
    let mut bare = with;
    bare.json["bufferViews"][1].as_object_mut().unwrap().remove("extensions");
    assert_refused(load(&with_placeholder(bare, json!({"byteLength": 4000}))), "BAD_FILE", &["only stands for"]);
}

// Quantization

#[test]
fn quantized_attributes_are_as_floats() {
    let i16s = |values: &[i16]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
    let primitive = json!({"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3, "material": 0});
    let parts = |node: Value| {
        json!({"nodes": [node], "meshes": [{"primitives": [primitive]}], "materials": [textured()],
            "extensionsUsed": ["KHR_mesh_quantization"], "extensionsRequired": ["KHR_mesh_quantization"]})
    };
    // Positions in hundreds, the node scales them; normals of 8 bits in rows of 4; coordinates in sixteenths.
    let mut with = Writer::new(parts(json!({"mesh": 0, "scale": [0.01, 0.01, 0.01]})));
    let positions =
        QUAD.chunks(3).flat_map(|p| [p[0], p[1], p[2], 0.0]).map(|v| (100.0 * v) as i16).collect::<Vec<_>>();
    let normals = QUAD_NORMALS
        .chunks(3)
        .flat_map(|n| [n[0], n[1], n[2], 0.0])
        .map(|v| (127.0 * v) as i8 as u8)
        .collect::<Vec<_>>();
    for (kind, component, bytes, normalized, stride) in [
        ("VEC3", I16, i16s(&positions), false, 8),
        ("VEC3", I8, normals, true, 4),
        ("VEC2", I16, i16s(&QUAD_UVS.map(|v| (16.0 * v) as i16)), false, 4),
    ] {
        let view = with.view(&bytes);
        with.json["bufferViews"][view]["byteStride"] = stride.into();
        with.push(
            "accessors",
            json!({"bufferView": view, "type": kind, "componentType": component, "count": 4, "normalized": normalized}),
        );
    }
    with.indices(&QUAD_INDICES);
    let mut without = quad(textured());
    without.json["nodes"][0]["scale"] = json!([1.0, 1.0, 1.0]);
    let image = image_file(2, 1, &[255, 0, 0, 255, 0, 255, 0, 128], image::ImageFormat::Png);
    for (writer, scale) in [(&mut with, 1.0 / 16.0), (&mut without, 1.0)] {
        let view = writer.view(&image);
        writer.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
        writer.push("textures", json!({"source": 0}));
        writer.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] =
            json!({"KHR_texture_transform": {"scale": [scale, scale]}});
    }
    let refused = {
        let mut plain = Writer::new(with.json.clone());
        plain.json["extensionsUsed"] = json!([]);
        plain.json["extensionsRequired"] = json!([]);
        plain.json["materials"] = json!([{}]);
        plain.view(&[0; 400]);
        plain.glb()
    };
    let (with, without) = (load(&with.glb()).unwrap(), load(&without.glb()).unwrap());
    let points = |scene: &Scene| {
        let (mesh, to_world) = (&scene.meshes[0], scene.instances[0].transform);
        mesh.positions.iter().map(|&p| to_world.transform_point3(p)).collect::<Vec<_>>()
    };
    assert!(points(&with).iter().zip(points(&without)).all(|(a, b)| a.distance(b) < 1e-6));
    assert_eq!(with.meshes[0].normals, without.meshes[0].normals);
    assert!(with.meshes[0].uvs[0].iter().zip(&without.meshes[0].uvs[0]).all(|(a, b)| *a / 16.0 == *b));
    assert_refused(load(&refused), "BAD_FILE", &["POSITION", "I16"]);
}

// Pictures

#[test]
fn pictures_decode_as_the_reference() {
    // Lossy WebP is subsampled; libwebp and image-webp interpolate chroma with other roundings.
    for (name, file, tolerance) in [
        ("etc1s", "etc1s.ktx2", 0),
        ("etc1s-alpha", "etc1s-alpha.ktx2", 0),
        ("uastc", "uastc.ktx2", 0),
        ("uastc-zstd", "uastc-zstd.ktx2", 0),
        ("lossless", "lossless.webp", 0),
        ("lossy", "lossy.webp", 2),
    ] {
        let expected = image::load_from_memory(&data(&format!("{name}.png"))).unwrap().into_rgba8();
        let decoded = picture::decode(&data(file), LIMITS).unwrap();
        assert_eq!((decoded.width, decoded.height), (expected.width(), expected.height()), "{name}");
        let worst = decoded.pixels.iter().zip(expected.as_raw()).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(worst <= Some(tolerance), "{name}: {worst:?}");
    }
}

#[test]
fn picture_scenes_are_as_their_twins() {
    for (extension, file, twin) in [
        ("KHR_texture_basisu", "etc1s.ktx2", "etc1s.png"),
        ("KHR_texture_basisu", "uastc-zstd.ktx2", "uastc-zstd.png"),
        ("EXT_texture_webp", "lossless.webp", "lossless.png"),
    ] {
        let with = load(&pictured(Some(extension), file).glb()).unwrap();
        assert_twins(&with, &load(&pictured(None, twin).glb()).unwrap());
    }
    // The extension's picture wins over the plain one that stands beside it.
    let mut both = pictured(Some("EXT_texture_webp"), "lossless.webp");
    both.json["extensionsRequired"] = json!([]);
    let view = both.view(&data("lossy.png"));
    both.push("images", json!({"bufferView": view}));
    both.json["textures"][0]["source"] = json!(1);
    assert_twins(&load(&both.glb()).unwrap(), &load(&pictured(None, "lossless.png").glb()).unwrap());
    // A picture of that kind without its extension.
    assert_refused(load(&pictured(None, "lossless.webp").glb()), "UNSUPPORTED", &["images[0]", "extensionsUsed"]);
}

#[test]
fn lying_pictures_are_refused() {
    let u32_at = |bytes: &mut Vec<u8>, at: usize, value: u32| bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
    let refused = |file: &str, changes: &[(usize, u32)], what: &str| {
        let mut bytes = data(file);
        changes.iter().for_each(|&(at, value)| u32_at(&mut bytes, at, value));
        let fault = picture::decode(&bytes, LIMITS).err().unwrap_or_else(|| panic!("{file} {changes:?} decodes"));
        assert!(format!("{fault:?}").contains(what), "{file} {changes:?}: {fault:?}");
    };
    for file in ["etc1s.ktx2", "uastc.ktx2", "uastc-zstd.ktx2"] {
        refused(file, &[(12, 37)], "Vulkan format 37");
        refused(file, &[(20, 0)], "0 x 14");
        refused(file, &[(20, 1 << 30)], "at most 16384 a side");
        refused(file, &[(20, 16_000), (24, 16_000)], "1048576 bytes");
        refused(file, &[(32, 6)], "not one two-dimensional picture");
        refused(file, &[(36, 6)], "not one two-dimensional picture");
        refused(file, &[(40, 0)], "not one two-dimensional picture");
        refused(file, &[(48, u32::MAX)], "format descriptor");
        refused(file, &[(68, u32::MAX)], "global data");
        refused(file, &[(84, u32::MAX)], "largest level");
        refused(file, &[(88, u32::MAX)], "largest level");
        refused(file, &[(44, 3)], "scheme 3");
    }
    refused("uastc.ktx2", &[(20, 200), (24, 200)], "bytes of blocks");
    refused("uastc-zstd.ktx2", &[(20, 200), (24, 200)], "bytes of blocks");
    // Consistent with itself, but not with what it decompresses to.
    refused("uastc-zstd.ktx2", &[(20, 200), (24, 200), (96, 40_000)], "another length");
    // What its slices hold is not known before they are decoded: another size is another picture, but never a larger one
    // than was allowed. Their place in the level is.
    let mut etc1s = data("etc1s.ktx2");
    let globals = u64::from_le_bytes(etc1s[64..72].try_into().unwrap()) as usize;
    for at in [24, 28] {
        let mut lying = etc1s.clone();
        u32_at(&mut lying, globals + at, u32::MAX);
        assert!(matches!(picture::decode(&lying, LIMITS), Err(Fault::Broken(what)) if what.contains("slice")));
    }
    u32_at(&mut etc1s, globals + 4, u32::MAX);
    assert!(matches!(picture::decode(&etc1s, LIMITS), Err(Fault::Broken(what)) if what.contains("codebook")));
    // A frame that is larger than the picture it belongs to.
    let mut frame = data("lossy.webp");
    let at = frame.windows(3).position(|code| code == [0x9d, 0x01, 0x2a]).unwrap() + 3;
    frame[at..at + 4].copy_from_slice(&[0xff, 0x3f, 0xff, 0x3f]);
    assert!(matches!(picture::decode(&frame, LIMITS), Err(Fault::Broken(what)) if what.contains("16383 x 16383")));
    let mut webp = data("lossless.webp");
    webp.truncate(40);
    assert!(picture::decode(&webp, LIMITS).is_err());
}

// Instancing

#[test]
fn instances_are_as_nodes() {
    let turn = Quat::from_rotation_y(0.5);
    let (translations, scales) = ([0.0, 0.0, 0.0, 3.0, 0.0, 1.0], [1.0, 1.0, 1.0, 2.0, 0.5, 2.0]);
    let mut with = quad(json!({}));
    with.floats("VEC3", &translations);
    with.floats("VEC4", &[Quat::IDENTITY.to_array(), turn.to_array()].concat());
    with.floats("VEC3", &scales);
    with.json["nodes"][0]["translation"] = json!([0.0, 5.0, 0.0]);
    with.json["nodes"][0]["extensions"] =
        json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 4, "ROTATION": 5, "SCALE": 6, "_ID": 99}}});
    with.json["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    with.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    let mut without = quad(json!({}));
    without.json["nodes"] = json!([
        {"translation": [0.0, 5.0, 0.0], "children": [1, 2]},
        {"mesh": 0},
        {"mesh": 0, "translation": translations[3..], "rotation": turn.to_array(), "scale": scales[3..]},
    ]);
    let broken = |change: &dyn Fn(&mut Value)| {
        let mut writer = quad(json!({}));
        writer.floats("VEC3", &translations);
        writer.floats("VEC4", &[0.0; 8]);
        writer.floats("VEC3", &[1.0; 9]);
        writer.floats("VEC3", &[f32::NAN; 6]);
        writer.json["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
        writer.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": {}}});
        change(&mut writer.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]);
        load(&writer.glb())
    };
    assert_twins(&load(&with.glb()).unwrap(), &load(&without.glb()).unwrap());
    let place = "nodes[0].extensions.EXT_mesh_gpu_instancing.attributes";
    for (attributes, what) in [
        (json!({}), "neither"),
        (json!({"TRANSLATION": 4, "SCALE": 6}), "different numbers of elements: [2, 3]"),
        (json!({"TRANSLATION": 5}), "Vec4"),
        (json!({"TRANSLATION": 99}), "accessors[99]"),
        (json!({"TRANSLATION": "x"}), "no index"),
        (json!({"ROTATION": 5}), "no length"),
        (json!({"TRANSLATION": 7}), "not finite"),
    ] {
        assert_refused(broken(&|json| *json = attributes.clone()), "BAD_FILE", &[place, what]);
    }
}

#[test]
fn quantized_rotations_of_instances() {
    let mut writer = quad(json!({}));
    let bytes: Vec<u8> = [0i16, 23_170, 0, 23_170].iter().flat_map(|v| v.to_le_bytes()).collect();
    writer.accessor("VEC4", I16, 1, &bytes);
    writer.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": {"ROTATION": 4}}});
    let scene = load(&writer.glb()).unwrap();
    let expected = Mat4::from_rotation_y(std::f32::consts::FRAC_PI_2);
    assert!(scene.instances[0].transform.abs_diff_eq(expected, 1e-4));
}

// Variants and scenes

#[test]
fn variants_are_chosen_by_name() {
    let file = with_variants().glb();
    assert_eq!(gltf::contents("test.glb", &file).unwrap().variants, ["day", "dusk", "night"]);
    let mut red = quad(json!({}));
    red.push("materials", json!({"name": "red", "pbrMetallicRoughness": {"baseColorFactor": [1.0, 0.0, 0.0, 1.0]}}));
    red.json["meshes"][0]["primitives"][0]["material"] = json!(1);
    let options = |variant| gltf::Options { variant: Some(variant), ..gltf::Options::default() };
    assert_twins(&load_with(&file, &options("dusk")).unwrap(), &load(&red.glb()).unwrap());
    assert_twins(
        &load_with(&file, &options("day")).unwrap(),
        &load(&quad(json!({})).glb())
            .map(|mut scene| {
                scene.materials.push(load(&file).unwrap().materials[1].clone());
                scene
            })
            .unwrap(),
    );
    assert_eq!(load(&file).unwrap().meshes[0].material, 0);
    assert_refused(load_with(&file, &options("noon")), "UNKNOWN_NAME", &["noon", "day, dusk, night"]);
    for (mapping, what) in [
        (json!({"material": 9, "variants": [1]}), "materials[9]"),
        (json!({"material": 1, "variants": [3]}), "not one of the 3"),
        (json!({"material": 1, "variants": [-1]}), "not one of the 3"),
        (json!({"variants": [1]}), "no material"),
        (json!({"material": 1}), "no variants"),
    ] {
        let mut writer = with_variants();
        writer.json["meshes"][0]["primitives"][0]["extensions"]["KHR_materials_variants"]["mappings"] =
            json!([mapping]);
        assert_refused(load_with(&writer.glb(), &options("dusk")), "BAD_FILE", &["mappings[0]", what]);
    }
}

#[test]
fn a_scene_is_chosen_by_index() {
    let mut writer = quad(json!({}));
    writer.json["nodes"] = json!([{"mesh": 0}, {"mesh": 0, "translation": [7.0, 0.0, 0.0]}]);
    writer.json["scenes"] = json!([{"name": "first", "nodes": [0]}, {"nodes": [0, 1]}]);
    writer.json["scene"] = json!(1);
    let file = writer.glb();
    let contents = gltf::contents("test.glb", &file).unwrap();
    assert_eq!((contents.scenes, contents.scene), (vec!["first".to_owned(), "scene 1".to_owned()], 1));
    let options = |scene| gltf::Options { scene: Some(scene), ..gltf::Options::default() };
    assert_eq!(load(&file).unwrap().instances.len(), 2);
    assert_twins(&load_with(&file, &options(0)).unwrap(), &load(&quad(json!({})).glb()).unwrap());
    assert_refused(load_with(&file, &options(2)), "BAD_VALUE", &["scene 2", "there are 2"]);
}

// UV sets

/// A quad whose material reads its textures from these sets, all of which it has.
fn uv_sets(base: u32, normal: u32, emissive: u32) -> Writer {
    let texture = |set: u32| json!({"index": 0, "texCoord": set});
    let mut writer = quad(json!({
        "pbrMetallicRoughness": {"baseColorTexture": texture(base)},
        "normalTexture": texture(normal),
        "emissiveTexture": texture(emissive),
    }));
    let view = writer.view(&image_file(2, 1, &[255, 0, 0, 255, 0, 255, 0, 128], image::ImageFormat::Png));
    writer.push("images", json!({"bufferView": view}));
    writer.push("textures", json!({"source": 0}));
    for set in 0..6u8 {
        let accessor = writer.floats("VEC2", &QUAD_UVS.map(|v| v + f32::from(set)));
        writer.json["meshes"][0]["primitives"][0]["attributes"][format!("TEXCOORD_{set}")] = json!(accessor);
    }
    writer
}

#[test]
fn any_uv_set_is_read() {
    for sets in [[0, 0, 0], [1, 0, 1], [5, 5, 5], [3, 1, 3], [4, 2, 4], [0, 3, 0], [2, 0, 0]] {
        let scene = load(&uv_sets(sets[0], sets[1], sets[2]).glb()).unwrap();
        assert_eq!(scene.warnings, Vec::<String>::new(), "{sets:?}");
        let (mesh, material) = (&scene.meshes[0], &scene.materials[0]);
        let textures = [material.base_color_texture, material.normal_texture, material.emissive_texture];
        for (texture, set) in textures.into_iter().zip(sets) {
            let uvs = &mesh.uvs[texture.unwrap().uv_set as usize];
            // Set n runs from n to n + 1; vertices may have been split for tangents.
            let least = uvs.iter().copied().fold(Vec2::MAX, Vec2::min);
            assert_eq!(least, Vec2::splat(set as f32), "{sets:?}");
        }
    }
    let scene = load(&uv_sets(3, 1, 5).glb()).unwrap();
    assert!(scene.materials[0].emissive_texture.is_none());
    assert_eq!(scene.warnings.len(), 1);
    let warning = &scene.warnings[0];
    assert!(warning.contains("materials[0].emissiveTexture") && warning.contains("TEXCOORD_5 besides"), "{warning}");
}

// OBJ

const OBJ: &str = "mtllib box.mtl
o quad
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
vn 0 0 1
usemtl painted
f 1/1/1 2/2/1 3/3/1 4/4/1
usemtl lamp
f 1/1/1 3/3/1 2/2/1
";
const MTL: &str = "newmtl painted
Kd 0.5 0.25 1
Ns 30
map_Kd -s 2 2 a\\ picture.png
newmtl lamp
Kd 0 0 0
Ke 0 4 2
Pr 0.3
Pm 1
";

fn obj_files(mtl: Option<&str>) -> impl FnMut(&str) -> Result<Vec<u8>> {
    let picture = image_file(2, 1, &[255, 0, 0, 255, 0, 255, 0, 128], image::ImageFormat::Png);
    let mtl = mtl.map(|text| text.replace("a\\ picture", "a picture"));
    move |path| match (path, &mtl) {
        ("box.mtl", Some(text)) => Ok(text.clone().into_bytes()),
        ("a picture.png", _) => Ok(picture.clone()),
        _ => nothing(path),
    }
}

#[test]
fn obj_scenes_are_as_their_twins() {
    let scene = obj::load_bytes("test.obj", OBJ.as_bytes(), &mut obj_files(Some(MTL))).unwrap();
    let mut twin = Writer::new(json!({
        "nodes": [{"mesh": 0}, {"mesh": 1}],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3, "material": 0}]},
            {"primitives": [{"attributes": {"POSITION": 4, "NORMAL": 5, "TEXCOORD_0": 6}, "indices": 7, "material": 1}]},
        ],
        "materials": [
            {"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 1.0, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.5,
                "baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform": {"scale": [2.0, 2.0], "offset": [0.0, -1.0]}}}}},
            {"pbrMetallicRoughness": {"baseColorFactor": [0.0, 0.0, 0.0, 1.0], "metallicFactor": 1.0, "roughnessFactor": 0.3},
                "emissiveFactor": [0.0, 1.0, 0.5], "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4.0}}},
        ],
    }));
    twin.floats("VEC3", &QUAD);
    twin.floats("VEC3", &QUAD_NORMALS);
    twin.floats("VEC2", &QUAD_UVS);
    twin.indices(&QUAD_INDICES);
    twin.floats("VEC3", &[QUAD[..3].to_vec(), QUAD[6..9].to_vec(), QUAD[3..6].to_vec()].concat());
    twin.floats("VEC3", &QUAD_NORMALS[..9]);
    twin.floats("VEC2", &[QUAD_UVS[..2].to_vec(), QUAD_UVS[4..6].to_vec(), QUAD_UVS[2..4].to_vec()].concat());
    twin.indices(&[0, 1, 2]);
    let view = twin.view(&image_file(2, 1, &[255, 0, 0, 255, 0, 255, 0, 128], image::ImageFormat::Png));
    twin.push("images", json!({"bufferView": view}));
    twin.push("textures", json!({"source": 0}));
    let twin = gltf::load_bytes("test.obj", &twin.glb(), &mut nothing).unwrap();
    assert_eq!(scene.instances.len(), 2);
    // Extensions that only other versions of the loader know are named, not needed.
    let said: Vec<_> = scene.warnings.iter().filter(|warning| !warning.starts_with("optional extension")).collect();
    assert_eq!(said, Vec::<&String>::new());
    assert!(flat(&scene) == flat(&twin));
}

#[test]
fn glass_and_cutouts_of_mtl() {
    let obj = "mtllib box.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl glass\nf 1 2 3\n";
    let converted = |mtl: &str| {
        let mut find = |_: &str| Some(mtl.as_bytes().to_vec());
        let glb = restir_decoders::obj::to_glb(obj.as_bytes(), &mut find).unwrap().glb;
        let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
        serde_json::from_slice::<Value>(&glb[20..20 + length]).unwrap()["materials"][0].clone()
    };
    let glass = converted("newmtl glass\nillum 7\nNi 1.45\nd 0.25\n");
    assert_eq!(glass["extensions"]["KHR_materials_ior"]["ior"], json!(1.45f32));
    assert_eq!(glass["extensions"]["KHR_materials_transmission"]["transmissionFactor"], json!(0.75));
    assert_eq!(glass["pbrMetallicRoughness"]["baseColorFactor"][3], json!(1.0));
    let leaf = converted("newmtl glass\nTr 0.75\nKd 1 1 1\n");
    assert_eq!(
        (&leaf["alphaMode"], &leaf["pbrMetallicRoughness"]["baseColorFactor"][3]),
        (&json!("BLEND"), &json!(0.25))
    );
    let grey = converted("newmtl glass\nKd 0.5\n");
    assert_eq!(grey["pbrMetallicRoughness"]["baseColorFactor"], json!([0.5, 0.5, 0.5, 1.0]));
    let odd = converted("newmtl glass\nKd nan inf -1\nNs nan\nKe nan 0 0\nd nan\n");
    assert_eq!(odd["pbrMetallicRoughness"]["baseColorFactor"], json!([0.0, 0.0, 0.0, 1.0]));
}

#[test]
fn odd_and_broken_obj() {
    let load = |text: &str, mtl| obj::load_bytes("test.obj", text.as_bytes(), &mut obj_files(mtl));
    let grey = load(OBJ, None).unwrap();
    assert!(grey.warnings.iter().any(|warning| warning.contains("box.mtl: it was not found")), "{:?}", grey.warnings);
    assert_eq!(grey.meshes.iter().map(|mesh| mesh.indices.len()).sum::<usize>(), 9);
    assert!(load(OBJ, Some("newmtl x\nKd red\n")).unwrap().warnings[0].contains("box.mtl"));
    assert!(load("# nothing\n", None).unwrap().warnings.iter().any(|warning| warning.contains("no triangles")));
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (text, what) in [
        (format!("{corners}f 1 2 4\n"), "out of bounds"),
        (format!("{corners}f 0 1 2\n"), "OBJ"),
        (format!("{corners}f 1 2 -9\n"), "OBJ"),
        (format!("{corners}vt 0 0\nf 1/7 2/7 3/7\n"), "out of bounds"),
        (format!("{corners}vn 0 0 1\nf 1//7 2//7 3//7\n"), "out of bounds"),
        (format!("{corners}f 1 2 99999999999\n"), "line 4: 99999999999"),
        (format!("{corners}f 1 2 -9223372036854775808\n"), "line 4"),
        (format!("{corners}f a b c\n"), "face"),
        ("v 0 0 zero\n".to_owned(), "position"),
        ("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_owned(), "not finite"),
        ("v 0 0 1e99\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_owned(), "not finite"),
    ] {
        assert!(load(&text, None).is_err(), "{text}");
        assert_refused(load(&text, None), "BAD_FILE", &["test.obj", what]);
    }
    // Binary data under the name.
    assert!(obj::load_bytes("test.obj", &[255, 254, 0, 1, 10], &mut nothing).is_err());
    // A byte order mark is no part of the first line.
    let triangle = "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n";
    let [with, without] = ["\u{feff}", ""].map(|mark| load(&format!("{mark}{triangle}"), None).unwrap());
    assert_eq!(with.meshes[0].positions, without.meshes[0].positions);
    // Textures stay in the folder.
    let outside = load(OBJ, Some("newmtl painted\nmap_Kd ../../etc/passwd\n"));
    assert_refused(outside, "BAD_FILE", &["leaves the folder"]);
}

// Required and optional extensions

#[test]
fn extensions_that_are_not_known() {
    let mut writer = quad(json!({}));
    writer.json["extensionsUsed"] = json!(["NEW_thing"]);
    let warnings = load(&writer.glb()).unwrap().warnings;
    assert_eq!(warnings, ["optional extension NEW_thing is ignored"]);
    let mut writer = quad(json!({}));
    writer.json["extensionsUsed"] = json!(["NEW_thing"]);
    writer.json["extensionsRequired"] = json!(["NEW_thing"]);
    assert_refused(load(&writer.glb()), "UNSUPPORTED", &["test.glb", "NEW_thing"]);
}

#[test]
fn every_extension_is_in_the_table() {
    let page =
        std::fs::read_to_string(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/formats.md")).unwrap();
    for extension in gltf::SUPPORTED_EXTENSIONS {
        let listed = page.lines().any(|line| line.starts_with('|') && line.contains(&format!("`{extension}`")));
        assert!(listed, "docs/formats.md: {extension}");
    }
}

// Cooked scenes

#[test]
fn cooked_scenes_come_back() {
    let scene = support::builtin("cornell");
    let file = cooked::to_file(&scene);
    assert_eq!(cooked::from_file("a.restir", &file).unwrap(), scene);
    let changed = |at: usize| {
        let mut file = file.clone();
        file[at] ^= 1;
        cooked::from_file("a.restir", &file)
    };
    assert_refused(changed(0), "BAD_FILE", &["a.restir", "no cooked scene"]);
    assert_refused(changed(8), "UNSUPPORTED", &["a.restir", "of version", "cook it again"]);
    assert_refused(changed(16), "BAD_FILE", &["bytes were written"]);
    assert_refused(changed(24), "BAD_FILE", &["checksum"]);
    for at in [32, 33, file.len() / 2, file.len() - 1] {
        assert_refused(changed(at), "BAD_FILE", &["checksum"]);
    }
    for length in [0, 7, 31, 32, file.len() - 1] {
        assert_refused(cooked::from_file("a.restir", &file[..length]), "BAD_FILE", &["a.restir"]);
    }
}
