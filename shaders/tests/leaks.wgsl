// Rays inside a closed mesh, which can never get out.
// One invocation: `input.a.y` rays of the seed `input.a.x` from within the ball `input.b` (centre, radius) to points,
// edges and corners of the first `input.a.z` triangles of instance `input.a.w`; from hits within a face two more, one back
// into the mesh and one out of it. Reads the scene. Writes counts: (leaks of first rays, leaks of second rays, second rays that hit
// the triangle they started on, rays out of the mesh that hit anything).
#include "tests/harness.wgsl"
#include "scene/surface.wgsl"
#include "lib/rng.wgsl"
#include "lib/sampling.wgsl"

// A point of a triangle: anywhere, on an edge, or a corner.
fn choose_barycentrics(kind: u32, u: vec4f) -> vec2f {
    let side = u32(u.z * 3.0);
    switch kind {
        case 0u: { return sample_triangle(u.xy); }
        case 1u: {
            return select(select(vec2f(u.x, 0.0), vec2f(0.0, u.x), side == 1u), vec2f(u.x, 1.0 - u.x), side == 2u);
        }
        default: { return select(select(vec2f(0.0), vec2f(1.0, 0.0), side == 1u), vec2f(0.0, 1.0), side == 2u); }
    }
}

// A direction on the side of `normal`, often grazing.
fn choose_direction(normal: vec3f, u: vec2f) -> vec3f {
    let cosine = max(u.x * u.x * u.x, 1e-4);
    let phi = 2.0 * PI * u.y;
    let sine = sqrt(1.0 - cosine * cosine);
    return basis_to_world(orthonormal_basis(normal), vec3f(sine * cos(phi), sine * sin(phi), cosine));
}

// Whether a hit is farther from its triangle's edges than rounding may have moved it.
fn is_within(hit: Hit) -> bool {
    let corners = triangle_corners(hit.instance, hit.triangle);
    let longest = max(length(corners.p1 - corners.p0), max(length(corners.p2 - corners.p1), length(corners.p0 - corners.p2)));
    let normal = triangle_normal(hit.instance, hit.triangle);
    let weight = min(hit.uv.x, min(hit.uv.y, 1.0 - hit.uv.x - hit.uv.y));
    return weight * length(normal) / longest > 4.0 * triangle_error(hit.instance, hit.triangle, normalize(normal));
}

fn count_leaks(input: TestInput) -> vec4u {
    var counts = vec4u(0u);
    let ball = float(input.b);
    var rng = rng_new(vec2u(input.a.x & 0xffffu, input.a.x >> 16u), 0u, 77u, 0u);
    for (var i = 0u; i < input.a.y; i += 1u) {
        let u = random_4(&rng);
        let w = random_4(&rng);
        let origin = ball.xyz + ball.w * (2.0 * vec3f(u.x, u.y, u.z) - 1.0) * 0.577;
        let triangle = bits_below(random_bits(&rng).x, input.a.z);
        let target_point = triangle_point(input.a.w, triangle, choose_barycentrics(i % 3u, w));
        var direction = normalize(target_point - origin);
        if i % 16u == 0u {
            // Along an axis.
            direction = select(select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, -1.0, 0.0), w.x > 0.3), vec3f(0.0, 0.0, 1.0), w.x > 0.6);
        }
        let hit = traverse(origin, direction, 3.0e38, false);
        if hit.triangle == NONE {
            counts.x += 1u;
            continue;
        }
        // From an edge a ray may leave through the face beside at once: only points within a face are tested.
        if i % 3u != 0u || i % 16u == 0u || !is_within(hit) {
            continue;
        }
        var surface: Surface;
        surface.position = triangle_point(hit.instance, hit.triangle, hit.uv);
        let front = normalize(triangle_normal(hit.instance, hit.triangle));
        surface.geometric_normal = select(front, -front, dot(front, direction) > 0.0);
        surface.position_error = triangle_error(hit.instance, hit.triangle, front);
        let v = random_4(&rng);
        let inwards = choose_direction(surface.geometric_normal, v.xy);
        let back = traverse(ray_origin(surface, inwards), inwards, 3.0e38, false);
        counts.y += u32(back.triangle == NONE);
        counts.z += u32(back.triangle == hit.triangle && back.instance == hit.instance);
        let outwards = choose_direction(-surface.geometric_normal, v.zw);
        let out = traverse(ray_origin(surface, outwards), outwards, 3.0e38, true);
        counts.w += u32(out.triangle != NONE);
    }
    return counts;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x < test_run.count {
        test_outputs[id.x] = TestOutput(count_leaks(test_inputs[id.x]), vec4u(0u));
    }
}
