//! Ray queries on the CPU: the same arithmetic as `shaders/scene/bvh.wgsl`, which tests compare with it.

use super::FlatScene;
use super::gpu_types::{BvhNode, TRIANGLE_DOUBLE_SIDED, Triangle};
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
}

/// The closest hit with 0 < t < `t_max`. Backs of single-sided triangles are missed; alpha is not tested.
pub fn intersect_cpu(scene: &FlatScene, origin: Vec3, direction: Vec3, t_max: f32) -> Option<Hit> {
    let safe = |d: f32| if d.abs() < 1e-20 { 1e-20 } else { d };
    let inverse = Vec3::from_array(direction.to_array().map(safe)).recip();
    let mut limit = t_max;
    let mut closest = None;
    let mut pending = vec![0u32];
    while let Some(node) = pending.pop().and_then(|i| scene.nodes.get(i as usize)) {
        if !hits_box(node, origin, inverse, limit) {
            continue;
        }
        if node.count == 0 {
            pending.extend([node.first + 1, node.first]);
        }
        for i in node.first..node.first + node.count {
            let hit = scene.triangles.get(i as usize).and_then(|t| intersect_triangle(t, origin, direction, limit));
            if let Some((t, u, v)) = hit {
                limit = t;
                closest = Some(Hit { t, triangle: i, u, v });
            }
        }
    }
    closest
}

/// Möller and Trumbore 1997: (t, u, v) if 0 < t < `t_max`.
pub fn intersect_triangle(triangle: &Triangle, origin: Vec3, direction: Vec3, t_max: f32) -> Option<(f32, f32, f32)> {
    let (e1, e2) = (triangle.p1 - triangle.p0, triangle.p2 - triangle.p0);
    let p = direction.cross(e2);
    let determinant = e1.dot(p);
    let culled = determinant < 0.0 && triangle.flags & TRIANGLE_DOUBLE_SIDED == 0;
    if determinant == 0.0 || culled {
        return None;
    }
    let inverse = 1.0 / determinant;
    let s = origin - triangle.p0;
    let u = s.dot(p) * inverse;
    let q = s.cross(e1);
    let v = direction.dot(q) * inverse;
    let t = e2.dot(q) * inverse;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && t < t_max).then_some((t, u, v))
}

/// Whether the ray meets the node's box within [0, t_max], two ulps wider so that rounding loses none (Ize 2013).
fn hits_box(node: &BvhNode, origin: Vec3, inverse: Vec3, t_max: f32) -> bool {
    let (a, b) = ((node.min - origin) * inverse, (node.max - origin) * inverse);
    let enter = a.min(b).max_element().max(0.0);
    let leave = a.max(b).min_element().min(t_max) * 1.000_000_4;
    enter <= leave
}
