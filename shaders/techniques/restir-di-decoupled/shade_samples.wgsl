// What a pixel makes of its three samples: the code of restir-di-decoupled/shade and of its inspection.
#include "techniques/common/reprojection.wgsl"
#include "techniques/restir-di-decoupled/params.wgsl"
#include "techniques/restir-di-decoupled/target.wgsl"
#include "techniques/restir-di-decoupled/tiles.wgsl"
#include "techniques/restir-di-decoupled/similar.wgsl"

@group(1) @binding(5) var<storage, read> selections: array<Selection>;
@group(1) @binding(6) var<storage, read> reservoirs_previous: array<DecoupledReservoir>;
@group(1) @binding(8) var<storage, read> domains_previous: array<DomainRecord>;

const VIEW_DIRECT = 1u;
const VIEW_INDIRECT = 2u;
const VIEW_CANDIDATE = 3u;
const VIEW_TEMPORAL = 4u;
const VIEW_SPATIOTEMPORAL = 5u;
const VIEW_CONFIDENCE_WEIGHT = 6u;
const VIEW_LIGHT = 7u;
const VIEW_SUBSET = 8u;
const VIEW_CONTRIBUTION_WEIGHT = 9u;
const VIEW_AGE = 10u;

// What a pixel shows of direct light, and hands on.
struct Shaded {
    direct: vec3f, // sum over i of m_i(x_i) f(x_i) V(x_i) W_i
    viewed: vec3f, // the term of the sample that a debug view asks for
    reservoir: DecoupledReservoir,
}

fn empty_reservoir() -> DecoupledReservoir {
    return DecoupledReservoir(NONE, 0u, 0.0, 0u);
}

// A reservoir of the previous frame, taken to this one: of a light that has grown, the density has shrunk; the sample of one
// that has been switched off is dropped.
fn history_reservoir(pixel: vec2u) -> DecoupledReservoir {
    var reservoir = reservoirs_previous[pixel_index(pixel)];
    if reservoir.light != NONE {
        reservoir.unbiased_contribution_weight *= history_factor(reservoir.light);
    }
    return reservoir;
}

// Whether shadowed samples are kept from being resampled.
fn feeds_visibility(i: u32) -> bool {
    if i == CANDIDATE {
        return params.visibility >= VISIBILITY_CANDIDATE;
    }
    return params.visibility == VISIBILITY_DISCARD || params.visibility == VISIBILITY_KEEP
        || params.visibility == VISIBILITY_MIS;
}

// One of the three samples of a pixel.
struct Sample {
    light: LightSample,
    unbiased_contribution_weight: f32, // W_i
    age: u32, // of what is known of its visibility
    is_visible: bool, // V_0(x_i), as far as is known
}

// Where sample i comes from: a pixel of the previous frame, or, of the candidate, none.
fn domain_of_sample(selection: Selection, i: u32) -> u32 {
    return select(selection.temporal, selection.spatiotemporal, i == SPATIOTEMPORAL);
}

fn sample_is_visible_here(selection: Selection, i: u32) -> bool {
    return params.visibility == VISIBILITY_NONE || (selection.visibility & visibility_bit(0u, i)) != 0u;
}

// c_i in frames; 0 where there is no domain, or where its history is thrown away with its shadowed sample.
fn domain_confidence(selection: Selection, i: u32) -> f32 {
    let domain = domain_of_sample(selection, i);
    if domain == NONE || (params.visibility == VISIBILITY_DISCARD && !sample_is_visible_here(selection, i)) {
        return 0.0;
    }
    let state = unpack_state(reservoirs_previous[pixel_index(domain_pixel(domain))].state);
    return min(state.confidence_weight, params.history_cap);
}

// A sample without weight is none, or shadowed and kept from being resampled.
fn gather_sample(selection: Selection, i: u32) -> Sample {
    let is_visible = sample_is_visible_here(selection, i);
    var sample = Sample(LightSample(selection.light, selection.point), selection.unbiased_contribution_weight, 0u, is_visible);
    if i != CANDIDATE {
        let reservoir = history_reservoir(domain_pixel(domain_of_sample(selection, i)));
        let was_traced = (selection.visibility & traced_bit(i)) != 0u;
        let age = select(unpack_state(reservoir.state).age + 1u, 0u, was_traced);
        sample = Sample(LightSample(reservoir.light, reservoir.point), reservoir.unbiased_contribution_weight, age, is_visible);
    }
    if feeds_visibility(i) && !is_visible {
        sample.unbiased_contribution_weight = 0.0;
    }
    return sample;
}

// p-hat_j(x) of a pixel of the previous frame, with the light as it was then.
fn domain_target(domain: Domain, light: ResolvedLight) -> f32 {
    let sample = tile_light_sample(light.packed);
    // The sky and the sun may turn where nothing else moves.
    let may_turn = (scene_has_environment || scene_has_sun) && lights[sample.light].kind >= LIGHT_ENVIRONMENT;
    if scene_has_motion || may_turn {
        let before = light_contribution(sample, domain.position, true);
        return luminance(before.value) * approximate_scatter(domain, before.direction);
    }
    let incidence = tile_incidence(light.packed, domain.position);
    return incidence.value * approximate_scatter(domain, incidence.direction);
}

// m_i(x_i), by what each domain makes of the sample: p-hat_0 is `own_target`.
fn mis_weight_of(i: u32, selection: Selection, confidences: vec3f, light: ResolvedLight, own_target: f32) -> f32 {
    if params.reuse_weights == REUSE_WEIGHT_HEURISTICS {
        return confidences[i] / (confidences.x + confidences.y + confidences.z);
    }
    var numerator = 0.0;
    var denominator = 0.0;
    for (var j = 0u; j < DOMAINS; j += 1u) {
        if confidences[j] <= 0.0 {
            continue;
        }
        var value = own_target;
        if j > 0u {
            let record = domains_previous[pixel_index(domain_pixel(domain_of_sample(selection, j)))];
            value = domain_target(unpack_domain_record(record, frame.previous_camera), light);
        }
        if params.visibility == VISIBILITY_MIS && (selection.visibility & visibility_bit(j, i)) == 0u {
            value = 0.0;
        }
        var share = confidences[j] * value;
        if params.reuse_weights == REUSE_WEIGHT_Z {
            share = select(0.0, confidences[j], value > 0.0);
        }
        denominator += share;
        if i == j {
            numerator = share;
        }
    }
    return numerator / max(denominator, 1e-37);
}

fn shade_samples(pixel: vec2u, surface: Surface, own: Domain, selection: Selection) -> Shaded {
    let confidences = vec3f(1.0, domain_confidence(selection, TEMPORAL), domain_confidence(selection, SPATIOTEMPORAL));
    var rng = rng_new(pixel, frame.index, frame.seed, STREAM_DECOUPLED);
    let u = random_4(&rng);
    var shaded: Shaded;
    var weight_sum = 0.0;
    var selected: Sample;
    var selected_target = 0.0;
    for (var i = 0u; i < DOMAINS; i += 1u) {
        if confidences[i] <= 0.0 {
            continue;
        }
        let sample = gather_sample(selection, i);
        let offered = Reservoir(sample.light.light, sample.light.point, sample.unbiased_contribution_weight, confidences[i]);
        var from_pixel = pixel;
        if i != CANDIDATE {
            from_pixel = domain_pixel(domain_of_sample(selection, i));
        }
        if sample.unbiased_contribution_weight <= 0.0 {
            observe_joined(0u, from_pixel, offered, 0.0, 0.0);
            continue;
        }
        let light = resolve_light(sample.light, 1.0);
        let incidence = tile_incidence(light.packed, own.position);
        // p-hat_0(x_i).
        let own_target = incidence.value * pixel_scatter(surface, own, incidence.direction, incidence.distance);
        if own_target <= 0.0 {
            observe_joined(0u, from_pixel, offered, 0.0, 0.0);
            continue;
        }
        let share = mis_weight_of(i, selection, confidences, light, own_target) * sample.unbiased_contribution_weight;
        let weight = share * own_target;
        observe_joined(0u, from_pixel, offered, share / sample.unbiased_contribution_weight, weight);
        weight_sum += weight;
        if u[i] * weight_sum < weight {
            selected = sample;
            selected_target = own_target;
        }
        if sample.is_visible {
            let incident = resolved_contribution(light, surface.position);
            let contribution = share * incident.value * direct_scatter(surface, incident.direction, incident.distance);
            shaded.direct += contribution;
            if frame.view == VIEW_CANDIDATE + i {
                shaded.viewed = contribution;
            }
        }
    }

    shaded.reservoir = empty_reservoir();
    var state = ReservoirState(confidences.x + confidences.y + confidences.z, false, 0u);
    if selected_target > 0.0 {
        let weight = weight_sum / selected_target;
        if !is_nan(weight) && !is_infinite(weight) {
            shaded.reservoir = DecoupledReservoir(selected.light.light, selected.light.point, weight, 0u);
            state.is_visible = selected.is_visible;
            state.age = selected.age;
        }
    }
    shaded.reservoir.state = pack_state(state);
    return shaded;
}

// A pixel that is left out of the checkerboard shows, and keeps, the sample of the same point in the previous frame. A
// point that was not seen then shows the candidate of the pixel beside it.
fn shade_left_out(pixel: vec2u, surface: Surface) -> Shaded {
    var shaded: Shaded;
    shaded.reservoir = empty_reservoir();
    var origin = CANDIDATE;
    var is_visible = false;
    if frame.history == 1u && params.temporal_reuse == 1u {
        let position = previous_position(pixel);
        let film = project(frame.previous_camera, position);
        if is_on_film(film) && is_similar(surface, previous_depth(position), domains_previous[pixel_index(vec2u(film))]) {
            origin = TEMPORAL;
            shaded.reservoir = history_reservoir(vec2u(film));
            var state = unpack_state(shaded.reservoir.state);
            state.age += 1u;
            is_visible = state.is_visible;
            shaded.reservoir.state = pack_state(state);
        }
    }
    var shown = shaded.reservoir;
    if origin == CANDIDATE {
        let beside = vec2u(select(pixel.x - 1u, pixel.x + 1u, pixel.x == 0u), pixel.y);
        if beside.x < frame.size.x {
            let selection = selections[pixel_index(beside)];
            shown = DecoupledReservoir(selection.light, selection.point, selection.unbiased_contribution_weight, 0u);
            is_visible = params.visibility == VISIBILITY_NONE
                || (selection.visibility & visibility_bit(0u, CANDIDATE)) != 0u;
        }
    }
    if is_visible && shown.unbiased_contribution_weight > 0.0 {
        let light = light_contribution(LightSample(shown.light, shown.point), surface.position, false);
        shaded.direct = shown.unbiased_contribution_weight * light.value
            * direct_scatter(surface, light.direction, light.distance);
        shaded.viewed = select(vec3f(0.0), shaded.direct, frame.view == VIEW_CANDIDATE + origin);
    }
    return shaded;
}

// Of a pixel that has a surface; no sample where there is no light.
fn shade_direct(pixel: vec2u, surface: Surface, domain: Domain) -> Shaded {
    if frame.light_count == 0u {
        var nothing: Shaded;
        nothing.reservoir = empty_reservoir();
        return nothing;
    }
    if is_left_out(pixel) {
        return shade_left_out(pixel, surface);
    }
    return shade_samples(pixel, surface, domain, selections[pixel_index(pixel)]);
}
