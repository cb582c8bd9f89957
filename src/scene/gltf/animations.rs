//! Animations: channels, samplers and their keyframes.

use super::accessor::{self, Elements};
use super::buffers::Buffers;
use super::container::Document;
use super::mesh::Budget;
use super::pointers::PowerChannel;
use super::tidy;
use crate::error::Result;
use crate::scene::rig::{CUBIC_SPLINE, LINEAR, ROTATION, Rig, SCALE, STEP, TRANSLATION, WEIGHTS};
use gltf::json;
use json::animation::{Interpolation, Property, Sampler};
use json::validation::Checked;

/// What the channels of a file may target.
pub(super) struct Targets<'a> {
    /// For each node of the file, its index in the rig, if it is in the scene.
    pub nodes: &'a [Option<u32>],
    /// For each node of the file, how many morph targets its mesh has.
    pub weights: &'a [u32],
}

/// Loads every animation into `rig`, in file order, each with its `powers`. Channels whose node is not in the scene move nothing.
pub(super) fn load(
    document: &Document,
    buffers: &Buffers,
    budget: &mut Budget,
    targets: &Targets,
    powers: &[PowerChannel],
    rig: &mut Rig,
    warnings: &mut Vec<String>,
) -> Result<()> {
    let mut powers = powers.iter().peekable();
    for (index, animation) in document.root.animations.iter().enumerate() {
        let place = format!("animations[{index}]");
        rig.add_clip(animation.name.as_deref().map_or_else(|| place.clone(), tidy));
        for (position, channel) in animation.channels.iter().enumerate() {
            let channel_place = format!("{place}.channels[{position}]");
            let node_index = channel.target.node.value();
            document.at(&document.root.nodes, node_index, "nodes", &format!("{channel_place}.target.node"))?;
            let sampler_index = channel.sampler.value();
            let sampler =
                document.at(&animation.samplers, sampler_index, "samplers", &format!("{channel_place}.sampler"))?;
            let Checked::Valid(property) = channel.target.path else {
                warnings.push(format!("{channel_place}: its path is unknown, and it is not played"));
                continue;
            };
            let reader = Reader { document, buffers, sampler, place: format!("{place}.samplers[{sampler_index}]") };
            let weights = targets.weights.get(node_index).copied().unwrap_or_default();
            if property == Property::MorphTargetWeights && weights == 0 {
                warnings.push(format!("{channel_place}: its node has no morph targets, and it is not played"));
                continue;
            }
            let keyframes = reader.read(budget, property, weights)?;
            if let Some(&Some(node)) = targets.nodes.get(node_index) {
                let path = path(property);
                // A mesh without triangles has no weights in the rig.
                if path == WEIGHTS && !rig.instances.iter().any(|placement| placement.node == node) {
                    continue;
                }
                rig.add_channel(node, path, keyframes.interpolation, &keyframes.times, &keyframes.values);
            }
        }
        while let Some(PowerChannel { power, keyframes, .. }) = powers.next_if(|next| next.animation == index) {
            rig.add_power_channel(*power, keyframes.interpolation, &keyframes.times, &keyframes.values);
        }
    }
    Ok(())
}

fn path(property: Property) -> u32 {
    match property {
        Property::Translation => TRANSLATION,
        Property::Rotation => ROTATION,
        Property::Scale => SCALE,
        Property::MorphTargetWeights => WEIGHTS,
    }
}

/// A sampler's contents.
pub(super) struct Keyframes {
    pub interpolation: u32,
    pub times: Vec<f32>,
    pub values: Vec<f32>,
}

pub(super) struct Reader<'a> {
    pub document: &'a Document<'a>,
    pub buffers: &'a Buffers<'a>,
    pub sampler: &'a Sampler,
    pub place: String,
}

impl Reader<'_> {
    /// Times and values, checked; `weights` is the number of weights in a keyframe of those.
    pub fn read(&self, budget: &mut Budget, property: Property, weights: u32) -> Result<Keyframes> {
        let interpolation =
            self.document.valid(&self.sampler.interpolation, &format!("{}.interpolation", self.place))?;
        let (interpolation, per_key) = match interpolation {
            Interpolation::Step => (STEP, 1),
            Interpolation::Linear => (LINEAR, 1),
            Interpolation::CubicSpline => (CUBIC_SPLINE, 3),
        };
        let times = self.times(budget)?;
        let (shape, per_value) = match property {
            Property::Rotation => (&accessor::ROTATION, 1),
            Property::MorphTargetWeights => (&accessor::SCALAR, weights as usize),
            Property::Translation | Property::Scale => (&accessor::FLOAT_VEC3, 1),
        };
        let place = format!("{}.output", self.place);
        let index = self.sampler.output.value();
        let output = Elements::open(self.document, self.buffers, budget, index, shape, &place)?;
        let expected = times.len() as u64 * per_key * per_value as u64;
        if output.count as u64 != expected {
            let what = format!("it has {} elements, but {} keyframes take {expected}", output.count, times.len());
            return Err(self.document.bad(place, what));
        }
        budget.charge(self.document, expected * 16)?;
        let values: Vec<f32> = match property {
            Property::Rotation => (0..output.count).flat_map(|i| output.vector::<4>(i, 0.0)).collect(),
            Property::MorphTargetWeights => (0..output.count).flat_map(|i| output.vector::<1>(i, 0.0)).collect(),
            Property::Translation | Property::Scale => {
                (0..output.count).flat_map(|i| output.vector::<3>(i, 0.0)).collect()
            }
        };
        if let Some(bad) = values.iter().position(|value| !value.is_finite()) {
            return Err(self.document.bad(place, format!("number {bad} is not finite")));
        }
        if property == Property::Rotation {
            let is_value = |element: usize| per_key == 1 || element % 3 == 1;
            let lengthless = |q: &[f32]| q.iter().map(|x| x * x).sum::<f32>() < f32::MIN_POSITIVE;
            let bad = values.chunks_exact(4).enumerate().position(|(i, q)| is_value(i) && lengthless(q));
            if let Some(element) = bad {
                return Err(self.document.bad(place, format!("element {element} is a rotation without length")));
            }
        }
        Ok(Keyframes { interpolation, times, values })
    }

    /// Times that are finite and do not descend. (The specification wants them to ascend; exporters repeat some.)
    fn times(&self, budget: &mut Budget) -> Result<Vec<f32>> {
        let place = format!("{}.input", self.place);
        let index = self.sampler.input.value();
        let input = Elements::open(self.document, self.buffers, budget, index, &accessor::TIME, &place)?;
        budget.charge(self.document, input.count as u64 * 4)?;
        let times: Vec<f32> = (0..input.count).map(|i| input.vector::<1>(i, 0.0)[0]).collect();
        if times.is_empty() {
            return Err(self.document.bad(place, "it has no keyframes"));
        }
        if let Some(i) = times.iter().position(|time| !(time.is_finite() && *time >= 0.0)) {
            return Err(self.document.bad(place, format!("time {i} is {}", times[i])));
        }
        if let Some(i) = times.windows(2).position(|pair| pair[1] < pair[0]) {
            let what = format!("time {} is {}, before the {} of the keyframe before it", i + 1, times[i + 1], times[i]);
            return Err(self.document.bad(place, what));
        }
        Ok(times)
    }
}
