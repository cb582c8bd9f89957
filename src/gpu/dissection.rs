//! A frame taken apart: what each of its passes has written, as pictures.

use super::Gpu;
use super::binding_kind::BindingKind;
use super::recorder::Recorder;
use super::shader::{Resource, Shader, table};
use crate::error::Result;
use glam::UVec2;

/// One pass of a dissected frame.
#[derive(Debug)]
pub struct Stage {
    /// The pass.
    pub shader: &'static Shader,
    /// RGBA8, row-major from the top: the picture that it wrote, or that what it wrote makes.
    picture: Option<wgpu::Buffer>,
}

impl Stage {
    /// Whether there is something to look at.
    pub fn has_picture(&self) -> bool {
        self.picture.is_some()
    }
}

/// What the passes of one frame wrote.
#[derive(Debug)]
pub struct Dissection {
    /// Picture size in pixels.
    pub size: UVec2,
    /// In order.
    pub stages: Vec<Stage>,
    exposure_state: wgpu::Buffer,
}

impl Dissection {
    /// One to be filled by a recorder.
    pub(crate) fn new(size: UVec2, exposure_state: wgpu::Buffer) -> Self {
        Dissection { size, stages: Vec::new(), exposure_state }
    }

    /// Notes a pass that has just been recorded with what was bound to it, and keeps the picture that it wrote.
    pub(super) fn keep(
        &mut self,
        recorder: &mut Recorder<'_>,
        shader: &'static Shader,
        bound: &[(&str, Resource<'_>)],
    ) -> Result<()> {
        self.stages.push(Stage { shader, picture: None });
        for binding in shader.bindings {
            let Some((_, resource)) = bound.iter().rev().find(|(name, _)| *name == binding.name) else { continue };
            match (resource, binding.kind) {
                (Resource::Texture(view), BindingKind::StorageTextureFloat) if self.fits(view) => {
                    self.illustrate(recorder, view)?;
                }
                (Resource::Buffer(display), BindingKind::StorageReadWrite) if binding.name == "display" => {
                    let picture = self.picture(recorder.gpu())?;
                    recorder.copy(display, &picture, picture.size());
                    self.set(picture);
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Keeps `radiance` as the picture of the last pass, as the film would show it.
    pub(super) fn illustrate(&mut self, recorder: &mut Recorder<'_>, radiance: &wgpu::TextureView) -> Result<()> {
        let picture = self.picture(recorder.gpu())?;
        recorder
            .pass(&table::FILM_SNAPSHOT)
            .bind("radiance", radiance)
            .bind("exposure_state", &self.exposure_state)
            .bind("display", &picture)
            .dispatch_over(self.size)?;
        self.set(picture);
        Ok(())
    }

    fn fits(&self, view: &wgpu::TextureView) -> bool {
        (view.texture().width(), view.texture().height()) == (self.size.x, self.size.y)
    }

    fn picture(&self, gpu: &Gpu) -> Result<wgpu::Buffer> {
        gpu.storage("dissected picture", u64::from(self.size.x) * u64::from(self.size.y) * 4)
    }

    fn set(&mut self, picture: wgpu::Buffer) {
        if let Some(stage) = self.stages.last_mut() {
            stage.picture = Some(picture);
        }
    }

    /// The picture of a stage, RGBA8, row-major from the top; empty where it has none.
    ///
    /// # Errors
    /// `DEVICE` if it cannot be read back.
    pub fn read(&self, gpu: &Gpu, stage: usize) -> impl Future<Output = Result<Vec<u8>>> + use<> {
        let (gpu, picture) = (gpu.clone(), self.stages.get(stage).and_then(|stage| stage.picture.clone()));
        // The smallest buffers are larger than their pictures.
        let bytes = u64::from(self.size.x) * u64::from(self.size.y) * 4;
        async move {
            match picture {
                Some(picture) => gpu.read_buffer(&picture, bytes).await,
                None => Ok(Vec::new()),
            }
        }
    }
}

/// What passes that only illustrate write to.
#[derive(Debug)]
pub(crate) struct Easel {
    pub(super) radiance: wgpu::TextureView,
    pub(super) counters: wgpu::Buffer,
}

impl Easel {
    pub(crate) fn new(gpu: &Gpu, size: UVec2) -> Result<Self> {
        Ok(Easel {
            radiance: gpu.texture("illustration", size, wgpu::TextureFormat::Rgba32Float),
            counters: gpu.storage("illustration counters", size_of::<crate::film::Counters>() as u64)?,
        })
    }
}
