//! Flat scenes in files: what `restir cook` writes.
//!
//! `RSTRCOOK`; the version of the bytes that follow (u32) and 0; their number and their checksum (u64 each); then what
//! [`FlatScene::to_bytes`] gives. Little-endian.

use super::FlatScene;
use super::bytes::VERSION;
use crate::error::{Error, Result};

const MAGIC: [u8; 8] = *b"RSTRCOOK";
const PREFIX: usize = 32;

/// FNV-1a over 64-bit words instead of bytes (Fowler, Noll, Vo): finds damage, not malice. From that
/// [`FlatScene::from_bytes`] protects.
fn checksum(bytes: &[u8]) -> u64 {
    let (words, rest) = bytes.as_chunks::<8>();
    let mut last = [0; 8];
    last[..rest.len()].copy_from_slice(rest);
    words.iter().chain(std::iter::once(&last)).fold(0xcbf2_9ce4_8422_2325, |hash, word| {
        // The high half carries what multiplication only moves upwards back down.
        let hash = (hash ^ u64::from_le_bytes(*word)).wrapping_mul(0x0000_0100_0000_01b3);
        hash ^ (hash >> 32)
    })
}

/// Whether a file begins as a cooked scene does.
pub fn is_cooked(bytes: &[u8]) -> bool {
    bytes.starts_with(&MAGIC)
}

/// The contents of a `.restir` file.
pub fn to_file(scene: &FlatScene) -> Vec<u8> {
    let bytes = scene.to_bytes();
    let mut out = Vec::with_capacity(PREFIX + bytes.len());
    out.extend(MAGIC);
    out.extend(VERSION.to_le_bytes());
    out.extend([0; 4]);
    out.extend((bytes.len() as u64).to_le_bytes());
    out.extend(checksum(&bytes).to_le_bytes());
    out.extend(bytes);
    out
}

/// The bytes for [`FlatScene::from_bytes`] in the `.restir` file `name`, once version, length and checksum are right.
///
/// # Errors
/// [`Error::BadFile`] for a file of another kind, cut off or damaged; [`Error::Unsupported`] for one that another version
/// of restir has cooked.
pub fn contents<'a>(name: &str, file: &'a [u8]) -> Result<&'a [u8]> {
    let bad = |place: &str, what: String| Error::bad_file(name, place, what);
    let Some((prefix, bytes)) = file.split_at_checked(PREFIX).filter(|_| is_cooked(file)) else {
        return Err(bad("prefix", "it is no cooked scene".into()));
    };
    let word = |at: usize| {
        let mut word = [0; 8];
        word.copy_from_slice(&prefix[at..at + 8]);
        u64::from_le_bytes(word)
    };
    let (version, length, sum) = (word(8), word(16), word(24));
    if version != u64::from(VERSION) {
        let what = format!("cooked scene of version {} instead of {VERSION}: cook it again; it", version & 0xffff_ffff);
        return Err(Error::Unsupported { file: name.to_owned(), what });
    }
    if length != bytes.len() as u64 {
        return Err(bad("prefix", format!("{length} bytes were written, {} are there", bytes.len())));
    }
    if checksum(bytes) != sum {
        return Err(bad("prefix", "the checksum is wrong: the file is damaged".into()));
    }
    Ok(bytes)
}

/// Reads a `.restir` file.
///
/// # Errors
/// As [`contents`] and [`FlatScene::from_bytes`].
pub fn from_file(name: &str, file: &[u8]) -> Result<FlatScene> {
    FlatScene::from_bytes(contents(name, file)?).map_err(|error| match error {
        Error::BadFile { place, what, .. } => Error::bad_file(name, place, what),
        other => other,
    })
}

/// Reads a `.restir` file from disk.
///
/// # Errors
/// [`Error::Io`] where it cannot be read, [`Error::Limit`] beyond [`MAX_FILE_BYTES`], else as [`from_file`].
pub fn load_file(path: &std::path::Path) -> Result<FlatScene> {
    from_file(&path.display().to_string(), &crate::scene::files::read(path, MAX_FILE_BYTES)?)
}

/// Most bytes of a cooked scene: twice what the largest scene takes.
pub const MAX_FILE_BYTES: u64 = 8 << 30;
