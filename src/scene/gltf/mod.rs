//! The glTF 2.0 loader: a `.glb` or `.gltf` file becomes a [`Scene`].
//!
//! Source: the glTF 2.0 specification and the extensions named in [`SUPPORTED_EXTENSIONS`]. The nodes of one scene are
//! loaded (the default one unless another is chosen; every root node where there are no scenes). Occlusion textures
//! are ignored, for light transport is computed. Animations, skins and morph targets become the scene's rig.
//!
//! Nothing in a file is trusted: every size, count, offset and index is checked before it is used or allocated for, so
//! the crate's typed JSON (`gltf::json`) is read directly rather than through its iterators, which panic.

mod accessor;
mod animations;
mod area_lights;
mod buffers;
mod camera;
mod container;
mod decoders;
mod deformation;
mod draco;
mod images;
mod instancing;
mod lights;
mod material;
mod material_extensions;
mod mesh;
mod nodes;
mod pointers;
mod skins;
mod topology;
mod uri;
mod variants;

pub use decoders::DECODED_EXTENSIONS;
pub(super) use uri::relative_path;

use super::Scene;
use crate::error::Result;
use container::Document;

/// Extensions that a file may require.
pub const SUPPORTED_EXTENSIONS: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_texture_basisu",
    "KHR_texture_transform",
];

/// Most placements of meshes a scene may have.
pub const MAX_INSTANCES: u64 = 4_000_000;
/// Most bytes of vertices and indices a scene may have before instancing.
pub const MAX_GEOMETRY_BYTES: u64 = 2 << 30;
/// Most bytes that all buffers of a file may have together; also the most for one file on disk.
pub const MAX_BUFFER_BYTES: u64 = 2 << 30;
/// Most bytes that all decoded images of a file may have together.
pub const MAX_IMAGE_BYTES: u64 = 1 << 30;
/// Longest side of an image in texels.
pub const MAX_IMAGE_SIDE: u32 = 16_384;
/// Most warnings that are kept one by one.
const MAX_WARNINGS: usize = 100;

/// Reads an external resource: it is given a relative path (percent-decoded, `/`-separated, without `..`).
pub type Resolve<'r> = &'r mut dyn FnMut(&str) -> Result<Vec<u8>>;

/// What a person chooses in a file; by default its own scene and materials.
#[derive(Clone, Copy, Default)]
pub struct Options<'a> {
    /// Index of the scene to load instead of the file's default.
    pub scene: Option<usize>,
    /// Name of the variant (`KHR_materials_variants`) whose materials are used; as [`Contents::variants`] has it.
    pub variant: Option<&'a str>,
}

/// What can be chosen in a file.
#[derive(Debug, Clone, Default, PartialEq, Eq, serde::Serialize)]
pub struct Contents {
    /// Names of the scenes, in file order.
    pub scenes: Vec<String>,
    /// Index of the default scene.
    pub scene: usize,
    /// Names of the material variants.
    pub variants: Vec<String>,
}

/// Looks into a file without loading it.
///
/// # Errors
/// As [`load_bytes`], for the file's container, version and required extensions.
pub fn contents(name: &str, bytes: &[u8]) -> Result<Contents> {
    container::contents(name, bytes)
}

/// As [`contents`], of a file on disk.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io) where it cannot be read, else as [`contents`].
pub fn contents_of_file(path: &std::path::Path) -> Result<Contents> {
    contents(&path.display().to_string(), &crate::scene::files::read(path, MAX_BUFFER_BYTES)?)
}

/// Loads a `.glb` or `.gltf` file; external buffers and images are read from beside it.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io) where a file cannot be read, else as [`load_bytes_with`].
pub fn load_file(path: &std::path::Path, options: &Options) -> Result<Scene> {
    let bytes = crate::scene::files::read(path, MAX_BUFFER_BYTES)?;
    let mut resolve = crate::scene::files::beside(path, MAX_BUFFER_BYTES);
    load_bytes_with(&path.display().to_string(), &bytes, options, &mut resolve)
}

/// Loads glTF from memory; `name` is used in errors and, without folder and suffix, as the scene's name. Binary glTF is
/// recognised by its magic. `resolve` is asked for what is neither embedded nor a `data:` URI; absolute paths, URLs
/// and paths that leave the file's folder are refused before it is asked.
///
/// # Errors
/// [`Error::BadFile`](crate::Error::BadFile) with the place for a broken file,
/// [`Error::Unsupported`](crate::Error::Unsupported) for a required extension or a format this loader lacks,
/// [`Error::Limit`](crate::Error::Limit) for a file beyond one of this module's limits, and what `resolve` returns.
pub fn load_bytes(name: &str, bytes: &[u8], resolve: Resolve) -> Result<Scene> {
    load_bytes_with(name, bytes, &Options::default(), resolve)
}

/// As [`load_bytes`], with a scene and a variant of the caller's choice.
///
/// # Errors
/// As [`load_bytes`]; [`Error::BadValue`](crate::Error::BadValue) and [`Error::Unknown`](crate::Error::Unknown) for a
/// scene or variant that the file does not have.
pub fn load_bytes_with(name: &str, bytes: &[u8], options: &Options, resolve: Resolve) -> Result<Scene> {
    let document = container::parse(name, bytes, options)?;
    let buffers = buffers::Buffers::load(&document, resolve)?;
    let mut scene = Scene { name: scene_name(name), ..Scene::default() };
    warn_of_extensions(&document, &mut scene.warnings);
    let uv_sets = material::load(&document, &buffers, resolve, &mut scene)?;
    nodes::load(&document, &buffers, &uv_sets, &mut scene)?;
    if scene.meshes.is_empty() {
        scene.warnings.push("the scene has no triangles".into());
    }
    if scene.warnings.len() > MAX_WARNINGS {
        let more = scene.warnings.len() - MAX_WARNINGS;
        scene.warnings.truncate(MAX_WARNINGS);
        scene.warnings.push(format!("and {more} more warnings"));
    }
    Ok(scene)
}

/// `folder/name.glb` is called `name`.
fn scene_name(file: &str) -> String {
    let base = file.rsplit(['/', '\\']).next().unwrap_or(file);
    base.rsplit_once('.').map_or(base, |(stem, _)| stem).to_owned()
}

/// Says which parts of the file stand still.
fn warn_of_extensions(document: &Document, warnings: &mut Vec<String>) {
    let root = &document.root;
    for extension in root.extensions_used.iter().filter(|e| !SUPPORTED_EXTENSIONS.contains(&e.as_str())) {
        warnings.push(format!("optional extension {} is ignored", tidy(extension)));
    }
}

/// Text from a file made fit for a one-line message: no control characters, at most 120 characters.
fn tidy(text: &str) -> String {
    let mut line: String = text.chars().take(120).map(|c| if c.is_control() { ' ' } else { c }).collect();
    if text.chars().nth(120).is_some() {
        line.push_str("...");
    }
    line
}
