// The pixel inspector's notes. A pass of it is one invocation that runs the code of another pass once more for one pixel, with
// the same random numbers, and writes down what it sees there: candidates, domains that are joined, the reservoir that comes out.
// That code calls `observe_...` where there is something to see; in the pass itself these do nothing (unobserved.wgsl). The
// including pass begins with `observe_begin`, and says by `observe_result` what it notes of a reservoir that is done, and by
// `observed_value` how the technique values a sample.
#include "scene/trace.wgsl"
#include "scene/visibility_buffer.wgsl"
#include "techniques/common/resampling.wgsl"
#include "techniques/common/observations.wgsl"

var<private> observed_surface: Surface;
var<private> observed_stage: u32;
// Of the domains of a combination.
var<private> observed_pixels: array<vec2u, 17>;

// Whether the inspected pixel shows a surface; without one there is nothing to note.
fn observe_begin(stage: u32) -> bool {
    observed_stage = stage;
    if any(inspected.pixel >= frame.size) || !pixel_has_surface(inspected.pixel) {
        return false;
    }
    observed_surface = load_pixel(inspected.pixel);
    return true;
}

// Notes that candidates leave room for: what became of them matters more than any one of them.
const RESERVED_NOTES = 512u;

fn observe(given: Observation) {
    let room = inspected.capacity - select(0u, RESERVED_NOTES, given.kind == OBSERVATION_CANDIDATE);
    let at = trace.head.count;
    if at >= room {
        trace.head.dropped += 1u;
        return;
    }
    trace.head.count += 1u;
    var note = given;
    note.stage = observed_stage;
    if note.light != NONE {
        let valued = observed_value(LightSample(note.light, note.point));
        note.direction = valued.direction;
        note.distance = valued.distance;
        note.target_value = valued.target_value;
    }
    trace.observations[at] = note;
}

fn observation(kind: u32, slot: u32, sample: LightSample) -> Observation {
    var note = Observation();
    note.kind = kind;
    note.slot = slot;
    note.light = sample.light;
    note.point = sample.point;
    note.pixel = vec2u(NONE);
    return note;
}

fn observe_candidate(slot: u32, sample: LightSample, weight: f32) {
    var note = observation(OBSERVATION_CANDIDATE, slot, sample);
    note.resampling_weight = weight;
    observe(note);
}

fn observe_domain(domain: u32, pixel: vec2u) {
    observed_pixels[domain] = pixel;
}

// A reservoir that joins with the MIS weight m and the resampling weight w.
fn observe_joined(slot: u32, pixel: vec2u, reservoir: Reservoir, mis_weight: f32, resampling_weight: f32) {
    var note = observation(OBSERVATION_DOMAIN, slot, reservoir_sample(reservoir));
    note.pixel = pixel;
    note.unbiased_contribution_weight = reservoir.unbiased_contribution_weight;
    note.confidence_weight = reservoir.confidence_weight;
    note.mis_weight = mis_weight;
    note.resampling_weight = resampling_weight;
    observe(note);
}

fn observe_rejected(pixel: vec2u) {
    var note = observation(OBSERVATION_REJECTED, 0u, LightSample(NONE, 0u));
    note.pixel = pixel;
    observe(note);
}

fn observe_reservoir(slot: u32, reservoir: Reservoir, reason: u32) {
    var note = observation(OBSERVATION_RESULT, slot, reservoir_sample(reservoir));
    note.unbiased_contribution_weight = reservoir.unbiased_contribution_weight;
    note.confidence_weight = reservoir.confidence_weight;
    note.reason = reason;
    let valued = observed_value(reservoir_sample(reservoir));
    note.is_visible = u32(valued.target_value > 0.0 && sample_is_visible(observed_surface, valued, false));
    observe(note);
}
