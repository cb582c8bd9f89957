// How a pixel joins its history: the code of restir-di/temporal and of its inspection.
#include "techniques/common/combine.wgsl"
#include "techniques/common/reprojection.wgsl"
#include "techniques/restir-di/reservoirs.wgsl"

// A pixel's partner in its 4 x 4 block, which the block's other diagonal mirrors it to; the blocks' corners are drawn anew
// each frame, so that no pixel takes the same history twice in a row. The same for all pixels: it looks at no sample.
fn permuted(pixel: vec2i) -> vec2i {
    let corner = vec2i(pcg4d(vec4u(frame.index, frame.seed, STREAM_TEMPORAL, 0u)).xy >> vec2u(30u));
    return ((pixel + corner) ^ vec2i(3)) - corner;
}

// The previous frame's pixel that saw this point, or (-1, -1) (thesis 000, section 4.2.3).
fn reproject(position: vec3f) -> vec2i {
    let film = project(frame.previous_camera, position);
    if !is_on_film(film) {
        return vec2i(-1);
    }
    let pixel = vec2i(film);
    if params.temporal_permutation == 0u {
        return pixel;
    }
    let other = permuted(pixel);
    let is_outside = any(other < vec2i(0)) || any(other >= vec2i(frame.size));
    return select(other, pixel, is_outside);
}

// Whether the surface, whose point was at `position`, is the one that was seen there.
fn is_same_surface(surface: Surface, position: vec3f, previous: Surface) -> bool {
    let distance = length(surface.position - frame.camera.position);
    let albedo_difference = abs(surface.bsdf.base_color - previous.bsdf.base_color);
    return length(position - previous.position) <= params.temporal_position_threshold * distance
        && dot(surface.basis.normal, previous.basis.normal) >= params.temporal_normal_threshold
        && max(albedo_difference.r, max(albedo_difference.g, albedo_difference.b)) <= params.temporal_albedo_threshold;
}

fn combine_slot(pixel: vec2u, previous_pixel: vec2u, slot: u32, surface: Surface, previous: Surface,
    rng: ptr<function, Rng>) {
    let current = load_reservoir(pixel, slot);
    var history = load_previous_reservoir(previous_pixel, slot);
    if history.light != NONE {
        history.unbiased_contribution_weight *= history_factor(history.light);
    }
    history.confidence_weight = min(history.confidence_weight, params.history_cap * current.confidence_weight);
    combination_begin();
    combination_offer(current);
    combination_offer(history);
    observe_domain(0u, pixel);
    observe_domain(1u, previous_pixel);
    // A loop rather than two calls, for each call is inlined.
    for (var j = 0u; j < combination_valuers(); j += 1u) {
        var domain = surface;
        if j == 1u {
            domain = previous;
        }
        combination_value(domain, j, j == 1u);
    }
    let combined = combination_finish(rng);
    store_reservoir(pixel, slot, combined);
    observe_result(slot, combined, REASON_NONE);
}

fn keep(pixel: vec2u, reason: u32) {
    for (var slot = 0u; slot < slot_count(); slot += 1u) {
        observe_result(slot, keep_reservoir(pixel, slot), reason);
    }
}

fn reuse_pixel(pixel: vec2u) {
    if frame.history == 0u || !pixel_has_surface(pixel) {
        keep(pixel, REASON_NO_HISTORY);
        return;
    }
    let surface = load_pixel(pixel);
    let position = previous_position(pixel);
    let reprojected = reproject(position);
    if reprojected.x < 0 {
        keep(pixel, REASON_OFF_FILM);
        return;
    }
    let previous_pixel = vec2u(reprojected);
    if !previous_pixel_has_surface(previous_pixel) {
        keep(pixel, REASON_NO_SURFACE);
        return;
    }
    let previous = load_previous_pixel(previous_pixel);
    if !reuse_everything && !is_same_surface(surface, position, previous) {
        keep(pixel, REASON_OTHER_SURFACE);
        return;
    }
    var rng = rng_new(pixel, frame.index, frame.seed, STREAM_TEMPORAL);
    for (var slot = 0u; slot < slot_count(); slot += 1u) {
        combine_slot(pixel, previous_pixel, slot, surface, previous, &rng);
    }
}
