//! A flat scene as one run of bytes and back: how a Worker hands it to the page.
//!
//! `RSTR`, version, length of the header (u32 each), 0; the header as JSON; then the arrays in the order of [`Sections`],
//! the texture arrays and the environment, each beginning
//! at a multiple of 16. Little-endian throughout.

use super::{Deformers, FlatEnvironment, FlatScene, SceneStats, TextureArray, validate};
use crate::error::{Error, Result};
use crate::pace::{Pace, SLICE_BYTES};
use crate::scene::rig::bytes::{self as rig_bytes, Section};
use crate::scene::{Camera, Projection, Rig};
use bytemuck::Pod;
use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::ops::Range;

const _: () = assert!(cfg!(target_endian = "little"), "arrays are copied as they lie in memory");

const MAGIC: [u8; 4] = *b"RSTR";
/// Of the layout: to be raised by each change to the header, the arrays or their elements.
pub(super) const VERSION: u32 = 6;
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
    textures: Vec<TextureRecord>,
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
    material_extensions: usize,
    lights: usize,
    light_powers: usize,
    environment_texels: usize,
    deformers: usize,
    deformer_vertices: usize,
    displacements: usize,
    corners: usize,
}

#[derive(Serialize, Deserialize)]
struct TextureRecord {
    width: u32,
    height: u32,
    layers: u32,
    levels: u32,
    bytes: usize,
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
        for section in self.sections() {
            out.resize(out.len().next_multiple_of(ALIGNMENT), 0);
            out.extend_from_slice(section);
        }
        out
    }

    /// The large arrays in the order in which they are written.
    fn sections(&self) -> Vec<&[u8]> {
        let mut sections: Vec<&[u8]> = vec![
            bytemuck::cast_slice(&self.nodes),
            bytemuck::cast_slice(&self.triangles),
            bytemuck::cast_slice(&self.attributes),
            bytemuck::cast_slice(&self.meshes),
            bytemuck::cast_slice(&self.instances),
            bytemuck::cast_slice(&self.materials),
            bytemuck::cast_slice(&self.material_extensions),
            bytemuck::cast_slice(&self.lights),
            bytemuck::cast_slice(&self.light_powers),
        ];
        sections.extend(self.textures.iter().map(|array| &array.texels[..]));
        if let Some(environment) = &self.environment {
            sections.push(bytemuck::cast_slice(&environment.radiance));
            sections.push(bytemuck::cast_slice(&environment.alias));
        }
        sections.extend(self.rig.arrays());
        let deformers = &self.deformers;
        sections.push(bytemuck::cast_slice(&deformers.list));
        sections.push(bytemuck::cast_slice(&deformers.vertices));
        sections.push(bytemuck::cast_slice(&deformers.displacements));
        sections.push(bytemuck::cast_slice(&deformers.corners));
        sections
    }

    /// As `sections`, to be filled.
    fn sections_mut(&mut self) -> Vec<&mut dyn Section> {
        let mut sections: Vec<&mut dyn Section> = vec![
            &mut self.nodes,
            &mut self.triangles,
            &mut self.attributes,
            &mut self.meshes,
            &mut self.instances,
            &mut self.materials,
            &mut self.material_extensions,
            &mut self.lights,
            &mut self.light_powers,
        ];
        sections.extend(self.textures.iter_mut().map(|array| &mut array.texels as &mut dyn Section));
        if let Some(environment) = &mut self.environment {
            sections.push(&mut environment.radiance);
            sections.push(&mut environment.alias);
        }
        sections.extend(self.rig.arrays_mut());
        let deformers = &mut self.deformers;
        sections.push(&mut deformers.list);
        sections.push(&mut deformers.vertices);
        sections.push(&mut deformers.displacements);
        sections.push(&mut deformers.corners);
        sections
    }

    /// Reads what [`FlatScene::to_bytes`] wrote. Every length and index is checked, so that the result is as safe to render
    /// as one from [`FlatScene::build`].
    ///
    /// # Errors
    /// [`Error::BadFile`] with the place of the first fault.
    pub fn from_bytes(bytes: &[u8]) -> Result<FlatScene> {
        let (mut scene, places) = Self::hollow(bytes, bytes.len())?;
        for (section, place) in scene.sections_mut().into_iter().zip(places) {
            section.lengthen(place.len(), usize::MAX).copy_from_slice(&bytes[place]);
        }
        validate::validate(&scene).map_err(|(place, what)| bad(place, what))?;
        Ok(scene)
    }

    /// As [`FlatScene::from_bytes`] in slices, for bytes that this program's own Worker has made a moment ago: lengths are
    /// checked, indices are not. `read` fills a slice with the bytes from an offset on; there are `length` of them.
    ///
    /// # Errors
    /// [`Error::BadFile`] for lengths that do not fit.
    pub async fn receive(length: usize, read: impl Fn(usize, &mut [u8]), pace: &mut Pace) -> Result<FlatScene> {
        let mut head = vec![0; length.min(PREFIX)];
        read(0, &mut head);
        let header_length = head.get(8..12).map_or(0, |word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]));
        head.resize(length.min(PREFIX + header_length as usize), 0);
        read(0, &mut head);
        let (mut scene, places) = Self::hollow(&head, length)?;
        for (section, mut place) in scene.sections_mut().into_iter().zip(places) {
            while !place.is_empty() {
                let part = section.lengthen(place.len(), SLICE_BYTES);
                read(place.start, part);
                place.start += part.len();
                pace.breathe().await;
            }
        }
        Ok(scene)
    }

    /// The scene that `length` bytes, of which `head` are at least the header, describe, its arrays still empty; and where
    /// each of them lies.
    fn hollow(head: &[u8], length: usize) -> Result<(FlatScene, Vec<Range<usize>>)> {
        let mut reader = Reader { head, length, position: 0, places: Vec::new() };
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
            material_extensions,
            lights,
            light_powers,
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
            material_extensions: reader.array(material_extensions, "material extensions")?,
            lights: reader.array(lights, "lights")?,
            light_powers: reader.array(light_powers, "light_powers")?,
            first_punctual: header.first_punctual,
            textures: header.textures.into_iter().map(|array| array.read(&mut reader)).collect::<Result<_>>()?,
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
        if reader.position != length {
            return Err(bad("end", format!("{} bytes too many", length - reader.position)));
        }
        Ok((scene, reader.places))
    }
}

fn bad(place: impl Into<String>, what: impl Into<String>) -> Error {
    Error::bad_file("flattened scene", place, what)
}

/// Goes through the bytes in order; only those of `head` are there.
struct Reader<'a> {
    head: &'a [u8],
    length: usize,
    position: usize,
    /// Where the arrays lie that were met.
    places: Vec<Range<usize>>,
}

impl<'a> Reader<'a> {
    /// Passes over bytes that must be promised.
    fn skip(&mut self, length: usize, place: &str) -> Result<()> {
        let left = self.length.saturating_sub(self.position);
        if length > left {
            let what = format!("{length} bytes were promised, {left} are left (byte {})", self.position);
            return Err(bad(place, what));
        }
        self.position += length;
        Ok(())
    }

    fn take(&mut self, length: usize, place: &str) -> Result<&'a [u8]> {
        let start = self.position;
        self.skip(length, place)?;
        self.head.get(start..self.position).ok_or_else(|| bad(place, "it is not there"))
    }

    /// Room for an array, if its bytes are there; it is filled later.
    fn array<T: Pod>(&mut self, count: usize, place: &str) -> Result<Vec<T>> {
        let padding = self.position.next_multiple_of(ALIGNMENT) - self.position;
        self.skip(padding, place)?;
        let length = count.checked_mul(size_of::<T>()).ok_or_else(|| bad(place, "absurd length"))?;
        self.skip(length, place)?;
        self.places.push(self.position - length..self.position);
        Ok(Vec::with_capacity(count))
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
        textures: scene.textures.iter().map(TextureRecord::of).collect(),
        environment: scene.environment.as_ref().map(|e| [e.width, e.height]),
        sections: Sections {
            nodes: scene.nodes.len(),
            triangles: scene.triangles.len(),
            attributes: scene.attributes.len(),
            meshes: scene.meshes.len(),
            instances: scene.instances.len(),
            materials: scene.materials.len(),
            material_extensions: scene.material_extensions.len(),
            lights: scene.lights.len(),
            light_powers: scene.light_powers.len(),
            environment_texels: scene.environment.as_ref().map_or(0, |e| e.radiance.len()),
            deformers: scene.deformers.list.len(),
            deformer_vertices: scene.deformers.vertices.len(),
            displacements: scene.deformers.displacements.len(),
            corners: scene.deformers.corners.len(),
        },
    }
}

impl TextureRecord {
    fn of(array: &TextureArray) -> Self {
        let TextureArray { width, height, layers, levels, ref texels } = *array;
        TextureRecord { width, height, layers, levels, bytes: texels.len() }
    }

    fn read(self, reader: &mut Reader) -> Result<TextureArray> {
        let TextureRecord { width, height, layers, levels, bytes } = self;
        Ok(TextureArray { width, height, layers, levels, texels: reader.array(bytes, "textures")? })
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
