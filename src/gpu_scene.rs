//! The uploaded scene: the buffers and textures of bind group 0, all but the frame uniform.

use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::data_texture::DataTexture;
use crate::gpu::recorder::Recorder;
use crate::gpu::shader::SceneFeatures;
use crate::pace::{Pace, SLICE_BYTES};
use crate::scene::FlatScene;
use crate::scene::flat::{FlatInstance, levels};
use crate::scene::gpu_types::{BvhNode, Instance, LIGHT_ENVIRONMENT, LIGHT_TRIANGLE, Light, NONE, TRIANGLE_ALPHA_MASK};
use glam::{Mat4, Quat, Vec3, Vec4};

/// Triangles in the first of the two buffers: 128 MiB, what every WebGPU device can bind. As in `shaders/scene/data.wgsl`.
const FIRST_TRIANGLES: usize = (128 << 20) / size_of::<crate::scene::gpu_types::Triangle>();

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
    /// Object to world of each instance in the frame that is uploaded.
    transforms: Vec<Mat4>,
    /// Index in `nodes` of the root of everything.
    top_level: u32,
    atlas: wgpu::TextureView,
    environment_radiance: wgpu::TextureView,
    environment_alias: wgpu::TextureView,
    /// The punctual lights as they are uploaded now, from `first_punctual` on.
    punctual: Vec<Light>,
    first_punctual: u32,
    rest_positions: Vec<Vec3>,
    features: SceneFeatures,
}

impl GpuScene {
    /// Uploads a scene.
    ///
    /// # Errors
    /// `LIMIT`, with numbers, where the device is too small for it.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn new(gpu: &Gpu, scene: &FlatScene) -> Result<Self> {
        pollster::block_on(Self::upload(gpu, scene, &mut Pace::unbroken()))
    }

    /// Uploads a scene, in slices.
    ///
    /// # Errors
    /// As [`GpuScene::new`].
    pub async fn upload(gpu: &Gpu, scene: &FlatScene, pace: &mut Pace) -> Result<Self> {
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
            pace,
        )
        .await;
        let black = ([1, 1, 1], vec![[0f32; 4]], vec![[0u32; 4]]);
        let (size, radiance, alias) = match &scene.environment {
            Some(e) => ([e.width, e.height, 1], &e.radiance, &e.alias),
            None => (black.0, &black.1, &black.2),
        };
        let (first_triangles, rest) = scene.triangles.split_at(scene.triangles.len().min(FIRST_TRIANGLES));
        let point = [bytemuck::Zeroable::zeroed()];
        let transforms: Vec<Mat4> = scene.instances.iter().map(|i| i.transform).collect();
        let first = scene.first_punctual as usize;
        let punctual: Vec<Light> =
            scene.lights.iter().skip(first).filter(|l| l.kind != LIGHT_ENVIRONMENT).copied().collect();
        Ok(GpuScene {
            nodes: gpu.storage_in_slices("nodes", &scene.nodes, pace).await?,
            triangles: [
                gpu.storage_in_slices("triangles", first_triangles, pace).await?,
                gpu.storage_in_slices(
                    "the triangles after the first 2796202",
                    if rest.is_empty() { &point } else { rest },
                    pace,
                )
                .await?,
            ],
            attributes: DataTexture::in_slices(gpu, "attributes", &scene.attributes, pace).await?,
            materials: DataTexture::new(gpu, "materials", &scene.materials)?,
            instances: DataTexture::new(gpu, "instances", &instance_records(scene, &transforms, &transforms))?,
            transforms,
            top_level: scene.root(),
            lights: if scene.lights.is_empty() {
                gpu.storage("lights", std::mem::size_of::<Light>() as u64)?
            } else {
                gpu.storage_in_slices("lights", &scene.lights, pace).await?
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
                pace,
            )
            .await
            .create_view(&Default::default()),
            environment_alias: upload(
                gpu,
                "environment alias table",
                size,
                wgpu::TextureFormat::Rgba32Uint,
                bytemuck::cast_slice(alias),
                pace,
            )
            .await
            .create_view(&Default::default()),
            rest_positions: punctual.iter().map(|l| l.position).collect(),
            punctual,
            first_punctual: scene.first_punctual,
            features: features(scene),
        })
    }

    /// Puts the lights that move where they are at `time` seconds, coming from where they were at `previous_time`.
    pub fn animate(&mut self, gpu: &Gpu, scene: &FlatScene, previous_time: f32, time: f32) {
        if scene.motions.is_empty() {
            return;
        }
        for motion in &scene.motions {
            let index = motion.light as usize;
            if let (Some(light), Some(rest)) = (self.punctual.get_mut(index), self.rest_positions.get(index)) {
                let at = |time: f32| {
                    let turn = Quat::from_axis_angle(motion.axis, motion.angular_speed * time);
                    motion.center + turn * (*rest - motion.center)
                };
                light.previous_position = at(previous_time);
                light.position = at(time);
            }
        }
        let offset = u64::from(self.first_punctual) * std::mem::size_of::<Light>() as u64;
        gpu.queue.write_buffer(&self.lights, offset, bytemuck::cast_slice(&self.punctual));
    }

    /// Moves the instances: `transforms` is object to world of each. The top level is rebuilt over them; where they stood
    /// before becomes the previous frame's place. A transform that cannot be undone hides its instance.
    pub fn place(&mut self, gpu: &Gpu, scene: &FlatScene, transforms: &[Mat4]) {
        if transforms.len() != scene.instances.len() || !scene.has_top_level() {
            return;
        }
        let boxes: Vec<[Vec3; 2]> = scene
            .instances
            .iter()
            .zip(transforms)
            .map(|(instance, &transform)| {
                let root = &scene.nodes[scene.meshes[instance.mesh as usize].root as usize];
                levels::transformed_box(transform, [root.min, root.max])
            })
            .collect();
        let nodes = levels::top_level(&boxes, self.top_level);
        let offset = u64::from(self.top_level) * size_of::<BvhNode>() as u64;
        gpu.queue.write_buffer(&self.nodes, offset, bytemuck::cast_slice(&nodes));
        self.instances.write(gpu, 0, &instance_records(scene, transforms, &self.transforms));
        self.transforms = transforms.to_vec();
    }

    /// Index in `nodes` of the root of everything.
    pub fn top_level(&self) -> u32 {
        self.top_level
    }

    /// The punctual lights as they are uploaded now, in the order of the scene.
    pub fn punctual_lights(&self) -> &[Light] {
        &self.punctual
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
        many_triangles: scene.triangles.len() > FIRST_TRIANGLES,
    }
}

fn instance_records(scene: &FlatScene, transforms: &[Mat4], previous: &[Mat4]) -> Vec<Instance> {
    let record = |((instance, &transform), &previous): ((&FlatInstance, &Mat4), &Mat4)| Instance {
        to_object: if levels::is_invertible(transform) { levels::rows(transform.inverse()) } else { [Vec4::ZERO; 3] },
        to_world: levels::rows(transform),
        previous_to_world: levels::rows(previous),
        root: scene.meshes[instance.mesh as usize].root,
        first_light: instance.first_light,
        previous_triangles: 0,
        padding: 0,
    };
    scene.instances.iter().zip(transforms).zip(previous).map(record).collect()
}

/// Index of the environment among the lights, or `NONE`.
pub fn environment_light(scene: &FlatScene) -> u32 {
    match scene.lights.last() {
        Some(light) if light.kind == LIGHT_ENVIRONMENT => scene.lights.len() as u32 - 1,
        _ => NONE,
    }
}

async fn upload(
    gpu: &Gpu,
    label: &str,
    size: [u32; 3],
    format: wgpu::TextureFormat,
    bytes: &[u8],
    pace: &mut Pace,
) -> wgpu::Texture {
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
    // A few rows of a layer at once, so that no staging copy is large.
    let rows = (SLICE_BYTES as u32 / row).clamp(1, height);
    for (layer, data) in bytes.chunks_exact(row as usize * height as usize).enumerate() {
        for (part, y) in data.chunks(row as usize * rows as usize).zip((0..).step_by(rows as usize)) {
            gpu.queue.write_texture(
                wgpu::TexelCopyTextureInfo {
                    texture: &texture,
                    mip_level: 0,
                    origin: wgpu::Origin3d { x: 0, y, z: layer as u32 },
                    aspect: wgpu::TextureAspect::All,
                },
                part,
                wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: Some(rows) },
                wgpu::Extent3d { width, height: part.len() as u32 / row, depth_or_array_layers: 1 },
            );
            pace.breathe().await;
        }
    }
    texture
}
