// The next coarser level of the environment's pyramid.
// One invocation: one texel of the coarser level. Reads its four children in the finer one. Writes their sums; 0 for
// children that are not there.
// Source: Wyman and Panteleev 2021, section 5.3.

@group(1) @binding(0) var level_out: texture_storage_2d<rgba32float, write>;
@group(1) @binding(1) var finer: texture_2d<f32>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(level_out)) {
        return;
    }
    let size = textureDimensions(finer);
    var sums = vec4f(0.0);
    for (var child = 0u; child < 4u; child += 1u) {
        let texel = 2u * id.xy + vec2u(child & 1u, child >> 1u);
        if all(texel < size) {
            let weights = textureLoad(finer, texel, 0);
            // In the order of `pyramid_sum`.
            sums[child] = ((weights.x + weights.y) + weights.z) + weights.w;
        }
    }
    textureStore(level_out, id.xy, sums);
}
