// Notes on reservoirs that join one after the other, each in words of its own (`observe_joined`), and on what comes out.
#include "techniques/common/observed.wgsl"

fn observe_result(slot: u32, reservoir: Reservoir, reason: u32) {
    observe_reservoir(slot, reservoir, reason);
}
