//! Skins: joints and their inverse bind matrices.

use super::accessor::{self, Elements};
use super::buffers::Buffers;
use super::container::Document;
use super::mesh::Budget;
use crate::error::Result;
use crate::scene::rig::{Joint, Rig, Skin};
use glam::Mat4;

/// Loads skin `index` into `rig`; `nodes` gives for each node of the file its index in the rig. None, with a warning,
/// where a joint is not in the scene: then there is nothing that the mesh could follow.
pub(super) fn load(
    document: &Document,
    buffers: &Buffers,
    budget: &mut Budget,
    index: usize,
    nodes: &[Option<u32>],
    rig: &mut Rig,
    warnings: &mut Vec<String>,
) -> Result<Option<u32>> {
    let skin = document.at(&document.root.skins, index, "skins", "skins")?;
    let place = format!("skins[{index}]");
    if skin.joints.is_empty() {
        return Err(document.bad(place, "it has no joints"));
    }
    let matrices = match skin.inverse_bind_matrices {
        Some(accessor) => {
            let place = format!("{place}.inverseBindMatrices");
            let matrices = Elements::open(document, buffers, budget, accessor.value(), &accessor::MATRIX, &place)?;
            // More matrices than joints are allowed and not used.
            if matrices.count < skin.joints.len() {
                let what = format!("it has {} matrices for {} joints", matrices.count, skin.joints.len());
                return Err(document.bad(place, what));
            }
            Some(matrices)
        }
        None => None,
    };
    let mut joints = Vec::with_capacity(skin.joints.len());
    for (i, joint) in skin.joints.iter().enumerate() {
        let joint_place = format!("{place}.joints[{i}]");
        let Some(node) = *document.at(nodes, joint.value(), "nodes", &joint_place)? else {
            let node = joint.value();
            warnings.push(format!("{joint_place}: nodes[{node}] is not in the scene: the skin is left out"));
            return Ok(None);
        };
        let inverse_bind =
            matrices.as_ref().map_or(Mat4::IDENTITY, |matrices| Mat4::from_cols_array(&matrices.vector::<16>(i, 0.0)));
        document.finite(inverse_bind.to_cols_array(), &format!("{place}.inverseBindMatrices, matrix {i}"))?;
        joints.push(Joint { inverse_bind, node, padding: [0; 3] });
    }
    budget.charge(document, joints.len() as u64 * size_of::<Joint>() as u64)?;
    rig.skins.push(Skin { first_joint: rig.joints.len() as u32, joint_count: joints.len() as u32 });
    rig.joints.extend(joints);
    Ok(Some(rig.skins.len() as u32 - 1))
}
