//! The pyramid of weights by which an environment that changes is sampled: made by compute passes, frame by frame
//! (Wyman and Panteleev 2021, section 5.3).

use crate::error::Result;
use crate::gpu::Gpu;
use crate::gpu::recorder::Recorder;
use crate::gpu::shader::table;
use glam::UVec2;

/// A texel of a level holds the weights of its four children in the next finer level, those of the finest level the
/// weights of four texels of the map. Sides are powers of two, so that every texel has one parent; what lies outside of
/// the map weighs nothing.
#[derive(Debug)]
pub struct EnvironmentPyramid {
    /// All levels, for sampling.
    pub view: wgpu::TextureView,
    /// Finest first.
    levels: Vec<wgpu::TextureView>,
}

impl EnvironmentPyramid {
    /// A pyramid for a map of `width` x `height` texels, not yet made.
    pub fn new(gpu: &Gpu, width: u32, height: u32) -> Self {
        let [width, height] = [width, height].map(|side| side.div_ceil(2).next_power_of_two());
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("environment pyramid"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: width.max(height).ilog2() + 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Float,
            usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let level = |base_mip_level| {
            texture.create_view(&wgpu::TextureViewDescriptor {
                base_mip_level,
                mip_level_count: Some(1),
                ..Default::default()
            })
        };
        EnvironmentPyramid {
            levels: (0..texture.mip_level_count()).map(level).collect(),
            view: texture.create_view(&Default::default()),
        }
    }

    /// Makes it from the map that is shared as `environment_radiance`.
    ///
    /// # Errors
    /// `SHADER` if none is.
    pub fn record(&self, recorder: &mut Recorder<'_>) -> Result<()> {
        for (i, level) in self.levels.iter().enumerate() {
            let texture = level.texture();
            let size = UVec2::new(texture.width() >> i, texture.height() >> i).max(UVec2::ONE);
            match i.checked_sub(1).and_then(|finer| self.levels.get(finer)) {
                None => {
                    recorder.pass(&table::SCENE_ENVIRONMENT_WEIGHTS).bind("level_out", level).dispatch_over(size)?
                }
                Some(finer) => recorder
                    .pass(&table::SCENE_ENVIRONMENT_REDUCE)
                    .bind("level_out", level)
                    .bind("finer", finer)
                    .dispatch_over(size)?,
            }
        }
        Ok(())
    }
}
