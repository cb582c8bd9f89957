//! Helpers shared by test files.

pub mod gltf_writer;
