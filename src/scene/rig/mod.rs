//! What moves, and how: a hierarchy of nodes, the animations that turn them, and what hangs on them.
//!
//! A [`Rig`] knows nothing of pictures. [`Rig::pose`] says where everything is at a moment, [`deform`] what shape a
//! skinned or morphed mesh has then. Plain arrays throughout, so that a Worker can hand a rig to the page.
//!
//! Source: glTF 2.0, sections 3.5, 3.7.2.2, 3.7.3 and 3.11, and appendix C.

pub(in crate::scene) mod bytes;
mod check;
pub mod deform;
mod keyframes;
mod pose;
mod settle;

pub use check::Counts;
pub use pose::Pose;

use super::gpu_types::NONE;
use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Quat, Vec3};

/// Everything that can move in a scene. The default rig moves nothing.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Rig {
    /// Parents stand before their children.
    pub nodes: Vec<Node>,
    /// The animations to choose from.
    pub clips: Vec<Clip>,
    /// Channels of all clips, clip by clip.
    pub channels: Vec<Channel>,
    /// Times and values of all channels.
    pub keys: Vec<f32>,
    /// Nodes that turn for ever, whatever clip is played.
    pub spins: Vec<Spin>,
    /// Skins.
    pub skins: Vec<Skin>,
    /// Joints of all skins, skin by skin.
    pub joints: Vec<Joint>,
    /// Weights of morph targets at rest, node by node.
    pub weights: Vec<f32>,
    /// Instances that hang on nodes.
    pub instances: Vec<Placement>,
    /// Punctual lights that hang on nodes.
    pub lights: Vec<Attachment>,
    /// Cameras that hang on nodes.
    pub cameras: Vec<Attachment>,
    /// Factors on the power of lights at rest, none negative; [`POWER`] channels animate them. A factor of 0 is a light that
    /// is switched off.
    pub powers: Vec<f32>,
    /// Instances all of whose emission a factor multiplies. Empty in a flat scene, where
    /// [`FlatScene::light_powers`](super::FlatScene::light_powers) says it light by light.
    pub dimmed_instances: Vec<Dimmer>,
    /// Punctual lights that a factor multiplies. Empty in a flat scene, as above.
    pub dimmed_lights: Vec<Dimmer>,
}

/// A coordinate system: `T * R * S * matrix` takes it to its parent's.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Node {
    /// Translation at rest, metres.
    pub translation: Vec3,
    /// Index of the parent, or [`NONE`].
    pub parent: u32,
    /// Unit rotation at rest.
    pub rotation: Quat,
    /// Scale at rest.
    pub scale: Vec3,
    /// Unused.
    pub padding: u32,
    /// What comes before scale, rotation and translation: the matrix of a node that was given by one.
    pub matrix: Mat4,
}

impl Default for Node {
    fn default() -> Self {
        Node {
            translation: Vec3::ZERO,
            parent: NONE,
            rotation: Quat::IDENTITY,
            scale: Vec3::ONE,
            padding: 0,
            matrix: Mat4::IDENTITY,
        }
    }
}

impl Node {
    /// To the parent's space.
    pub fn local(&self) -> Mat4 {
        Mat4::from_scale_rotation_translation(self.scale, self.rotation, self.translation) * self.matrix
    }
}

/// One animation: a loop over keyframes.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Clip {
    /// For menus and `--animation NAME`.
    pub name: String,
    /// Index of the first channel.
    pub first_channel: u32,
    /// Number of channels.
    pub channel_count: u32,
    /// Time of the last keyframe in seconds, after which the clip starts again.
    pub duration: f32,
}

/// [`Channel::path`]: a node's translation.
pub const TRANSLATION: u32 = 0;
/// [`Channel::path`]: a node's rotation.
pub const ROTATION: u32 = 1;
/// [`Channel::path`]: a node's scale.
pub const SCALE: u32 = 2;
/// [`Channel::path`]: weights of morph targets.
pub const WEIGHTS: u32 = 3;
/// [`Channel::path`]: a factor on the power of lights.
pub const POWER: u32 = 4;

/// [`Channel::interpolation`]: the value of the keyframe before.
pub const STEP: u32 = 0;
/// [`Channel::interpolation`]: linear, spherical for rotations.
pub const LINEAR: u32 = 1;
/// [`Channel::interpolation`]: cubic Hermite; each keyframe has in-tangent, value and out-tangent.
pub const CUBIC_SPLINE: u32 = 2;

/// How one property of one node, or one factor on the power of lights, follows keyframes.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub struct Channel {
    /// The node, or [`NONE`] for [`POWER`].
    pub node: u32,
    /// [`TRANSLATION`], [`ROTATION`], [`SCALE`], [`WEIGHTS`] or [`POWER`].
    pub path: u32,
    /// [`STEP`], [`LINEAR`] or [`CUBIC_SPLINE`].
    pub interpolation: u32,
    /// Number of keyframes, at least 1.
    pub count: u32,
    /// Numbers in a value.
    pub width: u32,
    /// Index in [`Rig::keys`] of the first time; times never descend.
    pub first_time: u32,
    /// Index in [`Rig::keys`] of the first value.
    pub first_value: u32,
    /// Index in [`Rig::weights`] of the first of `width` weights, or in [`Rig::powers`] of the factor; 0 for other paths.
    pub first_weight: u32,
}

/// A node that turns round an axis at a constant rate, before its other motion.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Spin {
    /// Unit axis in the node's space.
    pub axis: Vec3,
    /// Radians a second.
    pub angular_speed: f32,
    /// The node.
    pub node: u32,
}

/// A run of [`Rig::joints`].
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub struct Skin {
    /// Index of the first joint.
    pub first_joint: u32,
    /// Number of joints.
    pub joint_count: u32,
}

/// One joint of a skin.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Joint {
    /// Takes the mesh's space in its bind pose to the joint's.
    pub inverse_bind: Mat4,
    /// The node that is the joint.
    pub node: u32,
    /// Unused.
    pub padding: [u32; 3],
}

/// An instance on a node.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Placement {
    /// Takes the instance's space to the node's.
    pub offset: Mat4,
    /// The instance.
    pub instance: u32,
    /// The node.
    pub node: u32,
    /// Index in [`Rig::skins`], or [`NONE`]. A skinned mesh follows its joints alone, not its node.
    pub skin: u32,
    /// Index in [`Rig::weights`] of the weight of its mesh's first morph target.
    pub first_weight: u32,
    /// Number of morph targets.
    pub weight_count: u32,
    /// Unused.
    pub padding: [u32; 3],
}

impl Placement {
    /// An instance that takes the whole of its node's motion and has no shape of its own to change.
    pub fn rigid(instance: u32, node: u32) -> Self {
        let offset = Mat4::IDENTITY;
        Placement { offset, instance, node, skin: NONE, first_weight: 0, weight_count: 0, padding: [0; 3] }
    }
}

/// A light or camera on a node; it looks along the node's -Z.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub struct Attachment {
    /// The light or camera.
    pub target: u32,
    /// The node.
    pub node: u32,
}

/// What a factor on the power of lights dims.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dimmer {
    /// The instance or light.
    pub target: u32,
    /// Index in [`Rig::powers`].
    pub power: u32,
}

/// How an instance of a rig moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Not at all.
    Still,
    /// As a whole.
    Rigid,
    /// Its mesh changes its shape.
    Deforming,
}

impl Rig {
    /// Whether nothing moves and no light changes, whatever clip is played.
    pub fn is_still(&self) -> bool {
        self.instances.is_empty() && self.lights.is_empty() && self.cameras.is_empty() && self.powers.is_empty()
    }

    /// Adds a node; its index.
    pub fn add_node(&mut self, node: Node) -> u32 {
        self.nodes.push(node);
        self.nodes.len() as u32 - 1
    }

    /// Adds a channel to the last clip: `values` one after another, `times` in seconds.
    pub fn add_channel(&mut self, node: u32, path: u32, interpolation: u32, times: &[f32], values: &[f32]) {
        let placed = self.instances.iter().find(|placement| path == WEIGHTS && placement.node == node);
        let first_weight = placed.map_or(0, |placement| placement.first_weight);
        self.push_channel([node, path, interpolation, first_weight], times, values);
    }

    /// Adds a factor on the power of lights, which is `rest` where no clip says anything else; its index.
    pub fn add_power(&mut self, rest: f32) -> u32 {
        self.powers.push(rest);
        self.powers.len() as u32 - 1
    }

    /// As [`Rig::add_channel`], for factor `power` on the power of lights.
    pub fn add_power_channel(&mut self, power: u32, interpolation: u32, times: &[f32], values: &[f32]) {
        self.push_channel([NONE, POWER, interpolation, power], times, values);
    }

    fn push_channel(&mut self, [node, path, interpolation, first_weight]: [u32; 4], times: &[f32], values: &[f32]) {
        let per_key = if interpolation == CUBIC_SPLINE { 3 } else { 1 };
        let first_time = self.keys.len() as u32;
        self.keys.extend(times);
        let first_value = self.keys.len() as u32;
        self.keys.extend(values);
        self.channels.push(Channel {
            node,
            path,
            interpolation,
            count: times.len() as u32,
            width: (values.len() / (per_key * times.len()).max(1)) as u32,
            first_time,
            first_value,
            first_weight,
        });
        if let Some(clip) = self.clips.last_mut() {
            clip.channel_count += 1;
            clip.duration = clip.duration.max(times.last().copied().unwrap_or_default());
        }
    }

    /// Begins a clip without channels.
    pub fn add_clip(&mut self, name: impl Into<String>) {
        let first_channel = self.channels.len() as u32;
        self.clips.push(Clip { name: name.into(), first_channel, channel_count: 0, duration: 0.0 });
    }

    /// Seconds after which everything is where it was: of a clip, or of the slowest spin where there are no clips; 0 for
    /// a rig that is still.
    pub fn duration(&self, clip: usize) -> f32 {
        let turn = |spin: &Spin| std::f32::consts::TAU / spin.angular_speed.abs();
        let turns = self.spins.iter().map(turn).filter(|turn| turn.is_finite());
        self.clips.get(clip).map_or_else(|| turns.fold(0.0, f32::max), |clip| clip.duration)
    }

    /// The clip of this name or index.
    ///
    /// # Errors
    /// [`Error::Unknown`](crate::Error::Unknown) listing the names there are.
    pub fn find_clip(&self, name: &str) -> crate::Result<usize> {
        let named = self.clips.iter().position(|clip| clip.name == name);
        let numbered = || name.parse().ok().filter(|&index: &usize| index < self.clips.len());
        named.or_else(numbered).ok_or_else(|| crate::Error::Unknown {
            kind: "animation",
            name: name.to_owned(),
            known: self.clips.iter().map(|clip| clip.name.as_str()).collect::<Vec<_>>().join(", "),
        })
    }

    /// For each node, whether any clip or spin moves it or a node above it.
    pub fn moving_nodes(&self) -> Vec<bool> {
        let mut moving = vec![false; self.nodes.len()];
        let turned = self.spins.iter().map(|spin| spin.node);
        let animated = self.channels.iter().filter(|channel| channel.path < WEIGHTS).map(|channel| channel.node);
        for node in turned.chain(animated) {
            if let Some(moving) = moving.get_mut(node as usize) {
                *moving = true;
            }
        }
        for i in 0..self.nodes.len() {
            moving[i] |= moving.get(self.nodes[i].parent as usize).copied().unwrap_or(false);
        }
        moving
    }

    /// The joints of skin `index`; none for [`NONE`].
    pub fn joints_of(&self, index: u32) -> &[Joint] {
        let run = self.skins.get(index as usize);
        run.and_then(|skin| self.joints.get(skin.first_joint as usize..)?.get(..skin.joint_count as usize))
            .unwrap_or_default()
    }

    /// How an instance moves; `moving` is what [`Rig::moving_nodes`] gives.
    pub fn motion(&self, placement: &Placement, moving: &[bool]) -> Motion {
        let moves = |node: u32| moving.get(node as usize).copied().unwrap_or(false);
        let weights = placement.first_weight..placement.first_weight + placement.weight_count;
        let morphs = self.channels.iter().any(|c| c.path == WEIGHTS && weights.contains(&c.first_weight));
        let joints = self.joints_of(placement.skin);
        if morphs || joints.iter().any(|joint| moves(joint.node)) {
            return Motion::Deforming;
        }
        if joints.is_empty() && moves(placement.node) { Motion::Rigid } else { Motion::Still }
    }
}
