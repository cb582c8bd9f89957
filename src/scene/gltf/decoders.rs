//! Who decodes what only some files need: linked in where there is room, fetched on demand by the page's Worker.

use super::container::Document;
use super::tidy;
use crate::error::{Error, Result};
pub use restir_decoders::Fault;
pub use restir_decoders::draco::Mesh as DracoMesh;
pub use restir_decoders::picture::{Limits, Picture};

/// Extensions whose data a [`Decoders`] decodes.
pub const DECODED_EXTENSIONS: &[&str] = &[DRACO, MESHOPT[0], MESHOPT[1], BASISU, WEBP];

/// `KHR_draco_mesh_compression`.
pub(super) const DRACO: &str = "KHR_draco_mesh_compression";
/// Both names of meshopt compression; the first is version 0 of the second.
pub(super) const MESHOPT: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];
/// `KHR_texture_basisu`.
pub(super) const BASISU: &str = "KHR_texture_basisu";
/// `EXT_texture_webp`.
pub(super) const WEBP: &str = "EXT_texture_webp";

/// Decodes compressed geometry, and pictures. See the crate `restir-decoders` for each.
pub trait Decoders {
    /// A Draco mesh of at most `max_bytes`.
    ///
    /// # Errors
    /// [`Fault`]
    fn draco(&self, bytes: &[u8], max_bytes: u64) -> std::result::Result<DracoMesh, Fault>;

    /// A meshopt buffer view of `count * stride` bytes; `mode` and `filter` as the extension names them.
    ///
    /// # Errors
    /// [`Fault`]
    fn meshopt(
        &self,
        bytes: &[u8],
        mode: &str,
        filter: &str,
        count: u32,
        stride: u32,
    ) -> std::result::Result<Vec<u8>, Fault>;

    /// A PNG, JPEG, WebP or KTX2 picture.
    ///
    /// # Errors
    /// [`Fault`]
    fn picture(&self, bytes: &[u8], limits: Limits) -> std::result::Result<Picture, Fault>;
}

/// The decoders of this program.
#[cfg(not(target_arch = "wasm32"))]
pub struct Linked;

#[cfg(not(target_arch = "wasm32"))]
impl Decoders for Linked {
    fn draco(&self, bytes: &[u8], max_bytes: u64) -> std::result::Result<DracoMesh, Fault> {
        restir_decoders::draco::decode(bytes, max_bytes)
    }

    fn meshopt(
        &self,
        bytes: &[u8],
        mode: &str,
        filter: &str,
        count: u32,
        stride: u32,
    ) -> std::result::Result<Vec<u8>, Fault> {
        let layout = restir_decoders::meshopt::Layout::new(mode, filter, count as usize, stride as usize)?;
        restir_decoders::meshopt::decode(bytes, &layout)
    }

    fn picture(&self, bytes: &[u8], limits: Limits) -> std::result::Result<Picture, Fault> {
        restir_decoders::picture::decode(bytes, limits)
    }
}

impl Document<'_> {
    /// What `decode` makes of the decoders, of data whose extension the file has to name; faults are placed in this file.
    pub fn decode<T>(
        &self,
        place: &str,
        decode: impl FnOnce(&dyn Decoders) -> std::result::Result<T, Fault>,
    ) -> Result<T> {
        if !self.uses_decoded_extensions || self.decoders.is_none() {
            let what = format!("{place}: this kind of data without its extension among extensionsUsed");
            return Err(Error::Unsupported { file: self.file.into(), what });
        }
        self.decode_core(place, decode)
    }

    /// The same of data that the core specification knows.
    pub fn decode_core<T>(
        &self,
        place: &str,
        decode: impl FnOnce(&dyn Decoders) -> std::result::Result<T, Fault>,
    ) -> Result<T> {
        let Some(decoders) = self.decoders else {
            let what = format!("{place}: nothing was given that decodes it");
            return Err(Error::Unsupported { file: self.file.into(), what });
        };
        decode(decoders).map_err(|fault| match fault {
            Fault::Broken(what) => self.bad(place, tidy(&what)),
            Fault::Unsupported(what) => {
                Error::Unsupported { file: self.file.into(), what: format!("{} ({place})", tidy(&what)) }
            }
            other => Error::of_fault(self.file, other),
        })
    }
}
