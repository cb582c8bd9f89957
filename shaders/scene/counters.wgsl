// Counters that passes add to.
#include "scene/bvh.wgsl"
#include "film/counters.wgsl"

@group(1) @binding(1) var<storage, read_write> counters: Counters;

var<workgroup> workgroup_rays: atomic<u32>;

// Adds the rays of a whole workgroup at once. To be called by every invocation, in uniform control flow.
fn flush_ray_count(local_index: u32) {
    // There a barrier makes fibres of all invocations, on threads that wait for each other.
    if is_software {
        atomicAdd(&counters.rays, rays_traced);
        return;
    }
    atomicAdd(&workgroup_rays, rays_traced);
    workgroupBarrier();
    if local_index == 0u {
        atomicAdd(&counters.rays, atomicLoad(&workgroup_rays));
    }
}

var<private> neighbors_rejected: u32 = 0u;

// Notes that a neighbour was too different.
fn count_rejected() {
    if counts_pixels {
        neighbors_rejected += 1u;
    }
}

// Adds what this invocation has done to what is counted for its pixel, for views that show it.
fn count_pixel(pixel: vec2u) {
    if counts_pixels {
        counters.pixel[pixel.y * frame.size.x + pixel.x] += vec4u(rays_traced, nodes_visited, neighbors_rejected, 0u);
    }
}
