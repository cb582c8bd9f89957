//! What can be read from a renderer: pictures, counts, times, memory. Reads borrow nothing, so frames may be rendered while they are
//! pending.

use super::{Renderer, record_auxiliary};
use crate::error::Result;
use crate::film::Counters;
use crate::gpu::memory::{Memory, bytes_of};
use crate::gpu::recorder::{PassTime, Recorder, Timer};
use crate::inspect::Inspector;
use crate::output::Image;

/// Auxiliary pictures of the first surface each pixel sees. Zero where there is none.
#[derive(Debug, Clone, Default)]
pub struct Auxiliary {
    /// Linear base colour.
    pub albedo: Vec<[f32; 3]>,
    /// World-space unit shading normal.
    pub normal: Vec<[f32; 3]>,
    /// Distance along the view axis in metres.
    pub depth: Vec<f32>,
    /// How far what the pixel sees has moved since the frame before, in pixels, x to the right and y down. Not zero where
    /// there is no surface: the background moves with the camera's turn.
    pub motion: Vec<[f32; 2]>,
}

/// What was counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
pub struct FrameCounters {
    /// Rays traced in the last frame.
    pub rays: u64,
    /// Pixel samples left out of the film because they were not numbers.
    pub nan: u64,
    /// Pixel samples left out of the film because they were infinite.
    pub inf: u64,
}

impl FrameCounters {
    /// Pixel samples left out of the film because they were not finite.
    pub fn not_finite(&self) -> u64 {
        self.nan + self.inf
    }
}

impl Renderer {
    /// Bytes on the device.
    pub fn memory(&self) -> Memory {
        let [this, previous] = &self.visibility;
        let own = [this, previous, &self.albedo_depth, &self.normal, &self.motion].map(Into::into);
        let timers = [&self.timer, &self.display_timer].into_iter().flatten().map(Timer::memory).sum::<u64>();
        Memory {
            scene: self.gpu_scene.memory(),
            film: self.film.memory() + bytes_of(&own) + bytes_of(&[(&self.frame_uniform).into()]) + timers,
            technique: self.technique.memory(),
            inspector: self.inspector.as_ref().map_or(0, Inspector::memory),
        }
    }

    /// Waits for the device. Like all reads it borrows nothing, so frames may be rendered while it is pending.
    ///
    /// # Errors
    /// `DEVICE` for an error it has reported.
    pub fn wait(&self) -> impl Future<Output = Result<()>> + use<> {
        let gpu = self.gpu.clone();
        async move { gpu.wait().await }
    }

    /// The accumulated picture: linear Rec. 709 radiance.
    ///
    /// # Errors
    /// `DEVICE` if it cannot be read back.
    pub fn read_image(&self) -> impl Future<Output = Result<Image>> + use<> {
        let (gpu, accumulation, size) = (self.gpu.clone(), self.film.accumulation.clone(), self.size());
        async move {
            let bytes = gpu.read_buffer(&accumulation, accumulation.size()).await?;
            let pixels = bytes
                .chunks_exact(16)
                .take(size.x as usize * size.y as usize)
                .map(|pixel| {
                    let [r, g, b, count]: [f32; 4] = bytemuck::pod_read_unaligned(pixel);
                    [r, g, b].map(|c| c / count.max(1.0))
                })
                .collect();
            Ok(Image { width: size.x, height: size.y, pixels })
        }
    }

    /// The picture as it is displayed: sRGB RGBA8, row-major from the top.
    ///
    /// # Errors
    /// `DEVICE` if it cannot be read back.
    pub fn read_display(&mut self) -> impl Future<Output = Result<Vec<u8>>> + use<> {
        let rendered = self.render_display();
        let (gpu, display, size) = (self.gpu.clone(), self.film.display.clone(), self.size());
        async move {
            rendered?;
            gpu.read_buffer(&display, u64::from(size.x) * u64::from(size.y) * 4).await
        }
    }

    /// Albedo, normal and depth of the last frame's primary hits.
    ///
    /// # Errors
    /// `DEVICE` if they cannot be read back.
    pub fn read_auxiliary(&self) -> impl Future<Output = Result<Auxiliary>> + use<> {
        let read = self.read_surfaces();
        async move {
            let bytes = read.await?;
            let mut texels = bytes.chunks_exact(16).map(bytemuck::pod_read_unaligned::<[f32; 4]>);
            let pixels = bytes.len() / 48;
            let (mut albedo, mut depth) = (Vec::with_capacity(pixels), Vec::with_capacity(pixels));
            for [r, g, b, distance] in texels.by_ref().take(pixels) {
                albedo.push([r, g, b]);
                depth.push(distance);
            }
            let normal = texels.by_ref().take(pixels).map(|[x, y, z, _]| [x, y, z]).collect();
            Ok(Auxiliary { albedo, normal, depth, motion: texels.map(|[x, y, ..]| [x, y]).collect() })
        }
    }

    /// What [`Renderer::read_auxiliary`] reads, as it lies on the device: four `f32` a pixel, first albedo and depth of all pixels, then
    /// normals, then motion, each row-major from the top.
    ///
    /// # Errors
    /// `DEVICE` if they cannot be read back.
    pub fn read_surfaces(&self) -> impl Future<Output = Result<Vec<u8>>> + use<> {
        let recorded = self.record_first_surfaces();
        let gpu = self.gpu.clone();
        let textures = [&self.albedo_depth, &self.normal, &self.motion].map(|view| view.texture().clone());
        async move {
            recorded?;
            let mut bytes = Vec::new();
            for texture in &textures {
                bytes.extend(gpu.read_texture(texture, 16).await?);
            }
            Ok(bytes)
        }
    }

    /// Has albedo, normal, depth and motion of the last frame's primary hits written.
    fn record_first_surfaces(&self) -> Result<()> {
        let mut recorder = Recorder::new(&self.gpu, None);
        self.gpu_scene.share(&mut recorder);
        self.render_params.specialise(&mut recorder.features);
        recorder.share("frame", &self.frame_uniform);
        recorder.share("visibility", &self.visibility[(self.frame_index.wrapping_sub(1) & 1) as usize]);
        record_auxiliary(&mut recorder, [&self.albedo_depth, &self.normal, &self.motion], self.size())?;
        recorder.submit();
        Ok(())
    }

    /// Rays of the last frame, and what was left out of the film.
    ///
    /// # Errors
    /// `DEVICE` if it cannot be read back.
    pub fn counters(&self) -> impl Future<Output = Result<FrameCounters>> + use<> {
        let (gpu, counters) = (self.gpu.clone(), self.film.counters.clone());
        async move {
            let bytes = gpu.read_buffer(&counters, std::mem::size_of::<Counters>() as u64).await?;
            let counters: Counters = bytemuck::pod_read_unaligned(&bytes);
            Ok(FrameCounters { rays: counters.rays.into(), nan: counters.nan.into(), inf: counters.infinite.into() })
        }
    }

    /// GPU time of each pass of the last frame, those of its display included if it was displayed; empty where the
    /// device cannot time.
    ///
    /// # Errors
    /// `DEVICE` if they cannot be read back.
    pub fn pass_times(&self) -> impl Future<Output = Result<Vec<PassTime>>> + use<> {
        let (gpu, timers) = (self.gpu.clone(), [self.timer.clone(), self.display_timer.clone()]);
        async move {
            let mut times = Vec::new();
            for timer in timers.iter().flatten() {
                times.extend(timer.read(&gpu).await?);
            }
            Ok(times)
        }
    }
}
