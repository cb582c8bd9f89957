//! Lights with a shape, which glTF has no ratified extension for: they stand in a node's extras.

use super::container::Document;
use crate::error::Result;
use crate::scene::area_light::{AreaLight, Outline};
use glam::Vec3;
use gltf::json::Node;
use serde::Deserialize;

/// A node's `extras`, as far as they concern us. `docs/lights.md` documents them.
#[derive(Deserialize)]
struct Extras {
    restir_area_light: Option<serde_json::Value>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "camelCase")]
struct Light {
    r#type: Type,
    radius: Option<f32>,
    width: Option<f32>,
    height: Option<f32>,
    color: Option<[f32; 3]>,
    radiance: Option<f32>,
    double_sided: Option<bool>,
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Type {
    Sphere,
    Rectangle,
    Disk,
}

/// The area light that a node carries, if any.
pub(super) fn read(document: &Document, node: &Node, place: &str) -> Result<Option<AreaLight>> {
    let Some(extras) = node.extras.as_ref() else { return Ok(None) };
    // Extras of others may be anything.
    let Ok(Extras { restir_area_light: Some(light) }) = serde_json::from_str(extras.get()) else { return Ok(None) };
    let place = format!("{place}.extras.restir_area_light");
    let light: Light = serde_json::from_value(light).map_err(|error| document.bad(&place, error.to_string()))?;
    let wanted = |side: Option<f32>, name: &str| side.ok_or_else(|| document.bad(&place, format!("{name} is missing")));
    let outline = match light.r#type {
        Type::Sphere => Outline::Sphere { radius: wanted(light.radius, "radius")? },
        Type::Disk => Outline::Disk { radius: wanted(light.radius, "radius")? },
        Type::Rectangle => {
            Outline::Rectangle { width: wanted(light.width, "width")?, height: wanted(light.height, "height")? }
        }
    };
    Ok(Some(AreaLight {
        outline,
        radiance: Vec3::from(light.color.unwrap_or([1.0; 3])) * light.radiance.unwrap_or(1.0),
        double_sided: light.double_sided.unwrap_or(false),
    }))
}
