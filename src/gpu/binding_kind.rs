//! What kinds of resources passes bind; shared by `build.rs` and the library.

/// What kind of resource a binding is, with what a bind group layout needs to know.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BindingKind {
    /// `var<uniform>`, with its size in bytes.
    Uniform(u32),
    /// `var<storage, read>`.
    StorageRead,
    /// `var<storage, read_write>`.
    StorageReadWrite,
    /// `texture_2d<f32>`, read by `textureLoad`.
    TextureFloat,
    /// `texture_2d<u32>`.
    TextureUint,
    /// `texture_2d_array<f32>`.
    TextureFloatArray,
    /// `texture_storage_2d<rgba32float, write>`.
    StorageTextureFloat,
    /// `texture_storage_2d<rgba32uint, write>`.
    StorageTextureUint,
}
