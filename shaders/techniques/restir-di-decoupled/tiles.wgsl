// Which presampled lights a pixel looks at: those of its tile's subset, one after another.
//
// Each is uniform in the subset, as the paper has it. But the start is drawn by the tile and each pixel takes the light as
// many places further on as it is pixels into the tile, so that neighbours read neighbouring lights: a row of memory, not
// scattered pieces.
// Source: Wyman and Panteleev 2021, section 5.2.
#include "scene/light_tiles.wgsl"
#include "techniques/restir-di-decoupled/params.wgsl"

struct Tile {
    rng: Rng,
    words: vec4u,
    first: u32, // of the subset in the tile lights
    place: u32, // of the pixel in the tile
}

// The width of a tile in pixels.
fn tile_width() -> u32 {
    return 1u << params.tile_size;
}

// A tile's subset, random in each frame.
fn tile_subset(pixel: vec2u) -> u32 {
    var rng = rng_new(pixel >> vec2u(params.tile_size), frame.index, frame.seed, STREAM_TILE_CHOICE);
    return bits_below(random_bits(&rng).x, params.tile_subsets);
}

fn tile_begin(pixel: vec2u) -> Tile {
    let within = pixel & vec2u(tile_width() - 1u);
    let rng = rng_new(pixel >> vec2u(params.tile_size), frame.index, frame.seed, STREAM_TILE_LIGHTS);
    return Tile(rng, vec4u(0u), tile_subset(pixel) * params.tile_lights,
        (within.y * tile_width() + within.x) % params.tile_lights);
}

// The index of the next light; calls count from 0.
fn tile_next(tile: ptr<function, Tile>, call: u32) -> u32 {
    if call % 4u == 0u {
        var rng = (*tile).rng;
        (*tile).words = random_bits(&rng);
        (*tile).rng = rng;
    }
    let words = (*tile).words;
    (*tile).words = words.yzww;
    // Subsets are smaller than 65536.
    var index = (((words.x >> 16u) * params.tile_lights) >> 16u) + (*tile).place;
    index -= select(0u, params.tile_lights, index >= params.tile_lights);
    return (*tile).first + index;
}
