// Group 0: the scene, the cameras and the frame. Every struct here has a Rust twin of the same name
// (src/scene/gpu_types.rs, src/frame.rs) and a test compares their layouts.
#include "lib/math.wgsl"

struct CameraView {
    world_to_clip: mat4x4f,
    position: vec3f,
    orthographic: u32,
    right: vec3f, // half the picture's width
    padding_0: f32,
    up: vec3f, // half the picture's height
    padding_1: f32,
    forward: vec3f,
    padding_2: f32,
}

struct Frame {
    camera: CameraView,
    previous_camera: CameraView,
    size: vec2u, // pixels
    index: u32, // frames since the last reset
    seed: u32,
    max_depth: u32, // scattering events: 1 is direct light only
    mis_heuristic: u32, // MIS_BALANCE or MIS_POWER
    roulette_start: u32, // scattering events before Russian roulette
    roulette_minimum: f32, // q_min
    roulette_threshold: f32, // T_threshold
    light_count: u32,
    environment_light: u32, // index of the environment in `lights`, or NONE
    view: u32, // the technique's debug view; 0 is radiance
    scene_radius: f32, // metres
    history: u32, // 1 if the previous frame's buffers may be read
    pixel_filter: u32, // PIXEL_FILTER_BOX or PIXEL_FILTER_CENTER
    top_level: u32, // root of the top-level BVH in `nodes`
    environment_turn: vec2f, // cosine and sine of the turn of environment and sun about +Y
    previous_environment_turn: vec2f, // the same in the previous frame
    sun_light: u32, // index of the sun in `lights`, or NONE
    texture_levels: u32, // TEXTURE_LEVELS_CONE or TEXTURE_LEVELS_FINEST
    previous_top_level: u32, // root of the previous frame's top level
    instance_count: u32, // the twins of instances, as they were in the previous frame, come after as many
}

// Four children with boxes of 8 bits a plane; see src/scene/bvh/wide.rs.
struct WideNode {
    grid: vec4u,
    planes_0: vec4u,
    planes_1: vec4u,
    children: vec4u,
}

struct Triangle {
    p0: vec3f,
    flags: u32,
    p1: vec3f,
    material: u32,
    p2: vec3f,
    light: u32,
}

struct TriangleAttributes {
    uv_a: vec4f,
    uv_b: vec4f,
    uv_c: vec4f,
    normals: vec3u,
    tangents_01: u32,
    colors: vec3u,
    tangent_2: u32,
}

struct Instance {
    to_object: array<vec4f, 3>,
    to_world: array<vec4f, 3>,
    root: u32,
    first_light: u32,
    previous_triangles: u32,
    padding: u32,
}

// Packed as src/scene/gpu_types.rs says; unpacked in scene/texture.wgsl.
struct TextureSlot {
    row_u: vec3f,
    place: u32,
    row_v: vec3f,
    size: u32,
}

struct Material {
    base_color: vec4f,
    emissive: vec3f,
    metallic: f32,
    roughness: f32,
    normal_scale: f32,
    alpha_cutoff: f32,
    double_sided: u32,
    base_color_texture: TextureSlot,
    metallic_roughness_texture: TextureSlot,
    normal_texture: TextureSlot,
    emissive_texture: TextureSlot,
}

struct Light {
    position: vec3f,
    kind: u32,
    direction: vec3f,
    range: f32,
    intensity: vec3f, // of an emissive triangle factors on its emission: x in this frame, y in the previous one
    cos_outer: f32,
    cos_inner: f32,
    pmf: f32, // p(light)
    alias_threshold: f32,
    alias_light: u32,
    triangle: u32,
    instance: u32,
    previous: u32, // this light as it was in the previous frame
    cumulative: u32, // where its part of all words begins: a word that falls there chooses it
}

// What the scene has, fixed when a pipeline is made (src/gpu_scene.rs), so that no kernel carries code that its scene
// never runs. A software adapter executes both sides of a branch: there this is a factor of three.
override scene_has_textures: bool = true;
override scene_has_textures_1: bool = true;
override scene_has_textures_2: bool = true;
override scene_has_textures_3: bool = true;
override scene_has_alpha_masks: bool = true;
override scene_has_environment: bool = true;
override scene_has_sun: bool = true;
// Primitives other than triangles.
override scene_has_shapes: bool = true;
override scene_has_punctual_lights: bool = true;
// Emissive triangles that change their power.
override scene_has_dimmed_emitters: bool = true;
// How texels of the environment are drawn: by the pyramid of weights, or by the alias table.
override scene_has_environment_pyramid: bool = true;
// More than one instance: else there is one, that of what never moves, in world space.
override scene_has_instances: bool = true;
// Anything that is not where it was in the previous frame, or not as bright: else that frame's scene is this one's.
override scene_has_motion: bool = true;
// More triangles than one storage binding holds.
override scene_has_many_triangles: bool = true;
// More records than one row of a data texture holds (scene/data.wgsl).
override scene_has_data_rows: bool = true;

// No feature of a scene: kernels for an adapter that computes on the CPU. Nodes and triangles then lie in textures
// (src/gpu_scene/walked.rs), and code is left out that only GPUs gain by (docs/performance.md).
override is_software: bool = false;

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> nodes: array<WideNode>;
@group(0) @binding(2) var<storage, read> triangles: array<Triangle>;
@group(0) @binding(3) var<storage, read> triangles_rest: array<Triangle>;
@group(0) @binding(4) var<storage, read> lights: array<Light>;
@group(0) @binding(5) var attributes: texture_2d<u32>;
@group(0) @binding(6) var materials: texture_2d<u32>;
@group(0) @binding(7) var instances: texture_2d<u32>;
@group(0) @binding(8) var environment_radiance: texture_2d<f32>;
@group(0) @binding(9) var environment_alias: texture_2d<u32>;
@group(0) @binding(10) var textures_0: texture_2d_array<f32>;
@group(0) @binding(11) var textures_1: texture_2d_array<f32>;
@group(0) @binding(12) var textures_2: texture_2d_array<f32>;
@group(0) @binding(13) var textures_3: texture_2d_array<f32>;
@group(0) @binding(14) var node_texels: texture_2d<u32>;
@group(0) @binding(15) var triangle_texels: texture_2d<u32>;
@group(0) @binding(16) var environment_pyramid: texture_2d<f32>;
