//! The film: accumulation, exposure, tone mapping, what is displayed, and counters. It knows nothing of how the radiance
//! was made.

use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::memory::bytes_of;
use crate::gpu::recorder::Recorder;
use crate::gpu::shader::table;
use crate::gpu_struct;
use crate::params::FilmParams;
use crate::view::{COLOR_STEPS, Scale, color_map};
use glam::UVec2;

#[cfg(target_arch = "wasm32")]
pub mod blit;

gpu_struct! {
/// The film passes' uniform, as `shaders/film/film.wgsl` declares it.
pub struct FilmUniforms {
    /// Picture size in pixels.
    pub size: UVec2,
    /// Index of the tone map.
    pub tone_map: u32,
    /// 1 for automatic exposure.
    pub automatic_exposure: u32,
    /// EV.
    pub exposure: f32,
    /// 0 radiance, 1 colours, 2 a number, 3 a number by magnitude ([`Scale`]).
    pub scale: u32,
    /// The common view that is shown.
    pub view: u32,
    /// The number that gets the first colour.
    pub low: f32,
    /// The number that gets the last colour.
    pub high: f32,
    /// Unused.
    pub padding_0: u32,
    /// Unused.
    pub padding_1: u32,
    /// Unused.
    pub padding_2: u32,
    /// Colours for numbers, sRGB from 0 to 1.
    pub colors: [[f32; 4]; COLOR_STEPS],
}
}

gpu_struct! {
/// What passes count: rays of one frame, and what was left out of the film since it began.
pub struct Counters {
    /// Rays traced in the frame.
    pub rays: u32,
    /// Pixel samples that were not numbers, since the film began.
    pub nan: u32,
    /// Pixel samples that were infinite, since the film began.
    pub infinite: u32,
    /// Unused.
    pub padding: u32,
    /// What was counted for a pixel in the frame: rays, nodes of the BVH, neighbours that were rejected. This is the first pixel's; the
    /// others follow it where pixels are counted.
    pub pixel: [u32; 4],
}
}

/// Where in [`Counters`] those of pixels begin.
const PIXEL_COUNTS: u64 = std::mem::offset_of!(Counters, pixel) as u64;

/// The film's buffers for one picture size.
#[derive(Debug)]
pub struct Film {
    size: UVec2,
    uniforms: wgpu::Buffer,
    /// What the technique writes: linear radiance, `Rgba32Float`.
    pub radiance: wgpu::TextureView,
    /// Sum (rgb) and sample count (a) of each pixel.
    pub accumulation: wgpu::Buffer,
    exposure_state: wgpu::Buffer,
    /// Tone-mapped sRGB RGBA8, one `u32` a pixel.
    pub display: wgpu::Buffer,
    /// [`Counters`] up to the frame being recorded, then up to the last one.
    pub counters: wgpu::Buffer,
}

impl Film {
    /// A film of `size` pixels.
    ///
    /// # Errors
    /// `BAD_VALUE` for an empty picture, `LIMIT` for one the device cannot hold.
    pub fn new(gpu: &Gpu, size: UVec2) -> Result<Self> {
        if size.min_element() == 0 {
            return Err(Error::bad_value("size", format!("{}x{} has no pixels", size.x, size.y)));
        }
        let side = gpu.device.limits().max_texture_dimension_2d;
        if size.max_element() > side {
            return Err(Error::Limit {
                what: format!("a picture of {}x{}", size.x, size.y),
                wanted: size.max_element().into(),
                had: side.into(),
                unit: "pixels a side",
            });
        }
        let pixels = u64::from(size.x) * u64::from(size.y);
        Ok(Film {
            size,
            uniforms: gpu.uniform("film", std::mem::size_of::<FilmUniforms>() as u64),
            radiance: gpu.texture("radiance", size, wgpu::TextureFormat::Rgba32Float),
            accumulation: gpu.storage(&format!("accumulation at {}x{}", size.x, size.y), pixels * 16)?,
            exposure_state: gpu.storage("exposure", 16)?,
            display: gpu.storage("display", pixels * 4)?,
            counters: gpu.storage("counters", std::mem::size_of::<Counters>() as u64)?,
        })
    }

    /// Picture size in pixels.
    pub fn size(&self) -> UVec2 {
        self.size
    }

    /// Bytes on the device.
    pub fn memory(&self) -> u64 {
        let Film { size: _, uniforms, radiance, accumulation, exposure_state, display, counters } = self;
        bytes_of(&[
            uniforms.into(),
            radiance.into(),
            accumulation.into(),
            exposure_state.into(),
            display.into(),
            counters.into(),
        ])
    }

    /// Makes room to count by the pixel, or gives it back.
    ///
    /// # Errors
    /// `LIMIT` where the device has none; the film stays as it was.
    pub fn count_pixels(&mut self, gpu: &Gpu, counts: bool) -> Result<()> {
        let pixels = if counts { u64::from(self.size.x) * u64::from(self.size.y) } else { 1 };
        let bytes = PIXEL_COUNTS + pixels * (size_of::<Counters>() as u64 - PIXEL_COUNTS);
        if self.counters.size() != bytes {
            self.counters = gpu.storage("counters", bytes)?;
        }
        Ok(())
    }

    /// Clears what is counted by the frame; with `restart`, also what is counted since the film began.
    pub fn clear_counters(&self, recorder: &mut Recorder<'_>, restart: bool) {
        if restart {
            recorder.clear(&self.counters, 0, None);
        } else {
            recorder.clear(&self.counters, 0, Some(std::mem::offset_of!(Counters, nan) as u64));
            recorder.clear(&self.counters, PIXEL_COUNTS, None);
        }
    }

    /// Uploads how the picture is shown: which view ([`Shown::of_film`](crate::view::Shown::of_film)), and how its values become colours.
    pub fn prepare(&self, gpu: &Gpu, params: &FilmParams, view: u32, scale: Scale) {
        let (kind, low, high) = match scale {
            Scale::Radiance => (0, 0.0, 1.0),
            Scale::Colors => (1, 0.0, 1.0),
            Scale::Number { low, high, is_logarithmic, .. } => (2 + u32::from(is_logarithmic), low, high),
        };
        let uniforms = FilmUniforms {
            size: self.size,
            tone_map: params.tone_map,
            automatic_exposure: params.exposure_mode,
            exposure: params.exposure,
            scale: kind,
            view,
            low,
            high,
            padding_0: 0,
            padding_1: 0,
            padding_2: 0,
            colors: color_map(params.color_map).map(|color| {
                let [_, r, g, b] = color.to_be_bytes().map(|byte| f32::from(byte) / 255.0);
                [r, g, b, 1.0]
            }),
        };
        gpu.queue.write_buffer(&self.uniforms, 0, bytemuck::bytes_of(&uniforms));
    }

    /// Binds what techniques write to and count in.
    pub fn share<'a>(&'a self, recorder: &mut Recorder<'a>) {
        recorder.share("film", &self.uniforms);
        recorder.share("radiance_out", &self.radiance);
        recorder.share("counters", &self.counters);
    }

    /// Adds the frame's radiance; with `restart`, what was there before is dropped first.
    ///
    /// # Errors
    /// `SHADER` if a pass is bound wrongly.
    pub fn record_accumulate(&self, recorder: &mut Recorder<'_>, restart: bool) -> Result<()> {
        if restart {
            recorder.clear(&self.accumulation, 0, None);
        }
        recorder
            .pass(&table::FILM_ACCUMULATE)
            .inspected_by(&table::FILM_INSPECT)
            .bind("radiance", &self.radiance)
            .bind("accumulation", &self.accumulation)
            .dispatch_over(self.size)
    }

    /// Brings the display buffer up to date.
    ///
    /// # Errors
    /// `SHADER` if a pass is bound wrongly.
    pub fn record_display(&self, recorder: &mut Recorder<'_>, params: &FilmParams) -> Result<()> {
        if params.exposure_mode == 1 {
            recorder
                .pass(&table::FILM_EXPOSURE)
                .bind("accumulation", &self.accumulation)
                .bind("exposure_state", &self.exposure_state)
                .dispatch([1, 1, 1])?;
        }
        recorder
            .pass(&table::FILM_DISPLAY)
            .bind("accumulation", &self.accumulation)
            .bind("exposure_state", &self.exposure_state)
            .bind("display", &self.display)
            .dispatch_over(self.size)
    }

    /// Automatic exposure in EV, in the first of its numbers.
    pub fn exposure_state(&self) -> &wgpu::Buffer {
        &self.exposure_state
    }

    /// The uniform, for passes outside the recorder.
    pub fn uniforms(&self) -> &wgpu::Buffer {
        &self.uniforms
    }
}
