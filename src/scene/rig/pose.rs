//! Where everything is at a moment.

use super::{NONE, POWER, Placement, ROTATION, Rig, SCALE, TRANSLATION, WEIGHTS, keyframes};
use glam::{Mat4, Quat, Vec3};
use std::f64::consts::TAU;

/// A rig at one moment.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pose {
    /// To world space, one a node.
    pub world: Vec<Mat4>,
    /// Of morph targets, as [`Rig::weights`].
    pub weights: Vec<f32>,
    /// Factors on the power of lights, as [`Rig::powers`].
    pub powers: Vec<f32>,
}

impl Rig {
    /// Everything at rest: where the file says that nodes are, with no clip played.
    pub fn rest(&self) -> Pose {
        self.evaluate(None, 0.0)
    }

    /// Clip `clip` at `time` seconds. The clip starts again when it has come to its end; a time that is exactly its
    /// duration is its end, not its start. Where there is no such clip only spins move.
    pub fn pose(&self, clip: usize, time: f64) -> Pose {
        self.evaluate(Some(clip), time)
    }

    fn evaluate(&self, clip: Option<usize>, time: f64) -> Pose {
        let mut nodes = self.nodes.clone();
        let mut weights = self.weights.clone();
        let mut powers = self.powers.clone();
        let clip = clip.and_then(|clip| self.clips.get(clip));
        if let Some(clip) = clip {
            let local = local_time(time, clip.duration);
            let channels = self.channels.get(clip.first_channel as usize..).unwrap_or_default();
            for channel in channels.iter().take(clip.channel_count as usize) {
                let mut value = [0.0; 4];
                let value = match (channel.path, value.get_mut(..channel.width as usize)) {
                    (WEIGHTS, _) => {
                        let range = channel.first_weight as usize..(channel.first_weight + channel.width) as usize;
                        weights.get_mut(range).unwrap_or_default()
                    }
                    (POWER, _) => powers
                        .get_mut(channel.first_weight as usize..)
                        .and_then(|rest| rest.get_mut(..1))
                        .unwrap_or_default(),
                    (_, Some(value)) => value,
                    _ => continue,
                };
                keyframes::sample(channel, &self.keys, local, value);
                let Some(node) = nodes.get_mut(channel.node as usize) else { continue };
                match (channel.path, &*value) {
                    (TRANSLATION, &[x, y, z]) => node.translation = Vec3::new(x, y, z),
                    (ROTATION, &[x, y, z, w]) => node.rotation = Quat::from_xyzw(x, y, z, w),
                    (SCALE, &[x, y, z]) => node.scale = Vec3::new(x, y, z),
                    _ => {}
                }
            }
        }
        for spin in &self.spins {
            if let Some(node) = nodes.get_mut(spin.node as usize) {
                let angle = (f64::from(spin.angular_speed) * time).rem_euclid(TAU);
                node.rotation *= Quat::from_axis_angle(spin.axis, angle as f32);
            }
        }
        let mut world: Vec<Mat4> = Vec::with_capacity(nodes.len());
        for node in &nodes {
            let local = node.local();
            world.push(world.get(node.parent as usize).map_or(local, |parent| *parent * local));
        }
        // A spline may swing below its keyframes, or out of all numbers.
        powers.iter_mut().for_each(|power| *power = if power.is_finite() { power.max(0.0) } else { 0.0 });
        Pose { world, weights, powers }
    }
}

/// The moment of a clip of `duration` seconds that is played from time 0 on, again and again.
fn local_time(time: f64, duration: f32) -> f32 {
    let length = f64::from(duration);
    if (0.0..=length).contains(&time) || length <= 0.0 {
        return time as f32;
    }
    time.rem_euclid(length) as f32
}

impl Pose {
    /// Where a node is.
    pub fn node(&self, node: u32) -> Mat4 {
        self.world.get(node as usize).copied().unwrap_or(Mat4::IDENTITY)
    }

    /// What takes an instance's mesh to world space. A skinned mesh is in world space once it is deformed.
    pub fn instance(&self, placement: &Placement) -> Mat4 {
        if placement.skin != NONE { Mat4::IDENTITY } else { self.node(placement.node) * placement.offset }
    }

    /// The matrices of a skin's joints, from the mesh's space in its bind pose to world space.
    pub fn joint_matrices(&self, rig: &Rig, skin: u32) -> Vec<Mat4> {
        rig.joints_of(skin).iter().map(|joint| self.node(joint.node) * joint.inverse_bind).collect()
    }

    /// The weights of an instance's morph targets.
    pub fn morph_weights(&self, placement: &Placement) -> &[f32] {
        let first = self.weights.get(placement.first_weight as usize..).unwrap_or_default();
        first.get(..placement.weight_count as usize).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{LINEAR, Node, Spin};
    use super::*;

    fn swing() -> Rig {
        let mut rig = Rig::default();
        let root = rig.add_node(Node { translation: Vec3::X, ..Node::default() });
        let arm = rig.add_node(Node { parent: root, translation: Vec3::Y, ..Node::default() });
        rig.add_node(Node { parent: arm, translation: Vec3::Z, ..Node::default() });
        rig.add_clip("swing");
        let quarter = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
        let turns = [Quat::IDENTITY.to_array(), quarter.to_array()].concat();
        rig.add_channel(arm, ROTATION, LINEAR, &[0.0, 2.0], &turns);
        rig
    }

    fn tip(rig: &Rig, time: f64) -> Vec3 {
        rig.pose(0, time).node(2).w_axis.truncate()
    }

    #[test]
    fn children_follow_their_parents() {
        let rig = swing();
        assert_eq!(rig.rest().node(2).w_axis.truncate(), Vec3::ONE);
        // A quarter turn round X takes Z to -Y.
        assert!((tip(&rig, 2.0) - Vec3::new(1.0, 0.0, 0.0)).length() < 1e-6);
        let half = std::f32::consts::FRAC_1_SQRT_2;
        assert!((tip(&rig, 1.0) - Vec3::new(1.0, 1.0 - half, half)).length() < 1e-6);
    }

    #[test]
    fn clips_start_again_at_their_end() {
        let rig = swing();
        assert_eq!(rig.duration(0), 2.0);
        assert_eq!(tip(&rig, 7.0), tip(&rig, 1.0));
        assert_eq!(tip(&rig, -1.0), tip(&rig, 1.0));
        assert_ne!(tip(&rig, 2.0), tip(&rig, 0.0), "the end itself can be seen");
        assert_eq!(rig.pose(5, 1.0), rig.rest(), "no such clip");
    }

    #[test]
    fn spins_turn_for_ever() {
        let mut rig = swing();
        rig.spins.push(Spin { axis: Vec3::Y, angular_speed: -0.5, node: 0 });
        for time in [0.0, 1.5, 1e6] {
            let angle = (-0.5f64 * time).rem_euclid(TAU) as f32;
            let expected = Vec3::X + Quat::from_rotation_y(angle) * Vec3::new(0.0, 1.0, 1.0);
            let found = rig.pose(9, time).node(2).w_axis.truncate();
            assert!((found - expected).length() < 1e-5, "{time}: {found} {expected}");
        }
    }
}
