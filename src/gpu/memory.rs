//! How much of the device's memory is held, and for what.

use super::shader::Resource;

/// Bytes on the device that a renderer holds, by what they are for. What it has let go of is not among them; nor is what the driver adds,
/// nor copies on the way to and from the device, which live for a moment.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
pub struct Memory {
    /// Geometry, materials, textures, lights and environment.
    pub scene: u64,
    /// What grows with the picture alone: the accumulated picture, what is displayed, first surfaces.
    pub film: u64,
    /// Reservoirs and all else that the technique keeps.
    pub technique: u64,
    /// Notes of an inspected pixel.
    pub inspector: u64,
}

impl Memory {
    /// All of it, in bytes.
    pub fn total(&self) -> u64 {
        self.scene + self.film + self.technique + self.inspector
    }
}

/// Bytes that these resources take, a texture with all its layers and levels.
pub fn bytes_of(resources: &[Resource<'_>]) -> u64 {
    resources
        .iter()
        .map(|resource| match resource {
            Resource::Buffer(buffer) => buffer.size(),
            Resource::Texture(view) => texture_bytes(view.texture()),
        })
        .sum()
}

fn texture_bytes(texture: &wgpu::Texture) -> u64 {
    let texel = u64::from(texture.format().block_copy_size(None).unwrap_or(0));
    let side = |side: u32, level: u32| u64::from((side >> level).max(1));
    let levels = (0..texture.mip_level_count()).map(|i| side(texture.width(), i) * side(texture.height(), i));
    levels.sum::<u64>() * u64::from(texture.depth_or_array_layers()) * texel
}
