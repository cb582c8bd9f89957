//! Data that the crate `restir-decoders` decodes: where they may stand, and how their faults are told.

use super::container::Document;
use super::tidy;
use crate::error::{Error, Result};
use restir_decoders::Fault;

/// Extensions whose data are decoded.
pub const DECODED_EXTENSIONS: &[&str] = &[DRACO, MESHOPT[0], MESHOPT[1], BASISU, WEBP];

/// `KHR_draco_mesh_compression`.
pub(super) const DRACO: &str = "KHR_draco_mesh_compression";
/// Both names of meshopt compression; the first is version 0 of the second.
pub(super) const MESHOPT: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];
/// `KHR_texture_basisu`.
pub(super) const BASISU: &str = "KHR_texture_basisu";
/// `EXT_texture_webp`.
pub(super) const WEBP: &str = "EXT_texture_webp";

impl Document<'_> {
    /// What `decode` makes of data whose extension the file has to name; faults are placed in this file.
    pub fn decode<T>(&self, place: &str, decode: impl FnOnce() -> restir_decoders::Result<T>) -> Result<T> {
        if !self.uses_decoded_extensions {
            let what = format!("{place}: this kind of data without its extension among extensionsUsed");
            return Err(Error::Unsupported { file: self.file.into(), what });
        }
        self.decode_core(place, decode)
    }

    /// The same of data that the core specification knows.
    pub fn decode_core<T>(&self, place: &str, decode: impl FnOnce() -> restir_decoders::Result<T>) -> Result<T> {
        decode().map_err(|fault| match fault {
            Fault::Broken(what) => self.bad(place, tidy(&what)),
            Fault::Unsupported(what) => {
                Error::Unsupported { file: self.file.into(), what: format!("{} ({place})", tidy(&what)) }
            }
            other => Error::of_fault(self.file, other),
        })
    }
}
