// Boiling filter: reservoirs whose estimate is far above those around it are emptied, so that a lucky sample does not stay
// for as long as it is remembered. Biased: what it throws away is light.
// One invocation: one pixel; a workgroup's pixels are compared. Reads the visibility buffer, the scene and
// reservoirs. Writes reservoirs.
// Source: ours, in the manner of production renderers.
#include "scene/visibility_buffer.wgsl"
#include "techniques/common/resampling.wgsl"
#include "techniques/restir-di/reservoirs.wgsl"

const GROUP_SIZE = 64u;

var<workgroup> estimates: array<f32, GROUP_SIZE>;

// What is held, up to visibility: p-hat W.
fn estimate(pixel: vec2u, reservoir: Reservoir) -> f32 {
    if reservoir.unbiased_contribution_weight <= 0.0 || !pixel_has_surface(pixel) {
        return 0.0;
    }
    return target_function(load_pixel(pixel), reservoir_sample(reservoir), false) * reservoir.unbiased_contribution_weight;
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local_index: u32) {
    let pixel = id.xy;
    let is_inside = all(pixel < frame.size);
    for (var slot = 0u; slot < slot_count(); slot += 1u) {
        var own = 0.0;
        if is_inside {
            own = estimate(pixel, load_reservoir(pixel, slot));
        }
        workgroupBarrier();
        estimates[local_index] = own;
        workgroupBarrier();
        var sum = 0.0;
        var count = 0.0;
        for (var i = 0u; i < GROUP_SIZE; i += 1u) {
            sum += estimates[i];
            count += f32(estimates[i] > 0.0);
        }
        // Ten times the mean at the strength 0, the mean itself at 1.
        let most = sum / max(count, 1.0) * (10.0 - 9.0 * params.boiling_filter);
        if is_inside {
            if own > most {
                store_reservoir(pixel, slot, reservoir_empty());
            } else {
                keep_reservoir(pixel, slot);
            }
        }
    }
}
