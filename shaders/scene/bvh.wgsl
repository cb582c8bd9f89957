// Ray queries through the two-level BVH: a top level over instances, whose leaves lead into the bottom levels of their
// meshes. `traverse` is the only traversal loop; a kernel should call it from as few places as it can, for every call
// may be inlined.
#include "scene/data.wgsl"
#include "scene/texture.wgsl"
#include "lib/shapes.wgsl"

// The builders guarantee that no ray needs more (src/scene/bvh/wide.rs).
const BVH_STACK = 96u;

// What is left to do for a ray is a number: below LEAVE a node, above DONE a leaf.
const LEAVE = 0x7ffffffeu; // the bottom level is done: back to world space
const DONE = 0x7fffffffu;
const NO_CHILD = 3.4e38; // farther than anything

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
// Nodes that these rays have visited, where pixels are counted.
override counts_pixels: bool = false;
var<private> nodes_visited: u32 = 0u;

fn triangle_uvs(triangle: u32, uv: vec2f) -> vec4f {
    if !scene_has_textures {
        return vec4f(0.0);
    }
    let a = load_attributes(triangle);
    let w = 1.0 - uv.x - uv.y;
    return vec4f(w * a.uv_a.xy + uv.x * a.uv_a.zw + uv.y * a.uv_b.xy,
        w * a.uv_b.zw + uv.x * a.uv_c.xy + uv.y * a.uv_c.zw);
}

fn unpack_color(color: u32) -> vec4f {
    return unpack4x8unorm(color);
}

fn triangle_color(triangle: u32, uv: vec2f) -> vec4f {
    let colors = load_colors(triangle);
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

// Asked only where `scene_has_shapes`, in the same condition: so the code of spheres goes with them (src/gpu/specialize.rs).
fn is_sphere(flags: u32) -> bool {
    return shape_of(flags) == SHAPE_SPHERE;
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

// L1 norm: never less than the length, and absolute values are free in additions while maxima go at half rate on GPUs.
fn taxicab(v: vec3f) -> f32 {
    return abs(v.x) + abs(v.y) + abs(v.z);
}

// The test of Möller and Trumbore 1997, watertight by letting rounding pass: w1, w2 and what the sum leaves for the third
// corner are determinants, exact but for a few units of roundoff of the products they are made of. So of two triangles
// that share an edge, or of all that share a corner, one takes a ray between them. `rounding` is one unit of the products
// of L1 norms: no bound of the worst case, which is eight times that, but ten million rays have found no gap
// (docs/testing.md). A triangle seen from its back is missed unless it is double-sided (glTF 2.0, 3.9.6).
fn intersect_triangle(index: u32, instance: u32, origin: vec3f, direction: vec3f, hit: ptr<function, Hit>) {
    let triangle = load_triangle(index);
    if scene_has_shapes && shape_of(triangle.flags) != SHAPE_TRIANGLE {
        intersect_shape(index, instance, triangle, origin, direction, hit);
        return;
    }
    let e1 = triangle.p1 - triangle.p0;
    let e2 = triangle.p2 - triangle.p0;
    let s = origin - triangle.p0;
    let p = cross(direction, e2);
    let q = cross(s, e1);
    let determinant = dot(e1, p);
    let edges = taxicab(e1) + taxicab(e2);
    let rounding = 6e-8 * taxicab(direction) * edges * (taxicab(s) + edges);
    let side = select(1.0, -1.0, determinant < 0.0);
    let w1 = side * dot(s, p);
    let w2 = side * dot(direction, q);
    let sum = side * determinant;
    let is_outside = (w1 < -rounding) | (w2 < -rounding) | (sum - w1 - w2 < -rounding);
    let is_hidden = (side < 0.0) & ((triangle.flags & TRIANGLE_DOUBLE_SIDED) == 0u);
    // A software adapter goes on under a mask, which costs more than what is left.
    if !is_software && (is_outside || is_hidden || sum == 0.0) {
        return;
    }
    let t = dot(e2, q) / determinant;
    // `t` may be the NaN of a ray within the plane, for which no comparison holds.
    if is_outside | is_hidden | (sum == 0.0) | !((t > 0.0) & (t < (*hit).t)) {
        return;
    }
    let u = clamp(w1 / sum, 0.0, 1.0);
    let uv = vec2f(u, clamp(w2 / sum, 0.0, 1.0 - u));
    if scene_has_alpha_masks && (triangle.flags & TRIANGLE_ALPHA_MASK) != 0u && !passes_alpha(index, uv) {
        return;
    }
    *hit = Hit(t, index, uv, instance);
}

// 1 / direction, without infinities: 0 * inf would be NaN in the slab test.
fn safe_inverse(direction: vec3f) -> vec3f {
    return 1.0 / select(direction, vec3f(1e-20), abs(direction) < vec3f(1e-20));
}

// The four bytes of a word as numbers, in software over 255: a shift by a vector is done lane by lane there, and this is not.
// Its rounding takes a quarter of the margin that `bvh_visit` allows for all.
fn unpack_planes(word: u32) -> vec4f {
    if is_software {
        return unpack4x8unorm(word);
    }
    return vec4f(unpack4xU8(word));
}

// What the stack keeps of a child of the node `here >> 2`: which one it is, for it is read only when its turn comes. In software
// the child itself, read with the node: there a texel more costs less than the code that reads it later.
fn bvh_entry(here: u32, record: NodeRecord, child: u32) -> u32 {
    if is_software {
        return record.children[child];
    }
    return here | child;
}

fn bvh_child(entry: u32) -> u32 {
    if is_software {
        return entry;
    }
    return load_child(entry);
}

// The next thing to do.
fn bvh_pop(stack: ptr<function, array<u32, BVH_STACK>>, depth: ptr<function, u32>) -> u32 {
    if *depth == 0u {
        return DONE;
    }
    *depth -= 1u;
    let entry = (*stack)[*depth];
    if scene_has_instances && entry == LEAVE {
        return LEAVE;
    }
    return bvh_child(entry);
}

// Of numbers of which none is NaN: in a browser the built-in functions take care of those, lane by lane where there is no GPU.
fn larger(a: vec4f, b: vec4f) -> vec4f {
    if is_software {
        return select(a, b, a < b);
    }
    return max(a, b);
}

fn smaller(a: vec4f, b: vec4f) -> vec4f {
    if is_software {
        return select(a, b, b < a);
    }
    return min(a, b);
}

// Tests the boxes of a node's four children, stacks those that the ray meets within [0, t_max], the nearest last, and gives
// the nearest. Planes are moved apart by more than all rounding, that of `inverse` included, can move them: no box is lost.
fn bvh_visit(
    node: u32, origin: vec3f, inverse: vec3f, t_max: f32,
    stack: ptr<function, array<u32, BVH_STACK>>, depth: ptr<function, u32>
) -> u32 {
    if counts_pixels {
        nodes_visited += 1u;
    }
    let record = load_node(node);
    let grid = record.grid;
    let a = record.planes_0;
    let b = record.planes_1;
    let steps = vec3f(
        bitcast<f32>((grid.w & 0xffu) * 0x800000u), bitcast<f32>((grid.w & 0xff00u) * 0x8000u),
        bitcast<f32>((grid.w & 0xff0000u) * 0x80u)
    ) * inverse;
    let scaled = select(steps, 255.0 * steps, is_software); // by what `unpack_planes` gives
    let start = (bitcast<vec3f>(grid.xyz) - origin) * inverse;
    let margin = abs(start) * 6e-7 + abs(steps) * 2e-4;
    let near = start - margin;
    let far = start + margin;
    let back = inverse < vec3f(0.0);
    let enter_x = fma(unpack_planes(select(a.x, a.w, back.x)), vec4f(scaled.x), vec4f(near.x));
    let enter_y = fma(unpack_planes(select(a.y, b.x, back.y)), vec4f(scaled.y), vec4f(near.y));
    let enter_z = fma(unpack_planes(select(a.z, b.y, back.z)), vec4f(scaled.z), vec4f(near.z));
    let leave_x = fma(unpack_planes(select(a.w, a.x, back.x)), vec4f(scaled.x), vec4f(far.x));
    let leave_y = fma(unpack_planes(select(b.x, a.y, back.y)), vec4f(scaled.y), vec4f(far.y));
    let leave_z = fma(unpack_planes(select(b.y, a.z, back.z)), vec4f(scaled.z), vec4f(far.z));
    // Above 0, for the bits of positive numbers order as the numbers do.
    let enter = larger(larger(enter_x, enter_y), larger(enter_z, vec4f(1e-37)));
    let leave = smaller(smaller(leave_x, leave_y), smaller(leave_z, vec4f(t_max)));
    let keys = bitcast<vec4u>(select(vec4f(NO_CHILD), enter, enter <= leave));
    // Sorted with the number of the child in the lowest bits (a network of five comparisons).
    let k = (keys & vec4u(~3u)) | vec4u(0u, 1u, 2u, 3u);
    let low = min(k.xz, k.yw);
    let high = max(k.xz, k.yw);
    let inner = vec2u(max(low.x, low.y), min(high.x, high.y));
    let first = min(low.x, low.y);
    let second = min(inner.x, inner.y);
    let third = max(inner.x, inner.y);
    let fourth = max(high.x, high.y);
    let none = bitcast<u32>(NO_CHILD) & ~3u;
    if first >= none {
        return bvh_pop(stack, depth);
    }
    let here = node << 2u;
    if fourth < none {
        (*stack)[*depth] = bvh_entry(here, record, fourth & 3u);
        *depth += 1u;
    }
    if third < none {
        (*stack)[*depth] = bvh_entry(here, record, third & 3u);
        *depth += 1u;
    }
    if second < none {
        (*stack)[*depth] = bvh_entry(here, record, second & 3u);
        *depth += 1u;
    }
    return bvh_child(bvh_entry(here, record, first & 3u));
}

// A ray on its way through the tree.
struct Walk {
    world_origin: vec3f,
    next: u32, // what to do: a node, a leaf, LEAVE or DONE
    world_direction: vec3f,
    depth: u32, // entries of the stack
    // The ray in the space of the bottom level that is walked: that of `instance`, or of the world (NONE).
    origin: vec3f,
    instance: u32,
    direction: vec3f,
    inverse: vec3f,
    hit: Hit,
}

// `top_level` is the scene's root, that of this frame or of the previous one.
fn walk_start(top_level: u32, origin: vec3f, direction: vec3f, t_max: f32) -> Walk {
    rays_traced += 1u;
    let next = select(0u, top_level, scene_has_instances);
    let instance = select(0u, NONE, scene_has_instances);
    let hit = Hit(t_max, NONE, vec2f(0.0), 0u);
    return Walk(origin, next, direction, 0u, origin, instance, direction, safe_inverse(direction), hit);
}

// At most two nodes and then a leaf. Lanes that go different ways meet again after each turn, and a turn costs more than
// its nodes (docs/performance.md). In software one node: it is paid for by every turn, whether any lane wants it or not.
fn walk_turn(walk: ptr<function, Walk>, stack: ptr<function, array<u32, BVH_STACK>>, any_hit: bool) {
    var next = (*walk).next;
    var depth = (*walk).depth;
    var hit = (*walk).hit;
    if next < LEAVE {
        next = bvh_visit(next, (*walk).origin, (*walk).inverse, hit.t, stack, &depth);
    }
    if !is_software && next < LEAVE {
        next = bvh_visit(next, (*walk).origin, (*walk).inverse, hit.t, stack, &depth);
    }
    if next > DONE {
        let item = next & 0x0fffffffu;
        if scene_has_instances && (*walk).instance == NONE {
            (*walk).instance = item;
            (*walk).origin = instance_point(item, TO_OBJECT, (*walk).world_origin);
            (*walk).direction = instance_vector(item, TO_OBJECT, (*walk).world_direction);
            (*walk).inverse = safe_inverse((*walk).direction);
            (*stack)[depth] = LEAVE;
            depth += 1u;
            next = instance_texel(item, 6u).x;
        } else {
            let end = item + ((next >> 28u) & 7u) + 1u;
            for (var i = item; i < end; i += 1u) {
                intersect_triangle(i, (*walk).instance, (*walk).origin, (*walk).direction, &hit);
            }
            if any_hit && hit.triangle != NONE {
                next = DONE;
            } else {
                next = bvh_pop(stack, &depth);
            }
        }
    }
    if scene_has_instances && next == LEAVE {
        (*walk).instance = NONE;
        (*walk).origin = (*walk).world_origin;
        (*walk).direction = (*walk).world_direction;
        (*walk).inverse = safe_inverse((*walk).direction);
        next = bvh_pop(stack, &depth);
    }
    (*walk).next = next;
    (*walk).depth = depth;
    (*walk).hit = hit;
}

// The closest hit with 0 < t < t_max, or, with `any_hit`, whichever is found first. Distances are the same in the space
// of every mesh, for the ray's direction is not normalised on the way there.
fn traverse_from(top_level: u32, origin: vec3f, direction: vec3f, t_max: f32, any_hit: bool) -> Hit {
    var stack: array<u32, BVH_STACK>;
    var walk = walk_start(top_level, origin, direction, t_max);
    while walk.next != DONE {
        walk_turn(&walk, &stack, any_hit);
    }
    return walk.hit;
}

// The same in this frame's scene.
fn traverse(origin: vec3f, direction: vec3f, t_max: f32, any_hit: bool) -> Hit {
    return traverse_from(frame.top_level, origin, direction, t_max, any_hit);
}
