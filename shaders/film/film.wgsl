// What the film's passes share.

struct FilmUniforms {
    size: vec2u,
    tone_map: u32,
    automatic_exposure: u32,
    exposure: f32, // EV, added to the automatic one
    raw: u32, // 1: show values as they are, for debug views
    padding_0: u32,
    padding_1: u32,
}

@group(1) @binding(0) var<uniform> film: FilmUniforms;
