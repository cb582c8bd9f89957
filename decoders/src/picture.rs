//! Pictures: PNG, JPEG and WebP here, KTX2 in [`ktx2`].

use crate::words::u32_at;
use crate::{Fault, Result, broken, ktx2};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};
use std::io::Cursor;

/// A decoded picture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Width in texels, at least 1.
    pub width: u32,
    /// Height in texels, at least 1.
    pub height: u32,
    /// RGBA8, row-major from the top, as stored.
    pub pixels: Vec<u8>,
}

/// What a decoded picture may be.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Longest side in texels.
    pub side: u32,
    /// Most bytes as RGBA8.
    pub bytes: u64,
}

/// Decodes a PNG, JPEG, WebP or KTX2 file, told apart by their first bytes; only the largest level of a KTX2 is read. The size is
/// checked before anything is allocated for it.
///
/// # Errors
/// [`Fault::Broken`](crate::Fault::Broken) for a broken file or one beyond `limits`;
/// [`Fault::Unsupported`](crate::Fault::Unsupported) for other kinds of picture.
pub fn decode(bytes: &[u8], limits: Limits) -> Result<Picture> {
    if bytes.starts_with(&ktx2::IDENTIFIER) {
        return ktx2::decode(bytes, limits);
    }
    if bytes.starts_with(b"RIFF") && bytes.get(8..12) == Some(b"WEBP") {
        return decode_webp(bytes, limits);
    }
    match image::guess_format(bytes) {
        Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg)) => decode_core(bytes, format, limits),
        Ok(other) => Err(Fault::Unsupported(format!("image format {other:?}"))),
        Err(_) => Err(broken("it is neither PNG, JPEG, WebP nor KTX2")),
    }
}

/// A PNG or JPEG file: what glTF itself knows.
fn decode_core(bytes: &[u8], format: ImageFormat, limits: Limits) -> Result<Picture> {
    let error = |error: image::ImageError| broken(error.to_string());
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut decoder_limits = image::Limits::default();
    decoder_limits.max_image_width = Some(limits.side);
    decoder_limits.max_image_height = Some(limits.side);
    decoder_limits.max_alloc = Some(limits.bytes);
    reader.limits(decoder_limits);
    let decoder = reader.into_decoder().map_err(error)?;
    let (width, height) = decoder.dimensions();
    check_size(width, height, limits)?;
    if decoder.total_bytes() > limits.bytes {
        return Err(broken(format!("{width} x {height} texels take more than {} bytes", limits.bytes)));
    }
    let pixels = DynamicImage::from_decoder(decoder).map_err(error)?.into_rgba8().into_raw();
    Ok(Picture { width, height, pixels })
}

/// Refuses sizes that are 0 or too large.
pub(crate) fn check_size(width: u32, height: u32, limits: Limits) -> Result<()> {
    let bytes = u64::from(width) * u64::from(height) * 4;
    if width == 0 || height == 0 || width.max(height) > limits.side || bytes > limits.bytes {
        let Limits { side, bytes } = limits;
        return Err(broken(format!("{width} x {height} texels; at most {side} a side and {bytes} bytes are decoded")));
    }
    Ok(())
}

/// A WebP file, or the first picture of an animated one.
fn decode_webp(bytes: &[u8], limits: Limits) -> Result<Picture> {
    let error = |error: image_webp::DecodingError| broken(format!("WebP: {error}"));
    let mut decoder = image_webp::WebPDecoder::new(Cursor::new(bytes)).map_err(error)?;
    let (width, height) = decoder.dimensions();
    check_size(width, height, limits)?;
    check_frames(bytes.get(12..).unwrap_or_default(), true, limits)?;
    decoder.set_memory_limit(usize::try_from(limits.bytes).unwrap_or(usize::MAX));
    let size = decoder.output_buffer_size().ok_or_else(|| broken("WebP: too large"))?;
    let mut pixels = vec![0; size];
    decoder.read_image(&mut pixels).map_err(error)?;
    if !decoder.has_alpha() {
        pixels = pixels.as_chunks::<3>().0.iter().flat_map(|&[r, g, b]| [r, g, b, 255]).collect();
    }
    Ok(Picture { width, height, pixels })
}

/// Checks the sizes that frames give themselves, for which the decoder allocates whatever the file's header says. Only the
/// outermost chunks may hold others. Source:
/// RFC 9649, sections 2.3 (chunks), 2.7.1.1 (`ANMF`) and 3.4 (`VP8L`); RFC 6386, section 9.1 (`VP8 `).
fn check_frames(mut chunks: &[u8], outermost: bool, limits: Limits) -> Result<()> {
    while let (Some(name), Some(length)) = (chunks.get(..4), u32_at(chunks, 4)) {
        let body = chunks.get(8..).unwrap_or_default();
        let frame = body.get(..length as usize).unwrap_or(body);
        let size = match name {
            b"ANMF" if outermost => {
                check_frames(frame.get(16..).unwrap_or_default(), false, limits)?;
                None
            }
            b"VP8 " => u32_at(frame, 6).map(|sides| (sides & 0x3fff, sides >> 16 & 0x3fff)),
            b"VP8L" => u32_at(frame, 1).map(|sides| ((sides & 0x3fff) + 1, (sides >> 14 & 0x3fff) + 1)),
            _ => None,
        };
        if let Some((width, height)) = size {
            check_size(width, height, limits)?;
        }
        chunks = body.get((length as usize).saturating_add(length as usize & 1)..).unwrap_or_default();
    }
    Ok(())
}
