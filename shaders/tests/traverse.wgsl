// Ray queries, for tests against the CPU.
// One invocation: one ray (a: origin and t_max, b: direction, c.x: any hit). Reads the scene. Writes (t, triangle,
// barycentrics) and the instance.
#include "tests/harness.wgsl"
#include "scene/bvh.wgsl"

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= test_run.count {
        return;
    }
    let input = test_inputs[id.x];
    let a = float(input.a);
    let hit = traverse(a.xyz, float(input.b).xyz, a.w, input.c.x == 1u);
    test_outputs[id.x] = TestOutput(
        vec4u(bitcast<u32>(hit.t), hit.triangle, bitcast<u32>(hit.uv.x), bitcast<u32>(hit.uv.y)), vec4u(hit.instance, 0u, 0u, 0u));
}
