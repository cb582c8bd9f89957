//! The device: adapter and limits, device loss, pipelines, buffers, textures and read-back.

pub mod albedo_table;
pub mod data_texture;
pub mod dissection;
pub mod memory;
#[cfg(not(target_arch = "wasm32"))]
mod plant;
pub mod readback;
pub mod recorder;
#[cfg(all(debug_assertions, not(target_arch = "wasm32")))]
pub mod reload;
pub mod shader;

pub mod binding_kind;
#[cfg(not(target_arch = "wasm32"))]
pub mod shader_source;
pub mod specialize;

use crate::error::{Error, Result};
use crate::pace::{Pace, SLICE_BYTES};
use shader::{SceneFeatures, Shader};
use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::{Arc, Mutex};

/// A pass and the scene features it was specialised for.
type PipelineKey = (&'static str, SceneFeatures);

/// A pass has one pipeline for all features that it does not tell apart.
fn pipeline_key(shader: &'static Shader, features: SceneFeatures) -> PipelineKey {
    (shader.id, features.restricted(shader.overrides))
}

/// How to choose a device.
#[derive(Debug, Clone, Copy, Default)]
pub struct GpuOptions {
    /// Stay within WebGPU's default limits even where the adapter has more.
    pub default_limits: bool,
}

/// A device and queue with the pipelines made on it. A clone is another handle on the same device.
#[derive(Debug, Clone)]
pub struct Gpu {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// Whether compute passes can be timed.
    pub has_timestamps: bool,
    albedo_table: wgpu::TextureView,
    adapter: wgpu::AdapterInfo,
    poses_as_hardware: bool,
    failure: Arc<Mutex<Option<String>>>,
    pipelines: Arc<Mutex<HashMap<PipelineKey, wgpu::ComputePipeline>>>,
    /// Of the bind groups of passes, by id.
    layouts: Arc<Mutex<HashMap<&'static str, Vec<wgpu::BindGroupLayout>>>>,
    /// Text of every shader that has a planted fault, by id.
    #[cfg(not(target_arch = "wasm32"))]
    planted: Arc<Mutex<HashMap<&'static str, String>>>,
    #[cfg(all(debug_assertions, not(target_arch = "wasm32")))]
    reloader: Arc<Mutex<Option<reload::Reloader>>>,
}

/// The default instance: WebGPU on the web, Vulkan elsewhere.
pub fn instance() -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN | wgpu::Backends::BROWSER_WEBGPU;
    wgpu::Instance::new(descriptor)
}

fn keep_first(slot: &Mutex<Option<String>>, what: String) {
    if let Ok(mut slot) = slot.lock() {
        slot.get_or_insert(what);
    }
}

impl Gpu {
    /// A device without a window: the first GPU, or a software adapter where there is none.
    ///
    /// # Errors
    /// `NO_ADAPTER` if there is no Vulkan driver at all, with what to install.
    pub async fn headless(options: &GpuOptions) -> Result<Self> {
        Self::from_instance(&instance(), None, options).await
    }

    /// A device of `instance` that can present to `surface`, if one is given.
    ///
    /// # Errors
    /// `NO_ADAPTER` if no adapter or no device can be had.
    pub async fn from_instance(
        instance: &wgpu::Instance,
        surface: Option<&wgpu::Surface<'_>>,
        options: &GpuOptions,
    ) -> Result<Self> {
        let adapter = instance
            .request_adapter(&wgpu::RequestAdapterOptions {
                power_preference: wgpu::PowerPreference::HighPerformance,
                compatible_surface: surface,
                ..Default::default()
            })
            .await
            .map_err(|e| Error::NoAdapter(format!("{e}; a Vulkan driver is needed (Debian: mesa-vulkan-drivers)")))?;
        let has_timestamps = adapter.features().contains(wgpu::Features::TIMESTAMP_QUERY);
        let mut limits = wgpu::Limits::default();
        if !options.default_limits {
            // Only the sizes of things: every shader is written for the default counts.
            let have = adapter.limits();
            limits.max_storage_buffer_binding_size = have.max_storage_buffer_binding_size;
            limits.max_buffer_size = have.max_buffer_size;
        }
        let (device, queue) = adapter
            .request_device(&wgpu::DeviceDescriptor {
                label: Some("restir"),
                required_features: if has_timestamps {
                    wgpu::Features::TIMESTAMP_QUERY
                } else {
                    wgpu::Features::empty()
                },
                required_limits: limits,
                ..Default::default()
            })
            .await
            .map_err(|e| Error::NoAdapter(e.to_string()))?;
        let failure = Arc::new(Mutex::new(None));
        let on_error = failure.clone();
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| keep_first(&on_error, e.to_string())));
        let on_loss = failure.clone();
        device.set_device_lost_callback(move |reason, message| {
            if reason != wgpu::DeviceLostReason::Destroyed {
                keep_first(&on_loss, format!("the device was lost: {message}"));
            }
        });
        Ok(Gpu {
            albedo_table: albedo_table::upload(&device, &queue),
            device,
            queue,
            has_timestamps,
            adapter: adapter.get_info(),
            poses_as_hardware: false,
            failure,
            pipelines: Arc::default(),
            layouts: Arc::default(),
            #[cfg(not(target_arch = "wasm32"))]
            planted: Arc::default(),
            #[cfg(all(debug_assertions, not(target_arch = "wasm32")))]
            reloader: Arc::new(Mutex::new(reload::Reloader::of_source_tree())),
        })
    }

    /// The adapter's name and kind, for reports.
    pub fn adapter_name(&self) -> String {
        let name = if self.adapter.name.is_empty() { "WebGPU adapter" } else { &self.adapter.name };
        format!("{name} ({:?})", self.adapter.backend)
    }

    /// Whether the adapter computes on the CPU.
    pub fn is_software(&self) -> bool {
        self.adapter.device_type == wgpu::DeviceType::Cpu
    }

    /// Whether kernels are those for software adapters, which load a texel at once but gather what lies in buffers word by word
    /// (docs/performance.md).
    pub fn runs_software_kernels(&self) -> bool {
        self.is_software() && !self.poses_as_hardware
    }

    /// The same device, with kernels for GPUs though it may be none: so these are tested where there is no GPU.
    #[must_use]
    pub fn posing_as_hardware(self) -> Self {
        Gpu { poses_as_hardware: true, ..self }
    }

    /// The first error the device reported since it was made, if any.
    ///
    /// # Errors
    /// `DEVICE` with the driver's or validator's words.
    pub fn check(&self) -> Result<()> {
        match self.failure.lock() {
            Ok(slot) => slot.as_ref().map_or(Ok(()), |what| Err(Error::Device(what.clone()))),
            Err(_) => Err(Error::Device("an error handler panicked".into())),
        }
    }

    /// Has [`Gpu::check`] fail from now on, for this reason if there was none before.
    fn note_failure(&self, error: &Error) {
        if let Error::Device(what) = error {
            keep_first(&self.failure, what.clone());
        }
    }

    /// The compute pipeline of a pass for scenes that have `features`, made on first use.
    pub fn pipeline(&self, shader: &'static Shader, features: SceneFeatures) -> wgpu::ComputePipeline {
        let key = pipeline_key(shader, features);
        let make = || {
            let layouts = self.layouts(shader);
            shader.compute_pipeline(&self.device, &layouts, &self.shader_source(shader), key.1)
        };
        match self.pipelines.lock() {
            Ok(mut pipelines) => pipelines.entry(key).or_insert_with(make).clone(),
            Err(_) => make(),
        }
    }

    /// The layouts of a compute pass's bind groups, by group index; the same for all its pipelines.
    pub fn layouts(&self, shader: &'static Shader) -> Vec<wgpu::BindGroupLayout> {
        let make = || shader.layouts(&self.device, wgpu::ShaderStages::COMPUTE);
        match self.layouts.lock() {
            Ok(mut layouts) => layouts.entry(shader.id).or_insert_with(make).clone(),
            Err(_) => make(),
        }
    }

    /// Resolves when the device has taken in all that it was given so far: when pipelines are compiled, whether or not passes have run.
    pub fn taken_in(&self) -> impl Future<Output = ()> + use<> {
        // A scope round nothing catches nothing, and is answered in turn.
        let scope = self.device.push_error_scope(wgpu::ErrorFilter::Internal).pop();
        async move {
            scope.await;
        }
    }

    /// Whether [`Gpu::pipeline`] has it already.
    pub fn has_pipeline(&self, shader: &'static Shader, features: SceneFeatures) -> bool {
        self.pipelines.lock().is_ok_and(|pipelines| pipelines.contains_key(&pipeline_key(shader, features)))
    }

    /// A pass's text: with a planted fault, as edited while the program runs (native debug builds), or as built.
    fn shader_source(&self, shader: &'static Shader) -> Cow<'static, str> {
        #[cfg(not(target_arch = "wasm32"))]
        if let Ok(planted) = self.planted.lock()
            && let Some(text) = planted.get(shader.id)
        {
            return text.clone().into();
        }
        #[cfg(all(debug_assertions, not(target_arch = "wasm32")))]
        if let Ok(reloader) = self.reloader.lock()
            && let Some(reloader) = reloader.as_ref()
        {
            return reloader.source(shader).to_owned().into();
        }
        shader.source.into()
    }

    /// Replaces pipelines whose shader files have changed on disk. Nothing changed: `None`. Else one line for each that
    /// could not be replaced and keeps its old pipeline. Native debug builds only; elsewhere nothing happens.
    pub fn reload_shaders(&self) -> Option<Vec<String>> {
        #[cfg(all(debug_assertions, not(target_arch = "wasm32")))]
        // Pipelines first, as `pipeline` does: one order of locks.
        if let (Ok(mut pipelines), Ok(mut reloader)) = (self.pipelines.lock(), self.reloader.lock())
            && let Some(reloader) = reloader.as_mut()
        {
            return reloader.reload(&mut pipelines);
        }
        None
    }

    /// Reloads shaders from another folder than the one the program was built from.
    #[cfg(all(debug_assertions, not(target_arch = "wasm32")))]
    pub fn watch_shaders(&self, folder: &std::path::Path) {
        if let Ok(mut reloader) = self.reloader.lock() {
            *reloader = Some(reload::Reloader::new(folder));
        }
    }

    /// Fails, with numbers, where a storage buffer of `size` bytes would not be allowed.
    ///
    /// # Errors
    /// `LIMIT`.
    pub fn check_storage(&self, what: &str, size: u64) -> Result<()> {
        let limits = self.device.limits();
        let had = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        if size > had {
            return Err(Error::Limit { what: what.to_owned(), wanted: size, had, unit: "bytes in one buffer" });
        }
        Ok(())
    }

    /// A zeroed storage buffer of `size` bytes (at least 16) that can be copied from and to.
    ///
    /// # Errors
    /// `LIMIT` if the device does not allow it.
    pub fn storage(&self, label: &str, size: u64) -> Result<wgpu::Buffer> {
        self.check_storage(label, size)?;
        Ok(self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: size.max(16).next_multiple_of(4),
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        }))
    }

    /// A storage buffer that holds `data` (at least 16 bytes).
    ///
    /// # Errors
    /// `LIMIT` if the device does not allow it.
    pub fn storage_of<T: bytemuck::Pod>(&self, label: &str, data: &[T]) -> Result<wgpu::Buffer> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let buffer = self.storage(label, bytes.len() as u64)?;
        self.queue.write_buffer(&buffer, 0, bytes);
        Ok(buffer)
    }

    /// As [`Gpu::storage_of`], in slices.
    ///
    /// # Errors
    /// `LIMIT` if the device does not allow it.
    pub async fn storage_in_slices<T: bytemuck::Pod>(
        &self,
        label: &str,
        data: &[T],
        pace: &mut Pace,
    ) -> Result<wgpu::Buffer> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let buffer = self.storage(label, bytes.len() as u64)?;
        for (part, offset) in bytes.chunks(SLICE_BYTES).zip((0u64..).step_by(SLICE_BYTES)) {
            self.queue.write_buffer(&buffer, offset, part);
            pace.breathe().await;
        }
        Ok(buffer)
    }

    /// A uniform buffer of `size` bytes.
    pub fn uniform(&self, label: &str, size: u64) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    /// A 2D texture that passes write as a storage texture and read by `textureLoad`.
    pub fn texture(&self, label: &str, size: glam::UVec2, format: wgpu::TextureFormat) -> wgpu::TextureView {
        let texture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::STORAGE_BINDING
                | wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        texture.create_view(&wgpu::TextureViewDescriptor::default())
    }
}
