//! Maps of radiance: OpenEXR in [`crate::exr`], Radiance here.

use crate::{Fault, Result, broken};
use image::codecs::hdr::{HdrDecoder, SIGNATURE};
use image::{ImageDecoder, ImageError};

/// Longest side of a map.
pub const MAX_SIDE: u32 = 16384;
/// Most texels of a map: 8192 x 4096.
pub const MAX_TEXELS: usize = 8192 * 4096;
/// A file may claim at most this many bytes of pixels a byte of its own: twice what deflate can do at best.
pub(crate) const MAX_EXPANSION: u64 = 2064;

/// A decoded map.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// Width in texels, at least 1.
    pub width: u32,
    /// Height in texels, at least 1.
    pub height: u32,
    /// RGB, row-major from the top, as stored.
    pub pixels: Vec<[f32; 3]>,
}

/// Decodes an OpenEXR or a Radiance file of at most [`MAX_TEXELS`], told apart by their first bytes. The size is checked before
/// anything is allocated for it.
///
/// # Errors
/// [`Fault::Broken`] for a file that is neither, or broken; [`Fault::Unsupported`] for pixels of another kind;
/// [`Fault::TooLarge`] for more texels.
pub fn decode(bytes: &[u8]) -> Result<Map> {
    if bytes.starts_with(SIGNATURE) {
        decode_radiance(bytes)
    } else if bytes.starts_with(&crate::exr::SIGNATURE) {
        crate::exr::decode(bytes, MAX_TEXELS)
    } else {
        Err(broken("byte 0: neither an OpenEXR nor a Radiance file"))
    }
}

/// A Radiance file: its values divided by its EXPOSURE, which is what they were multiplied by (Ward, "Radiance File
/// Formats").
fn decode_radiance(bytes: &[u8]) -> Result<Map> {
    let error = |place: &str, error: ImageError| match error {
        ImageError::Unsupported(what) => Fault::Unsupported(one_line(&what)),
        other => broken(format!("{place}: {}", one_line(&other))),
    };
    let decoder = HdrDecoder::new(bytes).map_err(|e| error("header", e))?;
    let (width, height) = decoder.dimensions();
    if width == 0 || height == 0 || width.max(height) > MAX_SIDE {
        return Err(broken(format!("header: {width}x{height} is not within 1x1 and {MAX_SIDE}x{MAX_SIDE}")));
    }
    let texels = width as usize * height as usize;
    if texels > MAX_TEXELS {
        return Err(Fault::TooLarge { pixels: texels as u64, most: MAX_TEXELS as u64 });
    }
    // Run lengths of the old kind have no bound of their own: a few bytes can stand for any number of texels.
    let claimed = 12 * texels as u64;
    if claimed > MAX_EXPANSION * bytes.len() as u64 {
        let what = format!("header: {claimed} bytes of pixels are not believed to lie in {} bytes", bytes.len());
        return Err(broken(what));
    }
    let exposure = decoder.metadata().exposure.unwrap_or(1.0);
    if !(exposure.is_finite() && exposure > 0.0) {
        return Err(broken(format!("header: EXPOSURE={exposure}")));
    }
    let mut pixels = vec![[0.0f32; 3]; texels];
    decoder.read_image(bytemuck::cast_slice_mut(&mut pixels)).map_err(|e| error("pixels", e))?;
    for value in pixels.iter_mut().flatten() {
        *value /= exposure;
    }
    Ok(Map { width, height, pixels })
}

/// A message of the decoder, which may quote the file.
fn one_line(message: &dyn std::fmt::Display) -> String {
    message.to_string().chars().map(|c| if c.is_control() { ' ' } else { c }).take(160).collect()
}
