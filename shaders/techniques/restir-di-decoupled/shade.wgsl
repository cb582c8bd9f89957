// Kernel 3: shades the candidate, the temporal and the spatiotemporal sample, and resamples one of them for the next frame.
// One invocation: one pixel. Reads the selections, the previous frame's reservoirs, materials, lights and the indirect
// radiance. Writes radiance, or a debug view, and the next frame's reservoir. Traces nothing.
//
// Domain i offers its sample x_i with resampling weight w_i = m_i(x_i) p-hat(x_i) W_i. All three are shaded with the
// probability w_i / sum w that resampling would take them: sum_i (w_i / sum w) f(x_i) (sum w) / p-hat(x_i)
// = sum_i m_i(x_i) f(x_i) W_i.
// Source: Wyman and Panteleev 2021, section 7 (Fig. 13), Eq. 24 to 33; dissertation 004, Eq. 6.19 to 6.22.
#include "techniques/common/reprojection.wgsl"
#include "techniques/restir-di-decoupled/params.wgsl"
#include "techniques/restir-di-decoupled/target.wgsl"
#include "techniques/restir-di-decoupled/tiles.wgsl"
#include "techniques/restir-di-decoupled/similar.wgsl"

@group(1) @binding(4) var radiance_out: texture_storage_2d<rgba32float, write>;
@group(1) @binding(5) var<storage, read> selections: array<Selection>;
@group(1) @binding(6) var<storage, read> reservoirs_previous: array<DecoupledReservoir>;
@group(1) @binding(7) var<storage, read_write> reservoirs_out: array<DecoupledReservoir>;
@group(1) @binding(8) var indirect_radiance: texture_2d<f32>;

const VIEW_DIRECT = 1u;
const VIEW_INDIRECT = 2u;
const VIEW_CANDIDATE = 3u;
const VIEW_TEMPORAL = 4u;
const VIEW_SPATIOTEMPORAL = 5u;
const VIEW_CONFIDENCE_WEIGHT = 6u;
const VIEW_LIGHT = 7u;
const VIEW_SUBSET = 8u;

// The three samples of a pixel, component i that of domain i.
struct Samples {
    lights: vec3u,
    points: vec3u,
    weights: vec3f, // W_i
    confidences: vec3f, // c_i; 0 where there is no domain
    ages: vec3u, // of what is known of their visibility
    visible: vec3<bool>, // V_0(x_i), as far as is known
    resolved: array<TileLight, 3>, // where nothing moves: the same light for every domain, fetched once
}

// What a pixel shows of direct light, and hands on.
struct Shaded {
    contributions: array<vec3f, 3>, // m_i(x_i) f(x_i) V(x_i) W_i
    reservoir: DecoupledReservoir,
}

fn empty_reservoir() -> DecoupledReservoir {
    return DecoupledReservoir(NONE, 0u, 0.0, 0u);
}

fn light_sample_of(samples: Samples, i: u32) -> LightSample {
    return LightSample(samples.lights[i], samples.points[i]);
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

fn gather_samples(selection: Selection) -> Samples {
    var samples = Samples(vec3u(selection.light, NONE, NONE), vec3u(selection.point, 0u, 0u),
        vec3f(selection.unbiased_contribution_weight, 0.0, 0.0), vec3f(1.0, 0.0, 0.0), vec3u(0u), vec3<bool>(false),
        array<TileLight, 3>());
    let domains = vec3u(0u, selection.temporal, selection.spatiotemporal);
    for (var i = 0u; i < DOMAINS; i += 1u) {
        if i > 0u && domains[i] != NONE {
            let reservoir = history_reservoir(domain_pixel(domains[i]));
            let state = unpack_state(reservoir.state);
            samples.lights[i] = reservoir.light;
            samples.points[i] = reservoir.point;
            samples.weights[i] = reservoir.unbiased_contribution_weight;
            samples.confidences[i] = min(state.confidence_weight, params.history_cap);
            let was_traced = (selection.visibility & traced_bit(i)) != 0u;
            samples.ages[i] = select(state.age + 1u, 0u, was_traced);
        }
        samples.visible[i] = params.visibility == VISIBILITY_NONE
            || (selection.visibility & visibility_bit(0u, i)) != 0u;
        if feeds_visibility(i) && !samples.visible[i] {
            samples.weights[i] = 0.0;
            if i > 0u && params.visibility == VISIBILITY_DISCARD {
                samples.confidences[i] = 0.0;
            }
        }
        if !scene_has_motion && samples.weights[i] > 0.0 {
            samples.resolved[i] = pack_tile_light(light_sample_of(samples, i), 1.0);
        }
    }
    return samples;
}

// p-hat_j(x_i).
fn domain_target(domain: Surface, samples: Samples, i: u32, previous: bool) -> f32 {
    if scene_has_motion {
        return approximate_target(domain, light_sample_of(samples, i), previous);
    }
    let incidence = tile_incidence(samples.resolved[i], domain.position);
    if incidence.value <= 0.0 {
        return 0.0;
    }
    return incidence.value * approximate_scatter(domain, incidence.direction, incidence.distance);
}

fn shade_samples(pixel: vec2u, surface: Surface, selection: Selection) -> Shaded {
    let samples = gather_samples(selection);
    let domains = vec3u(0u, selection.temporal, selection.spatiotemporal);
    // What each domain makes of each sample: p-hat of this pixel, and sums over domains for the MIS weights.
    var targets = vec3f(0.0);
    var numerators = vec3f(0.0);
    var denominators = vec3f(0.0);
    let domain_count = select(DOMAINS, 1u, params.bias_correction == REUSE_WEIGHT_NONE);
    for (var j = 0u; j < domain_count; j += 1u) {
        if samples.confidences[j] <= 0.0 {
            continue;
        }
        var domain = surface;
        if j > 0u {
            domain = load_pixel_of(domain_pixel(domains[j]), true);
        }
        for (var i = 0u; i < DOMAINS; i += 1u) {
            if samples.weights[i] <= 0.0 {
                continue;
            }
            var value = domain_target(domain, samples, i, j > 0u);
            if j == 0u {
                targets[i] = value;
            }
            if params.visibility == VISIBILITY_MIS && (selection.visibility & visibility_bit(j, i)) == 0u {
                value = 0.0;
            }
            var share = samples.confidences[j] * value;
            if params.bias_correction == REUSE_WEIGHT_Z {
                share = select(0.0, samples.confidences[j], value > 0.0);
            }
            denominators[i] += share;
            if i == j {
                numerators[i] = share;
            }
        }
    }
    if params.bias_correction == REUSE_WEIGHT_NONE {
        numerators = samples.confidences;
        denominators = vec3f(samples.confidences.x + samples.confidences.y + samples.confidences.z);
    }

    var rng = rng_new(pixel, frame.index, frame.seed, STREAM_DECOUPLED);
    let u = random_4(&rng);
    var shaded: Shaded;
    var weight_sum = 0.0;
    var selected = NONE;
    for (var i = 0u; i < DOMAINS; i += 1u) {
        shaded.contributions[i] = vec3f(0.0);
        if targets[i] <= 0.0 || denominators[i] <= 0.0 {
            continue;
        }
        let share = numerators[i] / denominators[i] * samples.weights[i];
        let weight = share * targets[i];
        weight_sum += weight;
        if u[i] * weight_sum < weight {
            selected = i;
        }
        if samples.visible[i] {
            let light = light_contribution(light_sample_of(samples, i), surface.position, false);
            shaded.contributions[i] = share * light.value * direct_scatter(surface, light.direction, light.distance);
        }
    }

    shaded.reservoir = empty_reservoir();
    var state = ReservoirState(samples.confidences.x + samples.confidences.y + samples.confidences.z, false, 0u);
    if selected != NONE {
        let weight = weight_sum / targets[selected];
        if !is_nan(weight) && !is_infinite(weight) {
            shaded.reservoir.light = samples.lights[selected];
            shaded.reservoir.point = samples.points[selected];
            shaded.reservoir.unbiased_contribution_weight = weight;
            state.is_visible = samples.visible[selected];
            state.age = samples.ages[selected];
        }
    }
    shaded.reservoir.state = pack_state(state);
    return shaded;
}

// A pixel that is left out of the checkerboard shows, and keeps, the sample of the same point in the previous frame. A
// point that was not seen then shows the candidate of the pixel beside it.
fn shade_left_out(pixel: vec2u, surface: Surface) -> Shaded {
    var shaded: Shaded;
    shaded.contributions[CANDIDATE] = vec3f(0.0);
    shaded.contributions[TEMPORAL] = vec3f(0.0);
    shaded.contributions[SPATIOTEMPORAL] = vec3f(0.0);
    shaded.reservoir = empty_reservoir();
    var origin = CANDIDATE;
    var is_visible = false;
    if frame.history == 1u && params.temporal_reuse == 1u {
        let position = previous_position(pixel);
        let film = project(frame.previous_camera, position);
        if is_on_film(film) && is_similar(surface, previous_depth(position), vec2u(film)) {
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
        shaded.contributions[origin] = shown.unbiased_contribution_weight * light.value
            * direct_scatter(surface, light.direction, light.distance);
    }
    return shaded;
}

// A colour that a number can be told by.
fn number_color(number: u32) -> vec3f {
    return vec3f(pcg4d(vec4u(number, 1u, 2u, 3u)).xyz >> vec3u(8u)) * 5.9604645e-8;
}

fn indirect_light(pixel: vec2u) -> vec3f {
    if params.indirect == 0u {
        return vec3f(0.0);
    }
    return textureLoad(indirect_radiance, pixel, 0).rgb;
}

fn shade_pixel(pixel: vec2u) -> vec3f {
    if !pixel_has_surface(pixel) {
        reservoirs_out[pixel_index(pixel)] = empty_reservoir();
        return select(vec3f(0.0), environment_evaluate(primary_ray(pixel).direction), frame.view == 0u);
    }
    let surface = load_pixel_of(pixel, false);
    var shaded: Shaded;
    if frame.light_count == 0u {
        shaded.reservoir = empty_reservoir();
    } else if is_left_out(pixel) {
        shaded = shade_left_out(pixel, surface);
    } else {
        shaded = shade_samples(pixel, surface, selections[pixel_index(pixel)]);
    }
    reservoirs_out[pixel_index(pixel)] = shaded.reservoir;
    let direct = shaded.contributions[CANDIDATE] + shaded.contributions[TEMPORAL] + shaded.contributions[SPATIOTEMPORAL];
    switch frame.view {
        case VIEW_DIRECT: { return direct; }
        case VIEW_INDIRECT: { return indirect_light(pixel); }
        case VIEW_CANDIDATE: { return shaded.contributions[CANDIDATE]; }
        case VIEW_TEMPORAL: { return shaded.contributions[TEMPORAL]; }
        case VIEW_SPATIOTEMPORAL: { return shaded.contributions[SPATIOTEMPORAL]; }
        // White at the most that a pixel can have: its own, and two histories.
        case VIEW_CONFIDENCE_WEIGHT: {
            return vec3f(unpack_state(shaded.reservoir.state).confidence_weight / (1.0 + 2.0 * params.history_cap));
        }
        case VIEW_LIGHT: {
            return select(number_color(shaded.reservoir.light), vec3f(0.0), shaded.reservoir.light == NONE);
        }
        case VIEW_SUBSET: { return number_color(tile_subset(pixel)); }
        default: { return surface.emission + direct + indirect_light(pixel); }
    }
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if all(id.xy < frame.size) {
        textureStore(radiance_out, id.xy, vec4f(shade_pixel(id.xy), 1.0));
    }
}
