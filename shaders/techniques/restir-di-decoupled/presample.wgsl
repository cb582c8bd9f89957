// Light tiles: subsets of lights that are drawn once a frame, for all pixels to choose from.
// One invocation: one light of one subset. Reads the light table. Writes the presampled light and its density.
// Source: Wyman and Panteleev 2021, section 5.2 (the algorithm's first loop) and section 5.3 (kinds of light mixed).
#include "scene/light_tiles.wgsl"
#include "techniques/restir-di-decoupled/params.wgsl"

@group(1) @binding(4) var<storage, read_write> tile_lights_out: array<TileLight>;
@group(1) @binding(5) var<storage, read_write> tile_inverse_pdfs_out: array<f32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= params.tile_lights || frame.light_count == 0u {
        return;
    }
    var rng = rng_new(id.xy, frame.index, frame.seed, STREAM_LIGHT_TILES);
    let sample = presample_light(&rng);
    let pdf = presample_pdf(sample);
    // Zero, so never selected, where the density is none.
    let inverse_pdf = select(0.0, 1.0 / pdf, pdf > 0.0);
    let index = id.y * params.tile_lights + id.x;
    tile_lights_out[index] = resolve_light(sample, inverse_pdf).packed;
    tile_inverse_pdfs_out[index] = inverse_pdf;
}
