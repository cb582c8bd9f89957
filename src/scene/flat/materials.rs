//! Materials with their texture slots.

use super::atlas::Rectangle;
use crate::error::{Error, Result};
use crate::scene::gpu_types::{Material, TextureSlot};
use crate::scene::{self, AlphaMode, Scene, TextureRef, Wrap};
use glam::Vec3;

const UV_SET_1: u32 = 1;
const SRGB: u32 = 2;
const LINEAR_FILTER: u32 = 4;
const WRAP_U_SHIFT: u32 = 4;
const WRAP_V_SHIFT: u32 = 6;

/// Flattens the materials; a scene without any gets one default material.
pub(super) fn flatten(scene: &Scene, rectangles: &[Rectangle]) -> Result<Vec<Material>> {
    let fallback = [scene::Material::default()];
    let materials = if scene.materials.is_empty() { &fallback[..] } else { &scene.materials };
    let all = materials.iter().enumerate().map(|(i, material)| {
        flatten_one(material, scene, rectangles)
            .map_err(|what| Error::bad_value(format!("material {i} '{}'", material.name), what))
    });
    all.collect()
}

fn flatten_one(
    material: &scene::Material,
    scene: &Scene,
    rectangles: &[Rectangle],
) -> std::result::Result<Material, String> {
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
    let slot = |texture, srgb| slot(texture, srgb, scene, rectangles);
    Ok(Material {
        base_color: material.base_color,
        emissive: material.emissive,
        metallic: material.metallic,
        roughness: material.roughness,
        normal_scale: material.normal_scale,
        alpha_cutoff: cutoff,
        double_sided: u32::from(material.double_sided),
        base_color_texture: slot(material.base_color_texture, SRGB)?,
        metallic_roughness_texture: slot(material.metallic_roughness_texture, 0)?,
        normal_texture: slot(material.normal_texture, 0)?,
        emissive_texture: slot(material.emissive_texture, SRGB)?,
    })
}

fn slot(
    reference: Option<TextureRef>,
    srgb: u32,
    scene: &Scene,
    rectangles: &[Rectangle],
) -> std::result::Result<TextureSlot, String> {
    let Some(reference) = reference else { return Ok(bytemuck::Zeroable::zeroed()) };
    let index = reference.texture as usize;
    let (Some(texture), Some(place)) = (scene.textures.get(index), rectangles.get(index)) else {
        return Err(format!("there is no texture {index}"));
    };
    let [row_u, row_v] = uv_rows(&reference);
    if !row_u.is_finite() || !row_v.is_finite() {
        return Err("a texture transform is not finite".into());
    }
    let flags = if reference.uv_set == 1 { UV_SET_1 } else { 0 }
        | srgb
        | if texture.linear_filter { LINEAR_FILTER } else { 0 }
        | wrap_bits(texture.wrap[0]) << WRAP_U_SHIFT
        | wrap_bits(texture.wrap[1]) << WRAP_V_SHIFT;
    let Rectangle { layer, x, y, width, height } = *place;
    Ok(TextureSlot { row_u, flags, row_v, layer, x, y, width, height })
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

    const PLACE: Rectangle = Rectangle { layer: 3, x: 1, y: 2, width: 2, height: 1 };

    #[test]
    fn transform_follows_the_extension() {
        let apply = |rotation, uv: Vec3| uv_rows(&reference(rotation)).map(|row| row.dot(uv));
        assert_eq!(apply(0.0, Vec3::ONE), [2.5, 3.25]);
        let [u, v] = apply(FRAC_PI_2, Vec3::new(1.0, 0.0, 1.0));
        assert!((u - 0.5).abs() < 1e-6 && (v - (0.25 - 2.0)).abs() < 1e-6, "{u} {v}");
    }

    #[test]
    fn slot_says_how_to_read() {
        let materials = flatten(&scene(), &[PLACE]).unwrap();
        let slot = materials[0].base_color_texture;
        assert_eq!(slot.flags, UV_SET_1 | SRGB | LINEAR_FILTER | 1 << WRAP_U_SHIFT | 2 << WRAP_V_SHIFT);
        assert_eq!((slot.layer, slot.x, slot.y, slot.width, slot.height), (3, 1, 2, 2, 1));
        assert_eq!(materials[0].normal_texture.width, 0);
    }

    #[test]
    fn bad_materials_are_errors() {
        assert!(flatten(&scene(), &[]).is_err());
        let mut bad = scene();
        bad.materials[0].emissive.x = f32::INFINITY;
        assert!(flatten(&bad, &[PLACE]).is_err());
        bad.materials[0].emissive.x = -1.0;
        assert!(flatten(&bad, &[PLACE]).is_err());
        let mut bad = scene();
        bad.materials[0].base_color = Vec4::NAN;
        assert!(flatten(&bad, &[PLACE]).is_err());
    }

    #[test]
    fn no_materials_means_the_default_one() {
        assert_eq!(flatten(&Scene::default(), &[]).unwrap().len(), 1);
    }
}
