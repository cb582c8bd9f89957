//! PNG, for people: display-referred sRGB, 8 bits a channel.

use super::check_size;
use crate::error::{Error, Result};
use image::ImageEncoder;
use image::codecs::png::PngEncoder;

/// Encodes `rgba`, 4 bytes a pixel, already tone-mapped and sRGB-encoded, row-major from the top.
///
/// # Errors
/// [`Error::BadValue`] where the bytes do not fill `width` x `height`.
pub fn encode_png(width: u32, height: u32, rgba: &[u8]) -> Result<Vec<u8>> {
    if !rgba.len().is_multiple_of(4) {
        return Err(Error::bad_value("PNG", format!("{} bytes are no whole number of RGBA pixels", rgba.len())));
    }
    check_size("PNG", width, height, rgba.len() / 4)?;
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(rgba, width, height, image::ExtendedColorType::Rgba8)
        .map_err(|error| Error::bad_value("PNG", error.to_string()))?;
    Ok(bytes)
}

/// [`encode_png`] to a file, whole or not at all.
///
/// # Errors
/// As [`encode_png`] and [`super::write_atomic`].
#[cfg(not(target_arch = "wasm32"))]
pub fn write_png(path: &std::path::Path, width: u32, height: u32, rgba: &[u8]) -> Result<()> {
    super::write_atomic(path, &encode_png(width, height, rgba)?)
}
