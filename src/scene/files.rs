//! Reading whole files with a bound on their size.

use crate::error::{Error, Result};
use std::io::Read;
use std::path::Path;

/// The bytes of a regular file of at most `limit` bytes.
///
/// # Errors
/// [`Error::Io`] where it cannot be read or is no regular file, [`Error::Limit`] where it is larger.
pub fn read(path: &Path, limit: u64) -> Result<Vec<u8>> {
    let io_error = |source| Error::Io { path: path.display().to_string(), source };
    let too_large = |wanted| Error::Limit { what: path.display().to_string(), wanted, had: limit, unit: "bytes" };
    // Devices and pipes may never end.
    let metadata = std::fs::metadata(path).map_err(io_error)?;
    if !metadata.is_file() {
        return Err(io_error(std::io::Error::other("not a regular file")));
    }
    if metadata.len() > limit {
        return Err(too_large(metadata.len()));
    }
    // It may grow while it is read.
    let mut bytes = Vec::with_capacity(metadata.len() as usize);
    let file = std::fs::File::open(path).map_err(io_error)?;
    file.take(limit + 1).read_to_end(&mut bytes).map_err(io_error)?;
    if bytes.len() as u64 > limit { Err(too_large(bytes.len() as u64)) } else { Ok(bytes) }
}

/// Reads files that a scene at `path` names relative to its folder.
pub(crate) fn beside(path: &Path, limit: u64) -> impl FnMut(&str) -> Result<Vec<u8>> {
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    move |relative| read(&folder.join(relative), limit)
}
