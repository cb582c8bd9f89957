//! The uploaded scene: the buffers and textures of bind group 0, all but the frame uniform.

mod forest;
mod motion;
mod walked;

use crate::environment_pyramid::EnvironmentPyramid;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::data_texture::DataTexture;
use crate::gpu::memory::bytes_of;
use crate::gpu::recorder::Recorder;
use crate::gpu::shader::SceneFeatures;
use crate::pace::{Pace, SLICE_BYTES};
use crate::scene::flat::{FlatEnvironment, TextureArray};
use crate::scene::gpu_types::{
    LIGHT_ENVIRONMENT, LIGHT_SUN, LIGHT_TRIANGLE, Light, MATERIAL_UNLIT, MATERIAL_VOLUME, MaterialExtensions, NONE,
    TRIANGLE_ALPHA_MASK,
};
use crate::scene::stage::Stage;
use crate::scene::{FlatScene, Shape};
use forest::Forest;
use glam::{UVec2, Vec3};
use motion::Motion;
use walked::Walked;

/// The texture arrays as shaders name them. A scene may have fewer.
const TEXTURE_ARRAYS: [&str; 4] = ["textures_0", "textures_1", "textures_2", "textures_3"];

/// A [`FlatScene`] on the device.
#[derive(Debug)]
pub struct GpuScene {
    walked: Walked,
    lights: wgpu::Buffer,
    attributes: DataTexture,
    materials: DataTexture,
    material_extensions: DataTexture,
    instances: DataTexture,
    instance_count: u32,
    /// Index in `nodes` of the root of everything.
    top_level: u32,
    textures: [wgpu::TextureView; TEXTURE_ARRAYS.len()],
    environment_radiance: wgpu::TextureView,
    environment_alias: wgpu::TextureView,
    /// What stands in for a pyramid that there is not.
    no_pyramid: wgpu::TextureView,
    /// Made when the environment is to be sampled by it.
    pyramid: Option<EnvironmentPyramid>,
    /// Where what moves lies; none in a scene that stands still.
    motion: Option<Motion>,
    features: SceneFeatures,
}

impl Drop for GpuScene {
    /// Frees what is large at once: on the web it would otherwise lie about until a garbage collection. Frames that were submitted still
    /// have it.
    fn drop(&mut self) {
        self.walked.destroy();
        self.lights.destroy();
        for records in [&self.attributes, &self.materials, &self.material_extensions, &self.instances] {
            records.destroy();
        }
        for texture in self.textures.iter().chain([&self.environment_radiance, &self.environment_alias]) {
            texture.texture().destroy();
        }
    }
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
        for (i, array) in scene.textures.iter().enumerate() {
            let what = format!("texture array {i}");
            texture_limit(&what, array.width.max(array.height), side, "texels a side")?;
            texture_limit(&what, array.layers, limits.max_texture_array_layers, "layers")?;
        }
        if let Some(environment) = &scene.environment {
            texture_limit("the environment", environment.width.max(environment.height), side, "texels a side")?;
        }
        let black = ([1, 1], vec![[0f32; 4]], vec![[0u32; 4]]);
        let (size, radiance, alias) = match &scene.environment {
            Some(e) => ([e.width, e.height], &e.radiance, &e.alias),
            None => (black.0, &black.1, &black.2),
        };
        let mut forest = Forest::new(scene, pace).await?;
        let (motion, arrays) = Motion::lay_out(scene, &mut forest);
        let mut gpu_scene = GpuScene {
            walked: Walked::upload(gpu, &forest.nodes, &arrays.triangles, pace).await?,
            attributes: DataTexture::in_slices(gpu, "attributes", &arrays.attributes, pace).await?,
            materials: DataTexture::new(gpu, "materials", &scene.materials)?,
            material_extensions: DataTexture::new(gpu, "material extensions", &scene.material_extensions)?,
            instances: DataTexture::new(gpu, "instances", &arrays.instances)?,
            instance_count: scene.instances.len() as u32,
            top_level: forest.top_level,
            lights: if arrays.lights.is_empty() {
                gpu.storage("lights", std::mem::size_of::<Light>() as u64)?
            } else {
                gpu.storage_in_slices("lights", &arrays.lights, pace).await?
            },
            textures: [
                texture_array(gpu, TEXTURE_ARRAYS[0], scene.textures.first(), pace).await,
                texture_array(gpu, TEXTURE_ARRAYS[1], scene.textures.get(1), pace).await,
                texture_array(gpu, TEXTURE_ARRAYS[2], scene.textures.get(2), pace).await,
                texture_array(gpu, TEXTURE_ARRAYS[3], scene.textures.get(3), pace).await,
            ],
            environment_radiance: upload(
                gpu,
                "environment radiance",
                size,
                wgpu::TextureFormat::Rgba32Float,
                bytemuck::cast_slice(radiance),
                pace,
            )
            .await,
            environment_alias: upload(
                gpu,
                "environment alias table",
                size,
                wgpu::TextureFormat::Rgba32Uint,
                bytemuck::cast_slice(alias),
                pace,
            )
            .await,
            no_pyramid: gpu.texture("no pyramid", UVec2::ONE, wgpu::TextureFormat::Rgba32Float),
            pyramid: None,
            motion,
            features: features(scene),
        };
        let data = [&gpu_scene.attributes, &gpu_scene.materials, &gpu_scene.material_extensions, &gpu_scene.instances];
        gpu_scene.features.data_rows = gpu_scene.walked.has_rows() || data.into_iter().any(DataTexture::has_rows);
        Ok(gpu_scene)
    }

    /// Brings the device up to date with what moves: this frame's transforms, shapes and lights, and those of the frame
    /// before. Both top levels are rebuilt; a transform that cannot be undone hides its instance.
    pub fn take_stage(&mut self, gpu: &Gpu, scene: &FlatScene, stage: &Stage) {
        if let Some(mut motion) = self.motion.take() {
            if motion.version != Some(stage.version()) {
                motion.take_shapes(gpu, self, stage);
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

    /// Bytes on the device.
    pub fn memory(&self) -> u64 {
        let records = [&self.attributes, &self.materials, &self.material_extensions, &self.instances];
        let views = records.into_iter().map(|records| &records.view).chain(&self.textures).chain([
            &self.environment_radiance,
            &self.environment_alias,
            &self.no_pyramid,
        ]);
        let views = views.chain(self.pyramid.as_ref().map(|pyramid| &pyramid.view));
        self.walked.memory() + self.lights.size() + bytes_of(&views.map(Into::into).collect::<Vec<_>>())
    }

    /// Whether the environment is sampled by its pyramid, which [`GpuScene::record`] then makes, or by its alias table.
    pub fn sample_by_pyramid(&mut self, gpu: &Gpu, by_pyramid: bool) {
        let size = self.environment_radiance.texture().size();
        if !by_pyramid || !self.features.environment {
            self.pyramid = None;
        } else if self.pyramid.is_none() {
            self.pyramid = Some(EnvironmentPyramid::new(gpu, size.width, size.height));
        }
        self.features.environment_pyramid = self.pyramid.is_some();
    }

    /// Replaces the environment's radiance and alias table by those of a map of the same size.
    pub(crate) fn update_environment(&self, gpu: &Gpu, environment: &FlatEnvironment) {
        write_rows(gpu, self.environment_radiance.texture(), [0; 3], bytemuck::cast_slice(&environment.radiance));
        write_rows(gpu, self.environment_alias.texture(), [0; 3], bytemuck::cast_slice(&environment.alias));
    }

    /// What has to be made before the scene can be rendered.
    ///
    /// # Errors
    /// `SHADER` where [`GpuScene::share`] was not called.
    pub fn record(&self, recorder: &mut Recorder<'_>) -> Result<()> {
        self.pyramid.as_ref().map_or(Ok(()), |pyramid| pyramid.record(recorder))
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
        self.walked.share(recorder);
        recorder.share("lights", &self.lights);
        recorder.share("attributes", &self.attributes.view);
        recorder.share("materials", &self.materials.view);
        recorder.share("material_extensions", &self.material_extensions.view);
        recorder.share("instances", &self.instances.view);
        for (name, textures) in TEXTURE_ARRAYS.into_iter().zip(&self.textures) {
            recorder.share(name, textures);
        }
        recorder.share("environment_radiance", &self.environment_radiance);
        recorder.share("environment_alias", &self.environment_alias);
        let pyramid = self.pyramid.as_ref().map_or(&self.no_pyramid, |pyramid| &pyramid.view);
        recorder.share("environment_pyramid", pyramid);
    }
}

fn features(scene: &FlatScene) -> SceneFeatures {
    let any = |has: fn(&MaterialExtensions) -> bool| scene.material_extensions.iter().any(has);
    SceneFeatures {
        textures: !scene.textures.is_empty(),
        textures_1: scene.textures.len() > 1,
        textures_2: scene.textures.len() > 2,
        textures_3: scene.textures.len() > 3,
        alpha_masks: scene.triangles.iter().any(|t| t.flags & TRIANGLE_ALPHA_MASK != 0),
        environment: environment_light(scene) != NONE,
        sun: sun_light(scene) != NONE,
        environment_pyramid: false,
        shapes: scene.triangles.iter().any(|t| t.shape() != Shape::Triangles),
        punctual_lights: scene.lights.iter().any(|l| l.kind != LIGHT_TRIANGLE && !is_distant(l)),
        dimmed_emitters: scene.light_powers.iter().take(scene.first_punctual as usize).any(|&power| power != NONE),
        instances: scene.has_top_level(),
        motion: !scene.rig.is_still(),
        many_triangles: motion::triangle_count(scene) > walked::FIRST_TRIANGLES,
        transmission: any(|m| m.transmission > 0.0),
        volumes: any(|m| m.flags & MATERIAL_VOLUME != 0),
        dispersion: any(|m| m.flags & MATERIAL_VOLUME != 0 && m.dispersion > 0.0),
        unlit: any(|m| m.flags & MATERIAL_UNLIT != 0),
        anisotropy: any(|m| m.anisotropy > 0.0),
        // Where a medium is outside, index 1.5 reflects something else.
        specular: any(|m| {
            m.ior != 1.5
                || m.specular != 1.0
                || m.specular_color != Vec3::ONE
                || m.slots()[..2].iter().any(|slot| slot.read().is_some())
                || m.flags & MATERIAL_VOLUME != 0
        }),
        sheen: any(|m| m.sheen_color != Vec3::ZERO),
        clearcoat: any(|m| m.clearcoat > 0.0),
        iridescence: any(|m| m.iridescence > 0.0),
        ..SceneFeatures::NONE
    }
}

/// Index of the environment among the lights, or `NONE`.
pub fn environment_light(scene: &FlatScene) -> u32 {
    distant_light(scene, LIGHT_ENVIRONMENT)
}

/// Index of the sun among the lights, or `NONE`.
pub fn sun_light(scene: &FlatScene) -> u32 {
    distant_light(scene, LIGHT_SUN)
}

fn is_distant(light: &Light) -> bool {
    matches!(light.kind, LIGHT_SUN | LIGHT_ENVIRONMENT)
}

/// Distant lights are the last.
fn distant_light(scene: &FlatScene, kind: u32) -> u32 {
    let last = scene.lights.iter().enumerate().rev().take_while(|(_, light)| is_distant(light));
    last.into_iter().find(|(_, light)| light.kind == kind).map_or(NONE, |(index, _)| index as u32)
}

/// An array with all its levels; one white texel for an array that the scene does not have.
async fn texture_array(gpu: &Gpu, label: &str, array: Option<&TextureArray>, pace: &mut Pace) -> wgpu::TextureView {
    let format = wgpu::TextureFormat::Rgba8Unorm;
    let texture = match array {
        Some(array) => {
            let texture = create(gpu, label, [array.width, array.height, array.layers], array.levels, format);
            for level in 0..array.levels {
                for layer in 0..array.layers {
                    let start = array.offset(level, layer, 0, 0);
                    let end = start + array.layer_bytes(level) as usize;
                    write(gpu, &texture, level, layer, array.texels.get(start..end).unwrap_or_default(), pace).await;
                }
            }
            texture
        }
        None => {
            let texture = create(gpu, label, [1; 3], 1, format);
            write(gpu, &texture, 0, 0, &[u8::MAX; 4], pace).await;
            texture
        }
    };
    texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        ..Default::default()
    })
}

async fn upload(
    gpu: &Gpu,
    label: &str,
    size: [u32; 2],
    format: wgpu::TextureFormat,
    texels: &[u8],
    pace: &mut Pace,
) -> wgpu::TextureView {
    let texture = create(gpu, label, [size[0], size[1], 1], 1, format);
    write(gpu, &texture, 0, 0, texels, pace).await;
    texture.create_view(&Default::default())
}

fn create(gpu: &Gpu, label: &str, size: [u32; 3], levels: u32, format: wgpu::TextureFormat) -> wgpu::Texture {
    let [width, height, depth_or_array_layers] = size;
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width, height, depth_or_array_layers },
        mip_level_count: levels,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

/// Writes one layer of one level, a few rows at once, so that no staging copy is large.
async fn write(gpu: &Gpu, texture: &wgpu::Texture, level: u32, layer: u32, texels: &[u8], pace: &mut Pace) {
    let row = row_bytes(texture, level) as usize;
    let rows = (SLICE_BYTES / row).max(1);
    for (part, y) in texels.chunks(row * rows).zip((0..).step_by(rows)) {
        write_rows(gpu, texture, [level, layer, y], part);
        pace.breathe().await;
    }
}

fn row_bytes(texture: &wgpu::Texture, level: u32) -> u32 {
    (texture.width() >> level).max(1) * texture.format().block_copy_size(None).unwrap_or(4)
}

/// Writes whole rows from row `y` of a layer of a level on.
fn write_rows(gpu: &Gpu, texture: &wgpu::Texture, [level, layer, y]: [u32; 3], texels: &[u8]) {
    let row = row_bytes(texture, level);
    let height = texels.len() as u32 / row;
    gpu.queue.write_texture(
        wgpu::TexelCopyTextureInfo {
            texture,
            mip_level: level,
            origin: wgpu::Origin3d { x: 0, y, z: layer },
            aspect: wgpu::TextureAspect::All,
        },
        texels,
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: Some(height) },
        wgpu::Extent3d { width: (texture.width() >> level).max(1), height, depth_or_array_layers: 1 },
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Clearcoat, Iridescence, Material, Scene, Sheen, Specular, Transmission, Volume, shapes};

    /// Each extension puts in the code that it needs, and a scene without any puts in none.
    #[test]
    fn kernels_carry_what_materials_need() {
        let of = |material: Material| {
            let mesh = shapes::parallelogram(Vec3::ZERO, Vec3::X, Vec3::Y, 0);
            let instances = vec![crate::scene::Instance { mesh: 0, transform: glam::Mat4::IDENTITY }];
            let scene = Scene { meshes: vec![mesh], instances, materials: vec![material], ..Scene::default() };
            features(&FlatScene::build(&scene, &mut |_, _| ()).expect("a good scene"))
        };
        let plain = Material::default();
        let none = SceneFeatures::NONE;
        assert_eq!(of(plain.clone()), none);
        let transmission = Transmission { factor: 0.1, texture: None };
        let volume = Some(Volume { attenuation_distance: 1.0, attenuation_color: Vec3::ONE });
        for (material, expected) in [
            (Material { ior: 1.4, ..plain.clone() }, SceneFeatures { specular: true, ..none }),
            (
                Material { specular: Specular { strength: 0.5, ..Specular::default() }, ..plain.clone() },
                SceneFeatures { specular: true, ..none },
            ),
            (Material { transmission, ..plain.clone() }, SceneFeatures { transmission: true, ..none }),
            (
                Material { transmission, volume, ..plain.clone() },
                SceneFeatures { transmission: true, volumes: true, specular: true, ..none },
            ),
            (
                Material { transmission, volume, dispersion: 0.1, ..plain.clone() },
                SceneFeatures { transmission: true, volumes: true, specular: true, dispersion: true, ..none },
            ),
            (Material { unlit: true, ..plain.clone() }, SceneFeatures { unlit: true, ..none }),
            (
                Material { sheen: Sheen { color: Vec3::X, ..Sheen::default() }, ..plain.clone() },
                SceneFeatures { sheen: true, ..none },
            ),
            (
                Material { clearcoat: Clearcoat { factor: 0.1, ..Clearcoat::default() }, ..plain.clone() },
                SceneFeatures { clearcoat: true, ..none },
            ),
            (
                Material { iridescence: Iridescence { factor: 0.1, ..Iridescence::default() }, ..plain.clone() },
                SceneFeatures { iridescence: true, ..none },
            ),
            (
                Material {
                    anisotropy: crate::scene::Anisotropy { strength: 0.1, ..Default::default() },
                    ..plain.clone()
                },
                SceneFeatures { anisotropy: true, ..none },
            ),
        ] {
            assert_eq!(of(material), expected);
        }
    }
}
