//! What materials have from glTF's extensions.

use super::materials::{Find, slot};
use super::mips::Texels;
use crate::error::{Error, Result};
use crate::scene::gpu_types::{MATERIAL_UNLIT, MATERIAL_VOLUME, MaterialExtensions};
use crate::scene::{Material, Scene, Volume};
use glam::{Vec2, Vec3};

/// One record a material, or none at all where no material uses an extension.
pub(super) fn flatten(scene: &Scene, find: Find) -> Result<Vec<MaterialExtensions>> {
    let all = scene.materials.iter().enumerate().map(|(i, material)| {
        flatten_one(material, scene, find)
            .map_err(|what| Error::bad_value(format!("material {i} '{}'", material.name), what))
    });
    let all: Vec<_> = all.collect::<Result<_>>()?;
    let none = flatten_one(&Material::default(), scene, find)
        .map_err(|what| Error::bad_value("the default material", what))?;
    Ok(if all.iter().all(|one| *one == none) { Vec::new() } else { all })
}

fn flatten_one(material: &Material, scene: &Scene, find: Find) -> std::result::Result<MaterialExtensions, String> {
    let Material { specular, transmission, clearcoat, sheen, anisotropy, iridescence, .. } = material;
    let flags =
        if material.unlit { MATERIAL_UNLIT } else { 0 } | if material.bounds_a_medium() { MATERIAL_VOLUME } else { 0 };
    let mut slot = |texture, texels| slot(texture, texels, scene, find);
    let flat = MaterialExtensions {
        specular_color: specular.color,
        specular: specular.strength,
        absorption: material.volume.map_or(Vec3::ZERO, absorption),
        transmission: transmission.factor,
        sheen_color: sheen.color,
        sheen_roughness: sheen.roughness,
        ior: material.ior,
        dispersion: material.dispersion,
        clearcoat: clearcoat.factor,
        clearcoat_roughness: clearcoat.roughness,
        anisotropy_direction: Vec2::from_angle(anisotropy.rotation),
        anisotropy: anisotropy.strength,
        clearcoat_normal_scale: clearcoat.normal_scale,
        iridescence: iridescence.factor,
        film_ior: iridescence.ior,
        film_thickness_minimum: iridescence.thickness_minimum,
        film_thickness_maximum: iridescence.thickness_maximum,
        flags,
        padding_0: 0,
        padding_1: 0,
        padding_2: 0,
        specular_texture: slot(specular.texture, Texels::Data)?,
        specular_color_texture: slot(specular.color_texture, Texels::Color)?,
        transmission_texture: slot(transmission.texture, Texels::Data)?,
        clearcoat_texture: slot(clearcoat.texture, Texels::Data)?,
        clearcoat_roughness_texture: slot(clearcoat.roughness_texture, Texels::Data)?,
        clearcoat_normal_texture: slot(clearcoat.normal_texture, Texels::Normal)?,
        sheen_color_texture: slot(sheen.color_texture, Texels::Color)?,
        sheen_roughness_texture: slot(sheen.roughness_texture, Texels::Data)?,
        anisotropy_texture: slot(anisotropy.texture, Texels::Data)?,
        iridescence_texture: slot(iridescence.texture, Texels::Data)?,
        iridescence_thickness_texture: slot(iridescence.thickness_texture, Texels::Data)?,
    };
    if flat.factors().iter().any(|f| !f.is_finite()) {
        return Err("a factor of an extension is not finite".into());
    }
    Ok(flat)
}

/// Absorption coefficient in 1/m: Beer and Lambert's law turned round (KHR_materials_volume). What would be infinite is
/// as large as f32 can use.
fn absorption(volume: Volume) -> Vec3 {
    let color = volume.attenuation_color.clamp(Vec3::splat(1e-30), Vec3::ONE);
    let distance = volume.attenuation_distance.max(1e-12);
    Vec3::new(-color.x.ln(), -color.y.ln(), -color.z.ln()).max(Vec3::ZERO) / distance
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Clearcoat, Transmission};

    fn of(material: Material) -> MaterialExtensions {
        flatten(&Scene { materials: vec![material], ..Scene::default() }, &mut |_, _| None).expect("a good material")[0]
    }

    #[test]
    fn plain_materials_have_none() {
        let scene = Scene { materials: vec![Material::default(); 3], ..Scene::default() };
        assert_eq!(flatten(&scene, &mut |_, _| None).expect("good materials"), []);
    }

    #[test]
    fn absorption_is_beers_law() {
        let volume = Volume { attenuation_distance: 2.0, attenuation_color: Vec3::new(0.25, 0.5, 1.0) };
        let flat = of(Material {
            transmission: Transmission { factor: 1.0, texture: None },
            volume: Some(volume),
            ..Material::default()
        });
        // After the attenuation distance white light has the attenuation colour.
        let left = (-flat.absorption * 2.0).exp();
        assert!((left - volume.attenuation_color).abs().max_element() < 1e-6, "{left}");
        assert_eq!(flat.flags, MATERIAL_VOLUME);
        let clear = Volume { attenuation_distance: f32::INFINITY, ..volume };
        assert_eq!(absorption(clear), Vec3::ZERO);
        let opaque = Volume { attenuation_distance: 0.0, attenuation_color: Vec3::ZERO };
        assert!(absorption(opaque).is_finite());
    }

    #[test]
    fn bad_factors_are_errors() {
        let clearcoat = Clearcoat { roughness: f32::NAN, ..Clearcoat::default() };
        let scene = Scene { materials: vec![Material { clearcoat, ..Material::default() }], ..Scene::default() };
        assert!(flatten(&scene, &mut |_, _| None).is_err());
    }
}
