//! Every metric of two pictures at once.

use super::metrics::{Bias, bias, mape, mse, relmse};
use super::{flip, ssim};
use crate::error::Result;
use crate::output::Image;

/// How far a picture is from its reference; the metrics are described at the functions of the same names.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Comparison {
    /// Width of both in pixels.
    pub width: u32,
    /// Height of both in pixels.
    pub height: u32,
    /// [`super::mse`].
    pub mse: f64,
    /// [`super::rmse`].
    pub rmse: f64,
    /// [`super::relmse`].
    pub relmse: f64,
    /// [`super::mape`]; infinite (JSON: null) where the reference is black and the picture is not.
    pub mape: f64,
    /// [`super::ssim`]; none for pictures with a side under 11 pixels.
    pub ssim: Option<f64>,
    /// [`super::flip`].
    pub flip: f64,
    /// Signed mean bias of each channel and of luminance.
    pub bias: ChannelBias,
}

/// [`Bias`] a channel.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct ChannelBias {
    /// Red.
    pub r: Bias,
    /// Green.
    pub g: Bias,
    /// Blue.
    pub b: Bias,
    /// Luminance.
    pub luminance: Bias,
}

/// Compares `image` with `reference`.
///
/// # Errors
/// As [`super::metrics::check_pair`].
pub fn compare(image: &Image, reference: &Image) -> Result<Comparison> {
    let mse = mse(image, reference)?;
    let [r, g, b, luminance] = bias(image, reference)?;
    Ok(Comparison {
        width: image.width,
        height: image.height,
        mse,
        rmse: mse.sqrt(),
        relmse: relmse(image, reference)?,
        mape: mape(image, reference)?,
        ssim: ssim::ssim(image, reference)?,
        flip: flip::flip(image, reference)?,
        bias: ChannelBias { r, g, b, luminance },
    })
}
