//! Meshes that change their shape: what they are made of, and their triangles at a moment.

use super::FlatScene;
use crate::scene::gpu_types::{BITANGENT_SHIFT, TRIANGLE_TANGENTS, Triangle, TriangleAttributes};
use crate::scene::rig::deform::{Deformed, Displacement, Vertex, deform};
use crate::scene::rig::{Placement, Pose};
use crate::scene::{MAX_COORDINATE, octahedral};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// One instance whose mesh changes its shape: it has a bottom level of its own.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub struct Deformer {
    /// Index in [`Rig::instances`](crate::scene::Rig::instances).
    pub placement: u32,
    /// Index in [`FlatScene::meshes`].
    pub mesh: u32,
    /// Its first vertex in [`Deformers::vertices`].
    pub first_vertex: u32,
    /// Number of vertices.
    pub vertex_count: u32,
    /// Its first element in [`Deformers::displacements`]: target after target, one a vertex.
    pub first_displacement: u32,
    /// Its first element in [`Deformers::corners`], one a triangle of the mesh.
    pub first_corners: u32,
    /// 1 if normals are those of the triangles, and change with them.
    pub flat: u32,
}

/// All instances whose meshes change their shape.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Deformers {
    /// The instances.
    pub list: Vec<Deformer>,
    /// Vertices in their bind pose.
    pub vertices: Vec<Vertex>,
    /// What morph targets add.
    pub displacements: Vec<Displacement>,
    /// The three vertices of each triangle, counted from the deformer's first, in the order of the mesh's triangles.
    pub corners: Vec<[u32; 3]>,
}

impl Deformers {
    /// The vertices of a deformer in a pose, into `out`.
    pub fn deform(&self, scene: &FlatScene, deformer: &Deformer, pose: &Pose, out: &mut Vec<Deformed>) {
        let Some(placement) = scene.rig.instances.get(deformer.placement as usize) else { return };
        let vertices = run(&self.vertices, deformer.first_vertex, deformer.vertex_count);
        let displaced = deformer.vertex_count * placement.weight_count;
        let displacements = run(&self.displacements, deformer.first_displacement, displaced);
        let joints = pose.joint_matrices(&scene.rig, placement.skin);
        deform(vertices, displacements, pose.morph_weights(placement), &joints, out);
    }

    /// The triangles' vertices of a deformer whose mesh has `triangles`.
    pub fn corners_of(&self, deformer: &Deformer, triangles: u32) -> &[[u32; 3]] {
        run(&self.corners, deformer.first_corners, triangles)
    }

    /// Whether every index fits: of meshes (their numbers of triangles), placements and vertices.
    pub(super) fn check(&self, triangles: &[u32], placements: &[Placement]) -> Result<(), (String, String)> {
        for (i, deformer) in self.list.iter().enumerate() {
            let fault = |what: &str| Err((format!("deformers[{i}]"), what.to_owned()));
            let Some(placement) = placements.get(deformer.placement as usize) else {
                return fault("no such placement");
            };
            let Some(&count) = triangles.get(deformer.mesh as usize) else { return fault("no such mesh") };
            let displaced = deformer.vertex_count.checked_mul(placement.weight_count);
            let fits = run(&self.vertices, deformer.first_vertex, deformer.vertex_count).len()
                == deformer.vertex_count as usize
                && displaced
                    .is_some_and(|n| run(&self.displacements, deformer.first_displacement, n).len() == n as usize);
            let corners = self.corners_of(deformer, count);
            let inside = corners.iter().flatten().all(|&corner| corner < deformer.vertex_count);
            if !fits || corners.len() != count as usize || !inside {
                return fault("vertices, displacements or corners out of range");
            }
        }
        let finite = |v: &Vertex| {
            v.position.is_finite()
                && v.normal.is_finite()
                && v.tangent.iter().chain(&v.weights).all(|number| number.is_finite())
        };
        let displaced = |d: &Displacement| d.position.is_finite() && d.normal.is_finite() && d.tangent.is_finite();
        if !self.vertices.iter().all(finite) || !self.displacements.iter().all(displaced) {
            return Err(("deformers".into(), "numbers that are not finite".into()));
        }
        Ok(())
    }
}

/// `count` elements from `first`; fewer where there are not as many.
fn run<T>(list: &[T], first: u32, count: u32) -> &[T] {
    let rest = list.get(first as usize..).unwrap_or_default();
    &rest[..rest.len().min(count as usize)]
}

/// Writes the shape of `vertices` into triangles and their attributes; what does not change stays.
pub fn write_shape(
    vertices: &[Deformed],
    corners: &[[u32; 3]],
    flat: bool,
    triangles: &mut [Triangle],
    attributes: &mut [TriangleAttributes],
) {
    let has_tangents = triangles.first().is_some_and(|triangle| triangle.flags & TRIANGLE_TANGENTS != 0);
    let pack = if has_tangents { octahedral::pack_off_equator } else { octahedral::pack };
    let packed: Vec<(u32, u16)> = vertices
        .iter()
        .map(|vertex| {
            let normal = pack(vertex.normal);
            let tangent = vertex.tangent.truncate();
            let angle = if has_tangents { octahedral::tangent_angle(octahedral::unpack(normal), tangent) } else { 0 };
            (normal, angle)
        })
        .collect();
    for ((corners, triangle), attributes) in corners.iter().zip(triangles).zip(attributes) {
        let corners = corners.map(|corner| corner as usize);
        let [p0, p1, p2] = corners.map(|corner| usable(vertices.get(corner).map_or(Vec3::ZERO, |v| v.position)));
        (triangle.p0, triangle.p1, triangle.p2) = (p0, p1, p2);
        if flat {
            let face = (p1 - p0).cross(p2 - p0).try_normalize().unwrap_or(Vec3::Y);
            attributes.normals = [pack(face); 3];
            continue;
        }
        attributes.normals = corners.map(|corner| packed.get(corner).map_or(0, |packed| packed.0));
        if has_tangents {
            let angles = corners.map(|corner| packed.get(corner).map_or(0, |packed| u32::from(packed.1)));
            attributes.tangents_01 = angles[0] | angles[1] << 16;
            attributes.tangent_2 = angles[2];
            for (k, &corner) in corners.iter().enumerate() {
                if vertices.get(corner).is_some_and(|vertex| vertex.tangent.w < 0.0) {
                    attributes.tangent_2 |= 1 << (BITANGENT_SHIFT + k as u32);
                }
            }
        }
    }
}

/// A position that traversal can bear.
pub(super) fn usable(position: Vec3) -> Vec3 {
    let reach = Vec3::splat(MAX_COORDINATE);
    if position.is_nan() { Vec3::ZERO } else { position.clamp(-reach, reach) }
}
