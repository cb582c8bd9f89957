//! Records in a texture, for what does not fit in the storage buffers of a stage (`shaders/scene/data.wgsl`).

use super::Gpu;
use crate::error::{Error, Result};
use crate::pace::{Pace, SLICE_BYTES};

/// Texels of a row: every WebGPU device can hold that many.
const ROW: u64 = 8192;
/// Bytes of a texel: `Rgba32Uint`.
const TEXEL: u64 = 16;
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Uint;

/// Texels of 16 bytes, read by `textureLoad`, that can be overwritten in part.
#[derive(Debug)]
pub struct DataTexture {
    texture: wgpu::Texture,
    /// For binding.
    pub view: wgpu::TextureView,
}

impl DataTexture {
    /// A texture that holds `data`, whose records are whole texels; room for at least one.
    ///
    /// # Errors
    /// `LIMIT` if it has more rows than the device allows.
    pub fn new<T: bytemuck::Pod>(gpu: &Gpu, label: &str, data: &[T]) -> Result<Self> {
        let data_texture = Self::empty(gpu, label, size_of_val(data))?;
        data_texture.write(gpu, 0, data);
        Ok(data_texture)
    }

    /// As [`DataTexture::new`], in slices.
    ///
    /// # Errors
    /// As [`DataTexture::new`].
    pub async fn in_slices<T: bytemuck::Pod>(gpu: &Gpu, label: &str, data: &[T], pace: &mut Pace) -> Result<Self> {
        let data_texture = Self::empty(gpu, label, size_of_val(data))?;
        // Whole rows.
        let texels: &[[u32; 4]] = bytemuck::cast_slice(data);
        let slice = SLICE_BYTES / (ROW * TEXEL) as usize * ROW as usize;
        for (part, first) in texels.chunks(slice).zip((0u64..).step_by(slice)) {
            data_texture.write(gpu, first, part);
            pace.breathe().await;
        }
        Ok(data_texture)
    }

    /// Whether a record's place depends on more than a column.
    pub fn has_rows(&self) -> bool {
        self.texture.height() > 1
    }

    /// Frees it at once, rather than when nobody refers to it any more.
    pub fn destroy(&self) {
        self.texture.destroy();
    }

    /// A texture for `bytes` bytes.
    fn empty(gpu: &Gpu, label: &str, bytes: usize) -> Result<Self> {
        let texels = (bytes as u64 / TEXEL).max(1);
        let (rows, had) = (texels.div_ceil(ROW), u64::from(gpu.device.limits().max_texture_dimension_2d));
        if rows > had {
            let (wanted, had) = (texels * TEXEL, had * ROW * TEXEL);
            return Err(Error::Limit { what: format!("the scene's {label}"), wanted, had, unit: "bytes" });
        }
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d { width: texels.min(ROW) as u32, height: rows as u32, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: FORMAT,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        Ok(DataTexture { texture, view })
    }

    /// Overwrites records from texel `first` on. What lies past the texture's end is left out.
    pub fn write<T: bytemuck::Pod>(&self, gpu: &Gpu, first: u64, data: &[T]) {
        let mut bytes: &[u8] = bytemuck::cast_slice(data);
        let mut position = first;
        // The rest of a row, whole rows (at most 64 MiB at once, for the staging copy), the start of a row.
        while !bytes.is_empty() && position / ROW < u64::from(self.texture.height()) {
            let (x, y) = (position % ROW, position / ROW);
            let left = bytes.len() as u64 / TEXEL;
            let (width, height) =
                if x == 0 && left >= ROW { (ROW, (left / ROW).min(512)) } else { ((ROW - x).min(left), 1) };
            let (part, rest) = bytes.split_at((width * height * TEXEL) as usize);
            gpu.queue.write_texture(
                wgpu::TexelCopyTextureInfo {
                    texture: &self.texture,
                    mip_level: 0,
                    origin: wgpu::Origin3d { x: x as u32, y: y as u32, z: 0 },
                    aspect: wgpu::TextureAspect::All,
                },
                part,
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some((width * TEXEL) as u32),
                    rows_per_image: Some(height as u32),
                },
                wgpu::Extent3d { width: width as u32, height: height as u32, depth_or_array_layers: 1 },
            );
            position += width * height;
            bytes = rest;
        }
    }
}
