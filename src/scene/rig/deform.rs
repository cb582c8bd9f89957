//! Skinning and morphing on the CPU.
//!
//! Source: glTF 2.0, sections 3.7.2.2 (morph targets) and 3.7.3.3 (linear blend skinning).

use bytemuck::{Pod, Zeroable};
use glam::{Mat3, Mat4, Vec3, Vec4};

/// A vertex of a mesh that changes its shape, as it is in the bind pose: 64 bytes.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Vertex {
    /// Object-space position.
    pub position: Vec3,
    /// Object-space unit normal.
    pub normal: Vec3,
    /// Tangent (xyz unit, w the bitangent's sign), or zero.
    pub tangent: [f32; 4],
    /// Joints that move it.
    pub joints: [u16; 4],
    /// How much each does; they sum to 1, or are all 0 in a mesh without a skin.
    pub weights: [f32; 4],
}

/// What one morph target adds to one vertex at weight 1: 36 bytes.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
pub struct Displacement {
    /// To the position.
    pub position: Vec3,
    /// To the normal.
    pub normal: Vec3,
    /// To the tangent's direction.
    pub tangent: Vec3,
}

/// A vertex as it is at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deformed {
    /// World space where the mesh has a skin, object space where it has none.
    pub position: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Unit tangent, and the bitangent's sign.
    pub tangent: Vec4,
}

/// The vertices under `weights` of the morph targets and the matrices of the joints, into `out`, which is emptied first.
/// `displacements` hold one element a vertex, target after target. Without `joints` there is no skin.
pub fn deform(
    vertices: &[Vertex],
    displacements: &[Displacement],
    weights: &[f32],
    joints: &[Mat4],
    out: &mut Vec<Deformed>,
) {
    out.clear();
    out.reserve(vertices.len());
    // A target whose weight is 0 costs nothing: faces have fifty, and few are ever in use.
    let targets: Vec<(f32, &[Displacement])> = weights
        .iter()
        .zip(displacements.chunks_exact(vertices.len().max(1)))
        .filter(|(weight, _)| **weight != 0.0)
        .map(|(weight, target)| (*weight, target))
        .collect();
    for (i, vertex) in vertices.iter().enumerate() {
        let mut position = vertex.position;
        let mut normal = vertex.normal;
        let mut tangent = Vec3::from_slice(&vertex.tangent);
        for (weight, target) in &targets {
            if let Some(displacement) = target.get(i) {
                position += displacement.position * *weight;
                normal += displacement.normal * *weight;
                tangent += displacement.tangent * *weight;
            }
        }
        let mut sign = vertex.tangent[3];
        if !joints.is_empty() {
            let blended = blend(vertex, joints);
            position = blended.transform_point3(position);
            let linear = Mat3::from_mat4(blended);
            tangent = linear * tangent;
            let (x, y, z) = (linear.x_axis, linear.y_axis, linear.z_axis);
            // The cofactors, which exist for singular matrices too, with the determinant's sign.
            let cofactors = Mat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
            let mirror = if x.dot(cofactors.x_axis) < 0.0 { -1.0 } else { 1.0 };
            normal = cofactors * normal * mirror;
            sign *= mirror;
        }
        let normal = normal.try_normalize().unwrap_or(vertex.normal);
        out.push(Deformed { position, normal, tangent: tangent.normalize_or_zero().extend(sign) });
    }
}

/// Whether joints turn a mesh inside out, so that the winding of its triangles has to be turned round. All joints of a skin
/// are taken to agree.
pub fn is_mirrored(joints: &[Mat4]) -> bool {
    joints.first().is_some_and(|joint| joint.determinant() < 0.0)
}

/// The weighted sum of a vertex's joint matrices.
fn blend(vertex: &Vertex, joints: &[Mat4]) -> Mat4 {
    let mut sum = [Vec4::ZERO; 4];
    for (&joint, &weight) in vertex.joints.iter().zip(&vertex.weights) {
        if weight != 0.0
            && let Some(matrix) = joints.get(usize::from(joint))
        {
            for (sum, column) in sum.iter_mut().zip([matrix.x_axis, matrix.y_axis, matrix.z_axis, matrix.w_axis]) {
                *sum += column * weight;
            }
        }
    }
    Mat4::from_cols(sum[0], sum[1], sum[2], sum[3])
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::FRAC_PI_2;

    fn vertex(position: Vec3, joints: [u16; 4], weights: [f32; 4]) -> Vertex {
        Vertex { position, normal: Vec3::X, tangent: [0.0, 1.0, 0.0, 1.0], joints, weights }
    }

    fn one(vertex: Vertex, displacements: &[Displacement], weights: &[f32], joints: &[Mat4]) -> Deformed {
        let mut out = Vec::new();
        deform(&[vertex], displacements, weights, joints, &mut out);
        out[0]
    }

    #[test]
    fn joints_pull_by_their_weights() {
        let joints = [Mat4::from_translation(Vec3::X), Mat4::from_rotation_z(FRAC_PI_2)];
        let whole = one(vertex(Vec3::Y, [1, 0, 0, 0], [1.0, 0.0, 0.0, 0.0]), &[], &[], &joints);
        assert!((whole.position - Vec3::NEG_X).length() < 1e-6);
        assert!(
            (whole.normal - Vec3::Y).length() < 1e-6
                && (whole.tangent - Vec4::new(-1.0, 0.0, 0.0, 1.0)).length() < 1e-6
        );
        let half = one(vertex(Vec3::Y, [0, 1, 0, 0], [0.5, 0.5, 0.0, 0.0]), &[], &[], &joints);
        assert!((half.position - Vec3::new(0.0, 0.5, 0.0)).length() < 1e-6, "the middle of (1, 1) and (-1, 0)");
    }

    #[test]
    fn scaled_joints_keep_normals_upright() {
        // A plane x + y = 0 squeezed along x: normals go with the inverse transpose.
        let normal = Vec3::new(1.0, 1.0, 0.0).normalize();
        let flat = Vertex { normal, ..vertex(Vec3::ZERO, [0; 4], [1.0, 0.0, 0.0, 0.0]) };
        let squeezed = one(flat, &[], &[], &[Mat4::from_scale(Vec3::new(0.5, 1.0, 1.0))]);
        assert!((squeezed.normal - Vec3::new(2.0, 1.0, 0.0).normalize()).length() < 1e-6);
        let mirrored = one(flat, &[], &[], &[Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0))]);
        assert!((mirrored.normal - Vec3::new(-1.0, 1.0, 0.0).normalize()).length() < 1e-6);
        assert_eq!(mirrored.tangent.w, -1.0);
    }

    #[test]
    fn targets_add_before_the_skin() {
        let lift = Displacement { position: Vec3::Y, normal: Vec3::Z, tangent: Vec3::ZERO };
        let push = Displacement { position: Vec3::X, ..Displacement::default() };
        let quarter = [Mat4::from_rotation_z(FRAC_PI_2)];
        let rest = vertex(Vec3::ZERO, [0; 4], [1.0, 0.0, 0.0, 0.0]);
        let both = one(rest, &[lift, push], &[0.5, 2.0], &quarter);
        assert!((both.position - Vec3::new(-0.5, 2.0, 0.0)).length() < 1e-6);
        assert!((both.normal - Vec3::new(0.0, 1.0, 0.5).normalize()).length() < 1e-6);
        assert_eq!(one(rest, &[lift, push], &[0.5, 2.0], &[]).position, Vec3::new(2.0, 0.5, 0.0), "no skin");
    }
}
