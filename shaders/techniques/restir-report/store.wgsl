// Where a pass leaves a pixel's reservoirs.
#include "techniques/restir-report/reservoir.wgsl"

@group(1) @binding(6) var<storage, read_write> reservoirs_out: array<ReportReservoir>;

fn store_reservoir(pixel: vec2u, strategy: u32, reservoir: ReportReservoir, reason: u32) {
    reservoirs_out[reservoir_index(pixel, strategy)] = reservoir;
    observe_result(strategy, common_reservoir(reservoir), reason);
}
