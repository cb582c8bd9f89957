// Kernel 3: shades the candidate, the temporal and the spatiotemporal sample, and resamples one of them for the next frame.
// One invocation: one pixel. Reads the selections, the previous frame's reservoirs and domains, materials, lights and the
// indirect radiance. Writes radiance, or a debug view, and the pixel's reservoir and domain for the next frame. Traces
// nothing.
//
// Domain i offers its sample x_i with resampling weight w_i = m_i(x_i) p-hat(x_i) W_i. All three are shaded with the
// probability w_i / sum w that resampling would take them: sum_i (w_i / sum w) f(x_i) (sum w) / p-hat(x_i)
// = sum_i m_i(x_i) f(x_i) W_i.
// Source: Wyman and Panteleev 2021, section 7 (Fig. 13), Eq. 24 to 33; dissertation 004, Eq. 6.19 to 6.22.
#include "techniques/common/shade.wgsl"
#include "techniques/common/unobserved.wgsl"
#include "techniques/restir-di-decoupled/shade_samples.wgsl"

@group(1) @binding(4) var radiance_out: texture_storage_2d<rgba32float, write>;
@group(1) @binding(7) var<storage, read_write> reservoirs_out: array<DecoupledReservoir>;
@group(1) @binding(9) var<storage, read_write> domains_out: array<DomainRecord>;

fn shade_pixel(pixel: vec2u) -> vec3f {
    if !pixel_has_surface(pixel) {
        reservoirs_out[pixel_index(pixel)] = empty_reservoir();
        domains_out[pixel_index(pixel)] = record_without_surface();
        return select(vec3f(0.0), environment_evaluate(primary_ray(pixel).direction), frame.view == 0u);
    }
    let surface = load_pixel(pixel);
    let domain = domain_of(surface);
    domains_out[pixel_index(pixel)] = pack_domain_record(domain);
    let shaded = shade_direct(pixel, surface, domain);
    reservoirs_out[pixel_index(pixel)] = shaded.reservoir;
    switch frame.view {
        case VIEW_DIRECT: { return shaded.direct; }
        case VIEW_INDIRECT: { return indirect_light(pixel, params.indirect); }
        case VIEW_CANDIDATE, VIEW_TEMPORAL, VIEW_SPATIOTEMPORAL: { return shaded.viewed; }
        case VIEW_CONFIDENCE_WEIGHT: { return vec3f(unpack_state(shaded.reservoir.state).confidence_weight); }
        case VIEW_CONTRIBUTION_WEIGHT: { return vec3f(shaded.reservoir.unbiased_contribution_weight); }
        case VIEW_AGE: { return vec3f(f32(unpack_state(shaded.reservoir.state).age)); }
        case VIEW_LIGHT: { return number_color(shaded.reservoir.light); }
        case VIEW_SUBSET: { return number_color(tile_subset(pixel)); }
        default: { return surface.emission + shaded.direct + indirect_light(pixel, params.indirect); }
    }
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if all(id.xy < frame.size) {
        textureStore(radiance_out, id.xy, vec4f(shade_pixel(id.xy), 1.0));
    }
}
