//! Reading whole files with a bound on their size.

use crate::error::{Error, Result};
use std::path::Path;

/// The bytes of a regular file of at most `limit` bytes.
///
/// # Errors
/// [`Error::Io`] where it cannot be read or is no regular file, [`Error::Limit`] where it is larger.
pub(crate) fn read(path: &Path, limit: u64) -> Result<Vec<u8>> {
    let io_error = |source| Error::Io { path: path.display().to_string(), source };
    // Devices and pipes may never end.
    let metadata = std::fs::metadata(path).map_err(io_error)?;
    if !metadata.is_file() {
        return Err(io_error(std::io::Error::other("not a regular file")));
    }
    if metadata.len() > limit {
        return Err(Error::Limit {
            what: path.display().to_string(),
            wanted: metadata.len(),
            had: limit,
            unit: "bytes",
        });
    }
    std::fs::read(path).map_err(io_error)
}
