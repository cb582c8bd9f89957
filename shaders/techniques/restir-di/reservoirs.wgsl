// The reservoir buffers of restir-di: where a pixel's reservoirs lie in them, and in which words. Their size is that of
// `reservoir_words` in src/techniques/restir_di.rs.
#include "lib/reservoir.wgsl"
#include "scene/bindings.wgsl"
#include "techniques/restir-di/params.wgsl"

// Whether a reservoir is packed into three words instead of four, fixed when a pipeline is made.
override reservoirs_packed: bool = false;

// Read by fours, so that a reservoir in f32 is one load; written word by word, for a packed one shares its vectors with those
// of other pixels.
@group(1) @binding(4) var<storage, read> reservoirs: array<vec4u>;
@group(1) @binding(5) var<storage, read> reservoirs_previous: array<vec4u>;
@group(1) @binding(6) var<storage, read_write> reservoirs_out: array<u32>;

// Sides of tiles by `pixel_order`: rows are tiles of side 1.
const PIXEL_ORDER_ROWS = 0u;
const PIXEL_ORDER_COLUMNS = 1u;
const PIXEL_ORDER_TILES_2 = 2u;
const PIXEL_ORDER_TILES_4 = 3u;
const PIXEL_ORDER_TILES_8 = 4u;
const PIXEL_ORDER_TILES_16 = 5u;
const PIXEL_ORDER_TILES_40 = 6u;

// The place of a pixel among all; tiles that the picture's edge cuts are kept whole (thesis 000, table 2).
fn pixel_place(pixel: vec2u) -> u32 {
    if params.pixel_order == PIXEL_ORDER_ROWS {
        return pixel.y * frame.size.x + pixel.x;
    }
    if params.pixel_order == PIXEL_ORDER_COLUMNS {
        return pixel.x * frame.size.y + pixel.y;
    }
    let side = select(1u << (params.pixel_order - 1u), 40u, params.pixel_order == PIXEL_ORDER_TILES_40);
    let tile = pixel / side;
    let within = pixel - tile * side;
    let tiles_in_row = (frame.size.x + side - 1u) / side;
    return (tile.y * tiles_in_row + tile.x) * side * side + within.y * side + within.x;
}

// The number of a pixel's reservoir of a slot.
fn reservoir_place(pixel: vec2u, slot: u32) -> u32 {
    return pixel_place(pixel) * slot_count() + slot;
}

fn load_reservoir(pixel: vec2u, slot: u32) -> Reservoir {
    let place = reservoir_place(pixel, slot);
    if reservoirs_packed {
        let at = 3u * place + vec3u(0u, 1u, 2u);
        let vector = at / 4u;
        return unpack_reservoir(vec3u(reservoirs[vector.x][at.x & 3u], reservoirs[vector.y][at.y & 3u],
            reservoirs[vector.z][at.z & 3u]));
    }
    return reservoir_of_words(reservoirs[place]);
}

fn load_previous_reservoir(pixel: vec2u, slot: u32) -> Reservoir {
    let place = reservoir_place(pixel, slot);
    if reservoirs_packed {
        let at = 3u * place + vec3u(0u, 1u, 2u);
        let vector = at / 4u;
        return unpack_reservoir(vec3u(reservoirs_previous[vector.x][at.x & 3u], reservoirs_previous[vector.y][at.y & 3u],
            reservoirs_previous[vector.z][at.z & 3u]));
    }
    return reservoir_of_words(reservoirs_previous[place]);
}

fn reservoir_of_words(words: vec4u) -> Reservoir {
    return Reservoir(words.x, words.y, bitcast<f32>(words.z), bitcast<f32>(words.w));
}

fn store_reservoir(pixel: vec2u, slot: u32, reservoir: Reservoir) {
    let at = reservoir_place(pixel, slot) * select(4u, 3u, reservoirs_packed);
    reservoirs_out[at] = reservoir.light;
    reservoirs_out[at + 1u] = reservoir.point;
    if reservoirs_packed {
        reservoirs_out[at + 2u] = pack_weights(reservoir);
    } else {
        reservoirs_out[at + 2u] = bitcast<u32>(reservoir.unbiased_contribution_weight);
        reservoirs_out[at + 3u] = bitcast<u32>(reservoir.confidence_weight);
    }
}

// What is passed on as it is. A packed reservoir comes back from packing again as it was.
fn keep_reservoir(pixel: vec2u, slot: u32) -> Reservoir {
    let reservoir = load_reservoir(pixel, slot);
    store_reservoir(pixel, slot, reservoir);
    return reservoir;
}
