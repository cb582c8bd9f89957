// The finest level of the environment's pyramid.
// One invocation: one texel of the level, two by two texels of the map. Reads the map. Writes their four weights, mean
// luminance times solid angle; 0 outside of the map.
// Source: Wyman and Panteleev 2021, section 5.3. The mean is that of the bilinearly filtered map over the texel, a tent
// of (1, 6, 1) / 8 along both axes, so that nothing the filter can read has density 0.
#include "scene/environment_map.wgsl"

@group(1) @binding(0) var level_out: texture_storage_2d<rgba32float, write>;

fn tent(before: f32, here: f32, after: f32) -> f32 {
    return (before + 6.0 * here + after) * 0.125;
}

// Luminance of one texel above another, and of those beside them: four rows of one column.
fn column(x: i32, y: i32, size: vec2i) -> vec4f {
    return vec4f(
        luminance(environment_texel(vec2i(x, y - 1), size)), luminance(environment_texel(vec2i(x, y), size)),
        luminance(environment_texel(vec2i(x, y + 1), size)), luminance(environment_texel(vec2i(x, y + 2), size)));
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(environment_radiance);
    if any(id.xy >= textureDimensions(level_out)) {
        return;
    }
    let first = vec2i(2u * id.xy);
    var along_y: array<vec2f, 4>;
    for (var i = 0; i < 4; i += 1) {
        let values = column(first.x + i - 1, first.y, vec2i(size));
        along_y[i] = vec2f(tent(values.x, values.y, values.z), tent(values.y, values.z, values.w));
    }
    var weights = vec4f(0.0);
    for (var child = 0u; child < 4u; child += 1u) {
        let at = vec2u(child & 1u, child >> 1u);
        let texel = 2u * id.xy + at;
        if all(texel < size) {
            let mean = tent(along_y[at.x][at.y], along_y[at.x + 1u][at.y], along_y[at.x + 2u][at.y]);
            weights[child] = mean * environment_texel_solid_angle(texel.y, size);
        }
    }
    textureStore(level_out, id.xy, weights);
}
