//! Meshes of simple shapes for procedural scenes. Fronts point outwards; every mesh has normals and one UV set.

use super::Mesh;
use glam::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// A parallelogram of two triangles from its corner and two edges; the front is where `edge_u x edge_v` points.
pub fn parallelogram(corner: Vec3, edge_u: Vec3, edge_v: Vec3, material: u32) -> Mesh {
    let normal = edge_u.cross(edge_v).normalize_or(Vec3::Y);
    let uvs = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    Mesh {
        positions: uvs.map(|uv| corner + edge_u * uv.x + edge_v * uv.y).to_vec(),
        normals: vec![normal; 4],
        uvs: [uvs.to_vec(), Vec::new()],
        indices: vec![0, 1, 2, 0, 2, 3],
        material,
        ..Mesh::default()
    }
}

/// An axis-aligned box between two corners.
pub fn cuboid(min: Vec3, max: Vec3, material: u32) -> Mesh {
    let d = max - min;
    let (x, y, z) = (Vec3::X * d.x, Vec3::Y * d.y, Vec3::Z * d.z);
    let mut mesh = Mesh { material, ..Mesh::default() };
    for (corner, u, v) in [(min, z, y), (max, z, y), (min, x, z), (max, x, z), (min, y, x), (max, y, x)] {
        // Seen from the far corner the edges point back, which turns the face round.
        let face =
            if corner == max { parallelogram(max - u - v, v, u, material) } else { parallelogram(min, u, v, material) };
        append(&mut mesh, &face);
    }
    mesh
}

/// A sphere of `rings` x `2 * rings` patches, with the exact normals of the sphere.
pub fn sphere(center: Vec3, radius: f32, rings: u32, material: u32) -> Mesh {
    let segments = 2 * rings;
    let mut mesh = Mesh { material, ..Mesh::default() };
    for ring in 0..=rings {
        for segment in 0..=segments {
            let uv = Vec2::new(segment as f32 / segments as f32, ring as f32 / rings as f32);
            let (sin_theta, cos_theta) = (uv.y * PI).sin_cos();
            let (sin_phi, cos_phi) = (uv.x * TAU).sin_cos();
            let normal = Vec3::new(sin_theta * sin_phi, cos_theta, sin_theta * cos_phi);
            mesh.positions.push(center + normal * radius);
            mesh.normals.push(normal);
            mesh.uvs[0].push(uv);
        }
    }
    for ring in 0..rings {
        for segment in 0..segments {
            let a = ring * (segments + 1) + segment;
            let (right, below) = (a + 1, a + segments + 1);
            if ring > 0 {
                mesh.indices.extend([a, below, right]);
            }
            if ring + 1 < rings {
                mesh.indices.extend([right, below, below + 1]);
            }
        }
    }
    mesh
}

/// Adds the triangles of `other`, which must have the same attributes, to `mesh`.
pub fn append(mesh: &mut Mesh, other: &Mesh) {
    let base = mesh.positions.len() as u32;
    mesh.positions.extend(&other.positions);
    mesh.normals.extend(&other.normals);
    mesh.uvs[0].extend(&other.uvs[0]);
    mesh.colors.extend(&other.colors);
    mesh.indices.extend(other.indices.iter().map(|i| base + i));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Six times the volume enclosed, positive if the fronts point outwards; and that normals agree with the fronts.
    fn volume(mesh: &Mesh) -> f32 {
        let mut six_volumes = 0.0;
        for corners in mesh.indices.as_chunks::<3>().0 {
            let [a, b, c] = corners.map(|i| mesh.positions[i as usize]);
            let face = (b - a).cross(c - a);
            assert!(face.length() > 0.0);
            for i in corners {
                assert!(face.normalize().dot(mesh.normals[*i as usize]) > 0.9);
            }
            six_volumes += a.dot(b.cross(c));
        }
        six_volumes / 6.0
    }

    #[test]
    fn closed_shapes_point_outwards() {
        let (min, max) = (Vec3::new(-1.0, 0.0, 2.0), Vec3::new(0.0, 2.0, 5.0));
        assert!((volume(&cuboid(min, max, 0)) - 6.0).abs() < 1e-4);
        let sphere = sphere(Vec3::new(1.0, 2.0, 3.0), 2.0, 32, 0);
        assert!((volume(&sphere) / (4.0 / 3.0 * PI * 8.0) - 1.0).abs() < 0.01);
    }

    #[test]
    fn parallelogram_faces_its_cross_product() {
        let mesh = parallelogram(Vec3::ZERO, Vec3::Z, Vec3::X, 0);
        assert_eq!(mesh.normals[0], Vec3::Y);
        volume(&mesh);
    }
}
