//! Files that are written whole or not at all.

use crate::error::{Error, Result};
use std::fs::{self, File, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// Writes `bytes` to `path`: to a temporary file beside it, flushed to the disk, then renamed over it.
///
/// Whoever reads `path` sees the old file or the new one, never a part.
///
/// # Errors
/// [`Error::Io`] naming `path`; the old file is then untouched and the temporary one removed.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> Result<()> {
    let io = |source| Error::Io { path: path.display().to_string(), source };
    let (file, temporary) = create_beside(path).map_err(io)?;
    let written = write_and_flush(file, bytes).and_then(|()| fs::rename(&temporary, path));
    if written.is_err() {
        // The first error is the one to report; a temporary file that cannot be removed changes nothing about it.
        let _ = fs::remove_file(&temporary);
    }
    written.map_err(io)
}

/// Tells before long work whether [`write_atomic`] could write to `path`, without touching what is there.
///
/// # Errors
/// [`Error::Io`] where the folder does not exist or takes no file, or where `path` is a folder.
pub fn check_writable(path: &Path) -> Result<()> {
    let io = |source| Error::Io { path: path.display().to_string(), source };
    if path.is_dir() {
        return Err(io(ErrorKind::IsADirectory.into()));
    }
    // A name that is too long, say.
    if let Err(error) = fs::metadata(path)
        && error.kind() != ErrorKind::NotFound
    {
        return Err(io(error));
    }
    let (file, temporary) = create_beside(path).map_err(io)?;
    drop(file);
    fs::remove_file(temporary).map_err(io)
}

/// Creates a new file of an unused hidden name in the folder of `path`. The name is short whatever that of `path`, which
/// may be as long as the file system allows.
fn create_beside(path: &Path) -> std::io::Result<(File, PathBuf)> {
    static COUNTER: AtomicU32 = AtomicU32::new(0);
    if path.file_name().is_none() {
        return Err(ErrorKind::InvalidFilename.into());
    }
    loop {
        let number = COUNTER.fetch_add(1, Ordering::Relaxed);
        let temporary = path.with_file_name(format!(".restir-{}-{number}.tmp", std::process::id()));
        match OpenOptions::new().write(true).create_new(true).open(&temporary) {
            // Left behind by another process of this number.
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            created => return Ok((created?, temporary)),
        }
    }
}

fn write_and_flush(mut file: File, bytes: &[u8]) -> std::io::Result<()> {
    file.write_all(bytes)?;
    file.sync_all()
}
