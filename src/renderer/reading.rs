//! What can be read from a renderer: pictures, counts, times, memory. Reads borrow nothing, so frames may be rendered while they are
//! pending.

use super::{Renderer, record_auxiliary};
use crate::error::{Error, Result};
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

    /// Albedo, normal, depth and motion of the last frame's primary hits.
    ///
    /// # Errors
    /// `DEVICE` if they cannot be read back.
    pub fn read_auxiliary(&self) -> impl Future<Output = Result<Auxiliary>> + use<> {
        let reads = [0, 1, 2].map(|which| self.read_surfaces(which));
        async move {
            let [albedo_depth, normal, motion] = reads;
            let mut out = Auxiliary::default();
            for [r, g, b, depth] in texels(&albedo_depth.await?) {
                out.albedo.push([r, g, b]);
                out.depth.push(depth);
            }
            out.normal = texels(&normal.await?).map(|[x, y, z, _]| [x, y, z]).collect();
            out.motion = texels(&motion.await?).map(|[x, y, ..]| [x, y]).collect();
            Ok(out)
        }
    }

    /// A part of what [`Renderer::read_auxiliary`] reads, as it lies on the device: four `f32` a pixel, row-major from the top; of part 0
    /// albedo and depth, of 1 normals, of 2 motion.
    ///
    /// # Errors
    /// `BAD_VALUE` for another part, `DEVICE` if it cannot be read back.
    pub fn read_surfaces(&self, part: usize) -> impl Future<Output = Result<Vec<u8>>> + use<> {
        let recorded = self.record_first_surfaces();
        let gpu = self.gpu.clone();
        let texture = [&self.albedo_depth, &self.normal, &self.motion].get(part).map(|view| view.texture().clone());
        async move {
            recorded?;
            let texture = texture.ok_or_else(|| Error::bad_value("part", format!("{part} is not 0, 1 or 2")))?;
            gpu.read_texture(&texture, 16).await
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

/// Four numbers of each texel.
fn texels(bytes: &[u8]) -> impl Iterator<Item = [f32; 4]> {
    bytes.chunks_exact(16).map(bytemuck::pod_read_unaligned)
}
