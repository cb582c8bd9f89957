//! Environment maps: OpenEXR and Radiance files.

use super::{Environment, Scene};
use crate::error::{Error, Result};
pub use restir_decoders::map::{MAX_TEXELS, Map};

/// Radiance above this, and infinity, become this: sums over a whole map then stay finite in f32.
pub const MAX_RADIANCE: f32 = 1.0e8;

/// Loads an environment map from a file; see [`decode_counting`].
///
/// # Errors
/// [`Error::Io`] where it cannot be read, else as [`decode`].
pub fn load_file(path: &std::path::Path) -> Result<(Environment, u64)> {
    decode_counting(&path.display().to_string(), &super::files::read(path, 2 << 30)?)
}

/// Puts the map of a file round a scene; see [`surround`].
///
/// # Errors
/// As [`load_file`].
pub fn surround_by_file(scene: &mut Scene, path: &std::path::Path) -> Result<()> {
    surround(scene, &path.display().to_string(), &super::files::read(path, 2 << 30)?)
}

/// Decodes a map and puts it round a scene as [`surround_by`] does.
///
/// # Errors
/// As [`decode`].
pub fn surround(scene: &mut Scene, name: &str, bytes: &[u8]) -> Result<()> {
    surround_by(scene, name, decode_map(name, bytes)?)
}

/// Puts a map round a scene, in place of its environment and sun. What is odd about it is added to the scene's warnings:
/// values that were clamped, and a map that is not twice as wide as it is high.
///
/// # Errors
/// As [`repaired`].
pub fn surround_by(scene: &mut Scene, name: &str, map: Map) -> Result<()> {
    let (environment, clamped) = repaired(name, map)?;
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
/// [`Error::BadFile`] for a file that is neither, or broken, or of which most values are negative or no numbers;
/// [`Error::Unsupported`] for pixels of another kind; [`Error::Limit`] for more than [`MAX_TEXELS`]. `name` is the file in
/// these.
pub fn decode(name: &str, bytes: &[u8]) -> Result<Environment> {
    decode_counting(name, bytes).map(|(environment, _)| environment)
}

/// Like [`decode`]; also returns the number of channel values that were clamped.
///
/// # Errors
/// As [`decode`].
pub fn decode_counting(name: &str, bytes: &[u8]) -> Result<(Environment, u64)> {
    repaired(name, decode_map(name, bytes)?)
}

fn decode_map(name: &str, bytes: &[u8]) -> Result<Map> {
    restir_decoders::map::decode(bytes).map_err(|fault| Error::of_fault(name, fault))
}

/// The environment that a map is, and the number of channel values that were clamped.
///
/// # Errors
/// [`Error::BadFile`] where most values are negative or no numbers.
pub fn repaired(name: &str, map: Map) -> Result<(Environment, u64)> {
    let Map { width, height, mut pixels } = map;
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
