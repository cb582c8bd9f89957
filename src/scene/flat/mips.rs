//! Mip chains: each level half the size of the one before, down to a single texel.

use glam::{Vec3, Vec4};
use std::sync::OnceLock;

const TEXEL_BYTES: usize = 4;
/// The weight of a texel with alpha 0 in a masked image: where nothing is seen, the plain mean of the colours stands.
const LEAST_WEIGHT: f32 = 1e-4;

/// A mean of normals that is shorter than this says nothing about a direction: 8 bits cannot hold a zero.
const SHORTEST_NORMAL: f32 = 0.02;

/// What the texels of an image mean, which decides how they are averaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Texels {
    /// sRGB colour, averaged in linear light; alpha is averaged as it is.
    Color,
    /// The same where alpha cuts the surface away: colours are weighted by alpha, so that what nobody sees does not bleed
    /// into what is seen.
    MaskedColor,
    /// Tangent-space normals: vectors are averaged, and stored with unit length.
    Normal,
    /// Numbers, averaged as they are.
    Data,
}

/// One level of a chain.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Level {
    pub width: u32,
    pub height: u32,
    /// RGBA8, row by row.
    pub pixels: Vec<u8>,
}

/// Levels of the whole chain of an image, the image itself included.
pub(super) fn level_count(width: u32, height: u32) -> u32 {
    width.max(height).max(1).ilog2() + 1
}

/// Width or height of a level.
pub(super) fn side(side: u32, level: u32) -> u32 {
    side.checked_shr(level).unwrap_or(0).max(1)
}

/// The levels after the image itself, of RGBA8 texels; as many as are taken.
///
/// A texel is the mean of the texels below it by the area they share, which is two by two of them where sides are even
/// and up to three by three where they are odd: so every level has the image's mean. Sums are kept in f32 from level to
/// level, and rounded only where they are stored.
pub(super) fn chain(width: u32, height: u32, pixels: &[u8], texels: Texels) -> impl Iterator<Item = Level> + '_ {
    let mut sums: Vec<Vec4> = Vec::new();
    let mut size = (width, height);
    (1..level_count(width, height)).map(move |level| {
        let below = size;
        size = (side(width, level), side(height, level));
        sums = match level {
            1 => halve(below, size, |y, row| {
                let bytes = pixels.chunks_exact(below.0 as usize * TEXEL_BYTES).nth(y).unwrap_or_default();
                for (out, texel) in row.iter_mut().zip(bytes.as_chunks::<TEXEL_BYTES>().0) {
                    *out = texels.decode(*texel);
                }
            }),
            _ => halve(below, size, |y, row| {
                row.copy_from_slice(&sums[y * row.len()..][..row.len()]);
            }),
        };
        let pixels = sums.iter().flat_map(|sum| texels.encode(*sum)).collect();
        Level { width: size.0, height: size.1, pixels }
    })
}

/// The first texel below a texel of a halved side, and the weights of it and its neighbours.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Taps {
    first: usize,
    weights: [f32; 3],
}

/// Of each texel of a side that is halved from `below`.
fn taps(below: u32, size: u32) -> Vec<Taps> {
    let each = |i: u32| {
        if below == size {
            return Taps { first: i as usize, weights: [1.0, 0.0, 0.0] };
        }
        let first = 2 * i as usize;
        if below == 2 * size {
            return Taps { first, weights: [0.5, 0.5, 0.0] };
        }
        // 2 n + 1 texels to n: an interval of 2 + 1 / n texels, which begins i / n into the first of them.
        let whole = below as f32;
        Taps { first, weights: [(size - i) as f32 / whole, size as f32 / whole, (i + 1) as f32 / whole] }
    };
    (0..size).map(each).collect()
}

/// Area-weighted means; `read(y, row)` gives a row of what is below.
fn halve(below: (u32, u32), size: (u32, u32), mut read: impl FnMut(usize, &mut [Vec4])) -> Vec<Vec4> {
    let columns = taps(below.0, size.0);
    let mut row = vec![Vec4::ZERO; below.0 as usize];
    // Two more, for the taps that a side which is not odd does not have.
    let mut mean = vec![Vec4::ZERO; below.0 as usize + 2];
    let mut out = Vec::with_capacity(size.0 as usize * size.1 as usize);
    for rows in taps(below.1, size.1) {
        mean.fill(Vec4::ZERO);
        for (k, weight) in rows.weights.into_iter().enumerate().filter(|(_, weight)| *weight > 0.0) {
            read(rows.first + k, &mut row);
            for (mean, texel) in mean.iter_mut().zip(&row) {
                *mean += weight * *texel;
            }
        }
        out.extend(columns.iter().map(|Taps { first, weights: [a, b, c] }| {
            let [x, y, z] = [mean[*first], mean[first + 1], mean[first + 2]];
            a * x + b * y + c * z
        }));
    }
    out
}

impl Texels {
    /// What is summed for a texel.
    fn decode(self, texel: [u8; 4]) -> Vec4 {
        let unit = texel.map(|byte| f32::from(byte) / 255.0);
        let srgb = || {
            let decode = &srgb_tables().decode;
            Vec3::new(decode[usize::from(texel[0])], decode[usize::from(texel[1])], decode[usize::from(texel[2])])
        };
        match self {
            Texels::Color => srgb().extend(unit[3]),
            Texels::MaskedColor => {
                let weight = unit[3] + LEAST_WEIGHT;
                (srgb() * weight).extend(weight)
            }
            Texels::Normal => {
                let [x, y, z, w] = unit;
                (Vec3::new(x, y, z) * 2.0 - 1.0).extend(w)
            }
            Texels::Data => Vec4::from(unit),
        }
    }

    /// The texel of a mean.
    fn encode(self, mean: Vec4) -> [u8; 4] {
        // Halves to even: the mean of four bytes often ends in one, and always upwards would brighten the level.
        let byte = |unit: f32| (unit * 255.0).round_ties_even() as u8;
        let srgb = |linear: Vec3, alpha: f32| {
            let [r, g, b] = linear.to_array().map(|channel| srgb_tables().encode(channel));
            [r, g, b, byte(alpha)]
        };
        match self {
            Texels::Color => srgb(mean.truncate(), mean.w),
            Texels::MaskedColor => srgb(mean.truncate() / mean.w, mean.w - LEAST_WEIGHT),
            Texels::Normal => {
                let normal = mean.truncate();
                let is_left = normal.length() >= SHORTEST_NORMAL;
                let [x, y, z] =
                    if is_left { normal.normalize() } else { Vec3::Z }.to_array().map(|c| byte(0.5 * c + 0.5));
                [x, y, z, byte(mean.w)]
            }
            Texels::Data => mean.to_array().map(byte),
        }
    }
}

/// IEC 61966-2-1, decoded.
fn srgb_decode(encoded: f32) -> f32 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// Steps of the first guess at a byte.
const GUESSES: usize = 4096;

/// sRGB bytes to linear and back, without a power a texel.
struct SrgbTables {
    /// Of each byte, the linear value.
    decode: [f32; 256],
    /// Of each byte, where the next one begins.
    end: [f32; 256],
    /// Of each step, the byte at its beginning.
    guess: [u8; GUESSES],
}

impl SrgbTables {
    /// The byte whose value is nearest in sRGB.
    fn encode(&self, linear: f32) -> u8 {
        let linear = linear.clamp(0.0, 1.0);
        let step = (linear * GUESSES as f32) as usize;
        let mut byte = self.guess[step.min(GUESSES - 1)];
        while byte < u8::MAX && linear >= self.end[usize::from(byte)] {
            byte += 1;
        }
        byte
    }
}

fn srgb_tables() -> &'static SrgbTables {
    static TABLES: OnceLock<SrgbTables> = OnceLock::new();
    TABLES.get_or_init(|| {
        let decode = std::array::from_fn(|byte| srgb_decode(byte as f32 / 255.0));
        let end: [f32; 256] = std::array::from_fn(|byte| srgb_decode((byte as f32 + 0.5) / 255.0));
        let guess = std::array::from_fn(|step| {
            let linear = step as f32 / GUESSES as f32;
            end.iter().take(255).filter(|end| linear >= **end).count() as u8
        });
        SrgbTables { decode, end, guess }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::random::Random;

    fn noise(width: u32, height: u32, seed: u64) -> Vec<u8> {
        let mut random = Random::new(seed);
        (0..width * height * 4).map(|_| random.next_u32() as u8).collect()
    }

    fn srgb_encode(linear: f64) -> f64 {
        if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
    }

    fn srgb_decode_f64(encoded: f64) -> f64 {
        if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
    }

    const SIZES: [(u32, u32); 9] = [(1, 1), (2, 1), (1, 7), (3, 5), (4, 4), (16, 2), (31, 17), (64, 48), (1025, 3)];

    #[test]
    fn chains_end_in_one_texel_and_no_level_is_missing() {
        for (width, height) in SIZES {
            let levels: Vec<Level> = chain(width, height, &noise(width, height, 1), Texels::Data).collect();
            assert_eq!(levels.len() as u32 + 1, level_count(width, height));
            for (level, k) in levels.iter().zip(1..) {
                assert_eq!((level.width, level.height), ((width >> k).max(1), (height >> k).max(1)));
                assert_eq!(level.pixels.len(), (level.width * level.height * 4) as usize);
            }
            let last = levels.last().map_or((width, height), |level| (level.width, level.height));
            assert_eq!(last, (1, 1));
        }
    }

    /// The mean of what texels stand for, over a whole image.
    fn mean(pixels: &[u8], value: impl Fn(f64) -> f64) -> [f64; 4] {
        let count = pixels.len() as f64 / 4.0;
        [0, 1, 2, 3].map(|c| {
            let channel = pixels.iter().skip(c).step_by(4).map(|byte| f64::from(*byte) / 255.0);
            channel.map(|x| if c < 3 { value(x) } else { x }).sum::<f64>() / count
        })
    }

    #[test]
    fn the_last_texel_is_the_mean_of_the_image() {
        for (width, height) in SIZES {
            let pixels = noise(width, height, u64::from(width));
            let last = |texels| match chain(width, height, &pixels, texels).last() {
                Some(level) => level.pixels,
                None => pixels.clone(),
            };
            let expected = mean(&pixels, srgb_decode_f64);
            for (c, (byte, expected)) in last(Texels::Color).iter().zip(expected).enumerate() {
                let expected = 255.0 * if c < 3 { srgb_encode(expected) } else { expected };
                assert!((f64::from(*byte) - expected).abs() < 0.51, "{width}x{height} channel {c}: {byte} {expected}");
            }
            for (byte, expected) in last(Texels::Data).iter().zip(mean(&pixels, |x| x)) {
                assert!((f64::from(*byte) - 255.0 * expected).abs() < 0.51, "{width}x{height}: {byte} {expected}");
            }
        }
    }

    #[test]
    fn means_by_hand() {
        // Black and white: half the light is 188 in sRGB, and 128 as a number.
        let pixels = [[0, 0, 0, 255], [255, 255, 255, 255]].concat();
        let only = |texels, pixels: &[u8]| chain(2, 1, pixels, texels).next().unwrap().pixels;
        assert_eq!(only(Texels::Color, &pixels), [188, 188, 188, 255]);
        assert_eq!(only(Texels::Data, &pixels), [128, 128, 128, 255]);
        // Three texels to one: each counts a third.
        let three = [[0; 4], [90; 4], [30; 4]].concat();
        assert_eq!(chain(3, 1, &three, Texels::Data).next().unwrap().pixels, [40; 4]);
        // Five to two: 2 + 1/2 each.
        let five = [[10; 4], [20; 4], [100; 4], [40; 4], [60; 4]].concat();
        let expected = [(10.0 + 20.0 + 50.0) / 2.5, (50.0 + 40.0 + 60.0) / 2.5];
        let found = chain(5, 1, &five, Texels::Data).next().unwrap().pixels;
        assert_eq!([found[0], found[4]], expected.map(|x: f32| x.round() as u8));
    }

    #[test]
    fn what_a_mask_cuts_away_does_not_bleed() {
        let pixels = [[255, 0, 0, 255], [0, 255, 0, 0]].concat();
        let masked = |pixels: &[u8]| chain(2, 1, pixels, Texels::MaskedColor).next().unwrap().pixels;
        assert_eq!(masked(&pixels), [255, 0, 0, 128]);
        let invisible = [[0, 0, 0, 0], [255, 255, 255, 0]].concat();
        assert_eq!(masked(&invisible), [188, 188, 188, 0], "the plain mean where all is cut away");
        assert_eq!(chain(2, 1, &pixels, Texels::Color).next().unwrap().pixels, [188, 188, 0, 128]);
    }

    #[test]
    fn normals_keep_unit_length() {
        let encode = |n: Vec3| [n.x, n.y, n.z, 1.0].map(|c| ((0.5 * c + 0.5) * 255.0).round() as u8);
        let tilted = |x: f32| encode(Vec3::new(x, 0.0, (1.0 - x * x).sqrt()));
        let only = |pixels: &[u8]| chain(2, 1, pixels, Texels::Normal).next().unwrap().pixels;
        // Straight up between two that lean apart; plain numbers would have z = 0.6.
        let found = only(&[tilted(0.8), tilted(-0.8)].concat());
        assert!(found[0].abs_diff(128) <= 1 && found[2] == 255, "{found:?}");
        let along = only(&[tilted(0.6), tilted(0.0)].concat());
        let mean = (Vec3::new(0.6, 0.0, 0.8) + Vec3::Z).normalize();
        assert!(along.iter().zip(encode(mean)).all(|(a, b)| a.abs_diff(b) <= 1), "{along:?}");
        assert_eq!(only(&[encode(Vec3::X), encode(Vec3::NEG_X)].concat())[2], 255, "flat where nothing is left");
    }

    #[test]
    fn srgb_tables_round_to_the_nearest_byte() {
        let tables = srgb_tables();
        for byte in 0..=u8::MAX {
            assert_eq!(tables.encode(tables.decode[usize::from(byte)]), byte);
        }
        for i in 0..=100_000 {
            let linear = f64::from(i) / 100_000.0;
            let exact = 255.0 * srgb_encode(linear);
            let byte = f64::from(tables.encode(linear as f32));
            assert!((byte - exact).abs() < 0.501, "{linear}: {byte} {exact}");
        }
    }
}
