//! The `KHR_materials_` extensions, read as plain JSON: one way for all of them, and no second typed copy of what
//! [`crate::scene::material`](crate::scene) says already. Factors out of their range are clamped, with a warning.

use super::material::Loader;
use super::tidy;
use crate::error::Result;
use crate::scene::{Anisotropy, Clearcoat, Iridescence, Material, Sheen, Specular, TextureRef, Transmission, Volume};
use glam::Vec3;
use gltf::json;
use serde_json::{Map, Value};

/// Puts what the material's extensions say into `material`. `place` is the material's.
pub(super) fn load(loader: &mut Loader, source: &json::Material, place: &str, material: &mut Material) -> Result<()> {
    let Some(extensions) = &source.extensions else { return Ok(()) };
    let all = &extensions.others;
    if all.contains_key("KHR_materials_unlit") {
        // The extension knows nothing but base colour and alpha, and must not be mixed with others.
        material.unlit = true;
        return Ok(());
    }
    if let Some(e) = Extension::find(all, "KHR_materials_ior", place) {
        let [ior] = e.numbers(loader, "ior", [1.5])?;
        material.ior = if ior == 0.0 { 0.0 } else { e.clamped(loader, "ior", [ior], 1.0, f32::MAX)[0] };
    }
    if let Some(e) = Extension::find(all, "KHR_materials_dispersion", place) {
        [material.dispersion] = e.in_range(loader, "dispersion", [0.0], 0.0, f32::MAX)?;
    }
    if let Some(e) = Extension::find(all, "KHR_materials_specular", place) {
        let [strength] = e.in_range(loader, "specularFactor", [1.0], 0.0, 1.0)?;
        material.specular = Specular {
            strength,
            color: e.in_range(loader, "specularColorFactor", [1.0; 3], 0.0, f32::MAX)?.into(),
            texture: e.texture(loader, "specularTexture")?,
            color_texture: e.texture(loader, "specularColorTexture")?,
        };
    }
    if let Some(e) = Extension::find(all, "KHR_materials_transmission", place) {
        let [factor] = e.in_range(loader, "transmissionFactor", [0.0], 0.0, 1.0)?;
        material.transmission = Transmission { factor, texture: e.texture(loader, "transmissionTexture")? };
    }
    if let Some(e) = Extension::find(all, "KHR_materials_volume", place) {
        material.volume = volume(&e, loader)?;
    }
    if let Some(e) = Extension::find(all, "KHR_materials_clearcoat", place) {
        material.clearcoat = clearcoat(&e, loader)?;
    }
    if let Some(e) = Extension::find(all, "KHR_materials_sheen", place) {
        let [roughness] = e.in_range(loader, "sheenRoughnessFactor", [0.0], 0.0, 1.0)?;
        material.sheen = Sheen {
            color: e.in_range(loader, "sheenColorFactor", [0.0; 3], 0.0, 1.0)?.into(),
            roughness,
            color_texture: e.texture(loader, "sheenColorTexture")?,
            roughness_texture: e.texture(loader, "sheenRoughnessTexture")?,
        };
    }
    if let Some(e) = Extension::find(all, "KHR_materials_anisotropy", place) {
        let [strength] = e.in_range(loader, "anisotropyStrength", [0.0], 0.0, 1.0)?;
        let [rotation] = e.numbers(loader, "anisotropyRotation", [0.0])?;
        material.anisotropy = Anisotropy { strength, rotation, texture: e.texture(loader, "anisotropyTexture")? };
    }
    if let Some(e) = Extension::find(all, "KHR_materials_iridescence", place) {
        material.iridescence = iridescence(&e, loader)?;
    }
    Ok(())
}

/// A medium where the thickness is not 0; the thickness itself is for renderers that do not trace it.
fn volume(e: &Extension, loader: &mut Loader) -> Result<Option<Volume>> {
    let [thickness] = e.in_range(loader, "thicknessFactor", [0.0], 0.0, f32::MAX)?;
    let attenuation_color = e.in_range(loader, "attenuationColor", [1.0; 3], 0.0, 1.0)?;
    let mut attenuation_distance = f32::INFINITY;
    if e.value.contains_key("attenuationDistance") {
        [attenuation_distance] = e.numbers(loader, "attenuationDistance", [0.0])?;
        if attenuation_distance <= 0.0 {
            loader.warn(format!("{}.attenuationDistance is not positive: nothing is absorbed", e.place));
            attenuation_distance = f32::INFINITY;
        }
    }
    let volume = Volume { attenuation_distance, attenuation_color: Vec3::from(attenuation_color) };
    Ok((thickness > 0.0).then_some(volume))
}

fn clearcoat(e: &Extension, loader: &mut Loader) -> Result<Clearcoat> {
    let [factor] = e.in_range(loader, "clearcoatFactor", [0.0], 0.0, 1.0)?;
    let [roughness] = e.in_range(loader, "clearcoatRoughnessFactor", [0.0], 0.0, 1.0)?;
    let mut normal_scale = 1.0;
    if let Some(info) = e.value.get("clearcoatNormalTexture").and_then(Value::as_object) {
        let info = Extension { value: info, place: format!("{}.clearcoatNormalTexture", e.place) };
        [normal_scale] = info.numbers(loader, "scale", [1.0])?;
    }
    Ok(Clearcoat {
        factor,
        roughness,
        normal_scale,
        texture: e.texture(loader, "clearcoatTexture")?,
        roughness_texture: e.texture(loader, "clearcoatRoughnessTexture")?,
        normal_texture: e.texture(loader, "clearcoatNormalTexture")?,
    })
}

fn iridescence(e: &Extension, loader: &mut Loader) -> Result<Iridescence> {
    let [factor] = e.in_range(loader, "iridescenceFactor", [0.0], 0.0, 1.0)?;
    let [ior] = e.in_range(loader, "iridescenceIor", [1.3], 1.0, f32::MAX)?;
    let [thickness_minimum] = e.in_range(loader, "iridescenceThicknessMinimum", [100.0], 0.0, f32::MAX)?;
    let [thickness_maximum] = e.in_range(loader, "iridescenceThicknessMaximum", [400.0], 0.0, f32::MAX)?;
    Ok(Iridescence {
        factor,
        ior,
        thickness_minimum,
        thickness_maximum,
        texture: e.texture(loader, "iridescenceTexture")?,
        thickness_texture: e.texture(loader, "iridescenceThicknessTexture")?,
    })
}

/// One extension's object, and where it is.
struct Extension<'a> {
    value: &'a Map<String, Value>,
    place: String,
}

impl<'a> Extension<'a> {
    /// The extension, if the material has it. What is no object counts as empty.
    fn find(all: &'a Map<String, Value>, name: &str, place: &str) -> Option<Self> {
        let value = all.get(name)?.as_object()?;
        Some(Extension { value, place: format!("{place}.extensions.{name}") })
    }

    /// A number or a list of N numbers, or its default where it is absent.
    fn numbers<const N: usize>(&self, loader: &Loader, name: &str, default: [f32; N]) -> Result<[f32; N]> {
        let Some(value) = self.value.get(name) else { return Ok(default) };
        let place = format!("{}.{name}", self.place);
        let items = match value {
            Value::Array(items) => &items[..],
            single => std::slice::from_ref(single),
        };
        let numbers: Option<Vec<f32>> = items.iter().map(|item| item.as_f64().map(|number| number as f32)).collect();
        match numbers.and_then(|numbers| <[f32; N]>::try_from(numbers).ok()) {
            Some(numbers) => loader.document.finite(numbers, &place),
            None => {
                Err(loader.document.bad(place, if N == 1 { "is not a number" } else { "is not a list of 3 numbers" }))
            }
        }
    }

    /// The same, clamped to a range with a warning.
    fn in_range<const N: usize>(
        &self,
        loader: &mut Loader,
        name: &str,
        default: [f32; N],
        min: f32,
        max: f32,
    ) -> Result<[f32; N]> {
        let values = self.numbers(loader, name, default)?;
        Ok(self.clamped(loader, name, values, min, max))
    }

    fn clamped<const N: usize>(
        &self,
        loader: &mut Loader,
        name: &str,
        values: [f32; N],
        min: f32,
        max: f32,
    ) -> [f32; N] {
        let clamped = values.map(|value| value.clamp(min, max));
        if clamped != values {
            let range = if max == f32::MAX { format!("at least {min}") } else { format!("[{min}, {max}]") };
            loader.warn(format!("{}.{name} is clamped to {range}", self.place));
        }
        clamped
    }

    /// A textureInfo, if there is one.
    fn texture(&self, loader: &mut Loader, name: &str) -> Result<Option<TextureRef>> {
        let Some(info) = self.value.get(name) else { return Ok(None) };
        let place = format!("{}.{name}", self.place);
        let Some(index) = info.get("index").and_then(Value::as_u64) else {
            return Err(loader.document.bad(place, "has no index"));
        };
        let tex_coord = match info.get("texCoord") {
            None => 0,
            // A set beyond u32 is none that exists.
            Some(value) => value.as_u64().and_then(|set| u32::try_from(set).ok()).unwrap_or(u32::MAX),
        };
        let transform = info.get("extensions").and_then(|all| all.get("KHR_texture_transform"));
        let transform = transform.map(|value| serde_json::from_value(value.clone())).transpose();
        let transform = transform.map_err(|error| {
            let place = format!("{place}.extensions.KHR_texture_transform");
            loader.document.bad(place, tidy(&error.to_string()))
        })?;
        loader.texture_of(usize::try_from(index).unwrap_or(usize::MAX), tex_coord, transform, &place)
    }
}
