//! Whether a rig is sound: what evaluates it trusts its indices.

use super::{CUBIC_SPLINE, Channel, Clip, NONE, POWER, ROTATION, Rig, WEIGHTS};

/// (where, what is wrong there).
type Fault = (String, String);

/// What a rig may refer to.
#[derive(Debug, Clone, Copy)]
pub struct Counts {
    /// Instances of the scene.
    pub instances: usize,
    /// Punctual lights of the scene.
    pub lights: usize,
    /// Cameras of the scene.
    pub cameras: usize,
}

impl Rig {
    /// The first fault, if any: an index that points nowhere, a number that is not finite, times that descend.
    ///
    /// # Errors
    /// Where, and what is wrong there.
    pub fn check(&self, counts: Counts) -> Result<(), Fault> {
        each("rig.nodes", &self.nodes, |i, node| {
            let finite = node.translation.is_finite() && node.rotation.is_finite() && node.scale.is_finite();
            must(finite && node.matrix.is_finite(), "numbers that are not finite")?;
            must(node.parent == NONE || (node.parent as usize) < i, "its parent does not stand before it")
        })?;
        must(self.keys.iter().all(|key| key.is_finite()), "not finite").map_err(|what| fault("rig.keys", what))?;
        must(self.weights.iter().all(|weight| weight.is_finite()), "not finite")
            .map_err(|what| fault("rig.weights", what))?;
        let is_power = |power: &f32| power.is_finite() && *power >= 0.0;
        must(self.powers.iter().all(is_power), "negative, or not finite").map_err(|what| fault("rig.powers", what))?;
        for (name, dimmers, count) in [
            ("rig.dimmed_instances", &self.dimmed_instances, counts.instances),
            ("rig.dimmed_lights", &self.dimmed_lights, counts.lights),
        ] {
            each(name, dimmers, |_, dimmer| {
                must((dimmer.target as usize) < count, "there is nothing of that index")?;
                must((dimmer.power as usize) < self.powers.len(), "no such power")
            })?;
        }
        each("rig.clips", &self.clips, |_, clip| self.check_clip(clip))?;
        each("rig.channels", &self.channels, |_, channel| self.check_channel(channel))?;
        let is_node = |node: u32| must((node as usize) < self.nodes.len(), "no such node");
        each("rig.spins", &self.spins, |_, spin| {
            must(spin.axis.is_normalized() && spin.angular_speed.is_finite(), "an axis or a speed that is none")?;
            is_node(spin.node)
        })?;
        each("rig.skins", &self.skins, |_, skin| {
            must(within(skin.first_joint, skin.joint_count, self.joints.len()), "joints out of range")
        })?;
        each("rig.joints", &self.joints, |_, joint| {
            must(joint.inverse_bind.is_finite(), "a matrix that is not finite")?;
            is_node(joint.node)
        })?;
        each("rig.instances", &self.instances, |_, placement| {
            must((placement.instance as usize) < counts.instances, "no such instance")?;
            must(placement.skin == NONE || (placement.skin as usize) < self.skins.len(), "no such skin")?;
            must(within(placement.first_weight, placement.weight_count, self.weights.len()), "weights out of range")?;
            must(placement.offset.is_finite(), "a matrix that is not finite")?;
            is_node(placement.node)
        })?;
        for (name, attachments, count) in
            [("rig.lights", &self.lights, counts.lights), ("rig.cameras", &self.cameras, counts.cameras)]
        {
            each(name, attachments, |_, attachment| {
                must((attachment.target as usize) < count, "there is nothing of that index")?;
                is_node(attachment.node)
            })?;
        }
        Ok(())
    }

    fn check_clip(&self, clip: &Clip) -> Result<(), &'static str> {
        must(clip.duration.is_finite() && clip.duration >= 0.0, "a duration that is none")?;
        must(within(clip.first_channel, clip.channel_count, self.channels.len()), "channels out of range")
    }

    fn check_channel(&self, channel: &Channel) -> Result<(), &'static str> {
        let Channel { node, path, interpolation, count, width, first_time, first_value, first_weight } = *channel;
        must(path == POWER || (node as usize) < self.nodes.len(), "no such node")?;
        must(path <= POWER && interpolation <= CUBIC_SPLINE, "an unknown path or interpolation")?;
        let fits = match path {
            WEIGHTS => within(first_weight, width, self.weights.len()),
            ROTATION => width == 4,
            POWER => width == 1 && within(first_weight, 1, self.powers.len()),
            _ => width == 3,
        };
        must(fits, "values of the wrong width")?;
        let per_key: u32 = if interpolation == CUBIC_SPLINE { 3 } else { 1 };
        let values = u64::from(count) * u64::from(per_key) * u64::from(width);
        let values = u32::try_from(values).map_err(|_| "absurdly many keyframes")?;
        must(within(first_value, values, self.keys.len()), "values out of range")?;
        if path == POWER {
            // Of a cubic keyframe the value is the second number of three.
            let values = self.keys.get(first_value as usize..).unwrap_or_default().iter().take(values as usize);
            let mut values = values.skip(per_key as usize / 2).step_by(per_key as usize);
            must(values.all(|value| *value >= 0.0), "a power below 0")?;
        }
        must(count > 0 && within(first_time, count, self.keys.len()), "times out of range")?;
        let times = self.keys.get(first_time as usize..).and_then(|keys| keys.get(..count as usize));
        must(times.is_some_and(|times| times.is_sorted()), "times that descend")
    }
}

fn within(first: u32, count: u32, length: usize) -> bool {
    u64::from(first) + u64::from(count) <= length as u64
}

fn fault(place: impl Into<String>, what: impl Into<String>) -> Fault {
    (place.into(), what.into())
}

fn must(condition: bool, otherwise: &'static str) -> Result<(), &'static str> {
    if condition { Ok(()) } else { Err(otherwise) }
}

fn each<T>(name: &str, items: &[T], mut check: impl FnMut(usize, &T) -> Result<(), &'static str>) -> Result<(), Fault> {
    let mut each = items.iter().enumerate();
    each.try_for_each(|(i, item)| check(i, item).map_err(|what| fault(format!("{name}[{i}]"), what)))
}
