// The switches of restir-di, declared in src/techniques/restir_di.rs.

struct RestirDiParams {
    light_samples: u32,
    visibility_reuse: u32,
    temporal_reuse: u32,
    history_cap: f32,
    temporal_position_threshold: f32,
    temporal_normal_threshold: f32,
    temporal_albedo_threshold: f32,
    spatial_reuse: u32,
    spatial_iterations: u32,
    spatial_neighbors: u32,
    spatial_radius: f32,
    spatial_depth_threshold: f32,
    spatial_normal_threshold: f32,
    spatial_confidence_limit: f32,
    spatial_feedback: u32,
    reservoir_size: u32,
    reuse_weights: u32,
    visibility_in_weights: u32,
    indirect: u32,
}

const MAXIMUM_RESERVOIR_SIZE = 4u;

@group(1) @binding(3) var<uniform> params: RestirDiParams;

// Where a pixel's reservoir of a slot lies in a reservoir buffer.
fn reservoir_index(pixel: vec2u, slot: u32) -> u32 {
    return (pixel.y * frame.size.x + pixel.x) * slot_count() + slot;
}

fn slot_count() -> u32 {
    return select(1u, MAXIMUM_RESERVOIR_SIZE, params.reservoir_size == 1u);
}
