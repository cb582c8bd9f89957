//! Image files: PNG for people, OpenEXR for measurements, each written whole or not at all.

#[cfg(not(target_arch = "wasm32"))]
pub mod atomic;
#[cfg(not(target_arch = "wasm32"))]
pub mod exr;
pub mod png;

pub use png::encode_png;
#[cfg(not(target_arch = "wasm32"))]
pub use {
    atomic::{check_writable, write_atomic},
    exr::{ExrPicture, decode_exr, encode_exr, read_exr},
    png::write_png,
};

use crate::error::{Error, Result};

/// The largest width and height of a picture that is read, written or rendered.
pub const MAX_SIDE: u32 = restir_decoders::map::MAX_SIDE;

/// A picture: linear Rec. 709 radiance, row-major from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// `width * height` RGB triples.
    pub pixels: Vec<[f32; 3]>,
}

impl Image {
    /// A picture from its pixels.
    ///
    /// # Errors
    /// [`Error::BadValue`] where the sides are not 1 to [`MAX_SIDE`] or the number of pixels is not their product.
    pub fn new(width: u32, height: u32, pixels: Vec<[f32; 3]>) -> Result<Self> {
        check_size("image", width, height, pixels.len())?;
        Ok(Image { width, height, pixels })
    }
}

/// Whether `count` pixels fill a picture of `width` x `height`.
fn check_size(what: &str, width: u32, height: u32, count: usize) -> Result<()> {
    if !(1..=MAX_SIDE).contains(&width) || !(1..=MAX_SIDE).contains(&height) {
        return Err(Error::bad_value(what, format!("{width}x{height} is not within 1x1 and {MAX_SIDE}x{MAX_SIDE}")));
    }
    if count as u64 != u64::from(width) * u64::from(height) {
        return Err(Error::bad_value(what, format!("{count} pixels do not fill {width}x{height}")));
    }
    Ok(())
}
