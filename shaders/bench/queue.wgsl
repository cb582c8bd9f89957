// Rays of a list, taken by lanes as they finish.
// One workgroup: RAYS rays, of which each lane takes the next when its own is done, so that none waits for the longest of its
// neighbours' (after Aila and Laine 2009, "Understanding the efficiency of ray traversal on GPUs", persistent threads,
// with a counter of the workgroup instead of one for all). Reads the scene and the list. Writes the hits.
#include "bench/bench.wgsl"

const LANES = 64u;
const RAYS = 4u * LANES;

var<workgroup> queue_next: atomic<u32>;

fn queue_start(index: u32) -> Walk {
    let ray = bench_rays[index];
    return walk_start(frame.top_level, ray.origin + ray.t_min * ray.direction, ray.direction, ray.t_max - ray.t_min);
}

@compute @workgroup_size(LANES)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let first = group.x * RAYS;
    let end = min(first + RAYS, bench.count);
    if lane == 0u {
        atomicStore(&queue_next, first + LANES);
    }
    workgroupBarrier();
    var index = first + lane;
    if index >= end {
        return;
    }
    var stack: array<u32, BVH_STACK>;
    var walk = queue_start(index);
    loop {
        walk_turn(&walk, &stack, bench.any_hit != 0u);
        if walk.next == DONE {
            write_hit(index, walk.hit);
            index = atomicAdd(&queue_next, 1u);
            if index >= end {
                break;
            }
            walk = queue_start(index);
        }
    }
}
