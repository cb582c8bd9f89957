// The settings of restir-report, declared in src/techniques/restir_report.rs.

struct RestirReportParams {
    configuration: u32,
    resample_count: u32,
    history_cap: f32,
    spatial_radius: f32,
    fault_sample_count: u32,
    fault_target_not_reevaluated: u32,
    fault_count_weights: u32,
    fault_no_reprojection: u32,
    fault_no_similarity: u32,
    fault_unguarded_pdf: u32,
    indirect: u32,
}

// Configurations of the report, section 5.3. Which passes each runs is decided in Rust.
const CONFIGURATION_A_NAIVE = 0u;
const CONFIGURATION_B_RIS = 1u;
const CONFIGURATION_C_TEMPORAL = 2u;
const CONFIGURATION_D_SPATIAL = 3u;
const CONFIGURATION_E_BOTH = 4u;

@group(1) @binding(3) var<uniform> params: RestirReportParams;

// Proposals that each strategy makes for a pixel: RESAMPLE_COUNT, and one without resampling.
fn proposal_count() -> u32 {
    return select(params.resample_count, 1u, params.configuration == CONFIGURATION_A_NAIVE);
}
