// What the kernels of `restir bench rays` share: rays in, hits out.
#include "scene/bvh.wgsl"

struct BenchRay {
    origin: vec3f,
    t_min: f32, // distances count from here
    direction: vec3f,
    t_max: f32,
}

struct BenchRays {
    count: u32,
    any_hit: u32,
}

@group(1) @binding(0) var<uniform> bench: BenchRays;
@group(1) @binding(1) var<storage, read> bench_rays: array<BenchRay>;
@group(1) @binding(2) var<storage, read_write> bench_hits: array<vec4u>;

// (t, triangle, instance)
fn write_hit(index: u32, hit: Hit) {
    let ray = bench_rays[index];
    let t = select(ray.t_max, ray.t_min + hit.t, hit.triangle != NONE);
    bench_hits[index] = vec4u(bitcast<u32>(t), hit.triangle, hit.instance, 0u);
}
