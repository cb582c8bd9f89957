//! Structural similarity (Wang, Bovik, Sheikh and Simoncelli, "Image Quality Assessment: From Error Visibility to
//! Structural Similarity", 2004).

use super::metrics::{check_pair, luminance, srgb_encode};
use super::plane::{Plane, normalised};
use crate::error::Result;
use crate::output::Image;

const RADIUS: usize = 5;
const SIGMA: f64 = 1.5;
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// Mean structural similarity: 1 for equal pictures; none where a side is shorter than the window of 11 pixels.
///
/// The paper's constants: Gaussian window 11x11 of standard deviation 1.5, K1 = 0.01, K2 = 0.03, range L = 1. SSIM
/// wants bounded, perceptually even values, so radiance is mapped first: luminance, clamped to [0, 1] (exposure 0),
/// sRGB-encoded.
/// Only windows wholly inside the picture count.
///
/// # Errors
/// As [`check_pair`].
pub fn ssim(image: &Image, reference: &Image) -> Result<Option<f64>> {
    check_pair(image, reference)?;
    let side = 2 * RADIUS + 1;
    let (a, b) = (display_luminance(image), display_luminance(reference));
    if a.width < side || a.height < side {
        return Ok(None);
    }
    let window = normalised(RADIUS, |x| (-x * x / (2.0 * SIGMA * SIGMA)).exp());
    let blur = |plane: &Plane| plane.filter(&window, &window);
    let (mean_a, mean_b) = (blur(&a), blur(&b));
    let product = |x: f64, y: f64| x * y;
    let (aa, bb, ab) = (blur(&a.zip(&a, product)), blur(&b.zip(&b, product)), blur(&a.zip(&b, product)));

    let mut sum = 0.0;
    for y in RADIUS..a.height - RADIUS {
        for x in RADIUS..a.width - RADIUS {
            let i = y * a.width + x;
            let (ma, mb) = (mean_a.values[i], mean_b.values[i]);
            let (var_a, var_b, covariance) = (aa.values[i] - ma * ma, bb.values[i] - mb * mb, ab.values[i] - ma * mb);
            let luminance_term = (2.0 * ma * mb + C1) / (ma * ma + mb * mb + C1);
            sum += luminance_term * (2.0 * covariance + C2) / (var_a + var_b + C2);
        }
    }
    let windows = (a.width - 2 * RADIUS) * (a.height - 2 * RADIUS);
    Ok(Some(sum / windows as f64))
}

fn display_luminance(image: &Image) -> Plane {
    let values = image.pixels.iter().map(|&p| srgb_encode(luminance(p).clamp(0.0, 1.0))).collect();
    Plane { width: image.width as usize, height: image.height as usize, values }
}
