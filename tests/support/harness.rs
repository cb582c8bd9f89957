//! Evaluating shader functions from tests: inputs as words, one invocation each, outputs as words.

use restir::gpu::recorder::Recorder;
use restir::gpu::shader::Shader;
use restir::gpu_scene::{GpuScene, environment_light, sun_light};
use restir::scene::{Camera, FlatScene};
use restir::{Gpu, frame};

restir::gpu_struct! {
/// One evaluation's input, as `shaders/tests/harness.wgsl` declares it; floats as bits.
pub struct TestInput {
    /// First argument.
    pub a: [u32; 4],
    /// Second argument.
    pub b: [u32; 4],
    /// Third argument.
    pub c: [u32; 4],
    /// Fourth argument.
    pub d: [u32; 4],
}
}

restir::gpu_struct! {
/// One evaluation's output.
pub struct TestOutput {
    /// First result.
    pub a: [u32; 4],
    /// Second result.
    pub b: [u32; 4],
}
}

restir::gpu_struct! {
/// What to evaluate, and how often.
pub struct TestRun {
    /// Number of the function.
    pub operation: u32,
    /// Number of inputs.
    pub count: u32,
}
}

/// Operations of `shaders/tests/functions.wgsl`.
pub mod functions {
    pub const PCG4D: u32 = 0;
    pub const RANDOM: u32 = 1;
    pub const OCTAHEDRAL: u32 = 2;
    pub const BASIS: u32 = 3;
    pub const WARPS: u32 = 4;
    pub const SRGB: u32 = 9;
    pub const TONE_MAP: u32 = 10;
    pub const MIS_WEIGHT: u32 = 11;
    pub const STREAM_OF_FOUR: u32 = 12;
    pub const STREAM_MERGED: u32 = 13;
    pub const POINTS: u32 = 14;
    pub const CLASSIFY: u32 = 15;
    pub const BITS_BELOW: u32 = 16;
    pub const UNWARPED: u32 = 17;
    pub const PACKED: u32 = 18;
}

/// Operations of `shaders/tests/scene_functions.wgsl`.
pub mod scene_functions {
    pub const TEXTURE_READ: u32 = 0;
    pub const LIGHT_SAMPLE: u32 = 1;
    pub const LIGHT_CONTRIBUTION: u32 = 2;
    pub const LIGHT_PDFS: u32 = 3;
    pub const ENVIRONMENT: u32 = 4;
    pub const ENVIRONMENT_SAMPLE: u32 = 5;
    pub const CAMERA: u32 = 6;
    pub const SHADING_NORMAL: u32 = 8;
    pub const SHADOW_RAY: u32 = 9;
    pub const FOOTPRINT: u32 = 20;
    pub const PYRAMID_SAMPLE: u32 = 10;
}

impl TestInput {
    /// Up to four arguments; the rest is zero.
    pub fn new(arguments: &[[u32; 4]]) -> Self {
        let get = |i| arguments.get(i).copied().unwrap_or_default();
        TestInput { a: get(0), b: get(1), c: get(2), d: get(3) }
    }

    /// The same from floats.
    pub fn floats(arguments: &[[f32; 4]]) -> Self {
        Self::new(&arguments.iter().map(|v| v.map(f32::to_bits)).collect::<Vec<_>>())
    }
}

impl TestOutput {
    /// The first result as floats.
    pub fn a(&self) -> [f32; 4] {
        self.a.map(f32::from_bits)
    }

    /// The second result as floats.
    pub fn b(&self) -> [f32; 4] {
        self.b.map(f32::from_bits)
    }
}

/// Picture size that the camera of [`eval_gpu`] has.
pub const SIZE: [u32; 2] = [64, 48];

/// Runs `operation` of a test kernel on every input, in a scene if the kernel reads one.
pub fn eval_gpu(
    gpu: &Gpu,
    shader: &'static Shader,
    scene: Option<&FlatScene>,
    operation: u32,
    inputs: &[TestInput],
) -> Vec<TestOutput> {
    let run = TestRun { operation, count: inputs.len() as u32 };
    let uniform = gpu.uniform("test run", size_of::<TestRun>() as u64);
    gpu.queue.write_buffer(&uniform, 0, bytemuck::bytes_of(&run));
    let input = gpu.storage_of("test inputs", inputs).expect("inputs fit");
    let size = (inputs.len() * size_of::<TestOutput>()) as u64;
    let output = gpu.storage("test outputs", size).expect("outputs fit");
    let by_pyramid = operation == scene_functions::PYRAMID_SAMPLE;
    let gpu_scene = scene.map(|scene| {
        let mut gpu_scene = GpuScene::new(gpu, scene).expect("the scene fits");
        gpu_scene.sample_by_pyramid(gpu, by_pyramid);
        gpu_scene
    });
    let frame_uniform = gpu.uniform("frame", size_of::<frame::Frame>() as u64);
    if let (Some(scene), Some(gpu_scene)) = (scene, &gpu_scene) {
        // On the device the root lies elsewhere than in the scene.
        let frame = frame::Frame { top_level: gpu_scene.top_level(), ..frame_of(scene, &scene.cameras[0]) };
        gpu.queue.write_buffer(&frame_uniform, 0, bytemuck::bytes_of(&frame));
    }

    let mut recorder = Recorder::new(gpu, None);
    if let Some(gpu_scene) = &gpu_scene {
        gpu_scene.share(&mut recorder);
        recorder.share("frame", &frame_uniform);
        gpu_scene.record(&mut recorder).expect("everything is bound");
    }
    recorder
        .pass(shader)
        .bind("test_run", &uniform)
        .bind("test_inputs", &input)
        .bind("test_outputs", &output)
        .dispatch([run.count.div_ceil(shader.workgroup_size[0]), 1, 1])
        .expect("everything is bound");
    recorder.submit();
    let bytes = pollster::block_on(gpu.read_buffer(&output, size)).expect("no device error");
    bytemuck::pod_collect_to_vec(&bytes)
}

/// The first frame of a scene without a top level.
pub fn frame_of(scene: &FlatScene, camera: &Camera) -> frame::Frame {
    let camera = frame::camera_view(camera, SIZE.into());
    frame::Frame {
        camera,
        previous_camera: camera,
        size: SIZE.into(),
        max_depth: 1,
        light_count: scene.lights.len() as u32,
        environment_light: environment_light(scene),
        sun_light: sun_light(scene),
        environment_turn: glam::Vec2::X,
        previous_environment_turn: glam::Vec2::X,
        scene_radius: 1.0,
        ..bytemuck::Zeroable::zeroed()
    }
}
