// For passes that reuse: what they start from, which they may leave as it is.
#include "techniques/restir-report/store.wgsl"

@group(1) @binding(4) var<storage, read> reservoirs: array<ReportReservoir>;

fn keep(pixel: vec2u, reason: u32) {
    for (var strategy = 0u; strategy < STRATEGY_COUNT; strategy += 1u) {
        store_reservoir(pixel, strategy, reservoirs[reservoir_index(pixel, strategy)], reason);
    }
}
