//! OpenEXR, for measurements: linear Rec. 709, 32-bit float, with how the picture was made in the header.

use super::{Image, check_size};
use crate::error::{Error, Result};
use ::exr::image::write::WritableImage;
use ::exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image as ExrImage, Layer};
use ::exr::math::Vec2;
use ::exr::meta::attribute::{Chromaticities, LineOrder};
use ::exr::meta::header::LayerAttributes;
use restir_decoders::map::Map;
use std::io::Cursor;

/// A picture and what is known of it, for [`encode_exr`].
#[derive(Debug, Clone, Copy)]
pub struct ExrPicture<'a> {
    /// Channels `R`, `G`, `B`.
    pub image: &'a Image,
    /// Linear Rec. 709 albedo of the first surface: channels `albedo.R`, `albedo.G`, `albedo.B`.
    pub albedo: Option<&'a [[f32; 3]]>,
    /// World-space unit shading normal of the first surface: channels `normal.X`, `normal.Y`, `normal.Z`.
    pub normal: Option<&'a [[f32; 3]]>,
    /// Distance to the first surface along the view axis in metres: channel `depth.Z`.
    pub depth: Option<&'a [f32]>,
    /// How far what is seen has moved since the frame before, in pixels, x to the right and y down: channels `motion.X`,
    /// `motion.Y`.
    pub motion: Option<&'a [[f32; 2]]>,
    /// Technique id: attribute `restir.technique`.
    pub technique: &'a str,
    /// Every parameter as JSON text: attribute `restir.parameters`.
    pub parameters: &'a str,
    /// Attribute `restir.seed`.
    pub seed: u32,
    /// Frames rendered: attribute `restir.frames`.
    pub frames: u32,
}

/// Encodes a picture losslessly (ZIP). The same picture gives the same bytes.
///
/// All attributes of our own are strings (numbers in decimal); `restir.version` is the version of this crate, and
/// `chromaticities` are those of Rec. 709.
///
/// # Errors
/// [`Error::BadValue`] where a channel does not fill the picture.
pub fn encode_exr(picture: &ExrPicture) -> Result<Vec<u8>> {
    let Image { width, height, pixels } = picture.image;
    let size = Vec2(*width as usize, *height as usize);
    let check = |name: &str, count: usize| check_size(name, *width, *height, count);
    let mut channels = Vec::new();
    let mut add = |name: &str, samples: Vec<f32>| channels.push(AnyChannel::new(name, FlatSamples::F32(samples)));
    let component = |triples: &[[f32; 3]], i: usize| triples.iter().map(|t| t[i]).collect::<Vec<f32>>();

    check("EXR", pixels.len())?;
    for (i, name) in ["R", "G", "B"].into_iter().enumerate() {
        add(name, component(pixels, i));
    }
    if let Some(albedo) = picture.albedo {
        check("EXR albedo", albedo.len())?;
        for (i, name) in ["albedo.R", "albedo.G", "albedo.B"].into_iter().enumerate() {
            add(name, component(albedo, i));
        }
    }
    if let Some(normal) = picture.normal {
        check("EXR normal", normal.len())?;
        for (i, name) in ["normal.X", "normal.Y", "normal.Z"].into_iter().enumerate() {
            add(name, component(normal, i));
        }
    }
    if let Some(depth) = picture.depth {
        check("EXR depth", depth.len())?;
        add("depth.Z", depth.to_vec());
    }
    if let Some(motion) = picture.motion {
        check("EXR motion", motion.len())?;
        for (i, name) in ["motion.X", "motion.Y"].into_iter().enumerate() {
            add(name, motion.iter().map(|pair| pair[i]).collect());
        }
    }

    let encoding = Encoding { line_order: LineOrder::Increasing, ..Encoding::SMALL_LOSSLESS };
    let channels = AnyChannels::sort(channels.into_iter().collect());
    let mut file = ExrImage::from_layer(Layer::new(size, LayerAttributes::default(), encoding, channels));
    file.attributes.chromaticities = Some(Chromaticities {
        red: Vec2(0.64, 0.33),
        green: Vec2(0.30, 0.60),
        blue: Vec2(0.15, 0.06),
        white: Vec2(0.3127, 0.3290),
    });
    let mut bytes = Vec::new();
    file.write()
        .non_parallel()
        .to_buffered(Cursor::new(&mut bytes))
        .map_err(|error| Error::bad_value("EXR", error.to_string()))?;
    insert_attributes(
        &bytes,
        &[
            ("restir.frames", &picture.frames.to_string()),
            ("restir.parameters", picture.parameters),
            ("restir.seed", &picture.seed.to_string()),
            ("restir.technique", picture.technique),
            ("restir.version", env!("CARGO_PKG_VERSION")),
        ],
    )
    .ok_or_else(|| Error::bad_value("EXR", "the header is too large"))
}

/// Adds string attributes to the one header of an EXR file.
///
/// The exr crate keeps custom attributes in a hash map and writes them in an order that differs from run to run;
/// inserted here, the same picture gives the same bytes. An attribute is `name 0 type 0 size value`; an empty name ends
/// the header; the table of chunk offsets follows (OpenEXR, "File Layout").
fn insert_attributes(file: &[u8], attributes: &[(&str, &str)]) -> Option<Vec<u8>> {
    let mut inserted = Vec::new();
    for (name, value) in attributes {
        inserted.extend_from_slice(name.as_bytes());
        inserted.extend_from_slice(b"\0string\0");
        inserted.extend_from_slice(&i32::try_from(value.len()).ok()?.to_le_bytes());
        inserted.extend_from_slice(value.as_bytes());
    }
    let end = header_end(file)?;
    let mut out = Vec::with_capacity(file.len() + inserted.len());
    out.extend_from_slice(file.get(..end)?);
    out.extend_from_slice(&inserted);
    out.push(0);
    // The first chunk begins where the table ends.
    let table = end + 1;
    let first = u64::from_le_bytes(file.get(table..table + 8)?.try_into().ok()?);
    let first = usize::try_from(first).ok()?;
    for offset in file.get(table..first)?.chunks_exact(8) {
        let offset = u64::from_le_bytes(offset.try_into().ok()?);
        out.extend_from_slice(&(offset + inserted.len() as u64).to_le_bytes());
    }
    out.extend_from_slice(file.get(first..)?);
    Some(out)
}

/// Where the zero byte that ends the header lies.
fn header_end(file: &[u8]) -> Option<usize> {
    let mut at = 8; // magic number and version
    while *file.get(at)? != 0 {
        for _ in 0..2 {
            at += file.get(at..)?.iter().position(|&byte| byte == 0)? + 1;
        }
        let size = i32::from_le_bytes(file.get(at..at + 4)?.try_into().ok()?);
        at = at.checked_add(4)?.checked_add(usize::try_from(size).ok()?)?;
    }
    Some(at)
}

/// Most bytes of a file that [`read_exr`] reads.
const MAX_FILE_BYTES: u64 = 4 << 30;

/// [`decode_exr`] of a file.
///
/// # Errors
/// [`Error::Io`] where it cannot be read or is no regular file, [`Error::Limit`] where it is larger than 4 GiB; otherwise as [`decode_exr`].
pub fn read_exr(path: &std::path::Path) -> Result<Image> {
    decode_exr(&path.display().to_string(), &crate::scene::files::read(path, MAX_FILE_BYTES)?)
}

/// Reads the colour of an EXR file: channels `R`, `G`, `B`, or `Y` for grey, in 16- or 32-bit float, in any order, from
/// the first part that has them. Other channels are passed over. `name` is what errors call the file.
///
/// # Errors
/// [`Error::BadFile`] for a broken file, or one that claims more pixels than [`MAX_SIDE`](super::MAX_SIDE) squared or than its bytes
/// could hold (checked before anything is allocated for them); [`Error::Unsupported`] for deep or subsampled pixels and
/// for B44 and DWA compression.
pub fn decode_exr(name: &str, bytes: &[u8]) -> Result<Image> {
    let decoded = restir_decoders::exr::decode(bytes, usize::MAX);
    let Map { width, height, pixels } = decoded.map_err(|fault| Error::of_fault(name, fault))?;
    Ok(Image { width, height, pixels })
}
