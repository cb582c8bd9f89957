//! Metallic-roughness materials, their textures and samplers.

use super::buffers::Buffers;
use super::container::Document;
use super::images::{self, Images};
use super::{Resolve, material_extensions, tidy};
use crate::error::Result;
use crate::scene::{AlphaMode, Material, Scene, Texture, TextureRef, Wrap};
use glam::{Vec2, Vec3, Vec4};
use gltf::json;
use json::extensions::texture::TextureTransform;
use json::texture::{MagFilter, WrappingMode};

/// Loads every material of the file and the textures they use into `scene`, in file order. Returns the UV sets that each
/// of them reads.
pub(super) fn load(document: &Document, buffers: &Buffers, resolve: Resolve, scene: &mut Scene) -> Result<Vec<UvSets>> {
    let mut loader = Loader {
        document,
        buffers,
        resolve,
        images: Images::new(document),
        loaded: vec![None; document.root.textures.len()],
        textures: Vec::new(),
        warnings: Vec::new(),
        uv_sets: UvSets::default(),
    };
    let mut uv_sets = Vec::with_capacity(document.root.materials.len());
    for (index, material) in document.root.materials.iter().enumerate() {
        scene.materials.push(loader.material(material, &format!("materials[{index}]"))?);
        uv_sets.push(std::mem::take(&mut loader.uv_sets));
    }
    scene.textures = loader.textures;
    scene.warnings.append(&mut loader.warnings);
    Ok(uv_sets)
}

/// Which TEXCOORD sets of a file the two UV sets of a mesh are, for one material.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct UvSets([Option<u32>; 2]);

impl UvSets {
    /// The TEXCOORD set that is loaded as UV set `slot`.
    pub fn source(self, slot: u32) -> u32 {
        self.0.get(slot as usize).copied().flatten().unwrap_or(slot)
    }

    /// The UV set that becomes TEXCOORD set `source`: 0 and 1 keep their places where these are free. None where two
    /// others are taken.
    fn slot(&mut self, source: u32) -> Option<u32> {
        let preferred = if source == 0 { [0, 1] } else { [1, 0] };
        let taken = preferred.into_iter().find(|&slot| self.0[slot] == Some(source));
        let slot = taken.or_else(|| preferred.into_iter().find(|&slot| self.0[slot].is_none()))?;
        self.0[slot] = Some(source);
        Some(slot as u32)
    }
}

/// What materials share while they are loaded.
pub(super) struct Loader<'a> {
    pub(super) document: &'a Document<'a>,
    buffers: &'a Buffers<'a>,
    resolve: Resolve<'a>,
    images: Images,
    /// Index in `textures` of each glTF texture loaded so far.
    loaded: Vec<Option<u32>>,
    textures: Vec<Texture>,
    warnings: Vec<String>,
    /// Of the material being loaded.
    uv_sets: UvSets,
}

/// The three kinds of textureInfo as one.
struct TextureInfo {
    index: usize,
    tex_coord: u32,
    transform: Option<TextureTransform>,
}

impl From<&json::texture::Info> for TextureInfo {
    fn from(info: &json::texture::Info) -> Self {
        let transform = info.extensions.as_ref().and_then(|extensions| extensions.texture_transform.clone());
        TextureInfo { index: info.index.value(), tex_coord: info.tex_coord, transform }
    }
}

impl Loader<'_> {
    /// One material; factors out of their range are clamped, with a warning.
    fn material(&mut self, source: &json::Material, place: &str) -> Result<Material> {
        let document = self.document;
        let pbr = &source.pbr_metallic_roughness;
        let pbr_place = format!("{place}.pbrMetallicRoughness");
        let base_color = self.unit(pbr.base_color_factor.0, &format!("{pbr_place}.baseColorFactor"))?;
        let [metallic] = self.unit([pbr.metallic_factor.0], &format!("{pbr_place}.metallicFactor"))?;
        let [roughness] = self.unit([pbr.roughness_factor.0], &format!("{pbr_place}.roughnessFactor"))?;
        let alpha = self.alpha(source, place)?;
        let normal_texture = match &source.normal_texture {
            Some(info) => self.normal_texture(info, &format!("{place}.normalTexture"))?,
            None => None,
        };
        let scale = source.normal_texture.as_ref().map_or(1.0, |info| info.scale);
        let [normal_scale] = document.finite([scale], &format!("{place}.normalTexture.scale"))?;
        let mut material = Material {
            name: source.name.as_deref().map_or_else(|| place.to_owned(), tidy),
            base_color: Vec4::from(base_color),
            metallic,
            roughness,
            emissive: emissive(document, source, place)?,
            normal_scale,
            alpha,
            double_sided: source.double_sided,
            base_color_texture: self.texture(&pbr.base_color_texture, &format!("{pbr_place}.baseColorTexture"))?,
            metallic_roughness_texture: self
                .texture(&pbr.metallic_roughness_texture, &format!("{pbr_place}.metallicRoughnessTexture"))?,
            normal_texture,
            emissive_texture: self.texture(&source.emissive_texture, &format!("{place}.emissiveTexture"))?,
            ..Material::default()
        };
        material_extensions::load(self, source, place, &mut material)?;
        Ok(material)
    }

    /// Says what was odd.
    pub(super) fn warn(&mut self, warning: String) {
        self.warnings.push(warning);
    }

    /// The same as [`Loader::texture`] from the parts of an untyped textureInfo.
    pub(super) fn texture_of(
        &mut self,
        index: usize,
        tex_coord: u32,
        transform: Option<TextureTransform>,
        place: &str,
    ) -> Result<Option<TextureRef>> {
        self.texture_ref(TextureInfo { index, tex_coord, transform }, place)
    }

    /// Factors clamped to [0, 1].
    fn unit<const N: usize>(&mut self, values: [f32; N], place: &str) -> Result<[f32; N]> {
        let values = self.document.finite(values, place)?;
        let clamped = values.map(|value| value.clamp(0.0, 1.0));
        if clamped != values {
            self.warnings.push(format!("{place} is clamped to [0, 1]"));
        }
        Ok(clamped)
    }

    /// Blending has no meaning for a ray that either hits or misses: it becomes a mask.
    fn alpha(&mut self, source: &json::Material, place: &str) -> Result<AlphaMode> {
        Ok(match self.document.valid(&source.alpha_mode, &format!("{place}.alphaMode"))? {
            json::material::AlphaMode::Opaque => AlphaMode::Opaque,
            json::material::AlphaMode::Mask => {
                let cutoff = source.alpha_cutoff.unwrap_or_default().0;
                let [cutoff] = self.document.finite([cutoff], &format!("{place}.alphaCutoff"))?;
                AlphaMode::Mask(cutoff)
            }
            json::material::AlphaMode::Blend => {
                self.warnings.push(format!("{place}: alphaMode BLEND is treated as MASK with cutoff 0.5"));
                AlphaMode::Mask(0.5)
            }
        })
    }

    /// A normal texture; its transform is not typed by the JSON crate.
    fn normal_texture(&mut self, info: &json::material::NormalTexture, place: &str) -> Result<Option<TextureRef>> {
        let transform = info.extensions.as_ref().and_then(|all| all.others.get("KHR_texture_transform"));
        let transform = transform.map(|value| serde_json::from_value(value.clone())).transpose();
        let transform = transform.map_err(|error| {
            let place = format!("{place}.extensions.KHR_texture_transform");
            self.document.bad(place, tidy(&error.to_string()))
        })?;
        self.texture_ref(TextureInfo { index: info.index.value(), tex_coord: info.tex_coord, transform }, place)
    }

    /// An optional texture.
    fn texture(&mut self, info: &Option<json::texture::Info>, place: &str) -> Result<Option<TextureRef>> {
        info.as_ref().map_or(Ok(None), |info| self.texture_ref(info.into(), place))
    }

    /// How a material reads a texture, or none (with a warning) where it wants a third UV set besides two others.
    fn texture_ref(&mut self, info: TextureInfo, place: &str) -> Result<Option<TextureRef>> {
        let transform = info.transform.unwrap_or_default();
        let source = transform.tex_coord.unwrap_or(info.tex_coord);
        let Some(uv_set) = self.uv_sets.slot(source) else {
            let [first, second] = [0, 1].map(|slot| self.uv_sets.source(slot));
            self.warnings.push(format!(
                "{place} is ignored: it reads TEXCOORD_{source} besides {first} and {second}; a mesh keeps two UV sets"
            ));
            return Ok(None);
        };
        let ([ox, oy], [sx, sy]) = (transform.offset.0, transform.scale.0);
        let transform_place = format!("{place}.extensions.KHR_texture_transform");
        let [ox, oy, sx, sy, rotation] =
            self.document.finite([ox, oy, sx, sy, transform.rotation.0], &transform_place)?;
        let texture = self.load_texture(info.index, &format!("{place}.index"))?;
        Ok(Some(TextureRef { texture, uv_set, offset: Vec2::new(ox, oy), rotation, scale: Vec2::new(sx, sy) }))
    }

    /// Loads glTF texture `index` (an image with a sampler) at its first use.
    fn load_texture(&mut self, index: usize, place: &str) -> Result<u32> {
        let document = self.document;
        let texture = document.at(&document.root.textures, index, "textures", place)?;
        if let Some(Some(loaded)) = self.loaded.get(index) {
            return Ok(*loaded);
        }
        let place = format!("textures[{index}]");
        let source = images::source(document, texture, &place)?;
        let source_place = format!("{place}.source");
        let image = self.images.get(document, self.buffers, self.resolve, source, &source_place)?;
        let (wrap, linear_filter) = match texture.sampler {
            Some(sampler) => self.sampler(sampler.value(), &format!("{place}.sampler"))?,
            None => ([Wrap::Repeat; 2], true),
        };
        let loaded = self.textures.len() as u32;
        self.textures.push(Texture {
            name: texture.name.as_deref().map_or(place, tidy),
            width: image.width,
            height: image.height,
            pixels: image.pixels,
            wrap,
            linear_filter,
        });
        if let Some(slot) = self.loaded.get_mut(index) {
            *slot = Some(loaded);
        }
        Ok(loaded)
    }

    /// Wrapping along u and v, and whether magnification interpolates.
    fn sampler(&self, index: usize, place: &str) -> Result<([Wrap; 2], bool)> {
        let sampler = self.document.at(&self.document.root.samplers, index, "samplers", place)?;
        let wrap = |mode, name| {
            Ok(match self.document.valid(mode, &format!("samplers[{index}].{name}"))? {
                WrappingMode::ClampToEdge => Wrap::Clamp,
                WrappingMode::MirroredRepeat => Wrap::Mirror,
                WrappingMode::Repeat => Wrap::Repeat,
            })
        };
        let nearest = match &sampler.mag_filter {
            Some(filter) => self.document.valid(filter, &format!("samplers[{index}].magFilter"))? == MagFilter::Nearest,
            None => false,
        };
        Ok(([wrap(&sampler.wrap_s, "wrapS")?, wrap(&sampler.wrap_t, "wrapT")?], !nearest))
    }
}

/// Emitted radiance: emissiveFactor times KHR_materials_emissive_strength.
fn emissive(document: &Document, source: &json::Material, place: &str) -> Result<Vec3> {
    let extension = source.extensions.as_ref().and_then(|extensions| extensions.emissive_strength.as_ref());
    let strength = extension.map_or(1.0, |extension| extension.emissive_strength.0);
    let emissive = source.emissive_factor.0.map(|factor| factor * strength);
    let place = format!("{place}.emissiveFactor");
    if strength < 0.0 || source.emissive_factor.0.iter().any(|&factor| factor < 0.0) {
        return Err(document.bad(place, "emission is negative"));
    }
    document.finite(emissive, &place).map(Vec3::from)
}
