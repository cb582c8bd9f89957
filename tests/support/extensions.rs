//! Small files that use an extension, and what the reference decoders made of tests/data.

use super::gltf_writer::{F32, U8, U16, U32, Writer};
use serde_json::{Value, json};

/// Component types that only quantized attributes have.
pub const I8: u32 = 5120;
pub const I16: u32 = 5122;
/// A unit square in the plane z = 0.
pub const QUAD: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0];
pub const QUAD_NORMALS: [f32; 12] = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
pub const QUAD_UVS: [f32; 8] = [0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0];
pub const QUAD_INDICES: [u16; 6] = [0, 1, 2, 0, 2, 3];
/// A file of tests/data.
pub fn data(name: &str) -> Vec<u8> {
    std::fs::read(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)).unwrap()
}

/// The cases of a file of tests/data.
pub fn cases(name: &str) -> Vec<Value> {
    serde_json::from_slice(&data(name)).unwrap()
}

/// RFC 4648 base64, as make.mjs writes it.
pub fn unbase64(text: &Value) -> Vec<u8> {
    let value = |c: u8| match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        _ => 63,
    };
    let text = text.as_str().unwrap().trim_end_matches('=').as_bytes();
    let group = |quad: &[u8]| {
        let bits = quad.iter().enumerate().fold(0u32, |bits, (i, &c)| bits | u32::from(value(c)) << (18 - 6 * i));
        bits.to_be_bytes()[1..quad.len()].to_vec()
    };
    text.chunks(4).flat_map(group).collect()
}

/// A quad with a texture, in one mesh at one node.
pub fn quad(material: Value) -> Writer {
    let mut writer = Writer::new(json!({
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{
            "attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3, "material": 0,
        }]}],
        "materials": [material],
    }));
    writer.floats("VEC3", &QUAD);
    writer.floats("VEC3", &QUAD_NORMALS);
    writer.floats("VEC2", &QUAD_UVS);
    writer.indices(&QUAD_INDICES);
    writer
}

/// A material with texture 0.
pub fn textured() -> Value {
    json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}})
}

/// A file whose only mesh is Draco's, and its twin of what the reference decoder gave.
pub fn draco_twins(case: &Value) -> (Writer, Writer) {
    let vertices = case["vertices"].as_u64().unwrap() as usize;
    let indices = unbase64(&case["indices"]);
    let semantics =
        [("POSITION", "VEC3", F32), ("NORMAL", "VEC3", F32), ("TEXCOORD_0", "VEC2", F32), ("COLOR_0", "VEC4", U8)];
    let attributes = json!({"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "COLOR_0": 3});
    let primitive = json!({"attributes": attributes, "indices": 4});
    let parts = json!({"nodes": [{"mesh": 0}], "meshes": [{"primitives": [primitive]}]});
    let mut without = Writer::new(parts.clone());
    let mut with = Writer::new(parts);
    for (semantic, kind, component) in semantics {
        without.accessor(kind, component, vertices, &unbase64(&case[semantic]));
        with.push(
            "accessors",
            json!({"type": kind, "componentType": component, "count": vertices, "normalized": component == U8}),
        );
    }
    without.accessor("SCALAR", U32, indices.len() / 4, &indices);
    with.push("accessors", json!({"type": "SCALAR", "componentType": U32, "count": indices.len() / 4}));
    let view = with.view(&unbase64(&case["encoded"]));
    with.json["meshes"][0]["primitives"][0]["extensions"] =
        json!({"KHR_draco_mesh_compression": {"bufferView": view, "attributes": case["ids"]}});
    with.json["extensionsUsed"] = json!(["KHR_draco_mesh_compression"]);
    with.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    (with, without)
}

/// The sheet of make.mjs with its buffer views compressed, and its twin.
pub fn meshopt_twins(extension: &str, cases: &[Value], names: [&str; 3]) -> (Writer, Writer) {
    let primitive = json!({"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2});
    let parts = json!({"nodes": [{"mesh": 0}], "meshes": [{"primitives": [primitive]}],
        "extensionsUsed": [extension, "KHR_mesh_quantization"], "extensionsRequired": ["KHR_mesh_quantization"]});
    let (mut with, mut without) = (Writer::new(parts.clone()), Writer::new(parts));
    with.json["extensionsRequired"] = json!([extension, "KHR_mesh_quantization"]);
    let accessors = [("VEC3", F32, false), ("VEC3", I8, true), ("SCALAR", U16, false)];
    for (name, (kind, component, normalized)) in names.into_iter().zip(accessors) {
        let case = cases.iter().find(|case| case["name"] == name).unwrap();
        let accessor = |view: usize, count: &Value| json!({"bufferView": view, "type": kind, "componentType": component, "count": count, "normalized": normalized});
        let [count, stride] = [&case["count"], &case["stride"]];
        let decoded = unbase64(&case["decoded"]);
        let view = without.view(&decoded);
        without.push("accessors", accessor(view, count));
        let source = with.view(&unbase64(&case["encoded"]));
        let source = with.json["bufferViews"][source].clone();
        let view = with.push("bufferViews", json!({"buffer": 1, "byteLength": decoded.len(), "extensions": {extension: {
            "buffer": 0, "byteOffset": source["byteOffset"], "byteLength": source["byteLength"], "byteStride": stride,
            "count": count, "mode": case["mode"], "filter": case["filter"],
        }}}));
        if kind != "SCALAR" {
            with.json["bufferViews"][view]["byteStride"] = stride.clone();
            let view = without.json["bufferViews"].as_array().unwrap().len() - 1;
            without.json["bufferViews"][view]["byteStride"] = stride.clone();
        }
        with.push("accessors", accessor(view, count));
    }
    let length = with.json["bufferViews"].as_array().unwrap().iter().filter(|view| view["buffer"] == 0).count();
    assert_eq!(length, 3);
    (with, without)
}

/// Binary glTF whose second buffer only stands for decompressed data.
pub fn with_placeholder(mut writer: Writer, fallback: Value) -> Vec<u8> {
    let end = |view: &Value| view["byteOffset"].as_u64().unwrap_or(0) + view["byteLength"].as_u64().unwrap();
    let views = writer.json["bufferViews"].as_array().unwrap().clone();
    let first = views.iter().filter(|view| view["buffer"] == 0).map(end).max().unwrap();
    writer.json["buffers"] = json!([{"byteLength": first}, fallback]);
    writer.glb()
}

/// A quad with the picture in `file`, by the extension or as a plain image.
pub fn pictured(extension: Option<&str>, file: &str) -> Writer {
    let mut writer = quad(textured());
    let view = writer.view(&data(file));
    writer.push("images", json!({"bufferView": view}));
    match extension {
        Some(name) => {
            writer.push("textures", json!({"extensions": {name: {"source": 0}}}));
            writer.json["extensionsUsed"] = json!([name]);
            writer.json["extensionsRequired"] = json!([name]);
        }
        None => {
            writer.push("textures", json!({"source": 0}));
        }
    }
    writer
}

/// A quad with two materials and three variants.
pub fn with_variants() -> Writer {
    let mut writer = quad(json!({"name": "plain"}));
    writer.push("materials", json!({"name": "red", "pbrMetallicRoughness": {"baseColorFactor": [1.0, 0.0, 0.0, 1.0]}}));
    writer.json["extensions"] =
        json!({"KHR_materials_variants": {"variants": [{"name": "day"}, {"name": "dusk"}, {"name": "night"}]}});
    writer.json["extensionsUsed"] = json!(["KHR_materials_variants"]);
    writer.json["meshes"][0]["primitives"][0]["extensions"] = json!({"KHR_materials_variants": {"mappings": [{"material": 0, "variants": [0]}, {"material": 1, "variants": [1, 2]}]}});
    writer
}
