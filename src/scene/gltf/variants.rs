//! `KHR_materials_variants`: materials that a person chooses by a name.

use super::container::Document;
use crate::error::Result;
use gltf::json::mesh::Primitive;

const EXTENSION: &str = "KHR_materials_variants";

/// The material that the chosen variant gives `primitive`, if it gives it one.
pub(super) fn material(document: &Document, primitive: &Primitive, place: &str) -> Result<Option<usize>> {
    let Some(variant) = document.variant else { return Ok(None) };
    let extension = primitive.extensions.as_ref().and_then(|extensions| extensions.others.get(EXTENSION));
    let mappings = extension.and_then(|extension| extension.get("mappings")).and_then(|mappings| mappings.as_array());
    let number = |value: Option<&serde_json::Value>| value?.as_u64().and_then(|index| usize::try_from(index).ok());
    for (position, mapping) in mappings.into_iter().flatten().enumerate() {
        let place = format!("{place}.extensions.{EXTENSION}.mappings[{position}]");
        let variants = mapping.get("variants").and_then(|variants| variants.as_array());
        let variants = variants.ok_or_else(|| document.bad(&place, "it has no variants"))?;
        let mut chosen = false;
        for named in variants {
            let named = number(Some(named)).filter(|&index| index < document.contents.variants.len());
            let count = document.contents.variants.len();
            chosen |=
                named.ok_or_else(|| document.bad(&place, format!("a variant is not one of the {count}")))? == variant;
        }
        if chosen {
            let material = number(mapping.get("material"));
            let material = material.ok_or_else(|| document.bad(&place, "it has no material"))?;
            document.at(&document.root.materials, material, "materials", &place)?;
            return Ok(Some(material));
        }
    }
    Ok(None)
}
