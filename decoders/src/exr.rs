//! OpenEXR: the colour of a picture.

use crate::map::{MAX_EXPANSION, MAX_SIDE, Map};
use crate::{Fault, Result, broken};
use ::exr::block::reader::ChunksReader;
use ::exr::block::{self, UncompressedBlock};
use ::exr::math::Vec2;
use ::exr::meta::attribute::{Compression, SampleType};
use ::exr::meta::header::Header;
use std::io::Cursor;

/// What every OpenEXR file begins with.
pub const SIGNATURE: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// The compressions that are read. The exr crate's decoders of B44 and DWA overflow or allocate without bound on
/// hostile files, which no check of the header can prevent.
const COMPRESSIONS: [Compression; 6] = [
    Compression::Uncompressed,
    Compression::RLE,
    Compression::ZIP1,
    Compression::ZIP16,
    Compression::PIZ,
    Compression::PXR24,
];

/// Reads the colour of an EXR file of at most `most` pixels: channels `R`, `G`, `B`, or `Y` for grey, in 16- or 32-bit float,
/// in any order, from the first part that has them. Other channels are passed over.
///
/// # Errors
/// [`Fault::Broken`] for a broken file, or one that claims more pixels than its bytes could hold (checked before anything is
/// allocated for them); [`Fault::Unsupported`] for deep or subsampled pixels and for B44 and DWA compression;
/// [`Fault::TooLarge`] where a part has more pixels.
pub fn decode(bytes: &[u8], most: usize) -> Result<Map> {
    let bad = |place: &str, what: String| broken(format!("{place}: {what}"));
    let library = |place: &str, error: ::exr::error::Error| match error {
        ::exr::error::Error::NotSupported(what) => Fault::Unsupported(what.into()),
        other => bad(place, other.to_string()),
    };
    if !bytes.starts_with(&SIGNATURE) {
        return Err(bad("byte 0", "not an OpenEXR file".into()));
    }
    let reader = block::read(Cursor::new(bytes), false).map_err(|error| library("header", error))?;

    let mut claimed = 0u64;
    for header in reader.headers() {
        let Vec2(width, height) = header.layer_size;
        if width == 0 || height == 0 || width.max(height) > MAX_SIDE as usize {
            return Err(bad("dataWindow", format!("{width}x{height} is not within 1x1 and {MAX_SIDE}x{MAX_SIDE}")));
        }
        if width * height > most {
            return Err(Fault::TooLarge { pixels: (width * height) as u64, most: most as u64 });
        }
        if !COMPRESSIONS.contains(&header.compression) {
            return Err(Fault::Unsupported(format!("compression {}", header.compression)));
        }
        claimed = claimed.saturating_add((width * height) as u64 * header.channels.bytes_per_pixel as u64);
    }
    if claimed > MAX_EXPANSION * bytes.len() as u64 {
        return Err(bad("dataWindow", format!("{claimed} bytes of pixels cannot lie in {} bytes", bytes.len())));
    }
    let Some((part, colour)) = reader.headers().iter().enumerate().find_map(|(i, h)| Some((i, Colour::of(h)?))) else {
        return Err(bad("channels", "neither R, G and B nor Y".into()));
    };
    for &channel in &colour.channels {
        let description = &reader.headers()[part].channels.list[channel];
        if description.sampling != Vec2(1, 1) {
            return Err(Fault::Unsupported("a subsampled channel".into()));
        }
    }
    let Vec2(width, height) = reader.headers()[part].layer_size;
    let mut canvas = Canvas { width, pixels: vec![[0.0; 3]; width * height], filled: 0, colour };
    reader
        .all_chunks(true)
        .map_err(|error| library("chunk table", error))?
        .decompress_sequential(true, |meta, block| {
            match meta.headers.get(block.index.layer) {
                Some(header) if block.index.layer == part && block.index.level == Vec2(0, 0) => {
                    canvas.draw(header, &block)
                }
                _ => Some(()),
            }
            .ok_or_else(|| ::exr::error::Error::Invalid("a chunk outside the picture".into()))
        })
        .map_err(|error| library("pixels", error))?;
    if canvas.filled != width * height {
        return Err(bad("pixels", format!("{} pixels of {}", canvas.filled, width * height)));
    }
    Ok(Map { width: width as u32, height: height as u32, pixels: canvas.pixels })
}

/// Which channels of a part are the picture's red, green and blue.
struct Colour {
    channels: [usize; 3],
}

impl Colour {
    fn of(header: &Header) -> Option<Self> {
        let find = |name: &str| header.channels.list.iter().position(|c| c.name.as_slice() == name.as_bytes());
        let channels = match (find("R"), find("G"), find("B"), find("Y")) {
            (Some(r), Some(g), Some(b), _) => [r, g, b],
            (_, _, _, Some(y)) => [y; 3],
            _ => return None,
        };
        Some(Colour { channels })
    }
}

/// The picture being put together from blocks.
struct Canvas {
    width: usize,
    pixels: Vec<[f32; 3]>,
    filled: usize,
    colour: Colour,
}

impl Canvas {
    /// Copies a block into the picture; `None` where it does not lie inside or has too few bytes.
    ///
    /// A block holds its lines from the top, and within each line one run of native-endian samples a channel.
    fn draw(&mut self, header: &Header, block: &UncompressedBlock) -> Option<()> {
        let (Vec2(x0, y0), Vec2(columns, rows)) = (block.index.pixel_position, block.index.pixel_size);
        let line_bytes = columns.checked_mul(header.channels.bytes_per_pixel)?;
        if x0.checked_add(columns)? > self.width {
            return None;
        }
        let mut sources = Vec::with_capacity(3);
        for &wanted in &self.colour.channels {
            let before = header.channels.list.get(..wanted)?;
            let offset: usize = before.iter().map(|c| columns * c.sample_type.bytes_per_sample()).sum();
            sources.push((offset, header.channels.list.get(wanted)?.sample_type));
        }
        for row in 0..rows {
            let line = block.data.get(row * line_bytes..(row + 1) * line_bytes)?;
            let start = y0.checked_add(row)?.checked_mul(self.width)?.checked_add(x0)?;
            let target = self.pixels.get_mut(start..start + columns)?;
            for (component, (offset, kind)) in sources.iter().enumerate() {
                let samples = line.get(*offset..offset + columns * kind.bytes_per_sample())?;
                for (pixel, sample) in target.iter_mut().zip(samples.chunks_exact(kind.bytes_per_sample())) {
                    pixel[component] = decode_sample(*kind, sample)?;
                }
            }
        }
        self.filled += rows * columns;
        Some(())
    }
}

fn decode_sample(kind: SampleType, bytes: &[u8]) -> Option<f32> {
    Some(match kind {
        SampleType::F16 => ::exr::prelude::f16::from_ne_bytes(bytes.try_into().ok()?).to_f32(),
        SampleType::F32 => f32::from_ne_bytes(bytes.try_into().ok()?),
        SampleType::U32 => u32::from_ne_bytes(bytes.try_into().ok()?) as f32,
    })
}
