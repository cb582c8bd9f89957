//! `EXT_mesh_gpu_instancing`: many placements of one node's mesh.

use super::MAX_INSTANCES;
use super::accessor::{self, Elements, Shape};
use super::buffers::Buffers;
use super::container::Document;
use super::mesh::Budget;
use crate::error::Result;
use glam::{Mat4, Quat, Vec3, Vec4};
use gltf::json::Node;

const EXTENSION: &str = "EXT_mesh_gpu_instancing";

/// The transforms of `node`'s instances to the node's own space, or none where it has no such extension. Attributes other
/// than translation, rotation and scale are ignored.
pub(super) fn load(
    document: &Document,
    buffers: &Buffers,
    budget: &mut Budget,
    node: &Node,
    place: &str,
) -> Result<Option<Vec<Mat4>>> {
    let extension = node.extensions.as_ref().and_then(|extensions| extensions.others.get(EXTENSION));
    let Some(extension) = extension else { return Ok(None) };
    let place = format!("{place}.extensions.{EXTENSION}.attributes");
    let mut open = |name: &str, shape: &Shape| {
        let Some(index) = extension.get("attributes").and_then(|attributes| attributes.get(name)) else {
            return Ok(None);
        };
        let place = format!("{place}.{name}");
        let index = index.as_u64().and_then(|index| usize::try_from(index).ok());
        let index = index.ok_or_else(|| document.bad(&place, "it is no index"))?;
        Elements::open(document, buffers, budget, index, shape, &place).map(Some)
    };
    let translations = open("TRANSLATION", &accessor::FLOAT_VEC3)?;
    let rotations = open("ROTATION", &accessor::QUATERNION)?;
    let scales = open("SCALE", &accessor::FLOAT_VEC3)?;
    let counts: Vec<usize> = [&translations, &rotations, &scales].into_iter().flatten().map(|e| e.count).collect();
    let Some(&count) = counts.first() else {
        return Err(document.bad(place, "it has neither TRANSLATION nor ROTATION nor SCALE"));
    };
    if counts.iter().any(|&other| other != count) {
        return Err(document.bad(place, format!("its attributes have different numbers of elements: {counts:?}")));
    }
    document.within("the scene", count as u64, MAX_INSTANCES, "instances")?;
    budget.charge(document, count as u64 * size_of::<Mat4>() as u64)?;
    let transform = |i: usize| {
        let vector = |elements: &Option<Elements>, default: Vec3| {
            elements.as_ref().map_or(default, |elements| Vec3::from(elements.vector::<3>(i, 0.0)))
        };
        let rotation = rotations.as_ref().map_or(Vec4::W, |elements| Vec4::from(elements.vector::<4>(i, 0.0)));
        // What is left of the length by rounding, or by quantization, is removed.
        let rotation = rotation.try_normalize();
        let rotation =
            rotation.ok_or_else(|| document.bad(format!("{place}.ROTATION"), format!("element {i} has no length")))?;
        let transform = Mat4::from_scale_rotation_translation(
            vector(&scales, Vec3::ONE),
            Quat::from_vec4(rotation),
            vector(&translations, Vec3::ZERO),
        );
        if transform.is_finite() {
            Ok(transform)
        } else {
            Err(document.bad(&place, format!("element {i} is not finite")))
        }
    };
    (0..count).map(transform).collect::<Result<_>>().map(Some)
}
