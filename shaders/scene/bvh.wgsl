// Ray queries through the two-level BVH: a top level over instances, whose leaves lead into the bottom levels of their
// meshes. `traverse` is the only traversal loop; a kernel should call it from as few places as it can, for every call
// may be inlined.
#include "scene/data.wgsl"
#include "scene/texture.wgsl"

// The builders guarantee that no path down both levels is longer (src/scene/bvh.rs).
const BVH_STACK = 84u;

const TRIANGLE_DOUBLE_SIDED = 1u;
const TRIANGLE_ALPHA_MASK = 2u;
const TRIANGLE_TANGENTS = 4u;
const BITANGENT_SHIFT = 16u;

struct Hit {
    t: f32, // distance in units of the direction's length; t_max for a miss
    triangle: u32, // NONE for a miss
    uv: vec2f, // barycentric weights of the corners 1 and 2
    instance: u32,
}

// Rays traced by this invocation; passes that count add it to `counters`.
var<private> rays_traced: u32 = 0u;

fn triangle_uvs(triangle: u32, uv: vec2f) -> vec4f {
    let a = load_attributes(triangle);
    let w = 1.0 - uv.x - uv.y;
    return vec4f(w * a.uv_a.xy + uv.x * a.uv_a.zw + uv.y * a.uv_b.xy,
        w * a.uv_b.zw + uv.x * a.uv_c.xy + uv.y * a.uv_c.zw);
}

fn unpack_color(color: u32) -> vec4f {
    return unpack4x8unorm(color);
}

fn triangle_color(triangle: u32, uv: vec2f) -> vec4f {
    let colors = load_attributes(triangle).colors;
    return (1.0 - uv.x - uv.y) * unpack_color(colors.x) + uv.x * unpack_color(colors.y) + uv.y * unpack_color(colors.z);
}

// Whether a masked triangle exists at a point of it.
fn passes_alpha(triangle: u32, uv: vec2f) -> bool {
    let material = load_material(load_triangle(triangle).material);
    let alpha = material.base_color.a * triangle_color(triangle, uv).a
        * texture_read(material.base_color_texture, triangle_uvs(triangle, uv)).a;
    return alpha >= material.alpha_cutoff;
}

// Möller and Trumbore 1997. A triangle seen from its back is missed unless it is double-sided (glTF 2.0, 3.9.6).
fn intersect_triangle(index: u32, instance: u32, origin: vec3f, direction: vec3f, hit: ptr<function, Hit>) {
    let triangle = load_triangle(index);
    let e1 = triangle.p1 - triangle.p0;
    let e2 = triangle.p2 - triangle.p0;
    let p = cross(direction, e2);
    let determinant = dot(e1, p);
    if determinant <= 0.0 && (determinant == 0.0 || (triangle.flags & TRIANGLE_DOUBLE_SIDED) == 0u) {
        return;
    }
    let inverse = 1.0 / determinant;
    let s = origin - triangle.p0;
    let u = dot(s, p) * inverse;
    let q = cross(s, e1);
    let v = dot(direction, q) * inverse;
    let t = dot(e2, q) * inverse;
    if u < 0.0 || v < 0.0 || u + v > 1.0 || t <= 0.0 || t >= (*hit).t {
        return;
    }
    if scene_has_alpha_masks && (triangle.flags & TRIANGLE_ALPHA_MASK) != 0u && !passes_alpha(index, vec2f(u, v)) {
        return;
    }
    *hit = Hit(t, index, vec2f(u, v), instance);
}

// Where the ray enters the node's box, or a huge number if it misses it within [0, t_max].
fn intersect_box(node: u32, origin: vec3f, inverse: vec3f, t_max: f32) -> f32 {
    let a = (nodes[node].min - origin) * inverse;
    let b = (nodes[node].max - origin) * inverse;
    let near = min(a, b);
    let far = max(a, b);
    let enter = max(max(near.x, near.y), max(near.z, 0.0));
    // Two ulps wider, so that rounding never loses a box (Ize 2013).
    let leave = min(min(far.x, far.y), min(far.z, t_max)) * 1.0000004;
    return select(3.4e38, enter, enter <= leave);
}

// 1 / direction, without infinities: 0 * inf would be NaN in the slab test.
fn safe_inverse(direction: vec3f) -> vec3f {
    return 1.0 / select(direction, vec3f(1e-20), abs(direction) < vec3f(1e-20));
}

// The closest hit with 0 < t < t_max, or, with `any_hit`, whichever is found first. Distances are the same in the space
// of every mesh, for the ray's direction is not normalised on the way there. `top_level` is the scene's root, that of this
// frame or of the previous one.
fn traverse_from(top_level: u32, world_origin: vec3f, world_direction: vec3f, t_max: f32, any_hit: bool) -> Hit {
    rays_traced += 1u;
    var origin = world_origin;
    var direction = world_direction;
    var inverse = safe_inverse(direction);
    var hit = Hit(t_max, NONE, vec2f(0.0), 0u);
    var stack: array<u32, BVH_STACK>;
    var depth = 0u;
    var node = select(0u, top_level, scene_has_instances);
    // The instance whose bottom level is walked, and the stack's depth when it was entered.
    var instance = select(0u, NONE, scene_has_instances);
    var floor_depth = 0u;
    if intersect_box(node, origin, inverse, t_max) >= 3.4e38 {
        return hit;
    }
    loop {
        let count = nodes[node].count;
        let first = nodes[node].first;
        if count > 0u {
            if scene_has_instances && instance == NONE {
                instance = first;
                floor_depth = depth;
                origin = instance_point(instance, TO_OBJECT, world_origin);
                direction = instance_vector(instance, TO_OBJECT, world_direction);
                inverse = safe_inverse(direction);
                node = instance_texel(instance, 6u).x;
                continue;
            }
            for (var i = first; i < first + count; i += 1u) {
                intersect_triangle(i, instance, origin, direction, &hit);
            }
            if any_hit && hit.triangle != NONE {
                return hit;
            }
        } else {
            let left = intersect_box(first, origin, inverse, hit.t);
            let right = intersect_box(first + 1u, origin, inverse, hit.t);
            let left_first = left <= right;
            if min(left, right) < 3.4e38 {
                node = select(first + 1u, first, left_first);
                if max(left, right) < 3.4e38 && depth < BVH_STACK {
                    stack[depth] = select(first, first + 1u, left_first);
                    depth += 1u;
                }
                continue;
            }
        }
        if scene_has_instances && instance != NONE && depth == floor_depth {
            instance = NONE;
            origin = world_origin;
            direction = world_direction;
            inverse = safe_inverse(direction);
        }
        if depth == 0u {
            break;
        }
        depth -= 1u;
        node = stack[depth];
    }
    return hit;
}

// The same in this frame's scene.
fn traverse(origin: vec3f, direction: vec3f, t_max: f32, any_hit: bool) -> Hit {
    return traverse_from(frame.top_level, origin, direction, t_max, any_hit);
}

// A point moved off its surface along the geometric normal far enough that a ray from it cannot hit the surface again,
// by integer steps of the float's own resolution (Wächter and Binder 2019, Ray Tracing Gems, chapter 6).
fn offset_origin(position: vec3f, normal: vec3f) -> vec3f {
    let step = vec3i(normal * 256.0);
    let moved = bitcast<vec3f>(bitcast<vec3i>(position) + select(step, -step, position < vec3f(0.0)));
    return select(moved, position + normal * (1.0 / 65536.0), abs(position) < vec3f(1.0 / 32.0));
}
