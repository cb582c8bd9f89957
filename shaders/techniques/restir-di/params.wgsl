// The switches of restir-di, declared in src/techniques/restir_di.rs.

struct RestirDiParams {
    light_samples: u32,
    bsdf_samples: u32,
    light_choice: u32,
    stratified: u32,
    visibility_reuse: u32,
    temporal_reuse: u32,
    history_cap: f32,
    temporal_position_threshold: f32,
    temporal_normal_threshold: f32,
    temporal_albedo_threshold: f32,
    temporal_permutation: u32,
    boiling_filter: f32,
    spatial_reuse: u32,
    spatial_iterations: u32,
    spatial_neighbors: u32,
    disocclusion_neighbors: u32,
    spatial_retries: u32,
    spatial_pattern: u32,
    spatial_radius: f32,
    spatial_depth_threshold: f32,
    spatial_normal_threshold: f32,
    spatial_material_threshold: f32,
    spatial_cap: f32,
    spatial_confidence_limit: f32,
    spatial_feedback: u32,
    reservoir_size: u32,
    reservoir_format: u32,
    pixel_order: u32,
    reuse_weights: u32,
    visibility_in_weights: u32,
    indirect: u32,
}

const SPATIAL_PATTERN_RANDOM = 0u;
const SPATIAL_PATTERN_LOW_DISCREPANCY = 1u;

@group(1) @binding(3) var<uniform> params: RestirDiParams;

fn slot_count() -> u32 {
    return select(1u, 4u, params.reservoir_size == 1u);
}
