//! ReSTIR in the browser and headless: one WGSL source, five nouns.
//!
//! [`scene::Scene`] -> [`scene::FlatScene`] -> `GpuScene` -> `Technique` -> `Film`.

pub mod error;
pub mod lab;
pub mod output;
pub mod scene;

pub use error::{Error, Result};
