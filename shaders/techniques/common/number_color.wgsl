// Colours for views of which light, or which subset.
#include "lib/rng.wgsl"
#include "scene/bindings.wgsl"

// A colour that a number can be told by; black for NONE.
fn number_color(number: u32) -> vec3f {
    if number == NONE {
        return vec3f(0.0);
    }
    return vec3f(pcg4d(vec4u(number, 1u, 2u, 3u)).xyz >> vec3u(8u)) * 5.9604645e-8;
}
