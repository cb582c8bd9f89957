//! Materials with their texture slots.

use super::mips::Texels;
use super::textures::Place;
use crate::error::{Error, Result};
use crate::scene::gpu_types::{Material, TextureRead, TextureSlot};
use crate::scene::{self, AlphaMode, Scene, TextureRef, Wrap};
use glam::Vec3;

/// Tells where the image of a texture lies, or nothing if there is no such texture.
pub(super) type Find<'a> = &'a mut dyn FnMut(usize, Texels) -> Option<Place>;

/// Flattens the materials; a scene without any gets one default material.
pub(super) fn flatten(scene: &Scene, find: Find) -> Result<Vec<Material>> {
    let fallback = [scene::Material::default()];
    let materials = if scene.materials.is_empty() { &fallback[..] } else { &scene.materials };
    let all = materials.iter().enumerate().map(|(i, material)| {
        flatten_one(material, scene, find)
            .map_err(|what| Error::bad_value(format!("material {i} '{}'", material.name), what))
    });
    all.collect()
}

fn flatten_one(material: &scene::Material, scene: &Scene, find: Find) -> std::result::Result<Material, String> {
    let cutoff = match material.alpha {
        AlphaMode::Opaque => 0.0,
        AlphaMode::Mask(cutoff) => cutoff,
    };
    let factors = [material.metallic, material.roughness, material.normal_scale, cutoff];
    if !material.base_color.is_finite() || !material.emissive.is_finite() || factors.iter().any(|f| !f.is_finite()) {
        return Err("a factor is not finite".into());
    }
    if material.emissive.min_element() < 0.0 {
        return Err("negative emission".into());
    }
    let base_color = match material.alpha {
        AlphaMode::Opaque => Texels::Color,
        AlphaMode::Mask(_) => Texels::MaskedColor,
    };
    let mut slot = |texture, texels| slot(texture, texels, scene, find);
    Ok(Material {
        base_color: material.base_color,
        emissive: material.emitted(),
        metallic: material.metallic,
        roughness: material.roughness,
        normal_scale: material.normal_scale,
        alpha_cutoff: cutoff,
        double_sided: u32::from(material.is_two_sided()),
        base_color_texture: slot(material.base_color_texture, base_color)?,
        metallic_roughness_texture: slot(material.metallic_roughness_texture, Texels::Data)?,
        normal_texture: slot(material.normal_texture, Texels::Normal)?,
        emissive_texture: slot(material.emissive_texture, Texels::Color)?,
    })
}

pub(super) fn slot(
    reference: Option<TextureRef>,
    texels: Texels,
    scene: &Scene,
    find: Find,
) -> std::result::Result<TextureSlot, String> {
    let Some(reference) = reference else { return Ok(TextureSlot::NONE) };
    let index = reference.texture as usize;
    let (Some(texture), Some(place)) = (scene.textures.get(index), find(index, texels)) else {
        return Err(format!("there is no texture {index}"));
    };
    let [row_u, row_v] = uv_rows(&reference);
    if !row_u.is_finite() || !row_v.is_finite() {
        return Err("a texture transform is not finite".into());
    }
    let Place { spot, width, height } = place;
    let read = TextureRead {
        array: spot.array,
        layer: spot.layer,
        origin: [spot.x, spot.y],
        size: [width, height],
        uv_set: reference.uv_set,
        srgb: matches!(texels, Texels::Color | Texels::MaskedColor),
        linear_filter: texture.linear_filter,
        wrap: texture.wrap.map(wrap_bits),
    };
    Ok(TextureSlot::new(row_u, row_v, &read))
}

fn wrap_bits(wrap: Wrap) -> u32 {
    match wrap {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    }
}

/// KHR_texture_transform: translation x rotation x scale. V points down, so that turning the coordinates
/// counter-clockwise, as seen on the image, takes (1, 0) to (cos, -sin).
pub(super) fn uv_rows(reference: &TextureRef) -> [Vec3; 2] {
    let (sin, cos) = reference.rotation.sin_cos();
    let TextureRef { scale, offset, .. } = reference;
    [Vec3::new(cos * scale.x, sin * scale.y, offset.x), Vec3::new(-sin * scale.x, cos * scale.y, offset.y)]
}

#[cfg(test)]
mod tests {
    use super::super::packing::Spot;
    use super::*;
    use glam::{Vec2, Vec4};
    use std::f32::consts::FRAC_PI_2;
    use std::sync::Arc;

    fn reference(rotation: f32) -> TextureRef {
        TextureRef { texture: 0, uv_set: 1, offset: Vec2::new(0.5, 0.25), rotation, scale: Vec2::new(2.0, 3.0) }
    }

    fn scene() -> Scene {
        let material = scene::Material { base_color_texture: Some(reference(0.0)), ..scene::Material::default() };
        let texture = scene::Texture {
            name: String::new(),
            width: 2,
            height: 1,
            pixels: Arc::new(vec![0; 8]),
            wrap: [Wrap::Mirror, Wrap::Clamp],
            linear_filter: true,
        };
        Scene { materials: vec![material], textures: vec![texture], ..Scene::default() }
    }

    fn find(texture: usize, texels: Texels) -> Option<Place> {
        assert_eq!(texels, Texels::Color);
        let spot = Spot { array: 1, layer: 3, x: 8, y: 16 };
        (texture == 0).then_some(Place { spot, width: 2, height: 1 })
    }

    #[test]
    fn transform_follows_the_extension() {
        let apply = |rotation, uv: Vec3| uv_rows(&reference(rotation)).map(|row| row.dot(uv));
        assert_eq!(apply(0.0, Vec3::ONE), [2.5, 3.25]);
        let [u, v] = apply(FRAC_PI_2, Vec3::new(1.0, 0.0, 1.0));
        assert!((u - 0.5).abs() < 1e-6 && (v - (0.25 - 2.0)).abs() < 1e-6, "{u} {v}");
    }

    #[test]
    fn slot_says_how_to_read() {
        let materials = flatten(&scene(), &mut find).unwrap();
        let slot = materials[0].base_color_texture;
        let expected = TextureRead {
            array: 1,
            layer: 3,
            origin: [8, 16],
            size: [2, 1],
            uv_set: 1,
            srgb: true,
            linear_filter: true,
            wrap: [1, 2],
        };
        assert_eq!(slot.read(), Some(expected));
        assert_eq!(materials[0].normal_texture.read(), None);
    }

    #[test]
    fn bad_materials_are_errors() {
        assert!(flatten(&scene(), &mut |_, _| None).is_err());
        let mut bad = scene();
        bad.materials[0].emissive.x = f32::INFINITY;
        assert!(flatten(&bad, &mut find).is_err());
        bad.materials[0].emissive.x = -1.0;
        assert!(flatten(&bad, &mut find).is_err());
        let mut bad = scene();
        bad.materials[0].base_color = Vec4::NAN;
        assert!(flatten(&bad, &mut find).is_err());
    }

    #[test]
    fn no_materials_means_the_default_one() {
        assert_eq!(flatten(&Scene::default(), &mut find).unwrap().len(), 1);
    }
}
