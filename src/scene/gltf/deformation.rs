//! What changes the shape of a primitive: the joints of its vertices, and its morph targets.

use super::accessor::{self, Elements};
use super::buffers::Buffers;
use super::container::Document;
use super::mesh::Budget;
use crate::error::Result;
use crate::scene::rig::deform::Displacement;
use crate::scene::{Deformation, Influence};
use glam::Vec3;
use gltf::json;
use json::mesh::{Primitive, Semantic};

/// Most sets of four joints that are looked for.
const MAX_SETS: u32 = 4;

/// A primitive whose deformation is read.
pub(super) struct Reader<'a> {
    pub primitive: &'a super::mesh::Reader<'a>,
    pub document: &'a Document<'a>,
    pub buffers: &'a Buffers<'a>,
    pub source: &'a Primitive,
    pub place: &'a str,
    /// Elements of POSITION.
    pub count: usize,
}

impl Reader<'_> {
    /// The deformation of the vertices that `sources` names, one a vertex of the mesh.
    pub fn read(&self, budget: &mut Budget, sources: &[u32], warnings: &mut Vec<String>) -> Result<Deformation> {
        let has_skins = !self.document.root.skins.is_empty();
        let influences = if has_skins { self.influences(budget, sources, warnings)? } else { Vec::new() };
        let mut repaired = 0;
        let mut targets = Vec::new();
        for (i, target) in self.source.targets.iter().flatten().enumerate() {
            let mut open = |name: &str, index: Option<json::Index<json::Accessor>>, shape: &accessor::Shape| {
                index.map(|index| self.open(&format!("targets[{i}].{name}"), index.value(), shape, budget)).transpose()
            };
            let positions = open("POSITION", target.positions, &accessor::POSITION)?;
            let normals = open("NORMAL", target.normals, &accessor::NORMAL)?;
            let tangents = open("TANGENT", target.tangents, &accessor::NORMAL)?;
            budget.charge(self.document, sources.len() as u64 * size_of::<Displacement>() as u64)?;
            let mut read = |elements: &Option<Elements>, source: u32| {
                let read = elements.as_ref().map_or([0.0; 3], |e| e.vector::<3>(source as usize, 0.0));
                let read = Vec3::from(read);
                if read.is_finite() {
                    return read;
                }
                repaired += 1;
                Vec3::ZERO
            };
            let displacements = sources.iter().map(|&source| Displacement {
                position: read(&positions, source),
                normal: read(&normals, source),
                tangent: read(&tangents, source),
            });
            targets.push(displacements.collect());
        }
        if repaired > 0 {
            warnings.push(format!(
                "{}: {repaired} displacement(s) of morph targets were not finite: taken as 0",
                self.place
            ));
        }
        Ok(Deformation { influences, targets, flat: false })
    }

    /// An accessor with as many elements as there are positions.
    fn open(&self, name: &str, index: usize, shape: &accessor::Shape, budget: &mut Budget) -> Result<Elements<'_>> {
        let place = format!("{}.{name}", self.place);
        let elements = Elements::open(self.document, self.buffers, budget, index, shape, &place)?;
        if elements.count != self.count {
            let what = format!("it has {} elements, but POSITION has {}", elements.count, self.count);
            return Err(self.document.bad(format!("{place} = accessors[{index}]"), what));
        }
        Ok(elements)
    }

    /// The four joints that move each vertex most, their weights normalised (specification, section 3.7.3.3).
    fn influences(&self, budget: &mut Budget, sources: &[u32], warnings: &mut Vec<String>) -> Result<Vec<Influence>> {
        let mut sets = Vec::new();
        for set in 0..MAX_SETS {
            let count = Some(self.count);
            let joints = self.primitive.attribute(budget, Semantic::Joints(set), &accessor::JOINTS, count)?;
            let weights = self.primitive.attribute(budget, Semantic::Weights(set), &accessor::WEIGHTS, count)?;
            match (joints, weights) {
                (Some(joints), Some(weights)) => sets.push((joints, weights)),
                (None, None) => break,
                _ => {
                    let what = format!("JOINTS_{set} and WEIGHTS_{set} come together");
                    return Err(self.document.bad(format!("{}.attributes", self.place), what));
                }
            }
        }
        if sets.is_empty() {
            return Ok(Vec::new());
        }
        budget.charge(self.document, sources.len() as u64 * size_of::<Influence>() as u64)?;
        let (mut repaired, mut dropped) = (0u64, 0u64);
        let mut influences = Vec::with_capacity(sources.len());
        for &source in sources {
            let mut all: Vec<(u16, f32)> = Vec::with_capacity(4 * sets.len());
            for (joints, weights) in &sets {
                all.extend(joints.joints(source as usize).into_iter().zip(weights.vector::<4>(source as usize, 0.0)));
            }
            let sound = all.iter().all(|(_, weight)| weight.is_finite() && *weight >= 0.0);
            if sets.len() > 1 {
                all.sort_by(|a, b| b.1.total_cmp(&a.1));
                dropped += u64::from(all.iter().skip(4).any(|(_, weight)| *weight > 0.0));
            }
            let mut influence = Influence::default();
            for (k, (joint, weight)) in all.into_iter().take(4).enumerate() {
                influence.joints[k] = joint;
                influence.weights[k] = if weight.is_finite() { weight.max(0.0) } else { 0.0 };
            }
            let sum: f32 = influence.weights.iter().sum();
            if sum > 0.0 && sum.is_finite() {
                influence.weights = influence.weights.map(|weight| weight / sum);
            } else {
                influence.weights = [1.0, 0.0, 0.0, 0.0];
            }
            repaired += u64::from(!(sound && sum > 0.0 && sum.is_finite()));
            influences.push(influence);
        }
        if repaired > 0 {
            let place = self.place;
            warnings.push(format!(
                "{place}: the joint weights of {repaired} vertices are not usable; they follow what is left"
            ));
        }
        if dropped > 0 {
            warnings.push(format!(
                "{}: {dropped} vertices follow more than four joints: the four strongest are kept",
                self.place
            ));
        }
        Ok(influences)
    }
}
