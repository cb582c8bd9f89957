//! Ray queries on the CPU, through the binary tree: triangles are tested as in `shaders/scene/bvh.wgsl`, which tests compare
//! with it.

use super::gpu_types::{BvhNode, TRIANGLE_DOUBLE_SIDED, Triangle};
use super::{FlatScene, Shape, octahedral};
use glam::Vec3;

/// Where a ray met a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance in units of the direction's length.
    pub t: f32,
    /// Index of the triangle.
    pub triangle: u32,
    /// Barycentric weight of corner 1.
    pub u: f32,
    /// Barycentric weight of corner 2.
    pub v: f32,
    /// Index of the instance.
    pub instance: u32,
}

/// The closest hit with 0 < t < `t_max`, at rest. Backs of single-sided triangles are missed; alpha is not tested.
pub fn intersect_cpu(scene: &FlatScene, origin: Vec3, direction: Vec3, t_max: f32) -> Option<Hit> {
    let mut closest: Option<Hit> = None;
    let limit = |closest: &Option<Hit>| closest.map_or(t_max, |hit| hit.t);
    let bottom = |closest: &mut Option<Hit>, instance: u32| {
        let Some(placed) = scene.instances.get(instance as usize) else { return };
        let Some(mesh) = scene.meshes.get(placed.mesh as usize) else { return };
        let to_object = placed.transform.inverse();
        let (origin, direction) = (to_object.transform_point3(origin), to_object.transform_vector3(direction));
        walk(&scene.nodes, mesh.root, origin, direction, closest, limit, &mut |i, closest| {
            let triangle = scene.triangles.get(i as usize);
            let hit = triangle.and_then(|t| intersect_triangle(t, origin, direction, limit(closest)));
            if let Some((t, u, v)) = hit {
                *closest = Some(Hit { t, triangle: i, u, v, instance });
            }
        });
    };
    if scene.has_top_level() {
        walk(&scene.nodes, scene.root(), origin, direction, &mut closest, limit, &mut |i, closest| bottom(closest, i));
    } else {
        bottom(&mut closest, 0);
    }
    closest
}

/// Calls `leaf` for everything in the leaves below `root` whose boxes the ray meets.
fn walk(
    nodes: &[BvhNode],
    root: u32,
    origin: Vec3,
    direction: Vec3,
    closest: &mut Option<Hit>,
    limit: impl Fn(&Option<Hit>) -> f32,
    leaf: &mut dyn FnMut(u32, &mut Option<Hit>),
) {
    let safe = |d: f32| if d.abs() < 1e-20 { 1e-20 } else { d };
    let inverse = Vec3::from_array(direction.to_array().map(safe)).recip();
    let mut pending = vec![root];
    while let Some(node) = pending.pop().and_then(|i| nodes.get(i as usize)) {
        if !hits_box(node, origin, inverse, limit(closest)) {
            continue;
        }
        if node.count == 0 {
            pending.extend([node.first + 1, node.first]);
        }
        (node.first..node.first + node.count).for_each(|i| leaf(i, closest));
    }
}

/// Möller and Trumbore 1997, rounding let pass as in `shaders/scene/bvh.wgsl`: (t, u, v) if 0 < t < `t_max`.
pub fn intersect_triangle(triangle: &Triangle, origin: Vec3, direction: Vec3, t_max: f32) -> Option<(f32, f32, f32)> {
    if triangle.shape() != Shape::Triangles {
        return intersect_shape(triangle, origin, direction, t_max);
    }
    let (e1, e2) = (triangle.p1 - triangle.p0, triangle.p2 - triangle.p0);
    let s = origin - triangle.p0;
    let (p, q) = (direction.cross(e2), s.cross(e1));
    let determinant = e1.dot(p);
    let taxicab = |v: Vec3| v.abs().element_sum();
    let edges = taxicab(e1) + taxicab(e2);
    let rounding = 6e-8 * taxicab(direction) * edges * (taxicab(s) + edges);
    let side = determinant.signum();
    let (w1, w2, sum) = (side * s.dot(p), side * direction.dot(q), determinant.abs());
    let is_outside = w1.min(w2).min(sum - w1 - w2) < -rounding;
    let is_culled = side < 0.0 && triangle.flags & TRIANGLE_DOUBLE_SIDED == 0;
    let t = e2.dot(q) / determinant;
    let hits = !is_outside && !is_culled && sum > 0.0 && t > 0.0 && t < t_max;
    // Only then: `clamp` does not bear the NaN of a triangle without area.
    hits.then(|| {
        let u = (w1 / sum).clamp(0.0, 1.0);
        (t, u, (w2 / sum).clamp(0.0, 1.0 - u))
    })
}

/// A primitive that is no triangle: (t, u, v) as `intersect_shape` of `shaders/scene/bvh.wgsl`.
fn intersect_shape(triangle: &Triangle, origin: Vec3, direction: Vec3, t_max: f32) -> Option<(f32, f32, f32)> {
    let (e1, e2) = (triangle.p1 - triangle.p0, triangle.p2 - triangle.p0);
    let s = origin - triangle.p0;
    if triangle.shape() == Shape::Sphere {
        let t = enter_sphere(s, direction, e1.length()).filter(|t| *t > 0.0 && *t < t_max)?;
        let p = 0.5 * octahedral::encode((s + t * direction).normalize()) + 0.5;
        return Some((t, p.x, p.y));
    }
    let p = direction.cross(e2);
    let determinant = e1.dot(p);
    let culled = determinant < 0.0 && triangle.flags & TRIANGLE_DOUBLE_SIDED == 0;
    if determinant == 0.0 || culled {
        return None;
    }
    let q = s.cross(e1);
    let (u, v, t) = (s.dot(p) / determinant, direction.dot(q) / determinant, e2.dot(q) / determinant);
    let is_within = match triangle.shape() {
        Shape::Disk => u * u + v * v <= 1.0,
        _ => u >= 0.0 && v >= 0.0 && u <= 1.0 && v <= 1.0,
    };
    (is_within && t > 0.0 && t < t_max).then_some((t, u, v))
}

/// Where a ray enters a sphere from outside; see `shaders/lib/shapes.wgsl`.
fn enter_sphere(origin: Vec3, direction: Vec3, radius: f32) -> Option<f32> {
    let (a, b) = (direction.length_squared(), -origin.dot(direction));
    let nearest = origin + direction * (b / a);
    let discriminant = radius * radius - nearest.length_squared();
    let c = origin.length_squared() - radius * radius;
    (b > 0.0 && c > 0.0 && discriminant >= 0.0).then(|| c / (b + (a * discriminant).sqrt()))
}

/// Whether the ray meets the node's box within [0, t_max], two ulps wider so that rounding loses none (Ize 2013).
fn hits_box(node: &BvhNode, origin: Vec3, inverse: Vec3, t_max: f32) -> bool {
    let (a, b) = ((node.min - origin) * inverse, (node.max - origin) * inverse);
    let enter = a.min(b).max_element().max(0.0);
    let leave = a.max(b).min_element().min(t_max) * 1.000_000_4;
    enter <= leave
}
