//! The display buffer onto a canvas.

use super::Film;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::shader::{Resource, table};

/// A canvas and the pipeline that fills it.
pub struct Blit {
    surface: wgpu::Surface<'static>,
    format: wgpu::TextureFormat,
    configured: glam::UVec2,
    pipeline: wgpu::RenderPipeline,
    groups: Vec<wgpu::BindGroupLayout>,
}

impl Blit {
    /// A pipeline for `surface`.
    pub fn new(gpu: &Gpu, surface: wgpu::Surface<'static>) -> Self {
        // Eight bits without hardware sRGB, for the display buffer is encoded already. Every browser presents it.
        let format = wgpu::TextureFormat::Bgra8Unorm;
        let shader = &table::FILM_BLIT;
        let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(shader.id),
            source: wgpu::ShaderSource::Wgsl(shader.source.into()),
        });
        let groups = shader.layouts(&gpu.device, wgpu::ShaderStages::FRAGMENT);
        let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(shader.id),
            bind_group_layouts: &groups.iter().map(Some).collect::<Vec<_>>(),
            immediate_size: 0,
        });
        let pipeline = gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(shader.id),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fragment"),
                compilation_options: Default::default(),
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        Blit { surface, format, configured: glam::UVec2::ZERO, pipeline, groups }
    }

    /// Shows the film's display buffer; the canvas takes the film's size, and the page scales it.
    ///
    /// # Errors
    /// `DEVICE` if the canvas gives no texture.
    pub fn present(&mut self, gpu: &Gpu, film: &Film) -> Result<()> {
        if self.configured != film.size() {
            self.surface.configure(
                &gpu.device,
                &wgpu::SurfaceConfiguration {
                    usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
                    format: self.format,
                    color_space: Default::default(),
                    width: film.size().x,
                    height: film.size().y,
                    present_mode: wgpu::PresentMode::Fifo,
                    desired_maximum_frame_latency: 2,
                    alpha_mode: wgpu::CompositeAlphaMode::Opaque,
                    view_formats: vec![],
                },
            );
            self.configured = film.size();
        }
        let texture = match self.surface.get_current_texture() {
            wgpu::CurrentSurfaceTexture::Success(t) | wgpu::CurrentSurfaceTexture::Suboptimal(t) => t,
            // The next frame will do.
            wgpu::CurrentSurfaceTexture::Timeout | wgpu::CurrentSurfaceTexture::Occluded => return Ok(()),
            other => return Err(Error::Device(format!("the canvas gave no texture: {other:?}"))),
        };
        let view = texture.texture.create_view(&Default::default());
        let shader = &table::FILM_BLIT;
        let bound = [("film", Resource::Buffer(film.uniforms())), ("display", Resource::Buffer(&film.display))];
        let groups = shader.bind_groups(gpu, &self.groups, &bound)?;
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some(shader.id),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                ..Default::default()
            });
            pass.set_pipeline(&self.pipeline);
            for (index, group) in groups.iter().enumerate() {
                pass.set_bind_group(index as u32, group, &[]);
            }
            pass.draw(0..3, 0..1);
        }
        gpu.queue.submit([encoder.finish()]);
        gpu.queue.present(texture);
        Ok(())
    }
}
