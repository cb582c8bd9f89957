//! The uploaded scene: the buffers and textures of bind group 0, all but the frame uniform.

use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::recorder::Recorder;
use crate::gpu::shader::SceneFeatures;
use crate::scene::FlatScene;
use crate::scene::gpu_types::{LIGHT_ENVIRONMENT, LIGHT_TRIANGLE, Light, NONE, TRIANGLE_ALPHA_MASK};
use crate::scene::rig::{Pose, Rig};
use glam::Vec3;

/// A [`FlatScene`] on the device.
#[derive(Debug)]
pub struct GpuScene {
    nodes: wgpu::Buffer,
    triangles: wgpu::Buffer,
    materials: wgpu::Buffer,
    lights: wgpu::Buffer,
    atlas: wgpu::TextureView,
    environment_radiance: wgpu::TextureView,
    environment_alias: wgpu::TextureView,
    /// The punctual lights as they are uploaded now, from `first_punctual` on.
    punctual: Vec<Light>,
    first_punctual: u32,
    features: SceneFeatures,
}

impl GpuScene {
    /// Uploads a scene.
    ///
    /// # Errors
    /// `LIMIT`, with numbers, where the device is too small for it.
    pub fn new(gpu: &Gpu, scene: &FlatScene) -> Result<Self> {
        let limits = gpu.device.limits();
        let texture_limit = |what: &str, wanted: u32, had: u32, unit: &'static str| {
            if wanted > had {
                return Err(Error::Limit { what: what.into(), wanted: wanted.into(), had: had.into(), unit });
            }
            Ok(())
        };
        let side = limits.max_texture_dimension_2d;
        texture_limit("the texture atlas", scene.atlas.size, side, "texels a side")?;
        texture_limit("the texture atlas", scene.atlas.layers, limits.max_texture_array_layers, "layers")?;
        if let Some(environment) = &scene.environment {
            texture_limit("the environment", environment.width.max(environment.height), side, "texels a side")?;
        }
        let atlas = upload(
            gpu,
            "atlas",
            [scene.atlas.size, scene.atlas.size, scene.atlas.layers],
            wgpu::TextureFormat::Rgba8Unorm,
            &scene.atlas.texels,
        );
        let black = ([1, 1, 1], vec![[0f32; 4]], vec![[0u32; 4]]);
        let (size, radiance, alias) = match &scene.environment {
            Some(e) => ([e.width, e.height, 1], &e.radiance, &e.alias),
            None => (black.0, &black.1, &black.2),
        };
        let first = scene.first_punctual as usize;
        let punctual: Vec<Light> =
            scene.lights.iter().skip(first).filter(|l| l.kind != LIGHT_ENVIRONMENT).copied().collect();
        Ok(GpuScene {
            nodes: gpu.storage_of("nodes", &scene.nodes)?,
            triangles: gpu.storage_of("triangles", &scene.triangles)?,
            materials: gpu.storage_of("materials", &scene.materials)?,
            lights: if scene.lights.is_empty() {
                gpu.storage("lights", std::mem::size_of::<Light>() as u64)?
            } else {
                gpu.storage_of("lights", &scene.lights)?
            },
            atlas: atlas.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..Default::default()
            }),
            environment_radiance: upload(
                gpu,
                "environment radiance",
                size,
                wgpu::TextureFormat::Rgba32Float,
                bytemuck::cast_slice(radiance),
            )
            .create_view(&Default::default()),
            environment_alias: upload(
                gpu,
                "environment alias table",
                size,
                wgpu::TextureFormat::Rgba32Uint,
                bytemuck::cast_slice(alias),
            )
            .create_view(&Default::default()),
            punctual,
            first_punctual: scene.first_punctual,
            features: features(scene),
        })
    }

    /// Puts the lights that move where `pose` has them, coming from where they were at `previous`.
    pub fn animate(&mut self, gpu: &Gpu, rig: &Rig, previous: &Pose, pose: &Pose) {
        if rig.lights.is_empty() {
            return;
        }
        for attached in &rig.lights {
            let Some(light) = self.punctual.get_mut(attached.target as usize) else { continue };
            let [before, now] = [previous, pose].map(|pose| pose.node(attached.node));
            light.previous_position = before.w_axis.truncate();
            light.position = now.w_axis.truncate();
            light.direction = now.transform_vector3(Vec3::NEG_Z).try_normalize().unwrap_or(light.direction);
        }
        let offset = u64::from(self.first_punctual) * std::mem::size_of::<Light>() as u64;
        gpu.queue.write_buffer(&self.lights, offset, bytemuck::cast_slice(&self.punctual));
    }

    /// The punctual lights as they are uploaded now, in the order of the scene.
    pub fn punctual_lights(&self) -> &[Light] {
        &self.punctual
    }

    /// Binds everything for the passes of a frame.
    pub fn share<'a>(&'a self, recorder: &mut Recorder<'a>) {
        recorder.features = self.features;
        recorder.share("nodes", &self.nodes);
        recorder.share("triangles", &self.triangles);
        recorder.share("materials", &self.materials);
        recorder.share("lights", &self.lights);
        recorder.share("atlas", &self.atlas);
        recorder.share("environment_radiance", &self.environment_radiance);
        recorder.share("environment_alias", &self.environment_alias);
    }
}

fn features(scene: &FlatScene) -> SceneFeatures {
    let slots = scene
        .materials
        .iter()
        .flat_map(|m| [m.base_color_texture, m.metallic_roughness_texture, m.normal_texture, m.emissive_texture]);
    SceneFeatures {
        textures: slots.into_iter().any(|slot| slot.width > 0),
        alpha_masks: scene.triangles.iter().any(|t| t.flags & TRIANGLE_ALPHA_MASK != 0),
        environment: environment_light(scene) != NONE,
        punctual_lights: scene.lights.iter().any(|l| l.kind != LIGHT_TRIANGLE && l.kind != LIGHT_ENVIRONMENT),
    }
}

/// Index of the environment among the lights, or `NONE`.
pub fn environment_light(scene: &FlatScene) -> u32 {
    match scene.lights.last() {
        Some(light) if light.kind == LIGHT_ENVIRONMENT => scene.lights.len() as u32 - 1,
        _ => NONE,
    }
}

fn upload(gpu: &Gpu, label: &str, size: [u32; 3], format: wgpu::TextureFormat, bytes: &[u8]) -> wgpu::Texture {
    let [width, height, layers] = size;
    let extent = wgpu::Extent3d { width, height, depth_or_array_layers: layers };
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: extent,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let row = width * format.block_copy_size(None).unwrap_or(4);
    // Layer by layer, so that no staging copy is larger than a layer.
    let layer_bytes = row as usize * height as usize;
    for (layer, data) in bytes.chunks_exact(layer_bytes).enumerate() {
        gpu.queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                texture: &texture,
                mip_level: 0,
                origin: wgpu::Origin3d { x: 0, y: 0, z: layer as u32 },
                aspect: wgpu::TextureAspect::All,
            },
            data,
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: Some(height) },
            wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        );
    }
    texture
}
