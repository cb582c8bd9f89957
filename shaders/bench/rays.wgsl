// Rays of a list, each by an invocation of its own: as the techniques trace theirs.
// One invocation: one ray. Reads the scene and the list. Writes the hit.
#include "bench/bench.wgsl"

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= bench.count {
        return;
    }
    let ray = bench_rays[id.x];
    let start = ray.origin + ray.t_min * ray.direction;
    write_hit(id.x, traverse(start, ray.direction, ray.t_max - ray.t_min, bench.any_hit != 0u));
}
