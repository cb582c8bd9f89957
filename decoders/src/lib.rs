//! The decoders that only some files need: Draco and meshopt geometry; PNG, JPEG, WebP and Basis Universal pictures; OpenEXR
//! and Radiance maps; Wavefront OBJ.
//!
//! Native programs link them. The page keeps them in a wasm module of their own, which its Worker fetches when a file
//! asks for one, so that nobody else downloads them.
//!
//! Nothing in a file is trusted: what a decoder may produce is bounded by the caller, and checked before it is allocated.

pub mod draco;
pub mod exr;
mod ktx2;
pub mod map;
pub mod meshopt;
#[cfg(all(target_arch = "wasm32", feature = "module"))]
mod module;
pub mod obj;
pub mod picture;
mod words;

/// Why something was not decoded: one line for a person, without the name of the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Fault {
    /// The bytes are broken, or decode to more than the caller allows.
    Broken(String),
    /// They are sound but of a kind that is not decoded.
    Unsupported(String),
    /// A map has more pixels than the caller takes.
    TooLarge {
        /// How many it has.
        pixels: u64,
        /// How many it may have.
        most: u64,
    },
}

/// What every decoder returns.
pub type Result<T> = std::result::Result<T, Fault>;

/// A [`Fault::Broken`].
fn broken(what: impl Into<String>) -> Fault {
    Fault::Broken(what.into())
}
