// Kernel 2: shadow rays, and nothing else that is expensive.
// One invocation: one pixel. Reads both visibility buffers, the selections, the previous frame's reservoirs and the scene.
// Writes the visibility of the pixel's three samples into its selection and counts rays.
// Source: Wyman and Panteleev 2021, section 7.2 and Fig. 15 (what is traced), section 7.3 (what is reused), section 4.6
// (rays in the weights).
#include "scene/counters.wgsl"
#include "scene/lights.wgsl"
#include "techniques/common/reprojection.wgsl"
#include "techniques/restir-di-decoupled/params.wgsl"

@group(1) @binding(4) var<storage, read_write> selections: array<Selection>;
@group(1) @binding(5) var<storage, read> reservoirs_previous: array<DecoupledReservoir>;

// Two rays a pixel are enough for the decoupled pipeline: what more would want one reuses an old answer.
const DECOUPLED_RAYS = 2u;

// What a shadow ray needs of a domain's surface.
fn domain_surface(pixel: vec2u, previous: bool) -> Surface {
    var seen = textureLoad(visibility, pixel, 0);
    var camera = frame.camera;
    if previous {
        seen = textureLoad(previous_visibility, pixel, 0);
        seen.x = previous_instance(seen.x);
        camera = frame.previous_camera;
    }
    var surface: Surface;
    surface.position = triangle_point(seen.x, seen.y, bitcast<vec2f>(seen.zw));
    let front = front_normal(seen.x, seen.y, bitcast<vec2f>(seen.zw));
    let side = select(-1.0, 1.0, dot(front, direction_to_camera(camera, surface.position)) >= 0.0);
    surface.geometric_normal = front * side;
    surface.position_error = triangle_error(seen.x, seen.y, front);
    return surface;
}

fn trace_pixel(pixel: vec2u) {
    let index = pixel_index(pixel);
    let selection = selections[index];
    // A domain's pixel, or NONE.
    let domains = vec3u(0u, selection.temporal, selection.spatiotemporal);
    var lights_of = vec3u(selection.light, NONE, NONE);
    var points = vec3u(selection.point, 0u, 0u);
    var has_sample = vec3<bool>(selection.unbiased_contribution_weight > 0.0, false, false);
    var states = vec3u(0u);
    for (var i = 1u; i < DOMAINS; i += 1u) {
        if domains[i] != NONE {
            let reservoir = reservoirs_previous[pixel_index(domain_pixel(domains[i]))];
            lights_of[i] = reservoir.light;
            points[i] = reservoir.point;
            has_sample[i] = reservoir.unbiased_contribution_weight > 0.0;
            states[i] = reservoir.state;
        }
    }

    var bits = 0u;
    var rays = 0u;
    var surface: Surface;
    let pairs = select(DOMAINS, DOMAINS * DOMAINS, params.visibility == VISIBILITY_MIS);
    // Pair k is sample i seen from domain j, and bit k of the answer. Each turn goes on to the next pair that wants a ray, so
    // that neighbouring invocations trace at the same time, whichever pairs are theirs.
    for (var k = 0u; k < pairs; ) {
        var wants_ray = false;
        var light: LightContribution;
        for (; k < pairs && !wants_ray; k += 1u) {
            let j = k / DOMAINS;
            let i = k % DOMAINS;
            if j > 0u && domains[j] == NONE {
                continue;
            }
            if i == 0u {
                var place = pixel;
                if j > 0u {
                    place = domain_pixel(domains[j]);
                }
                surface = domain_surface(place, j > 0u);
            }
            if !has_sample[i] {
                continue;
            }
            // What a reservoir holds is lit where it is held: these very rays see to it.
            if j > 0u && i == j {
                bits |= visibility_bit(j, i);
                continue;
            }
            // Of no account to the pixel, so to its weights.
            if j > 0u && (bits & visibility_bit(0u, i)) == 0u {
                continue;
            }
            if j == 0u && i > 0u {
                if params.visibility == VISIBILITY_CANDIDATE {
                    bits |= visibility_bit(0u, i);
                    continue;
                }
                if params.visibility == VISIBILITY_DECOUPLED {
                    let state = unpack_state(states[i]);
                    let is_young = state.age < params.visibility_lifetime;
                    if (is_young && domain_may_reuse_visibility(domains[i])) || rays >= DECOUPLED_RAYS {
                        bits |= select(0u, visibility_bit(0u, i), state.is_visible);
                        continue;
                    }
                }
            }
            light = light_contribution(LightSample(lights_of[i], points[i]), surface.position, j > 0u);
            if j == 0u {
                bits |= traced_bit(i);
            }
            wants_ray = luminance(light.value) > 0.0
                && (scene_has_transmission || above_surface(surface, light.direction));
        }
        if !wants_ray {
            break;
        }
        rays += 1u;
        let pair = k - 1u;
        let top_level = select(frame.top_level, frame.previous_top_level, pair >= DOMAINS);
        if is_visible_from(top_level, surface, light.direction, light.distance) {
            bits |= 1u << pair;
        }
    }
    selections[index].visibility = bits;
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local_index: u32) {
    let pixel = invocation_pixel(id.xy);
    if all(pixel < frame.size) && pixel_has_surface(pixel) {
        trace_pixel(pixel);
        count_pixel(pixel);
    }
    flush_ray_count(local_index);
}
