//! The shader table that `build.rs` generates, and pipelines made from it.

pub use super::binding_kind::BindingKind;
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::specialize::specialize;

/// One resource a pass reaches.
#[derive(Debug, Clone, Copy)]
pub struct Binding {
    /// The WGSL variable's name, by which it is bound.
    pub name: &'static str,
    /// `@group`.
    pub group: u32,
    /// `@binding`.
    pub index: u32,
    /// What it is.
    pub kind: BindingKind,
}

/// A WGSL struct as naga lays it out.
#[derive(Debug, Clone, Copy)]
pub struct StructLayout {
    /// Its name.
    pub name: &'static str,
    /// Its size in bytes.
    pub size: u32,
    /// (field, byte offset).
    pub fields: &'static [(&'static str, u32)],
}

/// One pass: its WGSL with includes in place, and what was read from it at build time.
#[derive(Debug)]
pub struct Shader {
    /// `technique/pass`, `scene/pass` or `film/pass`.
    pub id: &'static str,
    /// The file, relative to `shaders/`.
    pub file: &'static str,
    /// Flattened WGSL.
    pub source: &'static str,
    /// `@workgroup_size`; zeros for a render pass.
    pub workgroup_size: [u32; 3],
    /// By group, then index.
    pub bindings: &'static [Binding],
    /// Scene features the shader is specialised by (`override` declarations).
    pub overrides: &'static [&'static str],
    /// Every struct with a layout.
    pub structs: &'static [StructLayout],
}

/// The generated table.
#[allow(missing_docs, reason = "generated")]
pub mod table {
    use super::{Binding, BindingKind, Shader, StructLayout};
    include!(concat!(env!("OUT_DIR"), "/shaders.rs"));
}

/// Declares the features once: the struct, its extremes, and the WGSL `override` of each: `scene_has_NAME` of what a scene
/// has, `NAME` of a setting.
macro_rules! scene_features {
    (
        scene { $($(#[$scene_meta:meta])* $scene:ident,)* }
        settings { $($(#[$setting_meta:meta])* $setting:ident,)* }
    ) => {
        /// What a scene has, and settings that change code: kernels leave out the code for what is not there.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub struct SceneFeatures {
            $($(#[$scene_meta])* pub $scene: bool,)*
            $($(#[$setting_meta])* pub $setting: bool,)*
        }

        impl SceneFeatures {
            /// Everything, with settings off: right for every scene, fast for few.
            pub const ALL: Self = SceneFeatures { $($scene: true,)* $($setting: false,)* };
            /// Nothing: single-sided triangles that shine evenly.
            pub const NONE: Self = SceneFeatures { $($scene: false,)* $($setting: false,)* };

            /// The names of the `override` declarations.
            pub const OVERRIDES: &[&str] =
                &[$(concat!("scene_has_", stringify!($scene)),)* $(stringify!($setting),)*];

            /// The value of the shader's `override` of this name.
            fn has(self, name: &str) -> bool {
                match name {
                    $(concat!("scene_has_", stringify!($scene)) => self.$scene,)*
                    $(stringify!($setting) => self.$setting,)*
                    _ => true,
                }
            }

            /// Those that a shader with these `override` declarations can tell apart; others are as in [`Self::NONE`].
            pub fn restricted(self, overrides: &[&str]) -> Self {
                SceneFeatures {
                    $($scene: self.$scene && overrides.contains(&concat!("scene_has_", stringify!($scene))),)*
                    $($setting: self.$setting && overrides.contains(&stringify!($setting)),)*
                }
            }
        }
    };
}

scene_features! {
    scene {
        /// Any texture.
        textures,
        /// A second texture array.
        textures_1,
        /// A third texture array.
        textures_2,
        /// A fourth texture array.
        textures_3,
        /// Any triangle whose alpha has to be tested.
        alpha_masks,
        /// An environment.
        environment,
        /// A sun.
        sun,
        /// Primitives other than triangles.
        shapes,
        /// A pyramid by which the environment is sampled, rather than by its alias table.
        environment_pyramid,
        /// Any point, spot or directional light.
        punctual_lights,
        /// Any emissive triangle that changes its power.
        dimmed_emitters,
        /// A top level: more than one mesh that is in world space already.
        instances,
        /// Anything that moves.
        motion,
        /// More triangles than one storage binding holds.
        many_triangles,
        /// A data texture of more than one row.
        data_rows,
        /// Any material that transmits light.
        transmission,
        /// Any material that bounds a medium.
        volumes,
        /// Any medium that bends colours apart.
        dispersion,
        /// Any material without lighting.
        unlit,
        /// Any material with highlights stretched along a direction.
        anisotropy,
        /// Any material whose dielectric reflection is not that of index 1.5.
        specular,
        /// Any material with sheen.
        sheen,
        /// Any material with a clearcoat.
        clearcoat,
        /// Any material with a thin film.
        iridescence,
    }
    settings {
        /// `render.energy_compensation`.
        energy_compensation,
        /// `render.conserving_mix`.
        conserving_mix,
        /// Kernels for an adapter that computes on the CPU ([`Gpu::runs_software_kernels`]).
        is_software,
        /// Lights chosen by search in the cumulative distribution (src/techniques/candidates.rs).
        light_choice_cdf,
        /// Lights chosen all alike.
        light_choice_uniform,
        /// Candidates drawn for the BSDF.
        bsdf_candidates,
        /// Reservoirs in three words instead of four.
        reservoirs_packed,
        /// Reuse weights 1/M (src/techniques/reuse.rs).
        reuse_constant,
        /// Joining reservoirs of all neighbours, however different.
        reuse_everything,
        /// Reuse weights 1/|Z|.
        reuse_valid,
        /// Pairwise reuse weights.
        reuse_pairwise,
        /// Their defensive variant.
        reuse_defensive,
        /// Visibility as a factor of target functions in reuse weights.
        reuse_visibility,
        /// Whether what a reservoir holds is known to be lit where it is held.
        reservoirs_are_visible,
        /// Rays, nodes and rejected neighbours counted by the pixel, for a view that shows them.
        counts_pixels,
    }
}

impl Shader {
    /// The highest group index plus one.
    pub fn group_count(&self) -> u32 {
        self.bindings.iter().map(|b| b.group + 1).max().unwrap_or(0)
    }

    /// Bind group layouts, one a group.
    pub fn layouts(&self, device: &wgpu::Device, visibility: wgpu::ShaderStages) -> Vec<wgpu::BindGroupLayout> {
        (0..self.group_count())
            .map(|group| {
                let entries: Vec<_> = self
                    .bindings
                    .iter()
                    .filter(|b| b.group == group)
                    .map(|b| wgpu::BindGroupLayoutEntry {
                        binding: b.index,
                        visibility,
                        ty: binding_type(b.kind),
                        count: None,
                    })
                    .collect();
                device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                    label: Some(self.id),
                    entries: &entries,
                })
            })
            .collect()
    }

    /// `source` (the shader's own, or an edited one) as a scene that has `features` needs it: with values in place of
    /// `override` constants, and without the code that these switch off.
    pub fn specialized(&self, source: &str, features: SceneFeatures) -> String {
        specialize(source, &|name| self.overrides.contains(&name).then(|| features.has(name)))
    }

    /// The compute pipeline of this pass from `source` (its own, or an edited one with the same bindings), for scenes
    /// that have `features`, with its own [`layouts`](Self::layouts).
    pub fn compute_pipeline(
        &self,
        device: &wgpu::Device,
        groups: &[wgpu::BindGroupLayout],
        source: &str,
        features: SceneFeatures,
    ) -> wgpu::ComputePipeline {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(self.id),
            source: wgpu::ShaderSource::Wgsl(self.specialized(source, features).into()),
        });
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(self.id),
            bind_group_layouts: &groups.iter().map(Some).collect::<Vec<_>>(),
            immediate_size: 0,
        });
        device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(self.id),
            layout: Some(&layout),
            module: &module,
            entry_point: Some("main"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        })
    }

    /// Whether an edited text of this pass is valid and binds what the built one does, for that is what the program knows
    /// how to bind.
    ///
    /// # Errors
    /// One line for a person.
    #[cfg(not(target_arch = "wasm32"))]
    pub(super) fn accepts(&self, edited: &super::shader_source::Flattened) -> std::result::Result<(), String> {
        let reflection = super::shader_source::reflect(edited)?;
        let is_compute = self.workgroup_size != [0; 3];
        if is_compute && !reflection.entry_points.iter().any(|(name, _)| name == "main") {
            return Err(format!("{}: the entry point main is gone", self.file));
        }
        let bindings = |name, group, index, kind| (name, group, index, kind);
        let new = reflection.bindings.iter().map(|b| bindings(b.name.as_str(), b.group, b.index, b.kind));
        let old = self.bindings.iter().map(|b| bindings(b.name, b.group, b.index, b.kind));
        let same = reflection.workgroup_size == self.workgroup_size
            && reflection.overrides.iter().eq(self.overrides.iter())
            && new.eq(old);
        if same {
            Ok(())
        } else {
            Err(format!("{}: bindings, overrides or workgroup size changed; rebuild the program", self.file))
        }
    }

    /// One bind group a group, every resource found by its name.
    ///
    /// # Errors
    /// `SHADER` naming the binding that nothing was bound to, or that got the wrong kind of resource.
    pub fn bind_groups(
        &self,
        gpu: &Gpu,
        layouts: &[wgpu::BindGroupLayout],
        bound: &[(&str, Resource<'_>)],
    ) -> Result<Vec<wgpu::BindGroup>> {
        let error = |what: String| Error::Shader { shader: self.id.to_owned(), what };
        let mut groups = Vec::with_capacity(layouts.len());
        for (group, layout) in layouts.iter().enumerate() {
            let mut entries = Vec::new();
            for binding in self.bindings.iter().filter(|b| b.group as usize == group) {
                // The last one bound wins, so that a pass can override what it shares.
                let Some((_, resource)) = bound.iter().rev().find(|(name, _)| *name == binding.name) else {
                    let names: Vec<_> = bound.iter().map(|(name, _)| *name).collect();
                    return Err(error(format!("nothing is bound as '{}' (bound: {})", binding.name, names.join(", "))));
                };
                let resource = match (resource, is_buffer(binding.kind)) {
                    (Resource::Buffer(buffer), true) => buffer.as_entire_binding(),
                    (Resource::Texture(view), false) => wgpu::BindingResource::TextureView(view),
                    (Resource::Buffer(_), false) => {
                        return Err(error(format!("'{}' wants a texture, got a buffer", binding.name)));
                    }
                    (Resource::Texture(_), true) => {
                        return Err(error(format!("'{}' wants a buffer, got a texture", binding.name)));
                    }
                };
                entries.push(wgpu::BindGroupEntry { binding: binding.index, resource });
            }
            groups.push(gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(self.id),
                layout,
                entries: &entries,
            }));
        }
        Ok(groups)
    }
}

/// Something that can be bound.
#[derive(Debug, Clone, Copy)]
pub enum Resource<'a> {
    /// A whole buffer.
    Buffer(&'a wgpu::Buffer),
    /// A texture view.
    Texture(&'a wgpu::TextureView),
}

impl<'a> From<&'a wgpu::Buffer> for Resource<'a> {
    fn from(buffer: &'a wgpu::Buffer) -> Self {
        Resource::Buffer(buffer)
    }
}

impl<'a> From<&'a wgpu::TextureView> for Resource<'a> {
    fn from(view: &'a wgpu::TextureView) -> Self {
        Resource::Texture(view)
    }
}

fn is_buffer(kind: BindingKind) -> bool {
    matches!(kind, BindingKind::Uniform(_) | BindingKind::StorageRead | BindingKind::StorageReadWrite)
}

fn binding_type(kind: BindingKind) -> wgpu::BindingType {
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let texture =
        |sample_type, view_dimension| wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false };
    let storage = |format| wgpu::BindingType::StorageTexture {
        access: wgpu::StorageTextureAccess::WriteOnly,
        format,
        view_dimension: wgpu::TextureViewDimension::D2,
    };
    let float = wgpu::TextureSampleType::Float { filterable: false };
    match kind {
        BindingKind::Uniform(_) => buffer(wgpu::BufferBindingType::Uniform),
        BindingKind::StorageRead => buffer(wgpu::BufferBindingType::Storage { read_only: true }),
        BindingKind::StorageReadWrite => buffer(wgpu::BufferBindingType::Storage { read_only: false }),
        BindingKind::TextureFloat => texture(float, wgpu::TextureViewDimension::D2),
        BindingKind::TextureUint => texture(wgpu::TextureSampleType::Uint, wgpu::TextureViewDimension::D2),
        BindingKind::TextureFloatArray => texture(float, wgpu::TextureViewDimension::D2Array),
        BindingKind::StorageTextureFloat => storage(wgpu::TextureFormat::Rgba32Float),
        BindingKind::StorageTextureUint => storage(wgpu::TextureFormat::Rgba32Uint),
    }
}
