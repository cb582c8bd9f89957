//! Values between keyframes.
//!
//! Source: glTF 2.0, appendix C.

use super::{CUBIC_SPLINE, Channel, ROTATION, STEP};
use glam::Quat;

/// The value of a channel at `time` in `out`, which is as long as the channel is wide. Before the first keyframe it is the
/// first one's, after the last the last one's. Rotations come out as unit quaternions.
pub(super) fn sample(channel: &Channel, keys: &[f32], time: f32, out: &mut [f32]) {
    let width = channel.width as usize;
    let count = channel.count as usize;
    let times = keys.get(channel.first_time as usize..).and_then(|rest| rest.get(..count)).unwrap_or_default();
    let values = keys.get(channel.first_value as usize..).unwrap_or_default();
    let cubic = channel.interpolation == CUBIC_SPLINE;
    // Part 1 of a cubic keyframe is its value, 0 its in-tangent, 2 its out-tangent.
    let part = |key: usize, part: usize| {
        let element = if cubic { 3 * key + part } else { key };
        values.get(element * width..).and_then(|rest| rest.get(..width)).unwrap_or_default()
    };
    let next = times.partition_point(|&t| t <= time);
    let before = next.saturating_sub(1);
    if next == 0 || next == count || channel.interpolation == STEP {
        copy(out, part(before, 1));
    } else {
        let step = times[next] - times[before];
        let s = (time - times[before]) / step;
        let (a, b) = (part(before, 1), part(next, 1));
        if cubic {
            let (out_tangent, in_tangent) = (part(before, 2), part(next, 0));
            let (s2, s3) = (s * s, s * s * s);
            let weights =
                [2.0 * s3 - 3.0 * s2 + 1.0, step * (s3 - 2.0 * s2 + s), 3.0 * s2 - 2.0 * s3, step * (s3 - s2)];
            for (i, out) in out.iter_mut().enumerate() {
                let at = |list: &[f32]| list.get(i).copied().unwrap_or_default();
                *out = weights[0] * at(a)
                    + weights[1] * at(out_tangent)
                    + weights[2] * at(b)
                    + weights[3] * at(in_tangent);
            }
        } else if channel.path == ROTATION {
            out.copy_from_slice(&quaternion(a).slerp(quaternion(b), s).to_array()[..out.len()]);
        } else {
            for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
                *out = a + s * (b - a);
            }
        }
    }
    if channel.path == ROTATION {
        let unit = quaternion(out);
        copy(out, &unit.to_array());
    }
}

fn copy(out: &mut [f32], from: &[f32]) {
    for (out, from) in out.iter_mut().zip(from) {
        *out = *from;
    }
}

/// Four numbers as a unit quaternion; no rotation where they have no direction.
fn quaternion(values: &[f32]) -> Quat {
    let at = |i: usize| values.get(i).copied().unwrap_or_default();
    let length = Quat::from_xyzw(at(0), at(1), at(2), at(3));
    if length.length_squared() > 0.0 && length.is_finite() { length.normalize() } else { Quat::IDENTITY }
}

#[cfg(test)]
mod tests {
    use super::super::{LINEAR, SCALE, TRANSLATION};
    use super::*;
    use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

    fn channel(path: u32, interpolation: u32, count: u32, width: u32) -> Channel {
        Channel { node: 0, path, interpolation, count, width, first_time: 0, first_value: count, first_weight: 0 }
    }

    fn at<const N: usize>(channel: &Channel, keys: &[f32], time: f32) -> [f32; N] {
        let mut out = [f32::NAN; N];
        sample(channel, keys, time, &mut out);
        out
    }

    #[test]
    fn steps_hold_and_lines_join() {
        let keys = [1.0, 2.0, 4.0, 10.0, 0.0, 0.0, 20.0, 1.0, 2.0, 40.0, 3.0, 3.0];
        let linear = channel(TRANSLATION, LINEAR, 3, 3);
        assert_eq!(at(&linear, &keys, 0.0), [10.0, 0.0, 0.0], "before the first keyframe");
        assert_eq!(at(&linear, &keys, 1.5), [15.0, 0.5, 1.0]);
        assert_eq!(at(&linear, &keys, 3.5), [35.0, 2.5, 2.75]);
        assert_eq!(at(&linear, &keys, 9.0), [40.0, 3.0, 3.0], "after the last");
        let step = channel(SCALE, STEP, 3, 3);
        assert_eq!(at(&step, &keys, 1.999), [10.0, 0.0, 0.0]);
        assert_eq!(at(&step, &keys, 2.0), [20.0, 1.0, 2.0], "a keyframe's own time is the keyframe's");
    }

    #[test]
    fn rotations_turn_evenly_along_the_shorter_way() {
        let turn = |angle: f32| Quat::from_rotation_y(angle);
        // The second key is the same rotation as a quarter turn, written with the other sign.
        let mut keys = vec![0.0, 1.0];
        keys.extend(turn(0.0).to_array());
        keys.extend((-turn(FRAC_PI_2)).to_array());
        let linear = channel(ROTATION, LINEAR, 2, 4);
        for s in [0.25f32, 0.5, 0.75] {
            let found = Quat::from_array(at(&linear, &keys, s));
            assert!(found.dot(turn(s * FRAC_PI_2)).abs() > 1.0 - 1e-6, "{s}");
        }
    }

    #[test]
    fn cubic_splines_follow_their_tangents() {
        // x^3 on [0, 2]: value and slope at both ends give the cubic itself.
        let keys = [0.0, 2.0, 0.0, 0.0, 0.0, 12.0, 8.0, 12.0];
        let cubic = channel(WEIGHTS_PATH, CUBIC_SPLINE, 2, 1);
        for x in [0.0f32, 0.3, 1.0, 1.7, 2.0] {
            assert!((at::<1>(&cubic, &keys, x)[0] - x.powi(3)).abs() < 1e-5, "{x}");
        }
        // A rotation comes out unit.
        let mut keys = vec![0.0, 1.0];
        for angle in [0.0, FRAC_PI_4] {
            keys.extend([0.0; 4]);
            keys.extend(Quat::from_rotation_x(angle).to_array());
            keys.extend([0.0; 4]);
        }
        let found = Quat::from_array(at(&channel(ROTATION, CUBIC_SPLINE, 2, 4), &keys, 0.5));
        assert!(found.is_normalized() && found.dot(Quat::from_rotation_x(0.5 * FRAC_PI_4)).abs() > 1.0 - 1e-6);
    }

    const WEIGHTS_PATH: u32 = super::super::WEIGHTS;

    #[test]
    fn keyframes_at_one_time_and_bad_quaternions_do_no_harm() {
        let keys = [1.0, 1.0, 5.0, 6.0];
        let linear = channel(WEIGHTS_PATH, LINEAR, 2, 1);
        assert_eq!(at(&linear, &keys, 0.9), [5.0]);
        assert_eq!(at(&linear, &keys, 1.0), [6.0]);
        let zero = [0.0, 0.0, 0.0, 0.0, 0.0];
        assert_eq!(at(&channel(ROTATION, LINEAR, 1, 4), &zero, 0.0), [0.0, 0.0, 0.0, 1.0]);
    }
}
