//! The uploaded scene: the buffers and textures of bind group 0, all but the frame uniform.

mod motion;

use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::data_texture::DataTexture;
use crate::gpu::recorder::Recorder;
use crate::gpu::shader::SceneFeatures;
use crate::scene::FlatScene;
use crate::scene::gpu_types::{LIGHT_ENVIRONMENT, LIGHT_TRIANGLE, Light, NONE, TRIANGLE_ALPHA_MASK, Triangle};
use crate::scene::stage::Stage;
use motion::Motion;

/// Triangles in the first of the two buffers: 128 MiB, what every WebGPU device can bind. As in `shaders/scene/data.wgsl`.
const FIRST_TRIANGLES: usize = (128 << 20) / size_of::<Triangle>();

/// A [`FlatScene`] on the device.
#[derive(Debug)]
pub struct GpuScene {
    nodes: wgpu::Buffer,
    /// The first [`FIRST_TRIANGLES`], and all others.
    triangles: [wgpu::Buffer; 2],
    lights: wgpu::Buffer,
    attributes: DataTexture,
    materials: DataTexture,
    instances: DataTexture,
    instance_count: u32,
    /// Index in `nodes` of the root of everything.
    top_level: u32,
    atlas: wgpu::TextureView,
    environment_radiance: wgpu::TextureView,
    environment_alias: wgpu::TextureView,
    /// Where what moves lies; none in a scene that stands still.
    motion: Option<Motion>,
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
        let (motion, arrays) = Motion::lay_out(scene);
        let (first_triangles, rest) = arrays.triangles.split_at(arrays.triangles.len().min(FIRST_TRIANGLES));
        let point = [bytemuck::Zeroable::zeroed()];
        Ok(GpuScene {
            nodes: gpu.storage_of("nodes", &arrays.nodes)?,
            triangles: [
                gpu.storage_of("triangles", first_triangles)?,
                gpu.storage_of("the triangles after the first 2796202", if rest.is_empty() { &point } else { rest })?,
            ],
            attributes: DataTexture::new(gpu, "attributes", &arrays.attributes)?,
            materials: DataTexture::new(gpu, "materials", &scene.materials)?,
            instances: DataTexture::new(gpu, "instances", &arrays.instances)?,
            instance_count: scene.instances.len() as u32,
            top_level: scene.root(),
            lights: if arrays.lights.is_empty() {
                gpu.storage("lights", std::mem::size_of::<Light>() as u64)?
            } else {
                gpu.storage_of("lights", &arrays.lights)?
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
            motion,
            features: features(scene),
        })
    }

    /// Brings the device up to date with what moves: this frame's transforms, shapes and lights, and those of the frame
    /// before. Both top levels are rebuilt; a transform that cannot be undone hides its instance.
    pub fn take_stage(&mut self, gpu: &Gpu, scene: &FlatScene, stage: &Stage) {
        if let Some(mut motion) = self.motion.take() {
            if motion.version != Some(stage.version()) {
                motion.take_shapes(gpu, self, scene, stage);
                motion.version = Some(stage.version());
                motion.at_rest = false;
            } else if !motion.at_rest {
                motion.stand_still();
            }
            if !motion.at_rest {
                motion.place(gpu, self, scene, stage);
                motion.at_rest = !stage.has_moved();
            }
            self.motion = Some(motion);
        }
    }

    /// Overwrites triangles from index `first` on, in whichever buffer they lie.
    fn write_triangles(&self, gpu: &Gpu, first: u32, triangles: &[Triangle]) {
        let first = first as usize;
        let (low, high) = triangles.split_at(FIRST_TRIANGLES.saturating_sub(first).min(triangles.len()));
        let write = |buffer: &wgpu::Buffer, index: usize, part: &[Triangle]| {
            if !part.is_empty() {
                gpu.queue.write_buffer(buffer, (index * size_of::<Triangle>()) as u64, bytemuck::cast_slice(part));
            }
        };
        write(&self.triangles[0], first, low);
        write(&self.triangles[1], (first + low.len()).saturating_sub(FIRST_TRIANGLES), high);
    }

    /// Index in `nodes` of the root of everything as it was in the frame before.
    pub fn previous_top_level(&self) -> u32 {
        self.motion.as_ref().map_or(self.top_level, |motion| motion.previous_top_level)
    }

    /// Instances, without their twins of the frame before.
    pub fn instance_count(&self) -> u32 {
        self.instance_count
    }

    /// Index in `nodes` of the root of everything.
    pub fn top_level(&self) -> u32 {
        self.top_level
    }

    /// Binds everything for the passes of a frame.
    pub fn share<'a>(&'a self, recorder: &mut Recorder<'a>) {
        recorder.features = self.features;
        recorder.share("nodes", &self.nodes);
        recorder.share("triangles", &self.triangles[0]);
        recorder.share("triangles_rest", &self.triangles[1]);
        recorder.share("lights", &self.lights);
        recorder.share("attributes", &self.attributes.view);
        recorder.share("materials", &self.materials.view);
        recorder.share("instances", &self.instances.view);
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
        instances: scene.has_top_level(),
        motion: !scene.rig.is_still(),
        many_triangles: motion::triangle_count(scene) > FIRST_TRIANGLES,
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
