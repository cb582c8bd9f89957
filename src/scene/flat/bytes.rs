//! A flat scene as one run of bytes and back: how a Worker hands it to the page.
//!
//! `RSTR`, version, length of the header (u32 each), 0; the header as JSON; then the arrays in the order of [`Sections`],
//! each beginning at a multiple of 16. Little-endian throughout.

use super::{Atlas, Deformers, FlatEnvironment, FlatScene, SceneStats, validate};
use crate::error::{Error, Result};
use crate::scene::rig::bytes as rig_bytes;
use crate::scene::{Camera, Projection, Rig};
use bytemuck::Pod;
use glam::Vec3;
use serde::{Deserialize, Serialize};

const _: () = assert!(cfg!(target_endian = "little"), "arrays are copied as they lie in memory");

const MAGIC: [u8; 4] = *b"RSTR";
const VERSION: u32 = 3;
const PREFIX: usize = 16;
const ALIGNMENT: usize = 16;

/// Everything that is not a large array.
#[derive(Serialize, Deserialize)]
struct Header {
    name: String,
    first_punctual: u32,
    rig: rig_bytes::Header,
    cameras: Vec<CameraRecord>,
    bounds: [[f32; 3]; 2],
    stats: SceneStats,
    warnings: Vec<String>,
    atlas_size: u32,
    atlas_layers: u32,
    environment: Option<[u32; 2]>,
    sections: Sections,
}

/// Elements of each array.
#[derive(Serialize, Deserialize)]
struct Sections {
    nodes: usize,
    triangles: usize,
    attributes: usize,
    meshes: usize,
    instances: usize,
    materials: usize,
    lights: usize,
    atlas_texels: usize,
    environment_texels: usize,
    deformers: usize,
    deformer_vertices: usize,
    displacements: usize,
    corners: usize,
}

#[derive(Serialize, Deserialize)]
struct CameraRecord {
    name: String,
    position: [f32; 3],
    forward: [f32; 3],
    up: [f32; 3],
    orthographic: bool,
    /// Vertical field of view, or half height.
    extent: f32,
}

impl FlatScene {
    /// The scene as bytes that [`FlatScene::from_bytes`] reads.
    pub fn to_bytes(&self) -> Vec<u8> {
        // A header of strings and finite numbers always has a JSON form.
        let header = serde_json::to_vec(&header_of(self)).unwrap_or_default();
        let mut out = Vec::with_capacity(self.gpu_bytes() as usize + header.len() + 1024);
        out.extend(MAGIC);
        out.extend(VERSION.to_le_bytes());
        out.extend((header.len() as u32).to_le_bytes());
        out.extend([0; 4]);
        out.extend(header);
        let mut section = |bytes: &[u8]| {
            out.resize(out.len().next_multiple_of(ALIGNMENT), 0);
            out.extend_from_slice(bytes);
        };
        section(bytemuck::cast_slice(&self.nodes));
        section(bytemuck::cast_slice(&self.triangles));
        section(bytemuck::cast_slice(&self.attributes));
        section(bytemuck::cast_slice(&self.meshes));
        section(bytemuck::cast_slice(&self.instances));
        section(bytemuck::cast_slice(&self.materials));
        section(bytemuck::cast_slice(&self.lights));
        section(&self.atlas.texels);
        if let Some(environment) = &self.environment {
            section(bytemuck::cast_slice(&environment.radiance));
            section(bytemuck::cast_slice(&environment.alias));
        }
        self.rig.arrays().into_iter().for_each(&mut section);
        section(bytemuck::cast_slice(&self.deformers.list));
        section(bytemuck::cast_slice(&self.deformers.vertices));
        section(bytemuck::cast_slice(&self.deformers.displacements));
        section(bytemuck::cast_slice(&self.deformers.corners));
        out
    }

    /// Reads what [`FlatScene::to_bytes`] wrote. Every length and index is checked, so that the result is as safe to render
    /// as one from [`FlatScene::build`].
    ///
    /// # Errors
    /// [`Error::BadFile`] with the place of the first fault.
    pub fn from_bytes(bytes: &[u8]) -> Result<FlatScene> {
        let mut reader = Reader { bytes, position: 0 };
        let prefix = reader.take(PREFIX, "prefix")?;
        let word = |i: usize| {
            let mut word = [0; 4];
            word.copy_from_slice(&prefix[4 * i..4 * i + 4]);
            word
        };
        if word(0) != MAGIC {
            return Err(bad("prefix", "not a flattened scene"));
        }
        if u32::from_le_bytes(word(1)) != VERSION {
            return Err(bad("prefix", format!("version {} instead of {VERSION}", u32::from_le_bytes(word(1)))));
        }
        let header = reader.take(u32::from_le_bytes(word(2)) as usize, "header")?;
        let header: Header = serde_json::from_slice(header).map_err(|e| bad("header", e.to_string()))?;
        let Sections {
            nodes,
            triangles,
            attributes,
            meshes,
            instances,
            materials,
            lights,
            atlas_texels,
            environment_texels,
            deformers,
            deformer_vertices,
            displacements,
            corners,
        } = header.sections;
        let scene = FlatScene {
            name: header.name,
            nodes: reader.array(nodes, "nodes")?,
            triangles: reader.array(triangles, "triangles")?,
            attributes: reader.array(attributes, "attributes")?,
            meshes: reader.array(meshes, "meshes")?,
            instances: reader.array(instances, "instances")?,
            materials: reader.array(materials, "materials")?,
            lights: reader.array(lights, "lights")?,
            first_punctual: header.first_punctual,
            atlas: Atlas {
                size: header.atlas_size,
                layers: header.atlas_layers,
                texels: reader.array(atlas_texels, "atlas")?,
            },
            environment: match header.environment {
                Some([width, height]) => Some(FlatEnvironment {
                    width,
                    height,
                    radiance: reader.array(environment_texels, "environment")?,
                    alias: reader.array(environment_texels, "environment")?,
                }),
                None => None,
            },
            rig: Rig::from_arrays(header.rig, &mut reader)?,
            deformers: Deformers {
                list: reader.array(deformers, "deformers")?,
                vertices: reader.array(deformer_vertices, "deformers.vertices")?,
                displacements: reader.array(displacements, "deformers.displacements")?,
                corners: reader.array(corners, "deformers.corners")?,
            },
            cameras: header.cameras.into_iter().map(CameraRecord::into_camera).collect(),
            bounds: header.bounds.map(Vec3::from_array),
            stats: header.stats,
            warnings: header.warnings,
        };
        if reader.position != bytes.len() {
            return Err(bad("end", format!("{} bytes too many", bytes.len() - reader.position)));
        }
        validate::validate(&scene).map_err(|(place, what)| bad(place, what))?;
        Ok(scene)
    }
}

fn bad(place: impl Into<String>, what: impl Into<String>) -> Error {
    Error::bad_file("flattened scene", place, what)
}

struct Reader<'a> {
    bytes: &'a [u8],
    position: usize,
}

impl<'a> Reader<'a> {
    fn take(&mut self, length: usize, place: &str) -> Result<&'a [u8]> {
        let rest = self.bytes.get(self.position..).unwrap_or_default();
        let taken = rest.get(..length).ok_or_else(|| {
            bad(place, format!("{length} bytes were promised, {} are left (byte {})", rest.len(), self.position))
        })?;
        self.position += length;
        Ok(taken)
    }

    /// Allocates only what the bytes are there for.
    fn array<T: Pod>(&mut self, count: usize, place: &str) -> Result<Vec<T>> {
        let padding = self.position.next_multiple_of(ALIGNMENT) - self.position;
        self.take(padding, place)?;
        let length = count.checked_mul(size_of::<T>()).ok_or_else(|| bad(place, "absurd length"))?;
        let bytes = self.take(length, place)?;
        let mut array = vec![T::zeroed(); count];
        bytemuck::cast_slice_mut(&mut array).copy_from_slice(bytes);
        Ok(array)
    }
}

impl rig_bytes::TakeArray for Reader<'_> {
    fn take_array<T: Pod>(&mut self, count: usize, place: &str) -> Result<Vec<T>> {
        self.array(count, place)
    }
}

fn header_of(scene: &FlatScene) -> Header {
    let cameras = scene.cameras.iter().map(|camera| {
        let (orthographic, extent) = match camera.projection {
            Projection::Perspective { vertical_fov } => (false, vertical_fov),
            Projection::Orthographic { half_height } => (true, half_height),
        };
        CameraRecord {
            name: camera.name.clone(),
            position: camera.position.to_array(),
            forward: camera.forward.to_array(),
            up: camera.up.to_array(),
            orthographic,
            extent,
        }
    });
    Header {
        name: scene.name.clone(),
        first_punctual: scene.first_punctual,
        rig: scene.rig.header(),
        cameras: cameras.collect(),
        bounds: scene.bounds.map(|corner| corner.to_array()),
        stats: scene.stats.clone(),
        warnings: scene.warnings.clone(),
        atlas_size: scene.atlas.size,
        atlas_layers: scene.atlas.layers,
        environment: scene.environment.as_ref().map(|e| [e.width, e.height]),
        sections: Sections {
            nodes: scene.nodes.len(),
            triangles: scene.triangles.len(),
            attributes: scene.attributes.len(),
            meshes: scene.meshes.len(),
            instances: scene.instances.len(),
            materials: scene.materials.len(),
            lights: scene.lights.len(),
            atlas_texels: scene.atlas.texels.len(),
            environment_texels: scene.environment.as_ref().map_or(0, |e| e.radiance.len()),
            deformers: scene.deformers.list.len(),
            deformer_vertices: scene.deformers.vertices.len(),
            displacements: scene.deformers.displacements.len(),
            corners: scene.deformers.corners.len(),
        },
    }
}

impl CameraRecord {
    fn into_camera(self) -> Camera {
        Camera {
            name: self.name,
            position: Vec3::from_array(self.position),
            forward: Vec3::from_array(self.forward),
            up: Vec3::from_array(self.up),
            projection: if self.orthographic {
                Projection::Orthographic { half_height: self.extent }
            } else {
                Projection::Perspective { vertical_fov: self.extent }
            },
        }
    }
}
