//! A small file with everything that moves: a bar with two joints, a triangle with two morph targets, a triangle that
//! moves as a whole, a light and a camera.

use super::gltf_writer::{U8, Writer};
use serde_json::{Value, json};

/// Indices of nodes in the file.
pub mod node {
    pub const UPPER_JOINT: usize = 1;
    pub const BAR: usize = 2;
    pub const MORPH: usize = 3;
    pub const RIGID: usize = 4;
}

/// Seconds of the animation "all".
pub const DURATION: f32 = 2.0;
/// Height of the joint that bends, and of the bar.
pub const HEIGHTS: [f32; 2] = [1.0, 2.0];
/// Half the bar's width.
pub const HALF_WIDTH: f32 = 0.25;

const QUARTER_Z: [f32; 4] = [0.0, 0.0, std::f32::consts::FRAC_1_SQRT_2, std::f32::consts::FRAC_1_SQRT_2];
const TRIANGLE: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];

/// The file, free to be spoilt. Two animations: "all", in which the bar's upper half turns a quarter round Z in 1 s and
/// back, and "still moves", in which only the rigid triangle does.
pub fn animated() -> Writer {
    let mut writer = Writer::new(json!({"scene": 0, "scenes": [{"nodes": [0, 2, 3, 4, 5, 6]}]}));
    // A bar in the plane z = 0: three rows of two vertices; the middle row follows both joints.
    let bar: Vec<f32> =
        [0.0, HEIGHTS[0], HEIGHTS[1]].iter().flat_map(|&y| [-HALF_WIDTH, y, 0.0, HALF_WIDTH, y, 0.0]).collect();
    let positions = writer.floats("VEC3", &bar);
    let normals = writer.floats("VEC3", &[0.0, 0.0, 1.0].repeat(6));
    let joints: Vec<u8> = [[0, 0, 0, 0], [0, 0, 0, 0], [0, 1, 0, 0], [0, 1, 0, 0], [1, 0, 0, 0], [1, 0, 0, 0]].concat();
    let joints = writer.accessor("VEC4", U8, 6, &joints);
    // Not normalised on purpose: 2 : 2 is a half each.
    let weights = [[3.0, 0.0, 0.0, 0.0], [3.0, 0.0, 0.0, 0.0], [2.0, 2.0, 0.0, 0.0], [2.0, 2.0, 0.0, 0.0]].concat();
    let weights = writer.floats("VEC4", &[weights, [1.0, 0.0, 0.0, 0.0].repeat(2)].concat());
    let indices = writer.indices(&[0, 1, 2, 1, 3, 2, 2, 3, 4, 3, 5, 4]);
    let attributes = json!({"POSITION": positions, "NORMAL": normals, "JOINTS_0": joints, "WEIGHTS_0": weights});
    writer.push("meshes", json!({"primitives": [{"attributes": attributes, "indices": indices}]}));

    let triangle = writer.floats("VEC3", &TRIANGLE);
    let up = writer.floats("VEC3", &[0.0, 0.0, 2.0].repeat(3));
    let right = writer.floats("VEC3", &[4.0, 0.0, 0.0].repeat(3));
    writer.push(
        "meshes",
        json!({"weights": [0.0, 0.5],
               "primitives": [{"attributes": {"POSITION": triangle}, "targets": [{"POSITION": up}, {"POSITION": right}]}]}),
    );
    writer.push("meshes", json!({"primitives": [{"attributes": {"POSITION": triangle}}]}));

    // Inverse bind matrices: the identity, and down from the upper joint.
    let identity = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    let mut down = identity;
    down[13] = -HEIGHTS[0];
    let matrices = matrices(&mut writer, &[identity, down]);
    writer.push("skins", json!({"joints": [0, 1], "inverseBindMatrices": matrices}));
    writer.push("cameras", json!({"type": "perspective", "name": "eye", "perspective": {"yfov": 0.8, "znear": 0.1}}));
    writer.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "spot", "intensity": 20, "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.6}}]}});
    writer.json["nodes"] = json!([
        {"children": [1], "name": "lower"},
        {"translation": [0, HEIGHTS[0], 0], "name": "upper"},
        // A skinned mesh follows its joints, not its node.
        {"mesh": 0, "skin": 0, "translation": [100, 0, 0]},
        {"mesh": 1, "translation": [0, 0, -1]},
        {"mesh": 2},
        {"extensions": {"KHR_lights_punctual": {"light": 0}}, "translation": [0, 1, 4]},
        {"camera": 0, "translation": [0, 1, 5]}]);

    let times = writer.floats("SCALAR", &[0.0, 1.0, DURATION]);
    let turns = writer.floats("VEC4", &[[0.0, 0.0, 0.0, 1.0], QUARTER_Z, [0.0, 0.0, 0.0, 1.0]].concat());
    let weights = writer.floats("SCALAR", &[0.0, 0.5, 1.0, 0.0, 0.0, 0.5]);
    let paths = writer.floats("VEC3", &[0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let lifts = writer.floats("VEC3", &[0.0, 1.0, 5.0, 0.0, 2.0, 5.0, 0.0, 1.0, 5.0]);
    let sampler =
        |output: usize, interpolation: &str| json!({"input": times, "output": output, "interpolation": interpolation});
    let channel =
        |sampler: usize, node: usize, path: &str| json!({"sampler": sampler, "target": {"node": node, "path": path}});
    let all: Value = json!({"name": "all",
        "samplers": [sampler(turns, "LINEAR"), sampler(weights, "LINEAR"), sampler(paths, "STEP"), sampler(lifts, "LINEAR")],
        "channels": [channel(0, node::UPPER_JOINT, "rotation"), channel(1, node::MORPH, "weights"),
                     channel(2, node::RIGID, "translation"), channel(3, 5, "translation"), channel(3, 6, "translation")]});
    writer.push("animations", all);
    writer.push(
        "animations",
        json!({"name": "still moves", "samplers": [sampler(paths, "LINEAR")],
               "channels": [channel(0, node::RIGID, "translation")]}),
    );
    writer
}

/// Appends an accessor of column-major matrices; returns its index.
fn matrices(writer: &mut Writer, matrices: &[[f32; 16]]) -> usize {
    let bytes: Vec<u8> = matrices.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
    writer.accessor("MAT4", super::gltf_writer::F32, matrices.len(), &bytes)
}
