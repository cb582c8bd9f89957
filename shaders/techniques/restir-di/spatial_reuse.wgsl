// How a pixel joins its neighbours: the code of restir-di/spatial and of its inspection.
#include "scene/visibility_buffer.wgsl"
#include "techniques/common/combine.wgsl"
#include "techniques/restir-di/reservoirs.wgsl"

struct PassIndex {
    value: u32,
}

@group(1) @binding(7) var<uniform> pass_index: PassIndex;

fn view_depth(position: vec3f) -> f32 {
    return dot(position - frame.camera.position, frame.camera.forward);
}

// Whether a neighbour is like enough to help. It looks only at surfaces, never at samples, so it adds no bias.
fn is_similar(surface: Surface, neighbor: Surface) -> bool {
    if reuse_everything {
        return true;
    }
    let depth = view_depth(surface.position);
    let color = abs(surface.bsdf.base_color - neighbor.bsdf.base_color);
    let shine = max(abs(surface.bsdf.metallic - neighbor.bsdf.metallic), length(surface.bsdf.alpha - neighbor.bsdf.alpha));
    return abs(view_depth(neighbor.position) - depth) <= params.spatial_depth_threshold * abs(depth)
        && dot(surface.basis.normal, neighbor.basis.normal) >= params.spatial_normal_threshold
        && max(max(color.r, color.g), max(color.b, shine)) <= params.spatial_material_threshold;
}

// The i-th of a pixel's points of the unit square: independent, or those of the R2 sequence (Roberts 2018), turned by
// `start`.
fn neighbor_point(i: u32, start: vec2f, rng: ptr<function, Rng>) -> vec2f {
    if params.spatial_pattern == SPATIAL_PATTERN_LOW_DISCREPANCY {
        return fract(start + f32(i) * vec2f(0.7548776662, 0.5698402910));
    }
    return random_2(rng);
}

fn keep(pixel: vec2u, reason: u32) {
    for (var slot = 0u; slot < slot_count(); slot += 1u) {
        observe_result(slot, keep_reservoir(pixel, slot), reason);
    }
}

fn reuse_pixel(pixel: vec2u) {
    if !pixel_has_surface(pixel) {
        keep(pixel, REASON_NO_SURFACE);
        return;
    }
    // The pixel's own, however many neighbours earlier iterations have joined.
    let confidence_weight = load_previous_reservoir(pixel, 0u).confidence_weight;
    if confidence_weight >= params.spatial_confidence_limit {
        keep(pixel, REASON_CONFIDENT);
        return;
    }
    var rng = rng_new(pixel, frame.index, frame.seed, STREAM_SPATIAL + pass_index.value);

    // Domain 0 is the pixel itself, the others are those neighbours that are like enough.
    var domains: array<vec2u, MAXIMUM_DOMAINS>;
    var found = 0u;
    var wanted = params.spatial_neighbors;
    if confidence_weight <= 1.0 {
        wanted = max(wanted, params.disocclusion_neighbors);
    }
    var start = vec2f(0.0);
    if params.spatial_pattern == SPATIAL_PATTERN_LOW_DISCREPANCY {
        start = random_2(&rng);
    }
    // The pixel's surface is read in the loop, too: twice the code that reads one would be a fifth of what is compiled here.
    var surface: Surface;
    for (var i = 0u; i <= wanted * params.spatial_retries && found <= wanted; i += 1u) {
        var domain = pixel;
        if i > 0u {
            let offset = sample_disk(neighbor_point(i - 1u, start, &rng)) * params.spatial_radius;
            let candidate = vec2i(floor(vec2f(pixel) + 0.5 + offset));
            if any(candidate < vec2i(0)) || any(candidate >= vec2i(frame.size)) || all(candidate == vec2i(pixel)) {
                continue;
            }
            domain = vec2u(candidate);
            if !pixel_has_surface(domain) {
                observe_rejected(domain);
                continue;
            }
        }
        let seen = load_pixel(domain);
        if i == 0u {
            surface = seen;
        } else if !is_similar(surface, seen) {
            observe_rejected(domain);
            continue;
        }
        domains[found] = domain;
        observe_domain(found, domain);
        found += 1u;
    }

    for (var slot = 0u; slot < slot_count(); slot += 1u) {
        combination_begin();
        for (var j = 0u; j < found; j += 1u) {
            var reservoir = load_reservoir(domains[j], slot);
            if j > 0u {
                reservoir.confidence_weight = min(reservoir.confidence_weight, params.spatial_cap);
            }
            combination_offer(reservoir);
        }
        for (var j = 0u; j < combination_valuers(); j += 1u) {
            combination_value(load_pixel(domains[j]), j, false);
        }
        let combined = combination_finish(&rng);
        store_reservoir(pixel, slot, combined);
        observe_result(slot, combined, REASON_NONE);
    }
}
