// For passes that nobody looks on: what common/observed.wgsl writes down is passed over here.
#include "lib/reservoir.wgsl"
#include "scene/counters.wgsl"
#include "techniques/common/observations.wgsl"

fn observe_candidate(slot: u32, sample: LightSample, weight: f32) {}
fn observe_joined(slot: u32, pixel: vec2u, reservoir: Reservoir, mis_weight: f32, resampling_weight: f32) {}
fn observe_domain(domain: u32, pixel: vec2u) {}
fn observe_rejected(pixel: vec2u) {
    count_rejected();
}
fn observe_result(slot: u32, reservoir: Reservoir, reason: u32) {}
