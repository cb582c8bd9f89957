//! Wavefront OBJ files with their materials, by way of glTF: `restir-decoders` converts, [`gltf`](super::gltf) loads. How
//! a material is converted is written in docs/formats.md.

use super::{Scene, files, gltf};
use crate::error::{Error, Result};
use restir_decoders::Fault;
use std::path::Path;

/// Loads an `.obj` file; material libraries and images are read from beside it. A library that is missing or broken is a
/// warning.
///
/// # Errors
/// [`Error::Io`] where a file cannot be read, [`Error::BadFile`] for a broken OBJ, else as
/// [`gltf::load_bytes_with`].
pub fn load_file(path: &Path) -> Result<Scene> {
    let name = path.display().to_string();
    let bytes = files::read(path, gltf::MAX_BUFFER_BYTES)?;
    load_bytes(&name, &bytes, &mut files::beside(path, gltf::MAX_BUFFER_BYTES))
}

/// Loads OBJ from memory; `resolve` is asked for material libraries and images, as by [`gltf::load_bytes`].
///
/// # Errors
/// As [`load_file`].
pub fn load_bytes(name: &str, bytes: &[u8], resolve: gltf::Resolve) -> Result<Scene> {
    let mut find = |library: &str| {
        let path = gltf::relative_path(library).ok()?;
        resolve(&path).ok()
    };
    let converted = restir_decoders::obj::to_glb(bytes, &mut find).map_err(|fault| match fault {
        Fault::Broken(what) => Error::bad_file(name, "OBJ", what),
        other => Error::of_fault(name, other),
    })?;
    let mut scene = gltf::load_bytes(name, &converted.glb, resolve)?;
    scene.warnings.splice(0..0, converted.warnings);
    Ok(scene)
}
