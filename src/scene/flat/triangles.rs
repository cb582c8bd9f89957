//! Meshes as triangles: what traversal reads and what shading reads, in the space of a bottom level.

use super::deformers::usable;
use crate::error::{Error, Result};
use crate::scene::gpu_types::{
    BITANGENT_SHIFT, NONE, SHAPE_SHIFT, TRIANGLE_ALPHA_MASK, TRIANGLE_DOUBLE_SIDED, TRIANGLE_TANGENTS, Triangle,
    TriangleAttributes,
};
use crate::scene::{AlphaMode, MAX_COORDINATE, Mesh, Scene, octahedral};
use glam::{Mat3, Mat4, Vec2, Vec3, Vec4};

/// Twice the area below which a triangle has none, in square metres: its square would be denormal.
const MIN_TWICE_AREA: f32 = 1e-18;

/// The triangles of one bottom level, in no order yet.
#[derive(Default)]
pub(super) struct Soup {
    pub triangles: Vec<Triangle>,
    pub attributes: Vec<TriangleAttributes>,
    /// Triangles left out because they have no area or are not finite.
    pub dropped: u64,
    /// Of a mesh that changes its shape: the three vertices of each triangle.
    pub corners: Vec<[u32; 3]>,
}

impl Soup {
    /// Adds a mesh through `transform`. The mesh must have been checked by [`check_all`].
    pub fn add(&mut self, scene: &Scene, mesh: &Mesh, transform: Mat4) {
        let flags = flags(scene, mesh);
        let placed = Placed::new(mesh, transform, flags, false);
        for corners in mesh.indices.as_chunks::<3>().0 {
            match placed.triangle(corners.map(|c| c as usize)) {
                Some((triangle, attributes)) => {
                    self.triangles.push(triangle);
                    self.attributes.push(attributes);
                }
                None => self.dropped += 1,
            }
        }
    }
}

impl Soup {
    /// A mesh that changes its shape, as it is. Triangles without area are kept, for they may gain some.
    pub fn of_deforming(scene: &Scene, mesh: &Mesh) -> Soup {
        let placed = Placed::new(mesh, Mat4::IDENTITY, flags(scene, mesh), true);
        let corners = mesh.indices.as_chunks::<3>().0;
        let each = corners.iter().filter_map(|corners| placed.triangle(corners.map(|c| c as usize)));
        let (triangles, attributes) = each.unzip();
        Soup { triangles, attributes, dropped: 0, corners: corners.to_vec() }
    }
}

/// `TRIANGLE_*` bits that a mesh's material asks for, and what its triangles stand for.
fn flags(scene: &Scene, mesh: &Mesh) -> u32 {
    scene.materials.get(mesh.material as usize).map_or(0, |material| {
        let masked = matches!(material.alpha, AlphaMode::Mask(_));
        u32::from(material.is_two_sided()) * TRIANGLE_DOUBLE_SIDED + u32::from(masked) * TRIANGLE_ALPHA_MASK
    }) | (mesh.shape as u32) << SHAPE_SHIFT
}

/// Checks every mesh.
pub(super) fn check_all(scene: &Scene) -> Result<()> {
    for (i, mesh) in scene.meshes.iter().enumerate() {
        check(mesh, scene.materials.len()).map_err(|what| Error::bad_value(format!("mesh {i}"), what))?;
    }
    Ok(())
}

/// Whether every index and attribute count of a mesh fits.
fn check(mesh: &Mesh, materials: usize) -> std::result::Result<(), String> {
    let positions = mesh.positions.len();
    let attributes = [
        ("normals", mesh.normals.len()),
        ("tangents", mesh.tangents.len()),
        ("texture coordinates 0", mesh.uvs[0].len()),
        ("texture coordinates 1", mesh.uvs[1].len()),
        ("colours", mesh.colors.len()),
    ];
    for (name, count) in attributes {
        if count != 0 && count != positions {
            return Err(format!("{count} {name} for {positions} positions"));
        }
    }
    if !mesh.indices.len().is_multiple_of(3) {
        return Err(format!("{} indices do not make whole triangles", mesh.indices.len()));
    }
    if let Some(index) = mesh.indices.iter().find(|&&index| index as usize >= positions) {
        return Err(format!("index {index} of {positions} positions"));
    }
    // Material 0 always exists once flattened: a scene without materials gets the default one.
    if mesh.material as usize >= materials.max(1) {
        return Err(format!("there is no material {}", mesh.material));
    }
    Ok(())
}

/// A mesh with everything that placing it needs.
struct Placed<'a> {
    mesh: &'a Mesh,
    transform: Mat4,
    flags: u32,
    linear: Mat3,
    /// Takes normals along: the cofactors, which exist for singular matrices too, with the determinant's sign.
    normal_matrix: Mat3,
    mirrored: bool,
    /// Whether triangles without area are kept.
    keeps_all: bool,
}

impl<'a> Placed<'a> {
    fn new(mesh: &'a Mesh, transform: Mat4, flags: u32, keeps_all: bool) -> Self {
        let linear = Mat3::from_mat4(transform);
        let (x, y, z) = (linear.x_axis, linear.y_axis, linear.z_axis);
        let mirrored = linear.determinant() < 0.0;
        let sign = if mirrored { -1.0 } else { 1.0 };
        let normal_matrix = Mat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * sign;
        Placed { mesh, transform, flags, linear, normal_matrix, mirrored, keeps_all }
    }

    /// The triangle through the transform, or none if it has no area or is not finite.
    fn triangle(&self, mut corners: [usize; 3]) -> Option<(Triangle, TriangleAttributes)> {
        if self.mirrored {
            corners.swap(1, 2);
        }
        let mut positions = corners.map(|c| self.transform.transform_point3(self.mesh.positions[c]));
        let face = match face_normal(positions) {
            Some(face) => face,
            None if self.keeps_all => Vec3::Y,
            None => return None,
        };
        if self.keeps_all {
            positions = positions.map(usable);
        }
        let [p0, p1, p2] = positions;
        let has_tangents = !self.mesh.tangents.is_empty();
        let normals = corners.map(|c| {
            let normal = self.mesh.normals.get(c).and_then(|n| (self.normal_matrix * *n).try_normalize());
            let pack = if has_tangents { octahedral::pack_off_equator } else { octahedral::pack };
            pack(normal.unwrap_or(face))
        });
        let mut flags = self.flags;
        let (mut angles, mut signs) = ([0u32; 3], 0);
        if has_tangents {
            flags |= TRIANGLE_TANGENTS;
            for (k, &corner) in corners.iter().enumerate() {
                let tangent = self.mesh.tangents[corner];
                let along = self.linear * tangent.truncate();
                angles[k] = u32::from(octahedral::tangent_angle(octahedral::unpack(normals[k]), along));
                // A mirror turns cross(normal, tangent) round against the mirrored bitangent.
                if (tangent.w < 0.0) != self.mirrored {
                    signs |= 1 << (BITANGENT_SHIFT + k as u32);
                }
            }
        }
        let uv = |set: usize, k: usize| finite_or_zero(self.mesh.uvs[set].get(corners[k]).copied().unwrap_or_default());
        let colors = corners.map(|c| self.mesh.colors.get(c).map_or(u32::MAX, |color| pack_color(*color)));
        let pair = |a: Vec2, b: Vec2| Vec4::new(a.x, a.y, b.x, b.y);
        let triangle = Triangle { p0, flags, p1, material: self.mesh.material, p2, light: NONE };
        let attributes = TriangleAttributes {
            uv_a: pair(uv(0, 0), uv(0, 1)),
            uv_b: pair(uv(0, 2), uv(1, 0)),
            uv_c: pair(uv(1, 1), uv(1, 2)),
            normals,
            tangents_01: angles[0] | angles[1] << 16,
            colors,
            tangent_2: angles[2] | signs,
        };
        Some((triangle, attributes))
    }
}

/// The unit normal of a triangle in world space, or none if it has no area or does not lie within the world.
pub(in crate::scene) fn face_normal([p0, p1, p2]: [Vec3; 3]) -> Option<Vec3> {
    let within = |p: Vec3| p.abs().max_element() <= MAX_COORDINATE && p.is_finite();
    let scaled = (p1 - p0).cross(p2 - p0);
    (within(p0) && within(p1) && within(p2) && scaled.length() >= MIN_TWICE_AREA).then(|| scaled.normalize())
}

fn finite_or_zero(uv: Vec2) -> Vec2 {
    if uv.is_finite() { uv } else { Vec2::ZERO }
}

/// RGBA8 unorm, red lowest. NaN becomes 0.
fn pack_color(color: Vec4) -> u32 {
    u32::from_le_bytes(color.to_array().map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8))
}
