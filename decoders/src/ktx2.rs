//! KTX2 with Basis Universal, as `KHR_texture_basisu` allows it: ETC1S under BasisLZ, UASTC with or without Zstandard.
//!
//! Source: KTX File Format Specification 2.0, sections 3 (header, level index, format descriptor) and 5 (BasisLZ global
//! data). The container is read here, with every length and offset checked; blocks are unpacked by `basisu`.

use crate::picture::{Limits, Picture, check_size};
use crate::words::{slice, u32_at, u64_at};
use crate::{Fault, Result, broken};
use basisu::basislz::etc1s::Etc1sTranscoder;
use basisu::uastc::unpack::unpack_uastc;
use std::io::Read;

/// The first bytes of a KTX 2.0 file.
pub(crate) const IDENTIFIER: [u8; 12] = [0xab, b'K', b'T', b'X', b' ', b'2', b'0', 0xbb, b'\r', b'\n', 0x1a, b'\n'];

/// Colour models of the format descriptor.
const ETC1S: u8 = 163;
const UASTC: u8 = 166;
/// Supercompression schemes.
const NO_SCHEME: u32 = 0;
const BASIS_LZ: u32 = 1;
const ZSTANDARD: u32 = 2;

/// The parts of a file that its largest level needs, each inside the file.
struct Container<'a> {
    width: u32,
    height: u32,
    levels: u32,
    scheme: u32,
    model: u8,
    /// Whether the format descriptor has a second sample: an alpha slice.
    has_alpha: bool,
    globals: &'a [u8],
    /// The largest level, and its length when decompressed.
    level: &'a [u8],
    uncompressed: u64,
}

/// Decodes the largest level.
pub(crate) fn decode(bytes: &[u8], limits: Limits) -> Result<Picture> {
    let container = parse(bytes, limits)?;
    let Container { width, height, .. } = container;
    let pixels = match (container.model, container.scheme) {
        (ETC1S, BASIS_LZ) => etc1s(&container)?,
        (UASTC, NO_SCHEME | ZSTANDARD) => uastc(&container)?,
        (model, scheme) => {
            let what = format!("KTX2 of colour model {model} with supercompression scheme {scheme}");
            return Err(Fault::Unsupported(what));
        }
    };
    Ok(Picture { width, height, pixels })
}

/// Reads the container.
fn parse(bytes: &[u8], limits: Limits) -> Result<Container<'_>> {
    let short = || broken("KTX2: the file ends in its header");
    let outside = |what: &str| broken(format!("KTX2: its {what} lies outside the file"));
    let word = |offset: usize| u32_at(bytes, offset).ok_or_else(short);
    let long = |offset: usize| u64_at(bytes, offset).ok_or_else(short);
    let [format, width, height, depth] = [word(12)?, word(20)?, word(24)?, word(28)?];
    let [layers, faces, levels, scheme] = [word(32)?, word(36)?, word(40)?, word(44)?];
    if format != 0 {
        return Err(Fault::Unsupported(format!(
            "KTX2 with pixels of Vulkan format {format} instead of Basis Universal"
        )));
    }
    if depth > 0 || layers > 1 || faces != 1 || !(1..=32).contains(&levels) {
        return Err(Fault::Unsupported("KTX2 that is not one two-dimensional picture with its levels".into()));
    }
    check_size(width, height, limits)?;
    let descriptor = slice(bytes, word(48)?.into(), word(52)?.into()).ok_or_else(|| outside("format descriptor"))?;
    let model = descriptor.get(12).filter(|_| descriptor.len() >= 44);
    let model = *model.ok_or_else(|| broken("KTX2: its format descriptor is too short"))?;
    Ok(Container {
        width,
        height,
        levels,
        scheme,
        model,
        has_alpha: descriptor.len() >= 60,
        globals: slice(bytes, long(64)?, long(72)?).ok_or_else(|| outside("global data"))?,
        level: slice(bytes, long(80)?, long(88)?).ok_or_else(|| outside("largest level"))?,
        uncompressed: long(96)?,
    })
}

/// Blocks of UASTC, perhaps under Zstandard.
fn uastc(container: &Container) -> Result<Vec<u8>> {
    let &Container { width, height, level, .. } = container;
    let (across, down) = (width.div_ceil(4) as usize, height.div_ceil(4) as usize);
    let size = across * down * 16;
    let said = if container.scheme == ZSTANDARD { container.uncompressed } else { level.len() as u64 };
    if said != size as u64 {
        return Err(broken(format!("KTX2: {said} bytes of blocks for {width} x {height} texels, not {size}")));
    }
    let inflated;
    let blocks = if container.scheme == ZSTANDARD {
        inflated = inflate(level, size)?;
        &inflated
    } else {
        level
    };
    let mut pixels = vec![0; width as usize * height as usize * 4];
    for (index, block) in blocks.as_chunks::<16>().0.iter().enumerate() {
        let texels = unpack_uastc(block, false).ok_or_else(|| broken(format!("KTX2: block {index} is not UASTC")))?;
        let (left, top) = (index % across * 4, index / across * 4);
        for (i, texel) in texels.iter().enumerate() {
            let (x, y) = (left + i % 4, top + i / 4);
            if x < width as usize && y < height as usize {
                let at = (y * width as usize + x) * 4;
                pixels[at..at + 4].copy_from_slice(&[texel.r(), texel.g(), texel.b(), texel.a()]);
            }
        }
    }
    Ok(pixels)
}

/// Decompresses exactly `size` bytes of Zstandard.
fn inflate(bytes: &[u8], size: usize) -> Result<Vec<u8>> {
    let fault = |what: &dyn std::fmt::Display| broken(format!("KTX2: Zstandard: {what}"));
    // A window is never longer than the smallest one allowed or what it is needed for.
    let window = (size as u64).max(1 << 23);
    let decoder = ruzstd::decoding::StreamingDecoder::new_with_max_window_size(bytes, window);
    let mut out = Vec::with_capacity(size);
    let mut limited = decoder.map_err(|error| fault(&error))?.take(size as u64 + 1);
    limited.read_to_end(&mut out).map_err(|error| fault(&error))?;
    if out.len() != size {
        return Err(fault(&format!("it decompresses to another length than {size} bytes")));
    }
    Ok(out)
}

/// Slices of ETC1S: indices into codebooks. The global data are a header of 20 bytes, as many for each level, the
/// codebooks of endpoints and selectors, and Huffman tables.
fn etc1s(container: &Container) -> Result<Vec<u8>> {
    let &Container { width, height, globals, level, .. } = container;
    let fault = |what: &str| broken(format!("KTX2: {what}"));
    let word = |offset: usize| u32_at(globals, offset).ok_or_else(|| fault("its global data are too short"));
    let counts = word(0)?;
    let (endpoints, selectors) = (counts & 0xffff, counts >> 16);
    if endpoints == 0 || selectors == 0 {
        return Err(fault("an empty codebook"));
    }
    let first = 20 + 20 * u64::from(container.levels);
    let (endpoint_bytes, selector_bytes) = (u64::from(word(4)?), u64::from(word(8)?));
    let part = |offset: u64, length: u64| {
        slice(globals, offset, length).ok_or_else(|| fault("a codebook lies outside its global data"))
    };
    let endpoint_data = part(first, endpoint_bytes)?;
    let selector_data = part(first + endpoint_bytes, selector_bytes)?;
    let tables = part(first + endpoint_bytes + selector_bytes, word(12)?.into())?;
    let slice_of = |at: usize| {
        let found = slice(level, word(at)?.into(), word(at + 4)?.into());
        found.ok_or_else(|| fault("a slice lies outside its level"))
    };
    let colour = slice_of(24)?;
    let alpha = container.has_alpha.then(|| slice_of(32)).transpose()?;

    let mut transcoder = Etc1sTranscoder::new();
    if !transcoder.decode_palettes(endpoints, endpoint_data, selectors, selector_data) {
        return Err(fault("a broken codebook"));
    }
    if !transcoder.decode_tables(tables) {
        return Err(fault("broken Huffman tables"));
    }
    let (across, down) = (width.div_ceil(4), height.div_ceil(4));
    let mut pixels = vec![0; width as usize * height as usize * 4];
    let decoded = match alpha {
        Some(alpha) => transcoder.transcode_image_rgba32(colour, alpha, across, down, width, height, None, &mut pixels),
        None => transcoder.transcode_slice_rgba32(colour, across, down, width, height, None, &mut pixels),
    };
    decoded.ok_or_else(|| fault("a broken slice"))?;
    Ok(pixels)
}
