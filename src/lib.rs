//! ReSTIR in the browser and headless: one WGSL source, five nouns, arrows one way.
//!
//! [`Scene`] -> [`FlatScene`] -> [`gpu_scene::GpuScene`] -> [`techniques::Technique`] -> [`film::Film`], and a
//! [`Renderer`] that holds one of each.

mod describe;
mod environment_pyramid;
pub mod error;
pub mod film;
pub mod frame;
pub mod gpu;
pub mod gpu_scene;
pub mod inspect;
pub mod lab;
pub mod output;
pub mod pace;
pub mod params;
pub mod renderer;
pub mod scene;
pub mod techniques;
pub mod view;
#[cfg(target_arch = "wasm32")]
pub mod web;

pub use describe::describe;
pub use error::{Error, Result};
pub use gpu::{Gpu, GpuOptions};
pub use output::Image;
pub use renderer::Renderer;
pub use scene::{FlatScene, Scene};

/// Every struct that has a WGSL twin of the same name. A test compares each with what naga says of the twin, and fails
/// for one that no shader declares.
pub fn gpu_layouts() -> Vec<scene::gpu_types::Layout> {
    use scene::gpu_types as types;
    let shared = [
        types::WideNode::LAYOUT,
        types::Triangle::LAYOUT,
        types::TriangleAttributes::LAYOUT,
        types::Instance::LAYOUT,
        types::TextureSlot::LAYOUT,
        types::Material::LAYOUT,
        types::MaterialExtensions::LAYOUT,
        types::Light::LAYOUT,
        types::CameraView::LAYOUT,
        frame::Frame::LAYOUT,
        film::FilmUniforms::LAYOUT,
        film::Counters::LAYOUT,
        inspect::Inspected::LAYOUT,
        inspect::Observation::LAYOUT,
        inspect::TraceHead::LAYOUT,
        inspect::Trace::LAYOUT,
    ];
    shared.into_iter().chain(techniques::ALL.iter().flat_map(|info| info.layouts.iter().copied())).collect()
}
