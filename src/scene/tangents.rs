//! Tangents for normal maps where a file has none: MikkTSpace, the space that normal maps are baked in.
//!
//! Source: M. Mikkelsen, "Simulation of Wrinkled Surfaces Revisited" (2008), as glTF 2.0, section 3.7.2.1, asks for.

use super::{Mesh, TextureRef};
use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{Vec2, Vec3};
use std::collections::HashMap;

/// Most triangles round one vertex for which MikkTSpace is run: its time grows with their square, its stack with them.
const MAX_VALENCE: u32 = 1024;
/// Most pairs of triangles that share a vertex, beyond 64 a corner.
const MAX_PAIRS: u64 = 100_000_000;

/// Gives `mesh` tangents for `texture`, whose UV set and UV transform they follow, and a vertex for each corner. A mesh
/// without that UV set is left as it is. Corners where the texture coordinates define no direction get an arbitrary
/// tangent; meshes with more than a thousand triangles round one vertex get tangents triangle by triangle.
pub fn generate(mesh: &mut Mesh, texture: &TextureRef) {
    let complete = |length: usize| length == mesh.positions.len();
    let Some(uvs) = mesh.uvs.get(texture.uv_set as usize).filter(|uvs| complete(uvs.len())) else { return };
    if !complete(mesh.normals.len()) {
        return;
    }
    let uvs: Vec<Vec2> = gather(uvs, &mesh.indices).iter().map(|uv| transform_uv(texture, *uv)).collect();
    give_corners_their_own_vertices(mesh);
    mesh.tangents = mesh.normals.iter().map(|normal| normal.any_orthonormal_vector().extend(1.0)).collect();
    // MikkTSpace searches all triangles for each that is degenerate; those are never seen.
    let faces = (0..mesh.positions.len() / 3).filter(|&face| {
        let p = |corner: usize| mesh.positions[3 * face + corner];
        p(0) != p(1) && p(1) != p(2) && p(2) != p(0)
    });
    let faces: Vec<usize> = faces.collect();
    let mut corners = Corners { mesh, uvs, faces };
    if !(corners.few_share_a_vertex() && generate_tangents(&mut corners).is_ok()) {
        corners.per_triangle();
    }
}

/// KHR_texture_transform: scale, then rotate counter-clockwise in the image (v points down), then shift.
fn transform_uv(texture: &TextureRef, uv: Vec2) -> Vec2 {
    let (sin, cos) = texture.rotation.sin_cos();
    let scaled = uv * texture.scale;
    Vec2::new(cos * scaled.x + sin * scaled.y, cos * scaled.y - sin * scaled.x) + texture.offset
}

/// `values` at `indices`; empty stays empty.
fn gather<T: Copy>(values: &[T], indices: &[u32]) -> Vec<T> {
    indices.iter().filter_map(|&index| values.get(index as usize).copied()).collect()
}

/// Splits every shared vertex.
fn give_corners_their_own_vertices(mesh: &mut Mesh) {
    mesh.positions = gather(&mesh.positions, &mesh.indices);
    mesh.normals = gather(&mesh.normals, &mesh.indices);
    mesh.colors = gather(&mesh.colors, &mesh.indices);
    for uvs in &mut mesh.uvs {
        *uvs = gather(uvs, &mesh.indices);
    }
    mesh.indices = (0..mesh.positions.len() as u32).collect();
}

/// A mesh with a vertex for each corner, its transformed texture coordinates, and the faces that are not degenerate.
struct Corners<'m> {
    mesh: &'m mut Mesh,
    uvs: Vec<Vec2>,
    faces: Vec<usize>,
}

impl Corners<'_> {
    /// The vertex of a corner of the n-th face that is not degenerate.
    fn vertex(&self, face: usize, corner: usize) -> usize {
        3 * self.faces[face] + corner
    }

    /// Whether MikkTSpace ends in reasonable time and depth.
    fn few_share_a_vertex(&self) -> bool {
        let corners = 3 * self.faces.len() as u64;
        let mut valences: HashMap<[u32; 8], u32> = HashMap::new();
        let mut pairs = 0u64;
        for face in 0..self.faces.len() {
            for corner in 0..3 {
                let (p, n) = (self.position(face, corner), self.normal(face, corner));
                let uv = self.tex_coord(face, corner);
                let key = [p[0], p[1], p[2], n[0], n[1], n[2], uv[0], uv[1]].map(f32::to_bits);
                let valence = valences.entry(key).or_insert(0);
                *valence += 1;
                // The n-th triangle makes 2 n - 1 more ordered pairs.
                pairs += 2 * u64::from(*valence) - 1;
                if *valence > MAX_VALENCE || pairs > MAX_PAIRS + 64 * corners {
                    return false;
                }
            }
        }
        true
    }

    /// Stores a tangent made orthogonal to the normal, if it has a direction.
    fn store(&mut self, vertex: usize, tangent: Vec3, sign: f32) {
        let normal = self.mesh.normals[vertex];
        if let Some(tangent) = tangent.reject_from_normalized(normal).try_normalize() {
            self.mesh.tangents[vertex] = tangent.extend(sign);
        }
    }

    /// The gradient of u on each triangle by itself.
    fn per_triangle(&mut self) {
        for face in 0..self.faces.len() {
            let v = [0, 1, 2].map(|corner| self.vertex(face, corner));
            let (p, uv) = (v.map(|vertex| self.mesh.positions[vertex]), v.map(|vertex| self.uvs[vertex]));
            let (e1, e2, d1, d2) = (p[1] - p[0], p[2] - p[0], uv[1] - uv[0], uv[2] - uv[0]);
            let area = d1.perp_dot(d2);
            let tangent = (e1 * d2.y - e2 * d1.y) * area.signum();
            for vertex in v {
                self.store(vertex, tangent, if area < 0.0 { 1.0 } else { -1.0 });
            }
        }
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.faces.len()
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.positions[self.vertex(face, corner)].to_array()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.normals[self.vertex(face, corner)].to_array()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        self.uvs[self.vertex(face, corner)].to_array()
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        if let Some(space) = space {
            let [x, y, z, sign] = space.tangent_encoded();
            // MikkTSpace's bitangent points along +v; a glTF normal map's green points up the image, along -v.
            self.store(self.vertex(face, corner), Vec3::new(x, y, z), -sign);
        }
    }
}
