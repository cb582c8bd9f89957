// What passes that end a frame have in common: the later bounces that common/indirect has traced, and colours for views.
#include "lib/rng.wgsl"
#include "scene/bindings.wgsl"

@group(1) @binding(15) var indirect_radiance: texture_2d<f32>;

// Zero where a technique's `indirect` is off, and nothing was traced.
fn indirect_light(pixel: vec2u, indirect: u32) -> vec3f {
    if indirect == 0u {
        return vec3f(0.0);
    }
    return textureLoad(indirect_radiance, pixel, 0).rgb;
}

// A colour that a number can be told by; black for NONE.
fn number_color(number: u32) -> vec3f {
    if number == NONE {
        return vec3f(0.0);
    }
    return vec3f(pcg4d(vec4u(number, 1u, 2u, 3u)).xyz >> vec3u(8u)) * 5.9604645e-8;
}
