// Counters that passes add to: rays are cleared every frame, what was left out when the film starts again.
#include "scene/bvh.wgsl"

struct Counters {
    rays: atomic<u32>,
    nan: atomic<u32>,
    infinite: atomic<u32>,
    padding: u32,
}

@group(1) @binding(1) var<storage, read_write> counters: Counters;

var<workgroup> workgroup_rays: atomic<u32>;

// Adds the rays of a whole workgroup at once. To be called by every invocation, in uniform control flow.
fn flush_ray_count(local_index: u32) {
    atomicAdd(&workgroup_rays, rays_traced);
    workgroupBarrier();
    if local_index == 0u {
        atomicAdd(&counters.rays, atomicLoad(&workgroup_rays));
    }
}
