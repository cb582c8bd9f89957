//! The glTF loader and the environment decoder: good files with exact values, broken ones with the error they must
//! give, and thousands of mutated ones that must do no harm.

mod support;

use glam::{Mat4, Vec2, Vec3, Vec4};
use restir::scene::{AlphaMode, Projection, PunctualKind, Scene, Wrap, environment, gltf};
use restir::{Error, Result};
use serde_json::{Value, json};
use std::time::{Duration, Instant};
use support::gltf_writer::{F32, U8, U16, U32, Writer, base64, glb, image_file};

const TRIANGLE: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
const QUAD: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0];
const QUAD_NORMALS: [f32; 12] = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
/// glTF texture coordinates: v points down.
const QUAD_UVS: [f32; 8] = [0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0];

fn load(bytes: &[u8]) -> Result<Scene> {
    gltf::load_bytes("folder/test.glb", bytes, &mut |path| {
        Err(Error::Io { path: path.into(), source: std::io::Error::other("no such file") })
    })
}

/// A file with one mesh of one primitive at one node.
fn one_primitive(primitive: Value) -> Writer {
    Writer::new(json!({"nodes": [{"mesh": 0}], "meshes": [{"primitives": [primitive]}]}))
}

/// The least file with a triangle.
fn triangle() -> Writer {
    let mut writer = one_primitive(json!({"attributes": {"POSITION": 0}}));
    writer.floats("VEC3", &TRIANGLE);
    writer
}

fn png() -> Vec<u8> {
    image_file(2, 1, &[255, 0, 0, 255, 0, 255, 0, 128], image::ImageFormat::Png)
}

/// A quad with positions, normals and UVs whose material has a normal map with `transform`.
fn normal_mapped_quad(transform: Value) -> Writer {
    let mut writer = one_primitive(
        json!({"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3, "material": 0}),
    );
    writer.floats("VEC3", &QUAD);
    writer.floats("VEC3", &QUAD_NORMALS);
    writer.floats("VEC2", &QUAD_UVS);
    writer.indices(&[0, 1, 2, 0, 2, 3]);
    let view = writer.view(&png());
    writer.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
    writer.push("textures", json!({"source": 0}));
    let texture = json!({"index": 0, "scale": 0.5, "extensions": {"KHR_texture_transform": transform}});
    writer.push("materials", json!({"normalTexture": texture}));
    writer
}

/// A file with nearly every feature, as food for mutations.
fn rich() -> Writer {
    let mut writer = normal_mapped_quad(json!({"rotation": 0.5, "offset": [0.1, 0.2]}));
    let jpeg = image_file(4, 4, &[200; 64], image::ImageFormat::Jpeg);
    writer.push("images", json!({"uri": format!("data:image/jpeg;base64,{}", base64(&jpeg))}));
    writer.push("samplers", json!({"magFilter": 9728, "wrapS": 33071, "wrapT": 33648}));
    writer.push("textures", json!({"source": 1, "sampler": 0, "name": "soft"}));
    writer.push(
        "materials",
        json!({"alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": true, "emissiveFactor": [1, 0.5, 0.25],
               "emissiveTexture": {"index": 1, "texCoord": 1},
               "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 4}},
               "pbrMetallicRoughness": {"metallicFactor": 0.5, "roughnessFactor": 0.25,
                   "baseColorFactor": [0.1, 0.2, 0.3, 0.4], "baseColorTexture": {"index": 1},
                   "metallicRoughnessTexture": {"index": 0}}}),
    );
    let uvs = writer.accessor("VEC2", U8, 4, &[0, 255, 255, 255, 255, 0, 0, 51]);
    let colors: Vec<u8> = [65_535u16, 0, 0, 0, 65_535, 0, 0, 0, 65_535, 65_535, 65_535, 13_107]
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect();
    let colors = writer.accessor("VEC3", U16, 4, &colors);
    let strip = writer.accessor("SCALAR", U8, 4, &[0, 1, 3, 2]);
    let (indices, values) = (writer.view(&[2, 3]), writer.view(&[0; 24]));
    let sparse = writer.push(
        "accessors",
        json!({"bufferView": 0, "type": "VEC3", "componentType": F32, "count": 4,
               "sparse": {"count": 2, "indices": {"bufferView": indices, "componentType": U8},
                          "values": {"bufferView": values}}}),
    );
    writer.push(
        "meshes",
        json!({"primitives": [
            {"attributes": {"POSITION": 0, "TEXCOORD_0": 2, "TEXCOORD_1": uvs, "COLOR_0": colors}, "mode": 5,
             "indices": strip, "material": 1},
            {"attributes": {"POSITION": sparse}, "mode": 6}]}),
    );
    writer.push("cameras", json!({"type": "perspective", "name": "eye", "perspective": {"yfov": 0.7, "znear": 0.1}}));
    writer.push(
        "cameras",
        json!({"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 2, "znear": 0.1, "zfar": 10}}),
    );
    writer.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "point", "intensity": 10, "color": [1, 0.5, 0.25], "range": 5},
        {"type": "directional", "intensity": 3},
        {"type": "spot", "intensity": 2, "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.6}}]}});
    writer.json["nodes"] = json!([
        {"children": [1, 2, 3], "translation": [1, 2, 3], "scale": [2, 2, 2]},
        {"mesh": 0, "scale": [-1, 1, 1]},
        {"mesh": 1, "rotation": [0, 2, 0, 2], "children": [4, 5]},
        {"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1]},
        {"camera": 1, "extensions": {"KHR_lights_punctual": {"light": 0}}},
        {"camera": 0, "name": "node", "extensions": {"KHR_lights_punctual": {"light": 1}}},
        {"extensions": {"KHR_lights_punctual": {"light": 2}}},
        {"mesh": 0, "name": "not in the scene"}]);
    writer.json["scenes"] = json!([{"nodes": []}, {"nodes": [0, 6]}]);
    writer.json["scene"] = json!(1);
    writer.json["extensionsUsed"] = json!(["KHR_lights_punctual", "EXT_unheard_of"]);
    writer
}

fn near(a: Vec3, b: Vec3) -> bool {
    (a - b).length() < 1e-5
}

#[test]
fn a_triangle_gets_flat_normals_and_the_default_material() {
    let scene = load(&triangle().glb()).unwrap();
    assert_eq!(scene.name, "test");
    assert_eq!(scene.meshes.len(), 1);
    assert_eq!(scene.meshes[0].positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!(scene.meshes[0].normals, [Vec3::Z; 3]);
    assert_eq!(scene.meshes[0].indices, [0, 1, 2]);
    assert!(scene.meshes[0].tangents.is_empty() && scene.meshes[0].colors.is_empty());
    let material = &scene.materials[scene.meshes[0].material as usize];
    assert_eq!((material.base_color, material.metallic, material.roughness), (Vec4::ONE, 1.0, 1.0));
    assert_eq!(scene.instances.len(), 1);
    assert_eq!(scene.instances[0].transform, Mat4::IDENTITY);
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
}

#[test]
fn the_hierarchy_places_instances_lights_and_cameras() {
    let scene = load(&rich().glb()).unwrap();
    assert_eq!(scene.meshes.len(), 3, "the shared mesh is loaded once, and two primitives of the other");
    assert_eq!(scene.instances.iter().map(|instance| instance.mesh).collect::<Vec<_>>(), [0, 1, 2, 0]);
    let at = |instance: usize, p: Vec3| scene.instances[instance].transform.transform_point3(p);
    assert!(near(at(0, Vec3::X), Vec3::new(-1.0, 2.0, 3.0)));
    assert!(scene.instances[0].transform.determinant() < 0.0);
    assert!(near(at(1, Vec3::X), Vec3::new(1.0, 2.0, 1.0)), "a quarter turn round Y takes X to -Z");
    assert!(near(at(3, Vec3::ZERO), Vec3::new(11.0, 14.0, 17.0)));

    // A quarter turn round Y takes -Z to -X. Neither intensity nor range is scaled.
    assert_eq!(scene.lights.len(), 3);
    assert_eq!(scene.lights[0].kind, PunctualKind::Point);
    assert_eq!(scene.lights[0].intensity, Vec3::new(10.0, 5.0, 2.5));
    assert_eq!(scene.lights[0].range, 5.0);
    assert!(near(scene.lights[0].position, Vec3::new(1.0, 2.0, 3.0)));
    assert_eq!(scene.lights[1].kind, PunctualKind::Directional);
    assert!(near(scene.lights[1].direction, Vec3::NEG_X));
    assert_eq!(scene.lights[2].kind, PunctualKind::Spot { inner: 0.1, outer: 0.6 });
    assert_eq!(scene.lights[2].direction, Vec3::NEG_Z);
    assert_eq!(scene.lights[2].range, f32::INFINITY);

    // In file order although the nodes place them the other way round.
    assert_eq!(scene.cameras.iter().map(|camera| camera.name.as_str()).collect::<Vec<_>>(), ["eye", "cameras[1]"]);
    assert_eq!(scene.cameras[0].projection, Projection::Perspective { vertical_fov: 0.7 });
    assert_eq!(scene.cameras[1].projection, Projection::Orthographic { half_height: 2.0 });
    assert!(near(scene.cameras[0].forward, Vec3::NEG_X) && near(scene.cameras[0].up, Vec3::Y));
    assert!(near(scene.cameras[0].position, Vec3::new(1.0, 2.0, 3.0)));
    assert!(scene.warnings.iter().any(|warning| warning.contains("EXT_unheard_of")), "{:?}", scene.warnings);
}

#[test]
fn materials_and_textures() {
    let scene = load(&rich().glb()).unwrap();
    let material = &scene.materials[1];
    assert_eq!(material.base_color, Vec4::new(0.1, 0.2, 0.3, 0.4));
    assert_eq!((material.metallic, material.roughness), (0.5, 0.25));
    assert_eq!(material.emissive, Vec3::new(4.0, 2.0, 1.0), "the strength multiplies");
    assert_eq!(material.alpha, AlphaMode::Mask(0.25));
    assert!(material.double_sided);
    assert_eq!(material.emissive_texture.unwrap().uv_set, 1);
    let base = material.base_color_texture.unwrap();
    assert_eq!(base.texture, material.emissive_texture.unwrap().texture, "one texture is loaded once");
    let soft = &scene.textures[base.texture as usize];
    assert_eq!((soft.name.as_str(), soft.width, soft.height), ("soft", 4, 4));
    assert_eq!((soft.wrap, soft.linear_filter), ([Wrap::Clamp, Wrap::Mirror], false));
    assert!(soft.pixels.chunks(4).all(|p| p[0].abs_diff(200) < 4 && p[3] == 255), "JPEG, opaque");

    let normal = scene.materials[0].normal_texture.unwrap();
    assert_eq!(scene.materials[0].normal_scale, 0.5);
    assert_eq!((normal.rotation, normal.offset, normal.scale), (0.5, Vec2::new(0.1, 0.2), Vec2::ONE));
    let pixels = &scene.textures[normal.texture as usize];
    assert_eq!(**pixels.pixels, [255, 0, 0, 255, 0, 255, 0, 128], "PNG, alpha kept, as stored");
    assert_eq!((pixels.wrap, pixels.linear_filter), ([Wrap::Repeat; 2], true));
    assert_eq!(scene.materials[0].alpha, AlphaMode::Opaque);
}

#[test]
fn attributes_of_every_type() {
    let scene = load(&rich().glb()).unwrap();
    // A strip with u8 indices 0 1 3 2; without normals each corner is a vertex.
    let strip = &scene.meshes[1];
    let (a, b, c, d) = (Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y);
    assert_eq!(strip.positions, [a, b, d, b, c, d]);
    assert_eq!(strip.normals, [Vec3::Z; 6]);
    assert_eq!(strip.uvs[1][2], Vec2::new(0.0, 0.2), "51 / 255");
    assert_eq!(strip.colors[0], Vec4::new(1.0, 0.0, 0.0, 1.0), "RGB is opaque");
    assert_eq!(strip.colors[2], Vec4::new(1.0, 1.0, 0.2, 1.0), "13107 / 65535");
    // A fan over a sparse accessor whose vertices 2 and 3 are replaced by zero: triangles without area are kept.
    let fan = &scene.meshes[2];
    assert_eq!(fan.positions, [b, a, a, a, a, a]);
    assert_eq!(fan.material, 2, "the default material follows the file's two");
}

#[test]
fn u32_indices_and_shared_vertices() {
    let mut writer = one_primitive(json!({"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2}));
    writer.floats("VEC3", &QUAD);
    writer.floats("VEC3", &QUAD_NORMALS);
    let bytes: Vec<u8> = [1u32, 2, 3].iter().flat_map(|index| index.to_le_bytes()).collect();
    writer.accessor("SCALAR", U32, 3, &bytes);
    let scene = load(&writer.glb()).unwrap();
    assert_eq!(scene.meshes[0].positions, [Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y], "only used vertices");
    assert_eq!(scene.meshes[0].indices, [0, 1, 2]);
}

#[test]
fn interleaved_attributes() {
    let mut writer = one_primitive(json!({"attributes": {"POSITION": 0, "NORMAL": 1}}));
    let normals = [Vec3::X, Vec3::Y, Vec3::Z];
    let bytes: Vec<u8> = TRIANGLE
        .chunks(3)
        .zip(normals)
        .flat_map(|(position, normal)| [position, &(normal * 2.0).to_array()].concat())
        .flat_map(f32::to_le_bytes)
        .collect();
    let view = writer.view(&bytes);
    writer.json["bufferViews"][view]["byteStride"] = json!(24);
    for offset in [0, 12] {
        writer.push(
            "accessors",
            json!({"bufferView": view, "byteOffset": offset, "type": "VEC3", "componentType": F32, "count": 3}),
        );
    }
    let scene = load(&writer.glb()).unwrap();
    assert_eq!(scene.meshes[0].positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!(scene.meshes[0].normals, normals, "made unit");
}

#[test]
fn tangents_follow_the_texture() {
    // A normal map's green points up the image: +Y here, so the bitangent cross(n, t) * w needs w = +1.
    let tangents = |transform| load(&normal_mapped_quad(transform).glb()).unwrap().meshes[0].tangents.clone();
    let along = |expected: Vec4, got: Vec<Vec4>| {
        assert_eq!(got.len(), 6);
        assert!(got.iter().all(|tangent| (*tangent - expected).length() < 1e-5), "{expected} {got:?}");
    };
    along(Vec4::new(1.0, 0.0, 0.0, 1.0), tangents(json!({})));
    along(Vec4::new(-1.0, 0.0, 0.0, -1.0), tangents(json!({"scale": [-1, 1]})));
    // Rotating the UVs counter-clockwise by a quarter turns u into what was v: u grows where v did, downwards.
    along(Vec4::new(0.0, -1.0, 0.0, 1.0), tangents(json!({"rotation": std::f32::consts::FRAC_PI_2})));
}

#[test]
fn given_tangents_are_kept() {
    let mut writer = normal_mapped_quad(json!({}));
    let given = [0.0, 3.0, 0.0, -1.0].repeat(4);
    let accessor = writer.floats("VEC4", &given);
    writer.json["meshes"][0]["primitives"][0]["attributes"]["TANGENT"] = json!(accessor);
    let scene = load(&writer.glb()).unwrap();
    assert_eq!(scene.meshes[0].tangents, [Vec4::new(0.0, 1.0, 0.0, -1.0); 4]);
}

#[test]
fn tangents_of_hostile_meshes_end() {
    // A fan of 20,000 triangles round one vertex, where MikkTSpace is quadratic and recurses once a triangle.
    let count = 20_000;
    let mut writer = normal_mapped_quad(json!({}));
    let angle = |i: usize| i as f32 / count as f32 * std::f32::consts::TAU;
    let rim = (0..count).flat_map(|i| [angle(i).cos(), angle(i).sin(), 0.0]);
    let positions: Vec<f32> = [0.0; 3].into_iter().chain(rim).collect();
    let normals = [0.0, 0.0, 1.0].repeat(count + 1);
    let uvs: Vec<f32> = positions.chunks(3).flat_map(|p| [p[0], -p[1]]).collect();
    let accessors = [("VEC3", positions), ("VEC3", normals), ("VEC2", uvs)];
    let [p, n, t] = accessors.map(|(kind, values)| writer.floats(kind, &values));
    writer.json["meshes"][0]["primitives"][0] =
        json!({"attributes": {"POSITION": p, "NORMAL": n, "TEXCOORD_0": t}, "mode": 6, "material": 0});
    let start = Instant::now();
    let scene = load(&writer.glb()).unwrap();
    assert!(start.elapsed() < Duration::from_secs(10));
    assert_eq!(scene.meshes[0].tangents.len(), 3 * (count - 1));
    let wrong = scene.meshes[0].tangents.iter().filter(|t| (**t - Vec4::new(1.0, 0.0, 0.0, 1.0)).length() > 0.01);
    assert!(wrong.count() < 30, "the gradient of u is X everywhere");
}

#[test]
fn tangents_of_extreme_numbers_are_finite() {
    let mut random = Random(7);
    let values = [0.0, -0.0, 1.0, 1e-38, 1e38, -1e38, 3.4e38, 0.5, 1e-20, 1e20];
    for _ in 0..300 {
        let mut writer = normal_mapped_quad(json!({}));
        let mut pick = |count: usize| -> Vec<f32> { (0..count).map(|_| values[random.below(values.len())]).collect() };
        let (positions, normals, uvs) = (pick(36), pick(36), pick(24));
        let [p, n, t] = [("VEC3", positions), ("VEC3", normals), ("VEC2", uvs)].map(|(k, v)| writer.floats(k, &v));
        writer.json["meshes"][0]["primitives"][0] =
            json!({"attributes": {"POSITION": p, "NORMAL": n, "TEXCOORD_0": t}, "material": 0});
        let scene = load(&writer.glb()).unwrap();
        let mesh = &scene.meshes[0];
        assert!(mesh.normals.iter().all(|normal| normal.is_normalized()));
        assert!(mesh.tangents.iter().all(|tangent| tangent.truncate().is_normalized() && tangent.w.abs() == 1.0));
    }
}

#[test]
fn json_files_with_data_uris_and_external_files() {
    let (file, buffer) = triangle().gltf("sub%20folder/../geo%6Detry.bin");
    let mut asked = Vec::new();
    let scene = gltf::load_bytes("a.gltf", &file, &mut |path| {
        asked.push(path.to_owned());
        Ok(buffer.clone())
    });
    assert_eq!(scene.unwrap().meshes[0].positions[1], Vec3::X);
    assert_eq!(asked, ["geometry.bin"]);

    let (_, buffer) = triangle().gltf("");
    let (file, _) = triangle().gltf(&format!("data:application/octet-stream;base64,{}", base64(&buffer)));
    assert_eq!(load(&file).unwrap().meshes[0].positions[1], Vec3::X);
}

#[test]
fn a_file_named_twice_is_read_once() {
    let (file, buffer) = triangle().gltf("a.bin");
    let mut json: Value = serde_json::from_slice(&file).unwrap();
    let first = json["buffers"][0].clone();
    json["buffers"] = json!([first, {"uri": "a.bin", "byteLength": 4}, {"uri": "b.bin", "byteLength": 4}, first]);
    json["bufferViews"][0]["buffer"] = 3.into();
    json["images"] = json!([{"uri": "c.png"}, {"uri": "d.png"}, {"uri": "c.png"}]);
    json["textures"] = json!([{"source": 0}, {"source": 1}, {"source": 2}]);
    let material = |index: u32| json!({"normalTexture": {"index": index}});
    json["materials"] = json!([material(0), material(1), material(2)]);
    let mut asked = Vec::new();
    let scene = gltf::load_bytes("a.gltf", json.to_string().as_bytes(), &mut |path| {
        asked.push(path.to_owned());
        Ok(if path.ends_with("png") { png() } else { buffer.clone() })
    });
    let scene = scene.unwrap();
    assert_eq!(asked, ["a.bin", "b.bin", "c.png", "d.png"]);
    assert_eq!(scene.meshes[0].positions[1], Vec3::X);
    let pixels: Vec<_> = scene.textures.iter().map(|texture| texture.pixels.as_ptr()).collect();
    assert!(pixels[0] == pixels[2] && pixels[0] != pixels[1]);

    // A view of a buffer ends where the buffer does, though its file be longer.
    json["bufferViews"][0]["buffer"] = 1.into();
    json["materials"] = json!([]);
    let error = gltf::load_bytes("a.gltf", json.to_string().as_bytes(), &mut |_| Ok(buffer.clone())).unwrap_err();
    assert!(error.to_string().contains("lie outside the 4 of its buffer"), "{error}");
}

#[test]
fn scenes_need_no_nodes() {
    let scene = load(br#"{"asset": {"version": "2.0"}, "scenes": [{}], "scene": 0}"#).unwrap();
    assert!(scene.instances.is_empty());
    let second = |mesh: Value| {
        changed(triangle(), |json| {
            json["scenes"] = json!([{"name": "empty"}, {"nodes": [0]}]);
            json["scene"] = 1.into();
            json["extras"] = json!({"kept": [1, 2.5]});
            json["nodes"][0]["mesh"] = mesh;
        })
    };
    assert_eq!(load(&second(0.into())).unwrap().instances.len(), 1);
    let error = load(&second("first".into())).unwrap_err();
    assert_eq!(error.code(), "BAD_FILE");
    assert!(error.to_string().ends_with("(at JSON)"), "{error}");
}

#[test]
fn files_are_found_beside_the_scene() {
    let folder = std::env::temp_dir().join(format!("restir-gltf-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let (file, buffer) = triangle().gltf("a%20b.bin");
    std::fs::write(folder.join("scene.gltf"), file).unwrap();
    let missing = gltf::load_file(&folder.join("scene.gltf"), &gltf::Options::default()).unwrap_err();
    std::fs::write(folder.join("a b.bin"), buffer).unwrap();
    let found = gltf::load_file(&folder.join("scene.gltf"), &gltf::Options::default());
    let folder_itself = gltf::load_file(&folder, &gltf::Options::default()).unwrap_err();
    std::fs::remove_dir_all(&folder).unwrap();
    assert_eq!(missing.code(), "IO");
    let message = missing.to_string();
    for part in ["scene.gltf", "buffers[0].uri", "a b.bin"] {
        assert!(message.contains(part), "{message}");
    }
    assert_eq!(found.unwrap().name, "scene");
    assert_eq!(folder_itself.code(), "IO");
}

#[test]
fn what_is_odd_is_said() {
    let warned = |writer: Writer, text: &str| {
        let scene = load(&writer.glb()).unwrap();
        assert!(scene.warnings.iter().any(|warning| warning.contains(text)), "{text}: {:?}", scene.warnings);
        scene
    };
    warned(Writer::new(json!({})), "no triangles");
    let mut lines = triangle();
    lines.json["meshes"][0]["primitives"][0]["mode"] = json!(1);
    assert!(warned(lines, "points and lines").meshes.is_empty());
    let mut blend = triangle();
    blend.push("materials", json!({"alphaMode": "BLEND"}));
    assert_eq!(warned(blend, "BLEND").materials[0].alpha, AlphaMode::Mask(0.5));
    let mut clamped = triangle();
    clamped.push("materials", json!({"pbrMetallicRoughness": {"roughnessFactor": 3}}));
    assert_eq!(warned(clamped, "materials[0].pbrMetallicRoughness.roughnessFactor").materials[0].roughness, 1.0);
    let mut uvs = normal_mapped_quad(json!({}));
    uvs.json["meshes"][0]["primitives"][0]["attributes"] = json!({"POSITION": 0});
    warned(uvs, "TEXCOORD_0, which it lacks");
    let third = normal_mapped_quad(json!({"texCoord": 2}));
    assert!(warned(third, "TEXCOORD_2, which it lacks").materials[0].normal_texture.is_some());
    let mut normals = one_primitive(json!({"attributes": {"POSITION": 0, "NORMAL": 1}}));
    normals.floats("VEC3", &TRIANGLE);
    normals.floats("VEC3", &[0.0, 0.0, 0.0, f32::NAN, 0.0, 0.0, 1.0, 0.0, 0.0]);
    assert_eq!(warned(normals, "2 attribute(s)").meshes[0].normals, [Vec3::Z, Vec3::Z, Vec3::X]);
}

#[test]
fn a_deep_hierarchy_does_not_overflow_the_stack() {
    let mut writer = triangle();
    let count = 200_000;
    let mut nodes: Vec<Value> = (1..count).map(|child| json!({"children": [child]})).collect();
    nodes.push(json!({"mesh": 0}));
    writer.json["nodes"] = json!(nodes);
    assert_eq!(load(&writer.glb()).unwrap().instances.len(), 1);
}

/// A writer changed by `change`, as binary glTF.
fn changed(mut writer: Writer, change: impl FnOnce(&mut Value)) -> Vec<u8> {
    change(&mut writer.json);
    writer.glb()
}

/// A PNG whose header says that it has this size.
fn png_header(width: u32, height: u32) -> Vec<u8> {
    let mut file = image_file(1, 1, &[0; 4], image::ImageFormat::Png);
    file[16..20].copy_from_slice(&width.to_be_bytes());
    file[20..24].copy_from_slice(&height.to_be_bytes());
    let checksum = crc32(&file[12..29]);
    file[29..33].copy_from_slice(&checksum.to_be_bytes());
    file
}

/// CRC-32 as PNG uses it.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 & (!(crc & 1)).wrapping_add(1)))
    })
}

/// A normal-mapped quad with another image.
fn with_image(image: Value, file: &[u8]) -> Vec<u8> {
    let mut writer = normal_mapped_quad(json!({}));
    let view = writer.view(file);
    writer.json["images"][0] = if image.is_null() { json!({"bufferView": view}) } else { image };
    writer.glb()
}

#[test]
fn broken_files_are_refused_with_a_place() {
    let good = triangle().glb();
    let patched = |offset: usize, value: u32| {
        let mut file = good.clone();
        file[offset..offset + 4].copy_from_slice(&value.to_le_bytes());
        file
    };
    let nodes = |nodes: Value| changed(triangle(), |json| json["nodes"] = nodes);
    let accessor = |key: &str, value: Value| changed(triangle(), |json| json["accessors"][0][key] = value);
    let view = |key: &str, value: Value| changed(triangle(), |json| json["bufferViews"][0][key] = value);
    let primitive =
        |key: &str, value: Value| changed(triangle(), |json| json["meshes"][0]["primitives"][0][key] = value);
    let buffer_uri = |uri: &str| triangle().gltf(uri).0;
    let indexed = |indices: &[u16]| {
        let mut writer = one_primitive(json!({"attributes": {"POSITION": 0}, "indices": 1}));
        writer.floats("VEC3", &TRIANGLE);
        writer.indices(indices);
        writer.glb()
    };
    let position = |value: f32| {
        let mut positions = TRIANGLE;
        positions[4] = value;
        let mut writer = one_primitive(json!({"attributes": {"POSITION": 0}}));
        writer.floats("VEC3", &positions);
        writer.glb()
    };
    let light = |light: Value| {
        changed(triangle(), |json| {
            json["extensions"] = json!({"KHR_lights_punctual": {"lights": [light]}});
            json["nodes"] = json!([{"extensions": {"KHR_lights_punctual": {"light": 0}}}]);
        })
    };
    let camera = |camera: Value| {
        changed(triangle(), |json| {
            json["cameras"] = json!([camera]);
            json["nodes"] = json!([{"camera": 0}]);
        })
    };
    let sparse = |count: u64, index: u8| {
        let mut writer = one_primitive(json!({"attributes": {"POSITION": 0}}));
        let (indices, values) = (writer.view(&[index, 1]), writer.view(&[0; 24]));
        writer.push(
            "accessors",
            json!({"type": "VEC3", "componentType": F32, "count": 3,
                   "sparse": {"count": count, "indices": {"bufferView": indices, "componentType": U8},
                              "values": {"bufferView": values}}}),
        );
        writer.glb()
    };

    let cases: Vec<(&str, Vec<u8>, &str, &str)> = vec![
        ("empty file", vec![], "BAD_FILE", "JSON line 1"),
        ("GLB header cut off", b"glTF\x02\0\0".to_vec(), "BAD_FILE", "GLB header"),
        ("truncated GLB", good[..good.len() - 5].to_vec(), "BAD_FILE", "GLB header"),
        ("GLB version 1", patched(4, 1), "UNSUPPORTED", "GLB version 1"),
        ("GLB length too small", patched(8, 3), "BAD_FILE", "GLB header"),
        ("lying chunk length", patched(12, 0xffff_fff0), "BAD_FILE", "chunk at byte 12"),
        ("no JSON chunk first", patched(16, 0x0042_4942), "BAD_FILE", "chunk at byte 12"),
        ("only a header", b"glTF\x02\0\0\0\x0c\0\0\0".to_vec(), "BAD_FILE", "no JSON chunk"),
        ("bad JSON", glb(b"{\"asset\": {\"version\": \"2.0\"},\n\"nodes\": [}", b""), "BAD_FILE", "JSON line 2"),
        (
            "deeply nested JSON",
            glb(["{\"asset\":", &"[".repeat(100_000)].concat().as_bytes(), b""),
            "BAD_FILE",
            "JSON line 1",
        ),
        ("a list", glb(b" []", b""), "BAD_FILE", "a list instead of an object"),
        ("very many objects", glb(&b"{},".repeat(1_100_000), b""), "LIMIT", "objects"),
        ("no asset", glb(b"{}", b""), "BAD_FILE", "asset"),
        ("glTF 1.0", glb(b"{\"asset\": {\"version\": \"1.0\"}}", b""), "UNSUPPORTED", "glTF version 1.0"),
        (
            "required extension",
            changed(triangle(), |json| json["extensionsRequired"] = json!(["KHR_unheard_of"])),
            "UNSUPPORTED",
            "KHR_unheard_of",
        ),
        ("node is its own child", nodes(json!([{"children": [0]}])), "BAD_FILE", "nodes[0]"),
        ("cyclic nodes", nodes(json!([{}, {"children": [2]}, {"children": [1]}])), "BAD_FILE", "nodes[1]"),
        ("two parents", nodes(json!([{"children": [2]}, {"children": [2]}, {}])), "BAD_FILE", "nodes[1].children[0]"),
        ("child out of range", nodes(json!([{"children": [7]}])), "BAD_FILE", "nodes[0].children[0]"),
        ("mesh out of range", nodes(json!([{"mesh": 7}])), "BAD_FILE", "nodes[0].mesh"),
        ("zero rotation", nodes(json!([{"rotation": [0, 0, 0, 0]}])), "BAD_FILE", "nodes[0].rotation"),
        ("infinite translation", nodes(json!([{"translation": [1e300, 0, 0]}])), "BAD_FILE", "nodes[0].translation"),
        (
            "projective matrix",
            nodes(json!([{"matrix": [1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}])),
            "BAD_FILE",
            "nodes[0].matrix",
        ),
        (
            "overflowing hierarchy",
            nodes(json!([{"scale": [1e30, 1, 1], "children": [1]}, {"scale": [1e30, 1, 1]}])),
            "BAD_FILE",
            "nodes[1]",
        ),
        ("scene out of range", changed(triangle(), |json| json["scene"] = json!(3)), "BAD_FILE", "(at scene)"),
        (
            "scene lists a child",
            changed(triangle(), |json| {
                json["nodes"] = json!([{"children": [1]}, {}]);
                json["scenes"] = json!([{"nodes": [1]}]);
            }),
            "BAD_FILE",
            "scenes[0].nodes[0]",
        ),
        (
            "scene lists a node twice",
            changed(triangle(), |json| json["scenes"] = json!([{"nodes": [0, 0]}])),
            "BAD_FILE",
            "scenes[0].nodes[1]",
        ),
        ("accessor out of range", primitive("attributes", json!({"POSITION": 9})), "BAD_FILE", "attributes.POSITION"),
        ("material out of range", primitive("material", json!(5)), "BAD_FILE", "meshes[0].primitives[0].material"),
        ("unknown mode", primitive("mode", json!(9)), "BAD_FILE", "meshes[0].primitives[0].mode"),
        ("indices of the wrong type", primitive("indices", json!(0)), "BAD_FILE", "meshes[0].primitives[0].indices"),
        ("index out of range", indexed(&[0, 1, 3]), "BAD_FILE", "meshes[0].primitives[0].indices"),
        ("accessor beyond its view", accessor("count", json!(4)), "BAD_FILE", "POSITION = accessors[0]"),
        ("absurd count", accessor("count", json!(u64::MAX)), "BAD_FILE", "accessors[0]"),
        ("count that overflows", accessor("count", json!(0xffff_fffeu32)), "BAD_FILE", "accessors[0]"),
        ("offset that overflows", accessor("byteOffset", json!(u64::MAX)), "BAD_FILE", "accessors[0]"),
        ("unknown component type", accessor("componentType", json!(1)), "BAD_FILE", "accessors[0]"),
        ("unknown type", accessor("type", json!("VEC9")), "BAD_FILE", "accessors[0]"),
        ("buffer view out of range", accessor("bufferView", json!(9)), "BAD_FILE", "accessors[0]"),
        ("negative index", accessor("bufferView", json!(-1)), "BAD_FILE", "JSON line 1"),
        ("view beyond its buffer", view("byteLength", json!(1000)), "BAD_FILE", "bufferViews[0]"),
        ("view that overflows", view("byteOffset", json!(u64::MAX)), "BAD_FILE", "bufferViews[0]"),
        ("stride of zero", view("byteStride", json!(0)), "BAD_FILE", "accessors[0]"),
        ("buffer out of range", view("buffer", json!(1)), "BAD_FILE", "bufferViews[0]"),
        (
            "buffer longer than its chunk",
            changed(triangle(), |json| json["buffers"] = json!([{"byteLength": 5000}])),
            "BAD_FILE",
            "buffers[0].byteLength",
        ),
        (
            "absurd buffer",
            changed(triangle(), |json| json["buffers"] = json!([{"byteLength": u64::MAX}])),
            "LIMIT",
            "buffers",
        ),
        (
            "buffer without bytes",
            changed(triangle(), |json| json["buffers"] = json!([{"byteLength": 36}, {"byteLength": 4}])),
            "BAD_FILE",
            "buffers[1]",
        ),
        (
            "billions of zeros",
            changed(triangle(), |json| {
                json["accessors"][0] = json!({"type": "VEC3", "componentType": F32, "count": 4_000_000_000u32})
            }),
            "LIMIT",
            "geometry",
        ),
        ("sparse index out of range", sparse(1, 3), "BAD_FILE", "accessors[0].sparse"),
        ("sparse indices descend", sparse(2, 2), "BAD_FILE", "accessors[0].sparse"),
        ("sparse count too large", sparse(u64::MAX, 0), "BAD_FILE", "accessors[0].sparse"),
        ("NaN position", position(f32::NAN), "BAD_FILE", "meshes[0].primitives[0].attributes.POSITION = accessors[0]"),
        ("infinite position", position(f32::INFINITY), "BAD_FILE", "vertex 1"),
        (
            "attributes of different lengths",
            {
                let mut writer = one_primitive(json!({"attributes": {"POSITION": 0, "TEXCOORD_0": 1}}));
                writer.floats("VEC3", &TRIANGLE);
                writer.floats("VEC2", &[0.0; 4]);
                writer.glb()
            },
            "BAD_FILE",
            "attributes.TEXCOORD_0 = accessors[1]",
        ),
        ("missing file", buffer_uri("missing.bin"), "IO", "test.glb (buffers[0].uri): missing.bin"),
        ("path that escapes", buffer_uri("a/../../secret.bin"), "BAD_FILE", "buffers[0].uri"),
        ("encoded path that escapes", buffer_uri("%2e%2e/secret.bin"), "BAD_FILE", "buffers[0].uri"),
        ("absolute path", buffer_uri("/etc/passwd"), "BAD_FILE", "absolute path"),
        ("URL", buffer_uri("https://example.org/a.bin"), "BAD_FILE", "is a URL"),
        ("data URI without comma", buffer_uri("data:oops"), "BAD_FILE", "buffers[0].uri"),
        ("data URI garbage", buffer_uri("data:;base64,@@@@"), "BAD_FILE", "buffers[0].uri"),
        ("data URI too short", buffer_uri("data:;base64,AAAA"), "BAD_FILE", "buffers[0].byteLength"),
        ("PNG with an absurd header", with_image(json!(null), &png_header(1 << 30, 1 << 30)), "BAD_FILE", "images[0]"),
        ("PNG that is too large", with_image(json!(null), &png_header(16_384, 16_384)), "BAD_FILE", "images[0]"),
        ("PNG of no size", with_image(json!(null), &png_header(0, 4)), "BAD_FILE", "images[0]"),
        ("PNG cut off", with_image(json!(null), &png()[..40]), "BAD_FILE", "images[0]"),
        ("no image", with_image(json!(null), b"hello, world"), "BAD_FILE", "images[0]"),
        ("another image format", with_image(json!(null), b"GIF89a\x01\0\x01\0"), "UNSUPPORTED", "images[0]"),
        ("image without source", with_image(json!({}), b""), "BAD_FILE", "images[0]"),
        ("image missing", with_image(json!({"uri": "gone.png"}), b""), "IO", "images[0].uri"),
        (
            "texture out of range",
            changed(normal_mapped_quad(json!({})), |json| json["materials"][0]["normalTexture"]["index"] = json!(4)),
            "BAD_FILE",
            "materials[0].normalTexture.index",
        ),
        (
            "texture without source",
            changed(normal_mapped_quad(json!({})), |json| json["textures"][0] = json!({})),
            "BAD_FILE",
            "textures[0]",
        ),
        (
            "sampler out of range",
            changed(normal_mapped_quad(json!({})), |json| json["textures"][0]["sampler"] = json!(2)),
            "BAD_FILE",
            "textures[0].sampler",
        ),
        (
            "transform of the wrong type",
            normal_mapped_quad(json!({"rotation": "left"})).glb(),
            "BAD_FILE",
            "materials[0].normalTexture.extensions.KHR_texture_transform",
        ),
        (
            "negative emission",
            changed(triangle(), |json| json["materials"] = json!([{"emissiveFactor": [0, -1, 0]}])),
            "BAD_FILE",
            "materials[0].emissiveFactor",
        ),
        ("unknown light", light(json!({"type": "laser"})), "BAD_FILE", "lights[0].type"),
        ("negative light", light(json!({"type": "point", "intensity": -1})), "BAD_FILE", "lights[0]"),
        ("light without range", light(json!({"type": "point", "range": 0})), "BAD_FILE", "lights[0].range"),
        ("spot without cone", light(json!({"type": "spot"})), "BAD_FILE", "lights[0].spot"),
        (
            "inverted cone",
            light(json!({"type": "spot", "spot": {"innerConeAngle": 1, "outerConeAngle": 0.5}})),
            "BAD_FILE",
            "lights[0].spot",
        ),
        (
            "light out of range",
            changed(triangle(), |json| json["nodes"] = json!([{"extensions": {"KHR_lights_punctual": {"light": 1}}}])),
            "BAD_FILE",
            "nodes[0].extensions.KHR_lights_punctual.light",
        ),
        ("camera without projection", camera(json!({"type": "perspective"})), "BAD_FILE", "cameras[0]"),
        (
            "camera that sees all",
            camera(json!({"type": "perspective", "perspective": {"yfov": 4, "znear": 1}})),
            "BAD_FILE",
            "cameras[0].perspective.yfov",
        ),
        (
            "too many triangles by instancing",
            changed(triangle(), |json| {
                json["accessors"][0] = json!({"type": "VEC3", "componentType": F32, "count": 300_000});
                json["nodes"] = json!(vec![json!({"mesh": 0}); 1000]);
            }),
            "LIMIT",
            "triangles",
        ),
        (
            "one buffer read again and again",
            changed(triangle(), |json| {
                json["accessors"][0] = json!({"type": "VEC3", "componentType": F32, "count": 3_000_000});
                json["meshes"][0]["primitives"] = json!(vec![json!({"attributes": {"POSITION": 0}, "mode": 1}); 1000]);
            }),
            "LIMIT",
            "geometry",
        ),
    ];
    for (name, file, code, place) in cases {
        let start = Instant::now();
        let error = load(&file).err().unwrap_or_else(|| panic!("{name}: loaded"));
        let message = error.to_string();
        assert_eq!(error.code(), code, "{name}: {message}");
        assert!(message.contains("folder/test.glb"), "{name}: {message}");
        assert!(message.contains(place), "{name}: {message} does not name {place}");
        assert!(!message.contains('\n') && message.len() < 500, "{name}: {message}");
        assert!(start.elapsed() < Duration::from_secs(20), "{name}: {:?}", start.elapsed());
    }
}

/// A small generator (xorshift) so that failures can be repeated.
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % end as u64) as usize
    }
}

/// Changes a few bytes, or cuts the file off; every second time only swaps digits, which leaves JSON well-formed.
fn mutate(file: &[u8], random: &mut Random) -> Vec<u8> {
    let mut file = file.to_vec();
    let digits: Vec<usize> = (0..file.len()).filter(|&i| file[i].is_ascii_digit()).collect();
    let only_digits = random.below(2) == 0;
    for _ in 0..=random.below(3) {
        let digit = digits[random.below(digits.len())];
        let anywhere = random.below(file.len());
        if only_digits {
            file[digit] = b'0' + random.below(10) as u8;
        } else {
            file[anywhere] = random.below(256) as u8;
        }
    }
    if random.below(20) == 0 {
        file.truncate(random.below(file.len()));
    }
    file
}

#[test]
fn mutated_files_do_no_harm() {
    let good = rich().glb();
    let mut random = Random(0x1234_5678_9abc_def1);
    let (mut loaded, mut slowest) = (0, Duration::ZERO);
    for _ in 0..4000 {
        let file = mutate(&good, &mut random);
        let start = Instant::now();
        match load(&file) {
            Ok(scene) => {
                loaded += 1;
                for mesh in &scene.meshes {
                    assert!(mesh.indices.iter().all(|&index| (index as usize) < mesh.positions.len()));
                    assert!(mesh.positions.iter().all(|position| position.is_finite()));
                    assert_eq!(mesh.normals.len(), mesh.positions.len());
                    assert!((mesh.material as usize) < scene.materials.len());
                }
            }
            Err(error) => assert!(!error.to_string().contains('\n')),
        }
        slowest = slowest.max(start.elapsed());
    }
    assert!(slowest < Duration::from_secs(5), "{slowest:?}");
    assert!((400..3600).contains(&loaded), "{loaded} of 4000 loaded: the mutations are too weak or too strong");
}

#[test]
fn sponza() {
    let Some(path) = support::shared_file("sponza", "assets/bench/sponza.glb") else { return };
    let scene = gltf::load_file(&path, &gltf::Options::default()).unwrap();
    let triangles = |mesh: u32| scene.meshes[mesh as usize].indices.len() / 3;
    let total: usize = scene.instances.iter().map(|instance| triangles(instance.mesh)).sum();
    assert_eq!(total, 190_279);
    assert_eq!((scene.materials.len(), scene.textures.len()), (25, 63));
    let mapped = |mesh: &&restir::scene::Mesh| scene.materials[mesh.material as usize].normal_texture.is_some();
    assert!(scene.meshes.iter().filter(mapped).all(|mesh| mesh.tangents.len() == mesh.positions.len()));
}

/// An EXR file of these pixels.
fn exr_file(width: usize, height: usize, pixel: impl Fn(usize, usize) -> (f32, f32, f32) + Sync) -> Vec<u8> {
    use exr::prelude::{SpecificChannels, WritableImage};
    let channels = SpecificChannels::rgb(|position: exr::prelude::Vec2<usize>| pixel(position.x(), position.y()));
    let mut file = std::io::Cursor::new(Vec::new());
    exr::prelude::Image::from_channels((width, height), channels)
        .write()
        .non_parallel()
        .to_buffered(&mut file)
        .unwrap();
    file.into_inner()
}

#[test]
fn environment_pixels_are_linear_and_in_place() {
    let file = exr_file(4, 2, |x, y| (x as f32, y as f32, 0.5));
    let environment = environment::decode("sky.exr", &file).unwrap();
    assert_eq!((environment.width, environment.height), (4, 2));
    assert_eq!(environment.pixels[0], [0.0, 0.0, 0.5]);
    assert_eq!(environment.pixels[4 + 3], [3.0, 1.0, 0.5]);
}

#[test]
fn environment_values_are_clamped_and_counted() {
    let file = exr_file(2, 1, |x, _| if x == 0 { (f32::NAN, -1.0, f32::INFINITY) } else { (1.0, 0.0, 70_000.0) });
    let (environment, clamped) = environment::decode_counting("sky.exr", &file).unwrap();
    assert_eq!(environment.pixels, [[0.0, 0.0, environment::MAX_RADIANCE], [1.0, 0.0, 70_000.0]]);
    assert_eq!(clamped, 3);
}

#[test]
fn broken_environments_are_refused() {
    let good = exr_file(8, 4, |x, y| (x as f32, y as f32, 1.0));
    // Of scan lines: with another width it has as many chunks.
    let high = {
        use exr::prelude::{Encoding, Image, Layer, LayerAttributes, SpecificChannels, WritableImage};
        let channels = SpecificChannels::rgb(|_: exr::prelude::Vec2<usize>| (1.0f32, 1.0f32, 1.0f32));
        let layer = Layer::new((1, 2100), LayerAttributes::default(), Encoding::SMALL_LOSSLESS, channels);
        let mut file = std::io::Cursor::new(Vec::new());
        Image::from_layer(layer).write().non_parallel().to_buffered(&mut file).unwrap();
        file.into_inner()
    };
    let sized = |file: &[u8], x: i32, y: i32| {
        let window = file.windows(10).position(|bytes| bytes == b"dataWindow").unwrap() + 10 + 1 + 6 + 4;
        let mut file = file.to_vec();
        file[window + 8..window + 12].copy_from_slice(&x.to_le_bytes());
        file[window + 12..window + 16].copy_from_slice(&y.to_le_bytes());
        file
    };
    let cases = [
        ("empty", vec![], "BAD_FILE"),
        ("no EXR", b"hello, world".to_vec(), "BAD_FILE"),
        ("cut off", good[..good.len() - 40].to_vec(), "BAD_FILE"),
        ("header cut off", good[..30].to_vec(), "BAD_FILE"),
        ("absurdly wide", sized(&good, 1_000_000, 3), "BAD_FILE"),
        ("too many texels", sized(&high, 16_383, 2099), "LIMIT"),
        ("window of i32::MAX", sized(&good, i32::MAX, i32::MAX), "BAD_FILE"),
    ];
    for (name, file, code) in cases {
        let error = environment::decode("sky.exr", &file).err().unwrap_or_else(|| panic!("{name}: decoded"));
        let message = error.to_string();
        assert_eq!(error.code(), code, "{name}: {message}");
        assert!(message.contains("sky.exr") && !message.contains('\n'), "{name}: {message}");
    }
}

/// A decoder of DWA or B44 would believe sizes that stand within the compressed blocks.
#[test]
fn environments_compressed_with_loss_are_refused() {
    let mut file = exr_file(8, 4, |_, _| (1.0, 1.0, 1.0));
    let name = b"compression\0compression\0";
    let value = file.windows(name.len()).position(|bytes| bytes == name).unwrap() + name.len() + 4;
    for (code, refused) in [(2, false), (6, true), (7, true), (8, true), (9, true)] {
        file[value] = code;
        let error = environment::decode("sky.exr", &file).err().map(|error| error.code());
        assert_eq!(error == Some("UNSUPPORTED"), refused, "compression {code}: {error:?}");
    }
}

/// A Radiance file with these lines in its header; `rgbe` are its texels.
fn hdr_file(header: &str, width: u32, height: u32, rgbe: &[[u8; 4]]) -> Vec<u8> {
    let head = format!("#?RADIANCE\n{header}FORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n");
    [head.as_bytes(), rgbe.as_flattened()].concat()
}

/// Mantissas of 1/256, exponents from 128: (128, 64, 0) at 129 is (1, 0.5, 0).
#[test]
fn radiance_environments_load() {
    let texels = [[128, 64, 0, 129], [0, 0, 128, 130], [255, 3, 2, 0], [128, 128, 128, 136]];
    let environment = environment::decode("sky.hdr", &hdr_file("", 2, 2, &texels)).unwrap();
    assert_eq!((environment.width, environment.height), (2, 2));
    let expected = [[1.0, 0.5, 0.0], [0.0, 0.0, 2.0], [0.0; 3], [128.0; 3]];
    for (found, expected) in environment.pixels.iter().flatten().zip(expected.as_flattened()) {
        assert!((found - expected).abs() < 1e-30, "{found} {expected}");
    }
    let exposed = environment::decode("sky.hdr", &hdr_file("EXPOSURE=2\nEXPOSURE=2\n", 2, 2, &texels)).unwrap();
    assert_eq!(exposed.pixels[3], [32.0; 3]);
    let (bright, clamped) = environment::decode_counting("sky.hdr", &hdr_file("", 1, 1, &[[128, 1, 0, 255]])).unwrap();
    assert_eq!((bright.pixels[0][0], clamped), (environment::MAX_RADIANCE, 2));
}

#[test]
fn broken_radiance_environments_are_refused() {
    let good = hdr_file("", 2, 2, &[[128, 64, 0, 129]; 4]);
    let sized = |width, height| hdr_file("", width, height, &[[128, 64, 0, 129]; 4]);
    let cases = [
        ("signature alone", b"#?RADIANCE".to_vec(), "BAD_FILE"),
        ("cut off", good[..good.len() - 3].to_vec(), "BAD_FILE"),
        ("no texels", sized(0, 2), "BAD_FILE"),
        ("absurdly wide", sized(1_000_000, 3), "BAD_FILE"),
        ("absurdly wide and high", sized(u32::MAX, u32::MAX), "UNSUPPORTED"),
        ("too many texels", sized(16_000, 16_000), "LIMIT"),
        ("larger than its bytes", sized(8000, 4000), "BAD_FILE"),
        ("a bomb", [hdr_file("", 8192, 4096, &[[9, 9, 9, 128]]), [[1, 1, 1, 255]; 3].concat()].concat(), "BAD_FILE"),
        ("exposed to nothing", hdr_file("EXPOSURE=0\n", 2, 2, &[[128; 4]; 4]), "BAD_FILE"),
        ("another colour space", b"#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n1111".to_vec(), "UNSUPPORTED"),
        ("upside down", b"#?RADIANCE\n\n+Y 1 +X 1\n1111".to_vec(), "UNSUPPORTED"),
    ];
    for (name, file, code) in cases {
        let error = environment::decode("sky.hdr", &file).err().unwrap_or_else(|| panic!("{name}: decoded"));
        let message = error.to_string();
        assert_eq!(error.code(), code, "{name}: {message}");
        assert!(message.contains("sky.hdr") && !message.contains('\n'), "{name}: {message}");
    }
}

#[test]
fn mutated_environments_do_no_harm() {
    let goods = [
        exr_file(8, 4, |x, y| (x as f32, y as f32, 1.0)),
        hdr_file("EXPOSURE=2\n", 8, 4, &[[128, 64, 0, 129]; 32]),
        // Runs of the old kind and, in the second row, of the new.
        hdr_file("", 8, 2, &[[9, 9, 9, 128], [1, 1, 1, 7], [2, 2, 0, 8], [136, 5, 136, 6], [136, 7, 136, 128]]),
    ];
    let mut random = Random(99);
    for good in goods {
        assert!(environment::decode("sky", &good).is_ok());
        for _ in 0..2000 {
            if let Ok(environment) = environment::decode("sky", &mutate(&good, &mut random)) {
                assert!(environment.pixels.iter().flatten().all(|value| value.is_finite() && *value >= 0.0));
            }
        }
    }
}

#[test]
fn shared_environments_load() {
    let Some(path) = support::shared_file("shared_environments_load", "assets/hdri/courtyard.exr") else { return };
    let (environment, clamped) = environment::load_file(&path).unwrap();
    assert_eq!(clamped, 0);
    assert_eq!((environment.width, environment.height), (1024, 512));
    assert!(environment.pixels.iter().flatten().sum::<f32>() > 0.0);
}
