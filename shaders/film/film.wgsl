// What the film's passes share.

struct FilmUniforms {
    size: vec2u,
    tone_map: u32,
    automatic_exposure: u32,
    exposure: f32, // EV, added to the automatic one
    scale: u32, // what becomes of values, SCALE_...
    view: u32, // of the common ones, VIEW_...; 0 for the picture and a technique's own
    low: f32, // the number that gets the first colour
    high: f32, // the number that gets the last colour
    padding_0: u32,
    padding_1: u32,
    padding_2: u32,
    colors: array<vec4f, COLOR_STEPS>, // sRGB, for numbers
}

const COLOR_STEPS = 17u;

// As src/film/mod.rs numbers them.
const SCALE_RADIANCE = 0u;
const SCALE_COLORS = 1u;
const SCALE_NUMBER = 2u;
const SCALE_MAGNITUDE = 3u;

// As src/view.rs lists them.
const VIEW_ALBEDO = 1u;
const VIEW_NORMAL = 2u;
const VIEW_DEPTH = 3u;
const VIEW_MOTION = 4u;
const VIEW_RAYS = 5u;
const VIEW_BVH_STEPS = 6u;
const VIEW_NOT_FINITE = 7u;
const VIEW_REJECTED_NEIGHBOURS = 8u; // of techniques that have any

@group(1) @binding(0) var<uniform> film: FilmUniforms;
