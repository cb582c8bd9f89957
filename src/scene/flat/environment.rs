//! The environment with its alias table.

use super::lights::luminance;
use crate::error::{Error, Result};
use crate::scene::gpu_types::EnvironmentTexel;
use crate::scene::{Environment, alias};
use glam::Vec3;
use std::f64::consts::{PI, TAU};

/// Longest side in texels: what every WebGPU device can hold.
const MAX_SIDE: u32 = 8192;

/// The environment with its alias table.
#[derive(Debug, Clone, PartialEq)]
pub struct FlatEnvironment {
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// Linear radiance, RGB and an unused 1.
    pub radiance: Vec<[f32; 4]>,
    /// One entry a texel.
    pub alias: Vec<EnvironmentTexel>,
}

impl FlatEnvironment {
    /// The environment with its alias table, or none if it is black everywhere.
    ///
    /// A texel weighs its solid angle times the mean luminance of the bilinearly filtered map over it, so that nothing the
    /// filter can read has density 0; within the texel directions are uniform in solid angle.
    ///
    /// # Errors
    /// [`Error::BadValue`] for a wrong number of texels and for radiance that is negative or not finite;
    /// [`Error::Limit`] for more than 8192 texels a side.
    pub fn build(environment: &Environment) -> Result<Option<Self>> {
        let radiance = texels(environment)?;
        let (width, height) = (environment.width, environment.height);
        Ok(radiance.map(|radiance| {
            let mut flat = FlatEnvironment { width, height, radiance, alias: Vec::new() };
            flat.build_alias();
            flat
        }))
    }

    /// Makes the alias table that belongs to the radiance.
    pub(crate) fn build_alias(&mut self) {
        let (width, height) = (self.width, self.height);
        let solid_angle = |row: usize| {
            let latitude = |edge: usize| (PI * edge as f64 / f64::from(height)).cos();
            TAU / f64::from(width) * (latitude(row) - latitude(row + 1))
        };
        let filtered = filtered_luminance(&self.radiance, width as usize);
        let weights: Vec<f64> = filtered.iter().enumerate().map(|(i, l)| l * solid_angle(i / width as usize)).collect();
        let entries = alias::build(&weights).into_iter().enumerate().map(|(i, entry)| {
            let pdf = (f64::from(entry.pmf) / solid_angle(i / width as usize)) as f32;
            [entry.threshold.to_bits(), entry.alias, pdf.to_bits(), 0]
        });
        self.alias = entries.collect();
    }
}

/// The texels of a map as they are uploaded, or none if all are black.
///
/// # Errors
/// As [`FlatEnvironment::build`].
pub(crate) fn texels(environment: &Environment) -> Result<Option<Vec<[f32; 4]>>> {
    let (width, height) = (environment.width, environment.height);
    let bad = |what: String| Error::bad_value("environment", what);
    if width == 0 || height == 0 || u64::from(width) * u64::from(height) != environment.pixels.len() as u64 {
        return Err(bad(format!("{width}x{height} texels were promised, {} came", environment.pixels.len())));
    }
    if width.max(height) > MAX_SIDE {
        return Err(Error::Limit {
            what: "the environment".into(),
            wanted: u64::from(width.max(height)),
            had: u64::from(MAX_SIDE),
            unit: "texels a side",
        });
    }
    if environment.pixels.iter().flatten().any(|c| !c.is_finite() || *c < 0.0) {
        return Err(bad("a radiance is negative or not finite".into()));
    }
    let shines = environment.pixels.iter().any(|&p| luminance(Vec3::from_array(p)) > 0.0);
    Ok(shines.then(|| environment.pixels.iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect()))
}

/// The mean over each texel of the bilinearly interpolated luminance: a tent of (1, 6, 1) / 8 along both axes, wrapped
/// along u and clamped along v.
fn filtered_luminance(radiance: &[[f32; 4]], width: usize) -> Vec<f64> {
    let texels: Vec<f64> = radiance.iter().map(|&[r, g, b, _]| luminance(Vec3::new(r, g, b))).collect();
    let tent = |before: f64, here: f64, after: f64| (before + 6.0 * here + after) / 8.0;
    let along_u: Vec<f64> = (0..texels.len())
        .map(|i| {
            let (x, row) = (i % width, i - i % width);
            tent(texels[row + (x + width - 1) % width], texels[i], texels[row + (x + 1) % width])
        })
        .collect();
    (0..along_u.len())
        .map(|i| {
            let above = if i < width { i } else { i - width };
            let below = if i + width < along_u.len() { i + width } else { i };
            tent(along_u[above], along_u[i], along_u[below])
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pdf(environment: &FlatEnvironment, i: usize) -> f64 {
        f64::from(f32::from_bits(environment.alias[i][2]))
    }

    #[test]
    fn even_environment_is_uniform_over_the_sphere() {
        for (width, height) in [(1, 1), (8, 4)] {
            let map = Environment { width, height, pixels: vec![[2.0; 3]; (width * height) as usize] };
            let flat = FlatEnvironment::build(&map).unwrap().unwrap();
            for i in 0..flat.alias.len() {
                assert!((pdf(&flat, i) * 4.0 * PI - 1.0).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn one_bright_texel_spreads_as_far_as_the_filter_reads() {
        let (width, height) = (8u32, 4u32);
        let mut pixels = vec![[0.0; 3]; 32];
        pixels[0] = [1.0; 3]; // the top left corner: wraps to x = 7
        let flat = FlatEnvironment::build(&Environment { width, height, pixels }).unwrap().unwrap();
        let mut total = 0.0;
        for i in 0..32 {
            let (x, y) = (i % 8, i / 8);
            let near = (x <= 1 || x == 7) && y <= 1;
            assert_eq!(pdf(&flat, i) > 0.0, near, "{x} {y}");
            let cos = |edge: usize| (PI * edge as f64 / 4.0).cos();
            total += pdf(&flat, i) * TAU / 8.0 * (cos(y) - cos(y + 1));
        }
        assert!((total - 1.0).abs() < 1e-5, "{total}");
    }

    #[test]
    fn bad_and_black_environments() {
        let map = |width, height, pixel: f32, n| Environment { width, height, pixels: vec![[pixel; 3]; n] };
        assert!(FlatEnvironment::build(&map(2, 2, 0.0, 4)).unwrap().is_none());
        assert!(FlatEnvironment::build(&map(2, 2, 1.0, 3)).is_err());
        assert!(FlatEnvironment::build(&map(0, 2, 1.0, 0)).is_err());
        assert!(FlatEnvironment::build(&map(1, 1, f32::NAN, 1)).is_err());
        assert!(FlatEnvironment::build(&map(1, 1, -1.0, 1)).is_err());
        assert!(FlatEnvironment::build(&map(8193, 1, 1.0, 8193)).is_err());
    }
}
