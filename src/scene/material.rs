//! What glTF's material extensions add to a [`Material`](super::Material). Each default is the extension's absence.
//! Colours are linear Rec. 709.

use super::TextureRef;
use glam::Vec3;

/// KHR_materials_specular: strength and colour of the dielectric's reflection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Specular {
    /// 0 (no reflection) to 1.
    pub strength: f32,
    /// Multiplies the reflectance at normal incidence; may be greater than 1.
    pub color: Vec3,
    /// Linear: alpha multiplies `strength`.
    pub texture: Option<TextureRef>,
    /// sRGB: multiplies `color`.
    pub color_texture: Option<TextureRef>,
}

impl Default for Specular {
    fn default() -> Self {
        Specular { strength: 1.0, color: Vec3::ONE, texture: None, color_texture: None }
    }
}

/// KHR_materials_transmission: the share of light that passes through instead of being scattered below the surface.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Transmission {
    /// 0 to 1.
    pub factor: f32,
    /// Linear: red multiplies `factor`.
    pub texture: Option<TextureRef>,
}

/// KHR_materials_volume: the surface bounds a medium. Its thickness is traced, not read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Volume {
    /// World-space metres after which white light has become `attenuation_color`; infinite for a clear medium.
    pub attenuation_distance: f32,
    /// 0 to 1.
    pub attenuation_color: Vec3,
}

/// KHR_materials_clearcoat: a smooth dielectric layer of index 1.5 over everything else.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clearcoat {
    /// 0 (no coat) to 1.
    pub factor: f32,
    /// Perceptual roughness.
    pub roughness: f32,
    /// Multiplies xy of the coat's normal map.
    pub normal_scale: f32,
    /// Linear: red multiplies `factor`.
    pub texture: Option<TextureRef>,
    /// Linear: green multiplies `roughness`.
    pub roughness_texture: Option<TextureRef>,
    /// Linear tangent-space normals of the coat; without them it follows the mesh, not the base's normal map.
    pub normal_texture: Option<TextureRef>,
}

impl Default for Clearcoat {
    fn default() -> Self {
        Clearcoat {
            factor: 0.0,
            roughness: 0.0,
            normal_scale: 1.0,
            texture: None,
            roughness_texture: None,
            normal_texture: None,
        }
    }
}

/// KHR_materials_sheen: fibres that stand on the surface.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sheen {
    /// Black for no sheen.
    pub color: Vec3,
    /// Perceptual roughness.
    pub roughness: f32,
    /// sRGB: multiplies `color`.
    pub color_texture: Option<TextureRef>,
    /// Linear: alpha multiplies `roughness`.
    pub roughness_texture: Option<TextureRef>,
}

/// KHR_materials_anisotropy: highlights stretched along a direction of the surface.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Anisotropy {
    /// 0 (none) to 1.
    pub strength: f32,
    /// Radians from the tangent, counter-clockwise about the normal.
    pub rotation: f32,
    /// Linear: red and green a direction in [-1, 1], blue multiplies `strength`.
    pub texture: Option<TextureRef>,
}

/// KHR_materials_iridescence: a thin film on the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Iridescence {
    /// 0 (no film) to 1.
    pub factor: f32,
    /// Index of refraction of the film.
    pub ior: f32,
    /// Nanometres where the thickness texture is 0.
    pub thickness_minimum: f32,
    /// Nanometres where it is 1, and everywhere without one.
    pub thickness_maximum: f32,
    /// Linear: red multiplies `factor`.
    pub texture: Option<TextureRef>,
    /// Linear: green is the thickness.
    pub thickness_texture: Option<TextureRef>,
}

impl Default for Iridescence {
    fn default() -> Self {
        Iridescence {
            factor: 0.0,
            ior: 1.3,
            thickness_minimum: 100.0,
            thickness_maximum: 400.0,
            texture: None,
            thickness_texture: None,
        }
    }
}
