//! KHR_lights_punctual.

use super::container::Document;
use crate::error::Result;
use crate::scene::{PunctualKind, PunctualLight};
use glam::{Mat4, Vec3};
use gltf::json::extensions::scene::khr_lights_punctual::{Light, Type};
use std::f32::consts::FRAC_PI_2;

/// Light `index` of the file where a node of transform `to_world` puts it, as [`PunctualLight::at`].
pub(super) fn load(
    document: &Document,
    index: usize,
    to_world: &Mat4,
    node_place: &str,
) -> Result<Option<PunctualLight>> {
    let lights: &[Light] = document.root.as_ref();
    let place = format!("{node_place}.extensions.KHR_lights_punctual.light");
    let light = document.at(lights, index, "extensions.KHR_lights_punctual.lights", &place)?;
    let place = format!("extensions.KHR_lights_punctual.lights[{index}]");
    let intensity = light.color.map(|channel| channel * light.intensity);
    if light.intensity < 0.0 || light.color.iter().any(|&channel| channel < 0.0) {
        return Err(document.bad(place, "its colour or intensity is negative"));
    }
    let intensity = Vec3::from(document.finite(intensity, &place)?);
    let range = light.range.unwrap_or(f32::INFINITY);
    if range <= 0.0 {
        return Err(document.bad(format!("{place}.range"), format!("{range} is not positive")));
    }
    let kind = match document.valid(&light.type_, &format!("{place}.type"))? {
        Type::Point => PunctualKind::Point,
        Type::Directional => PunctualKind::Directional,
        Type::Spot => spot(document, light, &format!("{place}.spot"))?,
    };
    let light = PunctualLight { kind, position: Vec3::ZERO, direction: Vec3::NEG_Z, intensity, range };
    Ok(light.at(to_world))
}

/// The cone of a spot light. Equal angles, a hard edge, are let pass: common exporters write them.
fn spot(document: &Document, light: &Light, place: &str) -> Result<PunctualKind> {
    let spot = light.spot.as_ref().ok_or_else(|| document.bad(place, "a spot light needs it"))?;
    let (inner, outer) = (spot.inner_cone_angle, spot.outer_cone_angle);
    // Decimal renderings of pi / 2 may lie a little above it.
    let valid = inner >= 0.0 && inner <= outer && outer > 0.0 && outer < FRAC_PI_2 + 1e-4;
    if !valid {
        let what = format!("cone angles {inner} and {outer} are not 0 <= inner <= outer <= pi / 2");
        return Err(document.bad(place, what));
    }
    Ok(PunctualKind::Spot { inner: inner.min(FRAC_PI_2), outer: outer.min(FRAC_PI_2) })
}
