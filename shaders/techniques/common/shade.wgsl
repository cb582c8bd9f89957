// The later bounces that common/indirect has traced, for passes that end a frame.
#include "scene/bindings.wgsl"
#include "techniques/common/number_color.wgsl"

@group(1) @binding(15) var indirect_radiance: texture_2d<f32>;

// Zero where a technique's `indirect` is off, and nothing was traced.
fn indirect_light(pixel: vec2u, indirect: u32) -> vec3f {
    if indirect == 0u {
        return vec3f(0.0);
    }
    return textureLoad(indirect_radiance, pixel, 0).rgb;
}
