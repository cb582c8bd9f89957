//! Environment maps: OpenEXR and Radiance files.

use super::{Environment, Scene};
use crate::error::{Error, Result};
use crate::output::{Image, MAX_SIDE, exr::MAX_EXPANSION, exr::decode_exr_within};
use image::codecs::hdr::{HdrDecoder, SIGNATURE};
use image::{ImageDecoder, ImageError};

/// Most texels of an environment map: 8192 x 4096. No side is longer than [`MAX_SIDE`].
pub const MAX_TEXELS: usize = 8192 * 4096;
/// Radiance above this, and infinity, become this: sums over a whole map then stay finite in f32.
pub const MAX_RADIANCE: f32 = 1.0e8;

/// Loads an environment map from a file; see [`decode_counting`].
///
/// # Errors
/// [`Error::Io`] where it cannot be read, else as [`decode`].
#[cfg(not(target_arch = "wasm32"))]
pub fn load_file(path: &std::path::Path) -> Result<(Environment, u64)> {
    decode_counting(&path.display().to_string(), &super::files::read(path, 2 << 30)?)
}

/// Puts the map of a file round a scene; see [`surround`].
///
/// # Errors
/// As [`load_file`].
#[cfg(not(target_arch = "wasm32"))]
pub fn surround_by_file(scene: &mut Scene, path: &std::path::Path) -> Result<()> {
    surround(scene, &path.display().to_string(), &super::files::read(path, 2 << 30)?)
}

/// Decodes a map and puts it round a scene, in place of its environment and sun. What is odd about it is added to the
/// scene's warnings: values that were clamped, and a map that is not twice as wide as it is high.
///
/// # Errors
/// As [`decode`].
pub fn surround(scene: &mut Scene, name: &str, bytes: &[u8]) -> Result<()> {
    let (environment, clamped) = decode_counting(name, bytes)?;
    let Environment { width, height, .. } = environment;
    if width != 2 * height {
        scene.warnings.push(format!("{name}: {width}x{height} is not twice as wide as high, but is the whole sphere"));
    }
    if clamped > 0 {
        let what = format!("{name}: {clamped} values were not within 0 and {MAX_RADIANCE:e} and were clamped");
        scene.warnings.push(what);
    }
    scene.surround_by(environment);
    Ok(())
}

/// Decodes an OpenEXR file (see [`decode_exr`](crate::output::decode_exr)) or a Radiance one (RGBE, rows from the top),
/// taken as linear Rec. 709 radiance. The picture is the whole sphere. Texels are clamped to [0, [`MAX_RADIANCE`]], and
/// one that is not a number becomes 0: [`decode_counting`] tells how many there were.
///
/// # Errors
/// [`Error::BadFile`] for a file that is neither, or broken, or of which most values are negative or no numbers; [`Error::Unsupported`] for pixels of another kind;
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
    let (mut clamped, mut broken) = (0, 0);
    for value in pixels.iter_mut().flatten() {
        let valid = if value.is_nan() { 0.0 } else { value.clamp(0.0, MAX_RADIANCE) };
        clamped += u64::from(valid != *value);
        broken += u64::from(value.is_nan() || *value < 0.0);
        *value = valid;
    }
    // A few come from resampling and are repaired. Most of them: this is no radiance.
    let values = 3 * pixels.len() as u64;
    if broken > values / 2 {
        return Err(Error::bad_file(
            name,
            "pixels",
            format!("{broken} of {values} values are negative or not a number"),
        ));
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
    // Run lengths of the old kind have no bound of their own: a few bytes can stand for any number of texels.
    let claimed = 12 * texels as u64;
    if claimed > MAX_EXPANSION * bytes.len() as u64 {
        let what = format!("{claimed} bytes of pixels are not believed to lie in {} bytes", bytes.len());
        return Err(Error::bad_file(name, "header", what));
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
