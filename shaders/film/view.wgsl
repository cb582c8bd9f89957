// Debug views that every technique has.
// One invocation: one pixel. Reads the auxiliary pictures. Writes radiance, to be shown as it is.
#include "scene/bindings.wgsl"

@group(1) @binding(0) var albedo_depth: texture_2d<f32>;
@group(1) @binding(1) var normal: texture_2d<f32>;
@group(1) @binding(2) var radiance_out: texture_storage_2d<rgba32float, write>;
@group(1) @binding(3) var motion: texture_2d<f32>;

// frame.view, as numbered in src/renderer.rs.
const VIEW_ALBEDO = 1000u;
const VIEW_NORMAL = 1001u;
const VIEW_DEPTH = 1002u;
const VIEW_MOTION = 1003u;

// Pixels of motion that saturate the view.
const MOTION_SCALE = 16.0;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let pixel = id.xy;
    if any(pixel >= frame.size) {
        return;
    }
    let a = textureLoad(albedo_depth, pixel, 0);
    let n = textureLoad(normal, pixel, 0).xyz;
    var color = vec3f(0.0);
    switch frame.view {
        case VIEW_ALBEDO: { color = a.rgb; }
        case VIEW_NORMAL: { color = select(vec3f(0.0), n * 0.5 + 0.5, dot(n, n) > 0.0); }
        // Half of the way at one scene radius, so that near and far both show.
        case VIEW_DEPTH: { color = vec3f(a.a / (a.a + frame.scene_radius)); }
        // Grey is at rest, red to the right, green down.
        case VIEW_MOTION: {
            color = clamp(vec3f(0.5 + textureLoad(motion, pixel, 0).xy * (0.5 / MOTION_SCALE), 0.5), vec3f(0.0), vec3f(1.0));
        }
        default: {}
    }
    textureStore(radiance_out, pixel, vec4f(color, 1.0));
}
