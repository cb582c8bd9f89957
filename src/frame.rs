//! The uniform that every pass reads: cameras, picture size, frame counters and light counts.

use crate::gpu_struct;
use crate::scene::gpu_types::CameraView;
use crate::scene::{Camera, Projection};
use glam::{Mat4, UVec2, Vec2, Vec3};

gpu_struct! {
/// One frame, as `shaders/scene/bindings.wgsl` declares it.
pub struct Frame {
    /// This frame's camera.
    pub camera: CameraView,
    /// The previous frame's camera.
    pub previous_camera: CameraView,
    /// Picture size in pixels.
    pub size: UVec2,
    /// Frames since the last reset.
    pub index: u32,
    /// Seed of all random numbers.
    pub seed: u32,
    /// Longest path in scattering events.
    pub max_depth: u32,
    /// 0 balance, 1 power.
    pub mis_heuristic: u32,
    /// Scattering events before Russian roulette.
    pub roulette_start: u32,
    /// q_min.
    pub roulette_minimum: f32,
    /// T_threshold.
    pub roulette_threshold: f32,
    /// Number of lights.
    pub light_count: u32,
    /// Index of the environment among the lights, or `NONE`.
    pub environment_light: u32,
    /// The technique's debug view; 0 is radiance.
    pub view: u32,
    /// Radius of the scene's bounding sphere in metres.
    pub scene_radius: f32,
    /// 1 if the previous frame's buffers may be read.
    pub history: u32,
    /// 0 box, 1 centre.
    pub pixel_filter: u32,
    /// Root of the top-level BVH in `nodes`.
    pub top_level: u32,
    /// Cosine and sine of the turn of environment and sun about +Y.
    pub environment_turn: Vec2,
    /// The same in the previous frame.
    pub previous_environment_turn: Vec2,
    /// Index of the sun among the lights, or `NONE`.
    pub sun_light: u32,
    /// 0 by ray cones, 1 always the finest.
    pub texture_levels: u32,
    /// The same of the previous frame.
    pub previous_top_level: u32,
    /// Instances of the scene; their twins come after as many.
    pub instance_count: u32,
}
}

/// A camera as the shaders need it, for a picture of `size` pixels.
pub fn camera_view(camera: &Camera, size: UVec2) -> CameraView {
    let aspect = size.x as f32 / size.y as f32;
    let right = camera.forward.cross(camera.up).normalize_or(Vec3::X);
    let up = right.cross(camera.forward).normalize_or(Vec3::Y);
    let (half_height, orthographic) = match camera.projection {
        Projection::Perspective { vertical_fov } => ((0.5 * vertical_fov).tan(), 0),
        Projection::Orthographic { half_height } => (half_height, 1),
    };
    let half_width = half_height * aspect;
    // Rows: x and y in units of the picture's half size; z is unused; w is depth (perspective) or 1.
    let row = |axis: Vec3, scale: f32| (axis / scale).extend(-camera.position.dot(axis) / scale);
    let w = if orthographic == 1 { glam::Vec4::W } else { camera.forward.extend(-camera.position.dot(camera.forward)) };
    let rows = Mat4::from_cols(row(right, half_width), row(up, half_height), row(camera.forward, 1.0), w);
    CameraView {
        world_to_clip: rows.transpose(),
        position: camera.position,
        orthographic,
        right: right * half_width,
        padding_0: 0.0,
        up: up * half_height,
        padding_1: 0.0,
        forward: camera.forward,
        padding_2: 0.0,
    }
}
