//! Pixel-by-pixel error and bias, on linear values without any tone mapping, in double precision.

use crate::error::{Error, Result};
use crate::output::Image;

/// Relative luminance of a linear Rec. 709 colour: 0.2126 R + 0.7152 G + 0.0722 B (ITU-R BT.709, item 3.2).
pub fn luminance(rgb: [f32; 3]) -> f64 {
    luminance_of(rgb.map(f64::from))
}

/// The same in double precision, as means have it.
fn luminance_of([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// The sRGB transfer function (IEC 61966-2-1), linear to encoded, both in [0, 1].
pub(super) fn srgb_encode(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// Whether two pictures can be compared: of one size, not empty, every value finite.
///
/// # Errors
/// [`Error::BadValue`] with both sizes, or with which picture holds how many NaN and infinite values.
pub fn check_pair(image: &Image, reference: &Image) -> Result<()> {
    let size = |i: &Image| format!("{}x{}", i.width, i.height);
    if (image.width, image.height, image.pixels.len()) != (reference.width, reference.height, reference.pixels.len()) {
        let what = format!("the image is {}, the reference {}; both must be alike", size(image), size(reference));
        return Err(Error::bad_value("size", what));
    }
    if image.pixels.is_empty() || image.pixels.len() as u64 != u64::from(image.width) * u64::from(image.height) {
        return Err(Error::bad_value("size", format!("{} pixels do not fill {}", image.pixels.len(), size(image))));
    }
    for (name, picture) in [("image", image), ("reference", reference)] {
        let values = || picture.pixels.iter().flatten();
        let nan = values().filter(|v| v.is_nan()).count();
        let infinite = values().filter(|v| v.is_infinite()).count();
        if nan + infinite > 0 {
            return Err(Error::bad_value(name, format!("{nan} NaN and {infinite} infinite values")));
        }
    }
    Ok(())
}

/// Mean of `f(a, b)` over all channels of all pixels.
fn mean_of(image: &Image, reference: &Image, f: impl Fn(f64, f64) -> f64) -> Result<f64> {
    check_pair(image, reference)?;
    let pairs = image.pixels.iter().flatten().zip(reference.pixels.iter().flatten());
    let sum: f64 = pairs.map(|(&a, &b)| f(a.into(), b.into())).sum();
    Ok(sum / (3 * image.pixels.len()) as f64)
}

/// Mean squared error, mean of (a - b)^2 over channels and pixels.
///
/// # Errors
/// As [`check_pair`].
pub fn mse(image: &Image, reference: &Image) -> Result<f64> {
    mean_of(image, reference, |a, b| (a - b).powi(2))
}

/// Square root of [`mse`], in the unit of radiance.
///
/// # Errors
/// As [`check_pair`].
pub fn rmse(image: &Image, reference: &Image) -> Result<f64> {
    mse(image, reference).map(f64::sqrt)
}

/// What [`relmse`] adds to the squared reference, so that black pixels do not divide by zero.
pub const RELMSE_EPSILON: f64 = 0.01;

/// Relative mean squared error, mean of (a - b)^2 / (b^2 + 0.01) over channels and pixels (after Rousselle, Knaus and
/// Zwicker, "Adaptive Sampling and Reconstruction using Greedy Error Minimization", 2011; the epsilon differs from
/// author to author).
///
/// # Errors
/// As [`check_pair`].
pub fn relmse(image: &Image, reference: &Image) -> Result<f64> {
    mean_of(image, reference, |a, b| (a - b).powi(2) / (b * b + RELMSE_EPSILON))
}

/// Mean absolute percentage error, mean of |I - G| / (0.01 mean(G) + G) over pixels, I and G the [`luminance`] of image
/// and reference (Lin's dissertation on many lights and resampling, chapter 6, footnote 12). A fraction, not percent.
///
/// A pixel without error counts 0 even where the denominator is 0; an error against an all-black reference is infinite.
///
/// # Errors
/// As [`check_pair`].
pub fn mape(image: &Image, reference: &Image) -> Result<f64> {
    check_pair(image, reference)?;
    let count = reference.pixels.len() as f64;
    let floor = 0.01 * reference.pixels.iter().map(|&p| luminance(p)).sum::<f64>() / count;
    let term = |(&a, &b): (&[f32; 3], &[f32; 3])| {
        let (a, b) = (luminance(a), luminance(b));
        if a == b { 0.0 } else { (a - b).abs() / (floor + b) }
    };
    Ok(image.pixels.iter().zip(&reference.pixels).map(term).sum::<f64>() / count)
}

/// Mean of each channel; zero for no pixels.
pub fn mean(image: &Image) -> [f64; 3] {
    let mut sum = [0.0f64; 3];
    for pixel in &image.pixels {
        for (sum, &value) in sum.iter_mut().zip(pixel) {
            *sum += f64::from(value);
        }
    }
    sum.map(|s| s / image.pixels.len().max(1) as f64)
}

/// Signed difference of means: positive where the image is brighter than the reference.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Bias {
    /// mean(image) - mean(reference), in the unit of radiance.
    pub absolute: f64,
    /// `absolute` / mean(reference), a fraction; none where the reference has mean zero.
    pub relative: Option<f64>,
}

/// The [`Bias`] of red, green, blue and luminance.
///
/// # Errors
/// As [`check_pair`].
pub fn bias(image: &Image, reference: &Image) -> Result<[Bias; 4]> {
    check_pair(image, reference)?;
    let with_luminance = |[r, g, b]: [f64; 3]| [r, g, b, luminance_of([r, g, b])];
    let (a, b) = (with_luminance(mean(image)), with_luminance(mean(reference)));
    Ok(std::array::from_fn(|i| {
        let absolute = a[i] - b[i];
        Bias { absolute, relative: (b[i] != 0.0).then(|| absolute / b[i]) }
    }))
}
