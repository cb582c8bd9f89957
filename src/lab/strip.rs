//! Strips: the middles of pictures side by side, tone-mapped. What each shows is said beside the strip, not in it.

use super::metrics::{luminance, srgb_encode};
use crate::error::{Error, Result};
use crate::output::{Image, encode_png, write_atomic};
use glam::UVec2;
use std::path::{Path, PathBuf};

/// Largest tile in pixels.
const TILE: [u32; 2] = [320, 180];
/// Tiles in a row.
const COLUMNS: usize = 4;
/// Transparent pixels between tiles.
const GAP: u32 = 4;
/// What the reference's mean luminance becomes, linear.
const KEY: f64 = 0.25;

/// The curve from radiance to the screen, 1 - exp(-s L) with one s for a whole strip: monotonous, so that noise stays in
/// sight, and never clipping.
#[derive(Debug, Clone, Copy)]
pub struct Exposure(f64);

impl Exposure {
    /// That which shows a picture's mean at a quarter of white.
    pub fn of(reference: &Image) -> Self {
        let count = reference.pixels.len().max(1) as f64;
        let mean = reference.pixels.iter().map(|&pixel| luminance(pixel)).sum::<f64>() / count;
        Exposure(if mean > 0.0 { -(1.0 - KEY).ln() / mean } else { 1.0 })
    }
}

/// Pixels for people.
#[derive(Debug, Clone)]
pub struct Tile {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// sRGB, 4 bytes a pixel, row-major from the top.
    pub rgba: Vec<u8>,
}

/// The middle of a picture.
pub fn tile(image: &Image, Exposure(gain): Exposure) -> Tile {
    let shown = |c: f32| (srgb_encode(1.0 - (-gain * f64::from(c).max(0.0)).exp()) * 255.0).round() as u8;
    middle([image.width, image.height], |index| image.pixels[index].map(shown))
}

/// The middle of what is displayed: sRGB, 4 bytes a pixel, row-major from the top.
pub fn tile_of_display(size: UVec2, rgba: &[u8]) -> Tile {
    middle(size.to_array(), |index| [0, 1, 2].map(|channel| rgba[4 * index + channel]))
}

/// The middle of a picture of `size` pixels whose colours `color` knows, row-major from the top.
fn middle(size: [u32; 2], color: impl Fn(usize) -> [u8; 3]) -> Tile {
    let [width, height] = [size[0].min(TILE[0]), size[1].min(TILE[1])];
    let [left, top] = [(size[0] - width) / 2, (size[1] - height) / 2];
    // Small pictures are shown with whole pixels enlarged.
    let scale = (TILE[0] / width).min(TILE[1] / height).max(1);
    let mut rgba = Vec::with_capacity((width * height * scale * scale * 4) as usize);
    for y in 0..height * scale {
        for x in 0..width * scale {
            let [r, g, b] = color(((top + y / scale) * size[0] + left + x / scale) as usize);
            rgba.extend([r, g, b, 255]);
        }
    }
    Tile { width: width * scale, height: height * scale, rgba }
}

/// Puts tiles, given as files, into rows of cells as large as the largest of them, and writes them.
///
/// # Errors
/// `IO` and `BAD_FILE` for a tile that cannot be read.
pub fn write(path: &Path, tiles: &[PathBuf]) -> Result<()> {
    let mut pictures = Vec::new();
    for tile in tiles {
        pictures.push(read_tile(tile)?);
    }
    let side = |f: fn(&image::RgbaImage) -> u32| pictures.iter().map(f).max().unwrap_or(1);
    let [width, height] = [side(image::RgbaImage::width), side(image::RgbaImage::height)];
    let columns = pictures.len().clamp(1, COLUMNS) as u32;
    let rows = (pictures.len() as u32).div_ceil(columns).max(1);
    let mut sheet = image::RgbaImage::new(columns * (width + GAP) - GAP, rows * (height + GAP) - GAP);
    for (i, picture) in (0u32..).zip(&pictures) {
        let [x, y] = [i % columns * (width + GAP), i / columns * (height + GAP)];
        image::imageops::replace(&mut sheet, picture, x.into(), y.into());
    }
    write_atomic(path, &encode_png(sheet.width(), sheet.height(), sheet.as_raw())?)
}

fn read_tile(path: &Path) -> Result<image::RgbaImage> {
    let name = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|source| Error::Io { path: name.clone(), source })?;
    let picture = image::load_from_memory_with_format(&bytes, image::ImageFormat::Png)
        .map_err(|error| Error::bad_file(name, "picture", error.to_string()))?;
    Ok(picture.to_rgba8())
}

/// Whether a tile is there, and whole.
pub fn is_whole(path: &Path) -> bool {
    read_tile(path).is_ok()
}

/// How many tiles stand in a row.
pub fn columns(tiles: usize) -> usize {
    tiles.clamp(1, COLUMNS)
}
