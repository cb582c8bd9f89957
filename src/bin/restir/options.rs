//! Values of options, parsed.

use glam::{UVec2, Vec3};
use restir::output::MAX_SIDE;
use restir::params::{Params, RenderParams};
use restir::{Error, Result};

/// `WIDTHxHEIGHT` in pixels, each 1 to [`MAX_SIDE`].
pub fn size(text: &str) -> Result<UVec2> {
    let bad = || Error::bad_value("size", format!("'{text}' is not WIDTHxHEIGHT, each a number from 1 to {MAX_SIDE}"));
    let (width, height) = text.split_once(['x', 'X']).ok_or_else(bad)?;
    let side = |text: &str| text.parse().ok().filter(|side| (1..=MAX_SIDE).contains(side)).ok_or_else(bad);
    Ok(UVec2::new(side(width)?, side(height)?))
}

/// `key=value`.
pub fn assignment(text: &str) -> Result<(String, String)> {
    match text.split_once('=') {
        Some((key, value)) if !key.is_empty() => Ok((key.to_owned(), value.to_owned())),
        _ => Err(Error::bad_value("set", format!("'{text}' is not key=value"))),
    }
}

/// A value of `render.max_depth`.
pub fn max_depth(text: &str) -> Result<u32> {
    let mut render = RenderParams::default();
    render.set("max_depth", text)?;
    Ok(render.max_depth)
}

/// A positive number of seconds.
pub fn seconds(text: &str) -> Result<f64> {
    let value = text.parse().ok().filter(|seconds: &f64| seconds.is_finite() && *seconds > 0.0);
    value.ok_or_else(|| Error::bad_value("seconds", format!("'{text}' is not a number above 0")))
}

/// A finite number of seconds.
pub fn time(text: &str) -> Result<f64> {
    let value = text.parse().ok().filter(|seconds: &f64| seconds.is_finite());
    value.ok_or_else(|| Error::bad_value("time", format!("'{text}' is not a number of seconds")))
}

/// Position, forward and up of a camera: nine finite numbers with commas between; the directions are made unit.
pub fn pose(text: &str) -> Result<[Vec3; 3]> {
    let bad = || Error::bad_value("pose", format!("'{text}' is not nine numbers with commas: position, forward, up"));
    let number = |part: &str| part.trim().parse().ok().filter(|value: &f32| value.is_finite());
    let numbers: Option<Vec<f32>> = text.split(',').map(number).collect();
    let [position, forward, up]: [Vec3; 3] = match numbers.as_deref() {
        Some(all @ [_, _, _, _, _, _, _, _, _]) => std::array::from_fn(|i| Vec3::from_slice(&all[3 * i..])),
        _ => return Err(bad()),
    };
    // Without a direction of its own, or with up along the view, there is no picture.
    let (forward, up) = forward.try_normalize().zip(up.try_normalize()).ok_or_else(bad)?;
    up.reject_from_normalized(forward).try_normalize().map(|_| [position, forward, up]).ok_or_else(bad)
}

/// Pictures a second: a finite number above 0.
pub fn rate(text: &str) -> Result<f64> {
    let value = text.parse().ok().filter(|rate: &f64| rate.is_finite() && *rate > 0.0);
    value.ok_or_else(|| Error::bad_value("animate", format!("'{text}' is not a number of pictures a second above 0")))
}

/// A picture file to write, by its extension.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Tone-mapped, for people.
    Png,
    /// Linear, for measurements.
    Exr,
}

/// Where to write which kind of picture.
#[derive(Debug, Clone)]
pub struct OutFile {
    pub path: std::path::PathBuf,
    pub format: Format,
}

impl OutFile {
    /// The file of picture `index` of `count`: `picture.png` becomes `picture-0000.png`.
    pub fn numbered(&self, index: u32, count: u32) -> OutFile {
        let digits = count.saturating_sub(1).max(1).ilog10() as usize + 1;
        let stem = self.path.file_stem().unwrap_or_default().to_string_lossy();
        let extension = self.path.extension().unwrap_or_default().to_string_lossy();
        let name = format!("{stem}-{index:0width$}.{extension}", width = digits.max(4));
        OutFile { path: self.path.with_file_name(name), format: self.format }
    }
}

/// A path that ends in `.png` or `.exr`.
pub fn out_file(text: &str) -> Result<OutFile> {
    let path = std::path::PathBuf::from(text);
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let format = match extension.as_str() {
        "png" => Format::Png,
        "exr" => Format::Exr,
        _ => return Err(Error::bad_value("out", format!("'{text}' ends neither in .png nor in .exr"))),
    };
    Ok(OutFile { path, format })
}

/// How long to render.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Length {
    /// This many frames.
    Frames(u32),
    /// Until this many seconds have passed.
    Seconds(f64),
}
