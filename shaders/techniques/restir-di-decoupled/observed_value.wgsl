// How an inspected pixel values a sample: by the simplified material.
#include "techniques/common/observed.wgsl"
#include "techniques/restir-di-decoupled/target.wgsl"
#include "techniques/restir-di-decoupled/tiles.wgsl"

fn observed_value(sample: LightSample) -> ValuedSample {
    if sample.light == NONE {
        return ValuedSample();
    }
    let incidence = tile_incidence(resolve_light(sample, 1.0).packed, observed_surface.position);
    let scatter = pixel_scatter(observed_surface, domain_of(observed_surface), incidence.direction, incidence.distance);
    return ValuedSample(incidence.value * scatter, incidence.direction, incidence.distance);
}
