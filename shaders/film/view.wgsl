// Debug views that every technique has.
// One invocation: one pixel. Reads the auxiliary pictures and what was counted for the pixel. Writes radiance: colours, or a
// number in each channel.
#include "scene/bindings.wgsl"
#include "film/film.wgsl"
#include "film/counters.wgsl"

@group(1) @binding(1) var albedo_depth: texture_2d<f32>;
@group(1) @binding(2) var normal: texture_2d<f32>;
@group(1) @binding(3) var radiance_out: texture_storage_2d<rgba32float, write>;
@group(1) @binding(4) var motion: texture_2d<f32>;
@group(1) @binding(5) var<storage, read_write> counters: Counters;

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
    let counted = counters.pixel[pixel.y * frame.size.x + pixel.x];
    switch film.view {
        case VIEW_ALBEDO: { color = a.rgb; }
        case VIEW_NORMAL: { color = select(vec3f(0.0), n * 0.5 + 0.5, dot(n, n) > 0.0); }
        case VIEW_DEPTH: { color = vec3f(a.a); }
        case VIEW_RAYS: { color = vec3f(f32(counted.x)); }
        case VIEW_BVH_STEPS: { color = vec3f(f32(counted.y)); }
        // Grey is at rest, red to the right, green down.
        case VIEW_MOTION: {
            color = clamp(vec3f(0.5 + textureLoad(motion, pixel, 0).xy * (0.5 / MOTION_SCALE), 0.5), vec3f(0.0), vec3f(1.0));
        }
        case VIEW_REJECTED_NEIGHBOURS: { color = vec3f(f32(counted.z)); }
        default: {}
    }
    textureStore(radiance_out, pixel, vec4f(color, 1.0));
}
