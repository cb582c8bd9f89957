//! Environment maps: OpenEXR files.

use super::Environment;
use crate::error::{Error, Result};
use exr::prelude::{ReadChannels, ReadLayers};
use std::io::Cursor;

/// Longest side of an environment map in texels.
pub const MAX_SIDE: usize = 16_384;
/// Most texels of an environment map: 8192 x 4096.
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

/// Decodes an OpenEXR file: the first layer that has channels R, G and B, taken as linear Rec. 709 radiance. Its data
/// window is the whole sphere. Texels are clamped to [0, [`MAX_RADIANCE`]], and one that is not a number becomes 0:
/// [`decode_counting`] tells how many there were.
///
/// # Errors
/// [`Error::BadFile`] for a file that is not OpenEXR, broken, or has no such layer; [`Error::Limit`] for one that is
/// too large. `name` is the file in these.
pub fn decode(name: &str, bytes: &[u8]) -> Result<Environment> {
    decode_counting(name, bytes).map(|(environment, _)| environment)
}

/// Like [`decode`]; also returns the number of channel values that were clamped.
///
/// # Errors
/// As [`decode`].
pub fn decode_counting(name: &str, bytes: &[u8]) -> Result<(Environment, u64)> {
    check_size(name, bytes)?;
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| (size.width(), vec![[0.0f32; 3]; size.area()]),
            |(width, pixels), position, (r, g, b): (f32, f32, f32)| {
                if let Some(pixel) = pixels.get_mut(position.y() * *width + position.x()) {
                    *pixel = [r, g, b];
                }
            },
        )
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| exr_error(name, "pixels", &error))?;
    let size = image.layer_data.size;
    let (_, mut pixels) = image.layer_data.channel_data.pixels;
    let mut clamped = 0;
    for value in pixels.iter_mut().flatten() {
        let valid = if value.is_nan() { 0.0 } else { value.clamp(0.0, MAX_RADIANCE) };
        clamped += u64::from(valid != *value);
        *value = valid;
    }
    Ok((Environment { width: size.width() as u32, height: size.height() as u32, pixels }, clamped))
}

/// Refuses what is too large by its header alone.
fn check_size(name: &str, bytes: &[u8]) -> Result<()> {
    let metadata = exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false);
    let metadata = metadata.map_err(|error| exr_error(name, "header", &error))?;
    for (index, header) in metadata.headers.iter().enumerate() {
        let (width, height) = (header.layer_size.width(), header.layer_size.height());
        if width == 0 || height == 0 {
            return Err(Error::bad_file(name, format!("layer {index}"), "it has no texels"));
        }
        let limit = |what: &str, wanted: usize, had: usize, unit| Error::Limit {
            what: format!("{name}: {what} of layer {index}"),
            wanted: wanted as u64,
            had: had as u64,
            unit,
        };
        if width.max(height) > MAX_SIDE {
            return Err(limit("a side", width.max(height), MAX_SIDE, "texels"));
        }
        if width * height > MAX_TEXELS {
            return Err(limit("the picture", width * height, MAX_TEXELS, "texels"));
        }
    }
    Ok(())
}

/// An error of the decoder on one line.
fn exr_error(name: &str, place: &str, error: &exr::error::Error) -> Error {
    let what: String = error.to_string().chars().map(|c| if c.is_control() { ' ' } else { c }).take(160).collect();
    Error::bad_file(name, place, what)
}
