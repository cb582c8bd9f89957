//! Unit vectors in 32 bits, and the frame built round them: the Rust twins of `shaders/lib/math.wgsl`.

use glam::{Vec2, Vec3};

/// Unit vector to [-1, 1]^2 by the octahedral map (Meyer et al. 2010).
pub fn encode(n: Vec3) -> Vec2 {
    let p = n.truncate() / (n.x.abs() + n.y.abs() + n.z.abs());
    if n.z >= 0.0 { p } else { (Vec2::ONE - Vec2::new(p.y.abs(), p.x.abs())) * sign_not_zero(p) }
}

/// The unit vector of a point of [-1, 1]^2; the inverse of [`encode`].
pub fn decode(p: Vec2) -> Vec3 {
    let z = 1.0 - p.x.abs() - p.y.abs();
    let xy = p - sign_not_zero(p) * (-z).max(0.0);
    xy.extend(z).normalize()
}

/// Unit vector to 2 x 16 bit snorm, x in the low half.
pub fn pack(n: Vec3) -> u32 {
    let (x, y) = quantize(n);
    pack_halves(x, y)
}

/// Like [`pack`], but never exactly on the equator z = 0, where [`orthonormal_basis`] jumps and the last bit of a GPU's
/// arithmetic would choose its side. For normals with tangents; costs at most 1/32767.
pub fn pack_off_equator(n: Vec3) -> u32 {
    let (mut x, mut y) = quantize(n);
    if x.abs() + y.abs() == SCALE as i32 {
        let larger = if x.abs() >= y.abs() { &mut x } else { &mut y };
        *larger -= larger.signum();
    }
    pack_halves(x, y)
}

/// The unit vector that [`pack`] stored.
pub fn unpack(packed: u32) -> Vec3 {
    let half = |bits: u32| (f32::from(bits as u16 as i16) / SCALE).max(-1.0);
    decode(Vec2::new(half(packed), half(packed >> 16)))
}

/// Two unit vectors orthogonal to the unit vector `n` and to each other: (tangent, bitangent)
/// (Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
pub fn orthonormal_basis(n: Vec3) -> (Vec3, Vec3) {
    let s = if n.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    (Vec3::new(1.0 + s * n.x * n.x * a, s * b, -s * n.x), Vec3::new(b, s + n.y * n.y * a, -n.y))
}

/// The angle of `tangent` in the basis of the normal `n`, 65536 steps a turn.
pub fn tangent_angle(n: Vec3, tangent: Vec3) -> u16 {
    let (b1, b2) = orthonormal_basis(n);
    let turns = tangent.dot(b2).atan2(tangent.dot(b1)) / std::f32::consts::TAU;
    (turns * 65536.0).round() as i32 as u16
}

const SCALE: f32 = 32767.0;

fn sign_not_zero(p: Vec2) -> Vec2 {
    Vec2::new(if p.x >= 0.0 { 1.0 } else { -1.0 }, if p.y >= 0.0 { 1.0 } else { -1.0 })
}

fn quantize(n: Vec3) -> (i32, i32) {
    let p = encode(n).clamp(Vec2::NEG_ONE, Vec2::ONE) * SCALE;
    (p.x.round() as i32, p.y.round() as i32)
}

fn pack_halves(x: i32, y: i32) -> u32 {
    u32::from(x as u16) | u32::from(y as u16) << 16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::random::Random;

    /// Half a step is 1.5e-5, which the map stretches by up to 3 and the diagonal by 1.4.
    const TOLERANCE: f32 = 8e-5;

    fn directions() -> Vec<Vec3> {
        let mut random = Random::new(1);
        let mut all: Vec<Vec3> = (0..20_000).map(|_| random.direction()).collect();
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            all.extend([axis, -axis]);
        }
        all.extend((0..1000).map(|i| Vec2::from_angle(i as f32 * 0.01).extend(0.0)));
        all
    }

    #[test]
    fn round_trips() {
        for n in directions() {
            assert!(unpack(pack(n)).distance(n) < TOLERANCE, "{n}");
            assert!(unpack(pack_off_equator(n)).distance(n) < 2.0 * TOLERANCE, "{n}");
        }
        assert_eq!(unpack(pack(Vec3::Y)), Vec3::Y);
        assert_eq!(unpack(pack(Vec3::NEG_Z)), Vec3::NEG_Z);
    }

    #[test]
    fn off_equator_keeps_clear_of_the_jump() {
        for n in directions() {
            assert!(unpack(pack_off_equator(n)).z.abs() > 1e-5, "{n}");
        }
    }

    #[test]
    fn basis_is_orthonormal_and_right_handed() {
        for n in directions() {
            let (b1, b2) = orthonormal_basis(n);
            assert!(b1.cross(b2).distance(n) < 1e-5, "{n}");
            assert!((b1.length() - 1.0).abs() < 1e-5 && b1.dot(n).abs() < 1e-5, "{n}");
        }
    }

    #[test]
    fn tangent_angle_round_trips() {
        let mut random = Random::new(2);
        for n in directions() {
            let n = unpack(pack_off_equator(n));
            let tangent = random.direction().reject_from_normalized(n).normalize();
            let (b1, b2) = orthonormal_basis(n);
            let (sin, cos) = (f32::from(tangent_angle(n, tangent)) / 65536.0 * std::f32::consts::TAU).sin_cos();
            assert!((b1 * cos + b2 * sin).distance(tangent) < 1e-4, "{n} {tangent}");
        }
    }
}
