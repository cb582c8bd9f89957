//! What the GPU tests share: one device a test binary, scenes in small pictures, and statistics.
#![allow(dead_code, reason = "each test binary uses its own part")]

pub mod above;
pub mod animated;
pub mod bsdf;
pub mod extensions;
pub mod gltf_writer;
pub mod harness;
pub mod plate;
pub mod statistics;
pub mod twins;

use restir::lab::truth::Proof;
use restir::{FlatScene, Gpu, GpuOptions, Image, Renderer, Scene};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// The test binary's device, within WebGPU's default limits: what passes here runs everywhere.
pub fn gpu() -> Gpu {
    static SHARED: OnceLock<Gpu> = OnceLock::new();
    SHARED.get_or_init(fresh_gpu).clone()
}

/// A device of a test's own, for tests that change what it compiles or keeps.
pub fn fresh_gpu() -> Gpu {
    pollster::block_on(Gpu::headless(&GpuOptions { default_limits: true }))
        .expect("a Vulkan driver (Debian: mesa-vulkan-drivers)")
}

/// How thoroughly statistical proofs are made: wholly for `npm run prove`, quickly else.
pub fn proof() -> Proof {
    if std::env::var_os("RESTIR_PROVE").is_some() { Proof::Whole } else { Proof::Quick }
}

/// All cases of a proof; of a quick one the first.
pub fn cases<T>(all: &[T]) -> &[T] {
    match proof() {
        Proof::Whole => all,
        Proof::Quick => all.get(..1).unwrap_or_default(),
    }
}

/// Says that a test does not run, and why.
pub fn skip(test: &str, why: &str) {
    say(&format!("skipped {test}: {why}"));
}

/// A line on stderr. Aloud: what `eprintln!` prints is only shown of tests that fail.
pub fn say(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// A file of the folder `shared` beside the repository, or nothing and a word about it: such files are too large to
/// belong to the repository.
pub fn shared_file(test: &str, name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared").join(name);
    if path.exists() {
        return Some(path);
    }
    skip(test, &format!("it wants the file shared/{name} in the folder that holds the repository"));
    None
}

/// Flattens a scene.
pub fn flatten(scene: &Scene) -> FlatScene {
    FlatScene::build(scene, &mut |_, _| ()).expect("the scene flattens")
}

/// A built-in scene, flattened.
pub fn builtin(name: &str) -> FlatScene {
    let scene = restir::scene::builtin::make(name).expect("a built-in scene");
    flatten(&scene)
}

/// A renderer of a scene with a technique and settings.
pub fn renderer(gpu: &Gpu, scene: FlatScene, size: [u32; 2], technique: &str, settings: &[(&str, &str)]) -> Renderer {
    let mut renderer = Renderer::new(gpu.clone(), scene, size.into()).expect("a renderer");
    renderer.set_technique(technique).expect("a technique");
    for (key, value) in settings {
        renderer.set(key, value).expect("a setting");
    }
    renderer
}

/// The picture after `frames` frames.
pub fn render(renderer: &mut Renderer, frames: u32) -> Image {
    for _ in 0..frames {
        renderer.render_frame().expect("a frame");
    }
    pollster::block_on(renderer.read_image()).expect("a picture")
}

/// Mean over pixels and channels.
pub fn mean(image: &Image) -> f64 {
    let sum: f64 = image.pixels.iter().flatten().map(|c| f64::from(*c)).sum();
    sum / (3 * image.pixels.len()) as f64
}

/// Whether two pictures are the same bit for bit; says where they first differ.
#[track_caller]
pub fn assert_same(actual: &Image, expected: &Image, what: &str) {
    assert_eq!((actual.width, actual.height), (expected.width, expected.height), "{what}");
    let mut pixels = actual.pixels.iter().zip(&expected.pixels).enumerate();
    if let Some((i, (a, b))) = pixels.find(|(_, (a, b))| a.map(f32::to_bits) != b.map(f32::to_bits)) {
        panic!("{what}: pixel {i} is {a:?}, should be {b:?}");
    }
}
