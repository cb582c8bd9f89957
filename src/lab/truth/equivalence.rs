//! Whether two renderers have the same expectation, by two one-sided tests on means over independent runs.

use crate::error::Result;
use crate::output::Image;
use crate::renderer::Renderer;
use pollster::block_on;
use std::fmt;

/// One-sided 95 % quantile of the normal distribution; runs are many enough.
pub const Z_95: f64 = 1.645;
/// Of the runs' seeds.
const FIRST_SEED: u32 = 1000;

/// Means over independent runs and their standard errors.
#[derive(Debug, Clone)]
pub struct Estimate(pub Vec<(f64, f64)>);

impl Estimate {
    /// Of each number that a run gives.
    pub fn of(samples: &[Vec<f64>]) -> Self {
        let n = samples.len() as f64;
        let column = |i: usize| {
            let mean = samples.iter().map(|s| s[i]).sum::<f64>() / n;
            let variance = samples.iter().map(|s| (s[i] - mean).powi(2)).sum::<f64>() / (n * (n - 1.0));
            (mean, variance.sqrt())
        };
        Estimate((0..samples[0].len()).map(column).collect())
    }

    /// Of the mean radiance of the picture, then of each of its square tiles, `tile` pixels wide.
    ///
    /// # Errors
    /// Those of rendering.
    pub fn radiance(renderer: &mut Renderer, runs: u32, frames: u32, tile: u32) -> Result<Self> {
        Ok(Self::of_pictures(&pictures(renderer, runs, frames)?, tile))
    }

    /// The same of the pictures of independent runs.
    pub fn of_pictures(pictures: &[Image], tile: u32) -> Self {
        Self::of(&pictures.iter().map(|picture| region_means(picture, tile)).collect::<Vec<_>>())
    }
}

/// The pictures of independent runs.
///
/// # Errors
/// Those of rendering.
pub fn pictures(renderer: &mut Renderer, runs: u32, frames: u32) -> Result<Vec<Image>> {
    Ok(counted_pictures(renderer, runs, frames)?.0)
}

/// The same, and how many samples the film left out of them because they were not finite. Where there are any, the
/// pictures' mean is that of the other samples.
///
/// # Errors
/// Those of rendering.
pub fn counted_pictures(renderer: &mut Renderer, runs: u32, frames: u32) -> Result<(Vec<Image>, u64)> {
    let mut not_finite = 0;
    let mut run = |number| {
        renderer.set_seed(FIRST_SEED + number);
        (0..frames).try_for_each(|_| renderer.render_frame())?;
        not_finite += block_on(renderer.counters())?.not_finite();
        block_on(renderer.read_image())
    };
    let pictures = (0..runs).map(&mut run).collect::<Result<_>>()?;
    Ok((pictures, not_finite))
}

/// Mean radiance of the picture, then of each of its square tiles, `tile` pixels wide.
pub fn region_means(image: &Image, tile: u32) -> Vec<f64> {
    let columns = image.width / tile;
    let mut sums = vec![0.0; 1 + (columns * (image.height / tile)) as usize];
    for (i, pixel) in image.pixels.iter().enumerate() {
        let value: f64 = pixel.iter().map(|c| f64::from(*c)).sum::<f64>() / 3.0;
        let (x, y) = (i as u32 % image.width / tile, i as u32 / image.width / tile);
        sums[0] += value / f64::from(image.width * image.height);
        sums[1 + (y * columns + x) as usize] += value / f64::from(tile * tile);
    }
    sums
}

/// How thoroughly an equivalence is proved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Proof {
    /// With all its runs.
    Whole,
    /// With a quarter of them. That doubles the errors, and twice the margin is all that can be asked then.
    Quick,
}

impl Proof {
    /// So many runs, or frames, of a whole proof, or a quarter of them.
    pub fn effort(self, whole: u32) -> u32 {
        match self {
            Proof::Whole => whole,
            Proof::Quick => whole.div_ceil(4),
        }
    }

    /// These margins of a whole proof, or twice as wide.
    pub fn margins(self, whole: Margins) -> Margins {
        match self {
            Proof::Whole => whole,
            Proof::Quick => Margins { picture: 2.0 * whole.picture, tile: 2.0 * whole.tile },
        }
    }
}

/// How much an expectation may be off, relative to it.
#[derive(Debug, Clone, Copy)]
pub struct Margins {
    /// Of the mean over the picture.
    pub picture: f64,
    /// Of the mean over a tile.
    pub tile: f64,
}

/// Relative difference of each region's mean from the reference's, its standard error, and its margin.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Comparison(Vec<(f64, f64, f64)>);

impl Comparison {
    /// Compares the regions of an estimate with those of the reference.
    pub fn new(estimate: &Estimate, reference: &Estimate, margins: Margins) -> Self {
        let regions = estimate.0.iter().zip(&reference.0).enumerate();
        Comparison(
            regions
                .map(|(i, ((mean, error), (truth, noise)))| {
                    let margin = if i == 0 { margins.picture } else { margins.tile };
                    (mean / truth - 1.0, error.hypot(*noise) / truth, margin)
                })
                .collect(),
        )
    }

    /// Signed relative difference of the whole picture's mean, and its standard error.
    pub fn bias(&self) -> (f64, f64) {
        self.0.first().map_or((0.0, 0.0), |(difference, error, _)| (*difference, *error))
    }

    /// Whether every mean lies within its margin with 95 % confidence.
    pub fn is_equivalent(&self) -> bool {
        self.0.iter().all(|(d, e, margin)| d.abs() + Z_95 * e < *margin)
    }

    /// Whether a bias lies beyond a margin with 95 % confidence; then a repetition of the test fails far more often than
    /// nine times in ten.
    pub fn is_caught(&self) -> bool {
        self.0.iter().any(|(d, e, margin)| d.abs() - Z_95 * e > *margin)
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        for (i, (difference, error, _)) in self.0.iter().enumerate() {
            let comma = if i == 0 { "" } else { ", " };
            write!(f, "{comma}{:+.3}±{:.3} %", 100.0 * difference, 100.0 * error)?;
        }
        Ok(())
    }
}
