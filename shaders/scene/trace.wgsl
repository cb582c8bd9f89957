// What the pixel inspector writes down: see techniques/common/observed.wgsl. Rust twins are in src/inspect.rs.
#include "scene/bindings.wgsl"

// One note. What a kind does not have is 0, or NONE.
struct Observation {
    direction: vec3f, // from the pixel's surface to the sample
    distance: f32, // to the sample
    kind: u32,
    stage: u32, // of the frame: 0 initial, 1 temporal, 2 and on spatial
    slot: u32,
    reason: u32, // of a result
    light: u32,
    point: u32,
    pixel: vec2u, // where a domain is
    unbiased_contribution_weight: f32, // W
    confidence_weight: f32, // c
    target_value: f32, // p-hat of the inspected pixel
    mis_weight: f32, // m
    resampling_weight: f32, // w
    is_visible: u32, // of a result: whether its sample is lit here
    padding_0: u32,
    padding_1: u32,
}

const OBSERVATION_CANDIDATE = 0u;
const OBSERVATION_DOMAIN = 1u;
const OBSERVATION_REJECTED = 2u;
const OBSERVATION_RESULT = 3u;

struct Inspected {
    pixel: vec2u,
    capacity: u32, // of notes
    padding_0: u32,
}

// What the pixel shows.
struct TraceHead {
    count: u32, // of notes
    instance: u32, // NONE where there is no surface
    triangle: u32,
    dropped: u32, // notes that there was no room for
    position: vec3f, // world space
    depth: f32, // along the view axis, metres
    normal: vec3f, // world space, shading
    metallic: f32,
    base_color: vec3f,
    alpha: f32, // roughness squared
    emission: vec3f, // towards the camera
    samples: f32, // in the film's pixel
    radiance: vec4f, // of this frame
    mean: vec4f, // of the film
}

struct Trace {
    head: TraceHead,
    observations: array<Observation>,
}

@group(1) @binding(13) var<uniform> inspected: Inspected;
@group(1) @binding(14) var<storage, read_write> trace: Trace;
