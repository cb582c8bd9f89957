// A pixel's candidate and the two pixels of the previous frame that it will meet: the code of restir-di-decoupled/select and of
// its inspection.
#include "techniques/common/reprojection.wgsl"
#include "techniques/restir-di-decoupled/params.wgsl"
#include "techniques/restir-di-decoupled/target.wgsl"
#include "techniques/restir-di-decoupled/tiles.wgsl"
#include "techniques/restir-di-decoupled/similar.wgsl"

@group(1) @binding(4) var<storage, read> tile_lights: array<TileLight>;
@group(1) @binding(5) var<storage, read> tile_inverse_pdfs: array<f32>;
@group(1) @binding(7) var<storage, read> domains_previous: array<DomainRecord>;

// Resampled importance sampling of M lights, uniform in the tile's subset (Eq. 5, 10 and 13).
fn select_candidate(pixel: vec2u, surface: Surface, selection: ptr<function, Selection>) {
    var tile = tile_begin(pixel);
    var rng = rng_new(pixel, frame.index, frame.seed, STREAM_INITIAL);
    var weight_sum = 0.0;
    var selected_weight = 0.0;
    var selected = 0u;
    var words = vec4f(0.0);
    let domain = domain_of(surface);
    for (var i = 0u; i < params.candidates; i += 1u) {
        if i % 4u == 0u {
            words = random_4(&rng);
        }
        let index = tile_next(&tile, i);
        let light = tile_lights[index];
        let incidence = tile_incidence(light, surface.position);
        var weight = 0.0;
        if incidence.value > 0.0 {
            // p-hat / q, for both are in `value`.
            weight = incidence.value * pixel_scatter(surface, domain, incidence.direction, incidence.distance);
        }
        observe_candidate(0u, tile_light_sample(light), weight / f32(params.candidates));
        weight_sum += weight;
        if words.x * weight_sum < weight {
            selected = index;
            selected_weight = weight;
        }
        words = words.yzww;
    }
    if selected_weight <= 0.0 {
        return;
    }
    let sample = tile_light_sample(tile_lights[selected]);
    // W = (1 / M) sum w / p-hat(y), with p-hat(y) = w_y q(y).
    let weight = weight_sum / (f32(params.candidates) * selected_weight) * tile_inverse_pdfs[selected];
    if is_nan(weight) || is_infinite(weight) {
        return;
    }
    (*selection).light = sample.light;
    (*selection).point = sample.point;
    (*selection).unbiased_contribution_weight = weight;
}

// The pixel of the same point, and one near it; where the point was not seen (a disocclusion), two near it, for there
// more samples matter most (section 6.4).
fn select_domains(pixel: vec2u, surface: Surface, selection: ptr<function, Selection>) {
    if frame.history == 0u {
        return;
    }
    let position = previous_position(pixel);
    let film = project(frame.previous_camera, position);
    let is_seen = is_on_film(film);
    // What comes into the picture has neighbours at its edge.
    let center = vec2u(clamp(film, vec2f(0.0), vec2f(frame.size) - 1.0));
    let depth = previous_depth(position);
    var rng = rng_new(pixel, frame.index, frame.seed, STREAM_TEMPORAL);
    // One loop, for each call is inlined: first the same point, then those near it.
    var temporal = NONE;
    var spatiotemporal = NONE;
    let tries = select(0u, params.spatiotemporal_tries, params.spatiotemporal_reuse == 1u);
    for (var i = 0u; i < 1u + 2u * tries; i += 1u) {
        if i == 0u && (params.temporal_reuse == 0u || !is_seen) {
            continue;
        }
        // The second half is for filling a disocclusion.
        if i > tries && (temporal != NONE || params.temporal_reuse == 0u || params.fill_disocclusions == 0u) {
            break;
        }
        if i > 0u && i <= tries && spatiotemporal != NONE {
            continue;
        }
        var offset = vec2f(0.0);
        if i > 0u {
            offset = sample_disk(random_2(&rng)) * params.spatiotemporal_radius;
        }
        let place = floor(vec2f(center) + 0.5 + offset);
        if !is_on_film(place) {
            continue;
        }
        let candidate = vec2u(place);
        if i > 0u && is_seen && all(candidate == center) {
            continue;
        }
        if spatiotemporal != NONE && all(candidate == domain_pixel(spatiotemporal)) {
            continue;
        }
        if !is_similar(surface, depth, domains_previous[pixel_index(candidate)]) {
            observe_rejected(candidate);
            continue;
        }
        let domain = pack_domain(candidate, i == 0u || length(offset) < params.visibility_reuse_radius);
        if i > 0u && i <= tries {
            spatiotemporal = domain;
        } else {
            temporal = domain;
        }
    }
    (*selection).temporal = temporal;
    (*selection).spatiotemporal = spatiotemporal;
}

fn select_samples(pixel: vec2u) -> Selection {
    var selection = Selection(NONE, 0u, 0.0, NONE, NONE, 0u);
    if pixel_has_surface(pixel) && frame.light_count > 0u {
        let surface = load_pixel(pixel);
        select_candidate(pixel, surface, &selection);
        select_domains(pixel, surface, &selection);
    }
    return selection;
}
