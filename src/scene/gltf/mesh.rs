//! Primitives of meshes: attributes, indices, normals and tangents.

use super::accessor::{self, Elements, Shape};
use super::buffers::Buffers;
use super::container::Document;
use super::draco::Draco;
use super::material::UvSets;
use super::{MAX_GEOMETRY_BYTES, deformation, topology, variants};
use crate::error::Result;
use crate::scene::{Material, Mesh, Scene, TextureRef, tangents};
use glam::{Vec2, Vec3, Vec4};
use gltf::json;
use json::mesh::{Primitive, Semantic};
use json::validation::Checked;
use std::collections::HashMap;

/// How much geometry a file has used of what it may.
#[derive(Default)]
pub(super) struct Budget {
    bytes: u64,
}

impl Budget {
    /// Counts `bytes` before they are allocated.
    pub fn charge(&mut self, document: &Document, bytes: u64) -> Result<()> {
        self.bytes = self.bytes.saturating_add(bytes);
        document.within("its geometry", self.bytes, MAX_GEOMETRY_BYTES, "bytes")
    }

    /// Bytes that may still be charged.
    pub fn left(&self) -> u64 {
        MAX_GEOMETRY_BYTES.saturating_sub(self.bytes)
    }
}

/// Loads glTF mesh `index` into `scene`: one mesh a primitive that has triangles. Returns their indices.
pub(super) fn load(
    document: &Document,
    buffers: &Buffers,
    uv_sets: &[UvSets],
    budget: &mut Budget,
    index: usize,
    scene: &mut Scene,
) -> Result<Vec<u32>> {
    let mesh = document.at(&document.root.meshes, index, "meshes", "meshes")?;
    let mut loaded = Vec::new();
    for (position, source) in mesh.primitives.iter().enumerate() {
        let place = format!("meshes[{index}].primitives[{position}]");
        let material = material_index(document, source, &place, scene)?;
        let tangents_for = tangents_for(scene.materials.get(material as usize));
        let uv_sets = uv_sets.get(material as usize).copied().unwrap_or_default();
        let draco = Draco::load(document, buffers, budget, source, &place)?;
        let reader = Reader { document, buffers, source, place: &place, tangents_for, uv_sets, draco };
        if let Some(mesh) = reader.read(budget, &mut scene.warnings)? {
            warn_of_missing_uvs(&mesh, scene.materials.get(material as usize), uv_sets, &place, &mut scene.warnings);
            loaded.push(scene.meshes.len() as u32);
            scene.meshes.push(Mesh { material, ..mesh });
        }
    }
    Ok(loaded)
}

/// The primitive's material; the specification's default one is appended where it is needed.
fn material_index(document: &Document, source: &Primitive, place: &str, scene: &mut Scene) -> Result<u32> {
    let materials = &document.root.materials;
    if let Some(material) = variants::material(document, source, place)? {
        return Ok(material as u32);
    }
    if let Some(material) = source.material {
        document.at(materials, material.value(), "materials", &format!("{place}.material"))?;
        return Ok(material.value() as u32);
    }
    if scene.materials.len() == materials.len() {
        scene.materials.push(Material { name: "default".into(), ..Material::default() });
    }
    Ok(materials.len() as u32)
}

/// Says which textures will be read at (0, 0).
fn warn_of_missing_uvs(
    mesh: &Mesh,
    material: Option<&Material>,
    uv_sets: UvSets,
    place: &str,
    warnings: &mut Vec<String>,
) {
    let Some(m) = material else { return };
    for (set, uvs) in mesh.uvs.iter().enumerate() {
        if uvs.is_empty() && m.textures().any(|texture| texture.uv_set as usize == set) {
            let source = uv_sets.source(set as u32);
            warnings.push(format!("{place}: its material reads TEXCOORD_{source}, which it lacks: (0, 0) is used"));
        }
    }
}

/// The texture whose space a mesh's tangents follow, if the material looks at tangents at all: its own, or that of UV set
/// 0 for an anisotropy without textures.
fn tangents_for(material: Option<&Material>) -> Option<TextureRef> {
    let material = material?;
    let plain = TextureRef { texture: 0, uv_set: 0, offset: Vec2::ZERO, rotation: 0.0, scale: Vec2::ONE };
    material.tangent_texture().or((material.anisotropy.strength > 0.0).then_some(plain))
}

/// One primitive and what it takes to read it.
pub(super) struct Reader<'a> {
    document: &'a Document<'a>,
    buffers: &'a Buffers<'a>,
    source: &'a Primitive,
    place: &'a str,
    /// What tangents would be for.
    tangents_for: Option<TextureRef>,
    /// Those that the material reads.
    uv_sets: UvSets,
    /// What stands in for the accessors of a compressed primitive.
    draco: Option<Draco>,
}

impl Reader<'_> {
    /// The primitive's triangles, or none (with a warning) if it has none. Only vertices that triangles use are read.
    fn read(&self, budget: &mut Budget, warnings: &mut Vec<String>) -> Result<Option<Mesh>> {
        let Some(positions) = self.attribute(budget, Semantic::Positions, &accessor::POSITION, None)? else {
            warnings.push(format!("{}: it has no POSITION and is left out", self.place));
            return Ok(None);
        };
        let count = Some(positions.count);
        let normals = self.attribute(budget, Semantic::Normals, &accessor::NORMAL, count)?;
        let tangents = self.attribute(budget, Semantic::Tangents, &accessor::TANGENT, count)?;
        let uvs = [
            self.attribute(budget, Semantic::TexCoords(self.uv_sets.source(0)), &accessor::TEXCOORD, count)?,
            self.attribute(budget, Semantic::TexCoords(self.uv_sets.source(1)), &accessor::TEXCOORD, count)?,
        ];
        let colors = self.attribute(budget, Semantic::Colors(0), &accessor::COLOR, count)?;

        let Some(corners) = self.triangles(budget, positions.count, warnings)? else { return Ok(None) };
        // Flat normals need a vertex for each corner (specification, section 3.7.2.1), as generated tangents may.
        let made_tangents = self.tangents_for.is_some() && (tangents.is_none() || normals.is_none());
        let vertices =
            if normals.is_none() || made_tangents { corners.len() } else { corners.len().min(positions.count) };
        budget.charge(self.document, vertices as u64 * VERTEX_BYTES)?;
        let (sources, indices) =
            if normals.is_none() { each_corner(corners) } else { used_vertices(corners, positions.count) };

        let mut repaired = 0;
        let mut mesh = Mesh {
            positions: self.positions(&positions, &sources)?,
            uvs: uvs
                .map(|set| set.map_or(Vec::new(), |set| finite_or(&set, &sources, [0.0; 2], &mut repaired)))
                .map(|set| set.into_iter().map(Vec2::from).collect()),
            colors: colors.map_or(Vec::new(), |colors| {
                finite_or(&colors, &sources, [1.0; 4], &mut repaired).into_iter().map(Vec4::from).collect()
            }),
            indices,
            ..Mesh::default()
        };
        mesh.normals = match &normals {
            Some(normals) => given_normals(&mesh, normals, &sources, &mut repaired),
            None => flat_normals(&mesh),
        };
        let deformation = deformation::Reader {
            primitive: self,
            document: self.document,
            buffers: self.buffers,
            source: self.source,
            place: self.place,
            count: positions.count,
        };
        mesh.deformation = deformation.read(budget, &sources, warnings)?;
        mesh.deformation.flat = normals.is_none();
        if repaired > 0 {
            warnings.push(format!("{}: {repaired} attribute(s) were not usable numbers and were replaced", self.place));
        }
        if let Some(texture) = self.tangents_for {
            let given = tangents.filter(|_| normals.is_some()).and_then(|given| given_tangents(&given, &sources));
            match given {
                Some(given) => mesh.tangents = given,
                None => tangents::generate(&mut mesh, &texture),
            }
        }
        Ok(Some(mesh))
    }

    /// An attribute, if the primitive has it; it must have `count` elements where that is given.
    pub(super) fn attribute(
        &self,
        budget: &mut Budget,
        semantic: Semantic,
        shape: &Shape,
        count: Option<usize>,
    ) -> Result<Option<Elements<'_>>> {
        let place = format!("{}.attributes.{}", self.place, semantic.to_string());
        let draco = self.draco.as_ref().and_then(|draco| draco.attribute(&semantic.to_string()));
        let Some(index) = self.source.attributes.get(&Checked::Valid(semantic)) else { return Ok(None) };
        if let Some(attribute) = draco {
            let accessor = self.document.at(&self.document.root.accessors, index.value(), "accessors", &place)?;
            let kind = attribute.kind(self.document, &place)?;
            return Elements::packed(self.document, accessor, kind, attribute.values(), shape, &place).map(Some);
        }
        let elements = Elements::open(self.document, self.buffers, budget, index.value(), shape, &place)?;
        match count {
            Some(count) if count != elements.count => {
                let what = format!("it has {} elements, but POSITION has {count}", elements.count);
                Err(self.document.bad(format!("{place} = accessors[{}]", index.value()), what))
            }
            _ => Ok(Some(elements)),
        }
    }

    /// Vertex indices, three a triangle, all below `vertices`; none (with a warning) where there are no triangles.
    fn triangles(&self, budget: &mut Budget, vertices: usize, warnings: &mut Vec<String>) -> Result<Option<Vec<u32>>> {
        let mode = self.document.valid(&self.source.mode, &format!("{}.mode", self.place))?;
        let place = format!("{}.indices", self.place);
        if let Some(draco) = &self.draco {
            // Always a list, whatever the mode says. Below the number of its own vertices, but positions may not be among them.
            if draco.indices().iter().any(|&index| index as usize >= vertices) {
                return Err(self.document.bad(place, format!("Draco has more vertices than the {vertices} positions")));
            }
            return Ok(Some(draco.indices().to_vec()).filter(|indices| !indices.is_empty()));
        }
        let indices = match self.source.indices {
            Some(index) => {
                Some(Elements::open(self.document, self.buffers, budget, index.value(), &accessor::INDEX, &place)?)
            }
            None => None,
        };
        let count = indices.as_ref().map_or(vertices, |indices| indices.count);
        // A strip or fan may become three times as many corners.
        budget.charge(self.document, count as u64 * 16)?;
        let corners: Vec<u32> = match indices {
            Some(indices) => (0..count).map(|i| indices.index(i)).collect(),
            None => (0..count as u32).collect(),
        };
        if let Some((i, index)) = corners.iter().enumerate().find(|(_, index)| **index as usize >= vertices) {
            let what = format!("element {i} is {index}, but there are {vertices} vertices");
            return Err(self.document.bad(place, what));
        }
        let Some(triangles) = topology::triangles(mode, corners) else {
            warnings.push(format!("{}: points and lines are left out", self.place));
            return Ok(None);
        };
        if triangles.is_empty() {
            warnings.push(format!("{}: it has no triangles", self.place));
            return Ok(None);
        }
        Ok(Some(triangles))
    }

    /// Positions, all finite.
    fn positions(&self, positions: &Elements, sources: &[u32]) -> Result<Vec<Vec3>> {
        let read = |&source: &u32| {
            let position = Vec3::from(positions.vector::<3>(source as usize, 0.0));
            if position.is_finite() {
                return Ok(position);
            }
            let accessor = self.source.attributes.get(&Checked::Valid(Semantic::Positions));
            let accessor = accessor.map_or(0, |index| index.value());
            let place = format!("{}.attributes.POSITION = accessors[{accessor}]", self.place);
            Err(self.document.bad(place, format!("vertex {source} is not finite: {position}")))
        };
        sources.iter().map(read).collect()
    }
}

/// Upper bound for what one vertex takes in a [`Mesh`].
const VERTEX_BYTES: u64 = 12 + 12 + 16 + 2 * 8 + 16;

/// A vertex for each corner: the vertices to read, and the new indices.
fn each_corner(corners: Vec<u32>) -> (Vec<u32>, Vec<u32>) {
    let indices = (0..corners.len() as u32).collect();
    (corners, indices)
}

/// The vertices that corners use and the corners renumbered: primitives often share one large vertex buffer.
fn used_vertices(corners: Vec<u32>, count: usize) -> (Vec<u32>, Vec<u32>) {
    if corners.len() >= count {
        return ((0..count as u32).collect(), corners);
    }
    let mut sources = Vec::new();
    let mut renumbered = HashMap::new();
    let indices = corners
        .into_iter()
        .map(|corner| {
            *renumbered.entry(corner).or_insert_with(|| {
                sources.push(corner);
                sources.len() as u32 - 1
            })
        })
        .collect();
    (sources, indices)
}

/// Elements with `replacement` for each that is not finite, which `repaired` counts.
fn finite_or<const N: usize>(
    elements: &Elements,
    sources: &[u32],
    replacement: [f32; N],
    repaired: &mut u64,
) -> Vec<[f32; N]> {
    let read = |&source: &u32| {
        // A colour without alpha is opaque.
        let value = elements.vector::<N>(source as usize, 1.0);
        if value.iter().all(|component| component.is_finite()) {
            return value;
        }
        *repaired += 1;
        replacement
    };
    sources.iter().map(read).collect()
}

/// Unit normal of a triangle by its winding; +Z where it has no area. In f64, for edges may be tiny or huge.
fn face_normal(positions: &[Vec3], triangle: &[u32]) -> Vec3 {
    let corner = |i: usize| triangle.get(i).and_then(|&index| positions.get(index as usize)).copied();
    let (Some(a), Some(b), Some(c)) = (corner(0), corner(1), corner(2)) else { return Vec3::Z };
    let (a, b, c) = (a.as_dvec3(), b.as_dvec3(), c.as_dvec3());
    (b - a).cross(c - a).try_normalize().map_or(Vec3::Z, |normal| normal.as_vec3())
}

/// The normals of triangles that share no vertices.
fn flat_normals(mesh: &Mesh) -> Vec<Vec3> {
    mesh.indices.chunks_exact(3).flat_map(|triangle| [face_normal(&mesh.positions, triangle); 3]).collect()
}

/// Normals from the file, made unit; one without direction becomes that of a triangle at it.
fn given_normals(mesh: &Mesh, normals: &Elements, sources: &[u32], repaired: &mut u64) -> Vec<Vec3> {
    let read = |&source: &u32| Vec3::from(normals.vector::<3>(source as usize, 0.0)).try_normalize();
    let mut normals: Vec<Option<Vec3>> = sources.iter().map(read).collect();
    if normals.iter().any(Option::is_none) {
        for triangle in mesh.indices.chunks_exact(3) {
            for &index in triangle {
                if let Some(normal @ None) = normals.get_mut(index as usize) {
                    *normal = Some(face_normal(&mesh.positions, triangle));
                    *repaired += 1;
                }
            }
        }
    }
    // A vertex without a triangle is never seen.
    normals.into_iter().map(|normal| normal.unwrap_or(Vec3::Z)).collect()
}

/// Tangents from the file, made unit, or none if one has no direction.
fn given_tangents(tangents: &Elements, sources: &[u32]) -> Option<Vec<Vec4>> {
    let read = |&source: &u32| {
        let tangent = Vec4::from(tangents.vector::<4>(source as usize, 0.0));
        let sign = if tangent.w < 0.0 { -1.0 } else { 1.0 };
        Some(tangent.truncate().try_normalize()?.extend(sign))
    };
    sources.iter().map(read).collect()
}
