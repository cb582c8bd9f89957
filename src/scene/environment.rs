//! Environment maps: OpenEXR and Radiance files.

use super::Environment;
use crate::error::{Error, Result};
use crate::output::{Image, MAX_SIDE, exr::decode_exr_within};
use image::codecs::hdr::{HdrDecoder, SIGNATURE};
use image::{ImageDecoder, ImageError};

/// Most texels of an environment map: 8192 x 4096. No side is longer than [`MAX_SIDE`].
pub const MAX_TEXELS: usize = 8192 * 4096;
/// Radiance above this, and infinity, become this: sums over a whole map then stay finite in f32.
pub const MAX_RADIANCE: f32 = 1.0e8;

/// Loads an environment map from a file; see [`decode`].
///
/// # Errors
/// [`Error::Io`] where it cannot be read, else as [`decode`].
#[cfg(not(target_arch = "wasm32"))]
pub fn load_file(path: &std::path::Path) -> Result<Environment> {
    decode(&path.display().to_string(), &super::files::read(path, 2 << 30)?)
}

/// Decodes an OpenEXR file (see [`decode_exr`](crate::output::decode_exr)) or a Radiance one (RGBE, rows from the top),
/// taken as linear Rec. 709 radiance. The picture is the whole sphere. Texels are clamped to [0, [`MAX_RADIANCE`]], and
/// one that is not a number becomes 0: [`decode_counting`] tells how many there were.
///
/// # Errors
/// [`Error::BadFile`] for a file that is neither, or broken; [`Error::Unsupported`] for pixels of another kind;
/// [`Error::Limit`] for more than [`MAX_TEXELS`]. `name` is the file in these.
pub fn decode(name: &str, bytes: &[u8]) -> Result<Environment> {
    decode_counting(name, bytes).map(|(environment, _)| environment)
}

/// Like [`decode`]; also returns the number of channel values that were clamped.
///
/// # Errors
/// As [`decode`].
pub fn decode_counting(name: &str, bytes: &[u8]) -> Result<(Environment, u64)> {
    let Image { width, height, mut pixels } = match bytes.starts_with(SIGNATURE) {
        true => decode_hdr(name, bytes)?,
        false => decode_exr_within(name, bytes, MAX_TEXELS)?,
    };
    let mut clamped = 0;
    for value in pixels.iter_mut().flatten() {
        let valid = if value.is_nan() { 0.0 } else { value.clamp(0.0, MAX_RADIANCE) };
        clamped += u64::from(valid != *value);
        *value = valid;
    }
    Ok((Environment { width, height, pixels }, clamped))
}

/// A Radiance file: its values divided by its EXPOSURE, which is what they were multiplied by (Ward, "Radiance File
/// Formats").
fn decode_hdr(name: &str, bytes: &[u8]) -> Result<Image> {
    let error = |place: &str, error: ImageError| match error {
        ImageError::Unsupported(what) => Error::Unsupported { file: name.to_owned(), what: one_line(&what) },
        other => Error::bad_file(name, place, one_line(&other)),
    };
    let decoder = HdrDecoder::new(bytes).map_err(|e| error("header", e))?;
    let (width, height) = decoder.dimensions();
    if width == 0 || height == 0 || width.max(height) > MAX_SIDE {
        let what = format!("{width}x{height} is not within 1x1 and {MAX_SIDE}x{MAX_SIDE}");
        return Err(Error::bad_file(name, "header", what));
    }
    let texels = width as usize * height as usize;
    if texels > MAX_TEXELS {
        return Err(Error::Limit {
            what: format!("{name}: the picture"),
            wanted: texels as u64,
            had: MAX_TEXELS as u64,
            unit: "pixels",
        });
    }
    let exposure = decoder.metadata().exposure.unwrap_or(1.0);
    if !(exposure.is_finite() && exposure > 0.0) {
        return Err(Error::bad_file(name, "header", format!("EXPOSURE={exposure}")));
    }
    let mut pixels = vec![[0.0f32; 3]; texels];
    decoder.read_image(bytemuck::cast_slice_mut(&mut pixels)).map_err(|e| error("pixels", e))?;
    for value in pixels.iter_mut().flatten() {
        *value /= exposure;
    }
    Ok(Image { width, height, pixels })
}

/// A message of the decoder, which may quote the file.
fn one_line(message: &dyn std::fmt::Display) -> String {
    message.to_string().chars().map(|c| if c.is_control() { ' ' } else { c }).take(160).collect()
}
