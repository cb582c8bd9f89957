//! ReSTIR in the browser and headless: one WGSL source, five nouns.
//!
//! [`scene::Scene`] -> [`scene::FlatScene`] -> `GpuScene` -> `Technique` -> `Film`.

pub mod error;
pub mod scene;

pub use error::{Error, Result};
