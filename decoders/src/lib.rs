//! The decoders that only some files need: Draco and meshopt geometry; PNG, JPEG, WebP and Basis Universal pictures; OpenEXR
//! and Radiance maps; Wavefront OBJ.
//!
//! They are a crate of their own so that they can be compiled, checked and fuzzed by themselves.
//!
//! Nothing in a file is trusted: what a decoder may produce is bounded by the caller, and checked before it is allocated.

pub mod draco;
pub mod exr;
mod ktx2;
pub mod map;
pub mod meshopt;
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
