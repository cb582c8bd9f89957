//! A rig as arrays of bytes, for the flat scene's file.

use super::{Clip, Rig};
use crate::error::Result;
use bytemuck::Pod;
use serde::{Deserialize, Serialize};

/// What is not a large array, and how long those are.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(in crate::scene) struct Header {
    clips: Vec<Clip>,
    lengths: [usize; 11],
}

/// Takes the next array of this many elements.
pub(in crate::scene) trait TakeArray {
    fn take_array<T: Pod>(&mut self, count: usize, place: &str) -> Result<Vec<T>>;
}

/// An array that is filled from its start. Memory that is touched for the first time takes longer than the copy, so that it
/// is not filled with zeros at once.
pub(in crate::scene) trait Section {
    /// Adds zeros for `wanted` bytes, or for a part of about `limit` bytes of them; that part, to be filled.
    fn lengthen(&mut self, wanted: usize, limit: usize) -> &mut [u8];
}

impl<T: Pod> Section for Vec<T> {
    fn lengthen(&mut self, wanted: usize, limit: usize) -> &mut [u8] {
        let before = self.len();
        let count = (wanted / size_of::<T>()).min((limit / size_of::<T>()).max(1));
        self.resize(before + count, T::zeroed());
        bytemuck::cast_slice_mut(&mut self[before..])
    }
}

impl Rig {
    /// What [`Rig::from_arrays`] needs besides the arrays.
    pub(in crate::scene) fn header(&self) -> Header {
        Header {
            clips: self.clips.clone(),
            lengths: [
                self.nodes.len(),
                self.channels.len(),
                self.keys.len(),
                self.spins.len(),
                self.skins.len(),
                self.joints.len(),
                self.weights.len(),
                self.instances.len(),
                self.lights.len(),
                self.cameras.len(),
                self.powers.len(),
            ],
        }
    }

    /// The arrays, in the order of the header's lengths; a flat scene's rig dims nothing by itself.
    pub(in crate::scene) fn arrays(&self) -> [&[u8]; 11] {
        use bytemuck::cast_slice;
        [
            cast_slice(&self.nodes),
            cast_slice(&self.channels),
            cast_slice(&self.keys),
            cast_slice(&self.spins),
            cast_slice(&self.skins),
            cast_slice(&self.joints),
            cast_slice(&self.weights),
            cast_slice(&self.instances),
            cast_slice(&self.lights),
            cast_slice(&self.cameras),
            cast_slice(&self.powers),
        ]
    }

    /// The same, to be filled.
    pub(in crate::scene) fn arrays_mut(&mut self) -> [&mut dyn Section; 11] {
        [
            &mut self.nodes,
            &mut self.channels,
            &mut self.keys,
            &mut self.spins,
            &mut self.skins,
            &mut self.joints,
            &mut self.weights,
            &mut self.instances,
            &mut self.lights,
            &mut self.cameras,
            &mut self.powers,
        ]
    }

    /// The rig again; not checked yet.
    pub(in crate::scene) fn from_arrays(header: Header, reader: &mut impl TakeArray) -> Result<Rig> {
        let [nodes, channels, keys, spins, skins, joints, weights, instances, lights, cameras, powers] = header.lengths;
        Ok(Rig {
            clips: header.clips,
            nodes: reader.take_array(nodes, "rig.nodes")?,
            channels: reader.take_array(channels, "rig.channels")?,
            keys: reader.take_array(keys, "rig.keys")?,
            spins: reader.take_array(spins, "rig.spins")?,
            skins: reader.take_array(skins, "rig.skins")?,
            joints: reader.take_array(joints, "rig.joints")?,
            weights: reader.take_array(weights, "rig.weights")?,
            instances: reader.take_array(instances, "rig.instances")?,
            lights: reader.take_array(lights, "rig.lights")?,
            cameras: reader.take_array(cameras, "rig.cameras")?,
            powers: reader.take_array(powers, "rig.powers")?,
            dimmed_instances: Vec::new(),
            dimmed_lights: Vec::new(),
        })
    }
}
