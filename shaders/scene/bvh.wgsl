// Ray queries through the two-level BVH: a top level over instances, whose leaves lead into the bottom levels of their
// meshes. `traverse` is the only traversal loop; a kernel should call it from as few places as it can, for every call
// may be inlined.
#include "scene/data.wgsl"
#include "scene/texture.wgsl"
#include "lib/shapes.wgsl"

// The builders guarantee that no path down both levels is longer (src/scene/bvh.rs).
const BVH_STACK = 84u;

const TRIANGLE_DOUBLE_SIDED = 1u;
const TRIANGLE_ALPHA_MASK = 2u;
const TRIANGLE_TANGENTS = 4u;
const SHAPE_SHIFT = 28u;
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

// Whether a masked triangle exists at a point of it. Read at level 0: a mean of alpha against a cutoff is not the part that
// exists, and a surface must be there, or not, for every ray alike.
fn passes_alpha(triangle: u32, uv: vec2f) -> bool {
    let material = load_material(load_triangle(triangle).material);
    let alpha = material.base_color.a * triangle_color(triangle, uv).a
        * texture_read(material.base_color_texture, texture_finest(triangle_uvs(triangle, uv))).a;
    return alpha >= material.alpha_cutoff;
}

fn shape_of(flags: u32) -> u32 {
    return (flags >> SHAPE_SHIFT) & 3u;
}

fn is_sphere(flags: u32) -> bool {
    return scene_has_shapes && shape_of(flags) == SHAPE_SPHERE;
}

// A primitive that is no triangle. The plane of a flat one as by Möller and Trumbore 1997; it has no neighbours to be
// watertight with.
fn intersect_shape(index: u32, instance: u32, triangle: Triangle, origin: vec3f, direction: vec3f,
    hit: ptr<function, Hit>) {
    let e1 = triangle.p1 - triangle.p0;
    let e2 = triangle.p2 - triangle.p0;
    let s = origin - triangle.p0;
    if is_sphere(triangle.flags) {
        let t = enter_sphere(s, direction, length(e1));
        if t > 0.0 && t < (*hit).t {
            *hit = Hit(t, index, sphere_uv(normalize(s + t * direction)), instance);
        }
        return;
    }
    let p = cross(direction, e2);
    let determinant = dot(e1, p);
    if determinant <= 0.0 && (determinant == 0.0 || (triangle.flags & TRIANGLE_DOUBLE_SIDED) == 0u) {
        return;
    }
    let q = cross(s, e1);
    let uv = vec2f(dot(s, p), dot(direction, q)) / determinant;
    let t = dot(e2, q) / determinant;
    if t > 0.0 && t < (*hit).t && shape_contains(shape_of(triangle.flags), uv) {
        *hit = Hit(t, index, uv, instance);
    }
}

// The sign of the volume that a ray from the origin spans with the edge from a to b (its Plücker product). The same edge
// seen from the triangle on its other side gives exactly the negative value, however the arithmetic is contracted: a ray
// cannot pass between two triangles that share an edge.
fn edge_product(a: vec3f, b: vec3f, direction: vec3f) -> f32 {
    return dot(cross(a - b, a + b), direction);
}

fn largest_component(v: vec3f) -> f32 {
    return max(abs(v.x), max(abs(v.y), abs(v.z)));
}

// Edge tests by Plücker products (Davidovic et al. 2012, "3D rasterization: a bridge between rasterization and ray
// casting"), watertight along edges; rounding is let pass, so that they are at corners too, where many triangles meet. A
// triangle seen from its back is missed unless it is double-sided (glTF 2.0, 3.9.6).
fn intersect_triangle(index: u32, instance: u32, origin: vec3f, direction: vec3f, hit: ptr<function, Hit>) {
    let triangle = load_triangle(index);
    let e1 = triangle.p1 - triangle.p0;
    let e2 = triangle.p2 - triangle.p0;
    if scene_has_shapes && shape_of(triangle.flags) != SHAPE_TRIANGLE {
        intersect_shape(index, instance, triangle, origin, direction, hit);
        return;
    }
    let p0 = triangle.p0 - origin;
    let p1 = triangle.p1 - origin;
    let p2 = triangle.p2 - origin;
    let w0 = edge_product(p2, p1, direction);
    let w1 = edge_product(p0, p2, direction);
    let w2 = edge_product(p1, p0, direction);
    let sum = w0 + w1 + w2;
    // All of one sign, but for rounding (16 units of roundoff of the largest products); which sign says from which side
    // the ray comes.
    let edge = max(largest_component(e1), largest_component(e2));
    let rounding = 1e-6 * largest_component(direction) * edge * (largest_component(p0) + edge);
    let is_front = sum > 0.0 && min(w0, min(w1, w2)) >= -rounding;
    let is_back = sum < 0.0 && max(w0, max(w1, w2)) <= rounding && (triangle.flags & TRIANGLE_DOUBLE_SIDED) != 0u;
    if !is_front && !is_back {
        return;
    }
    let normal = cross(e1, e2);
    // In a sliver rounding may turn the normal's sign against the ray; the edge products know better.
    let speed = abs(dot(direction, normal));
    let t = dot(p0, normal) / select(speed, -speed, is_front);
    // Not `t >= hit.t`, which is false for the NaN of a ray within the plane.
    if !(t > 0.0 && t < (*hit).t) {
        return;
    }
    let u = clamp(w1 / sum, 0.0, 1.0);
    let uv = vec2f(u, clamp(w2 / sum, 0.0, 1.0 - u));
    if scene_has_alpha_masks && (triangle.flags & TRIANGLE_ALPHA_MASK) != 0u && !passes_alpha(index, uv) {
        return;
    }
    *hit = Hit(t, index, uv, instance);
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
