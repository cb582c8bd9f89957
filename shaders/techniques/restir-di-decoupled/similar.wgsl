// Which surfaces of the previous frame are like enough to help (Wyman and Panteleev 2021, section 4.3).
#include "techniques/common/reprojection.wgsl"
#include "techniques/restir-di-decoupled/params.wgsl"

// Whether a pixel of the previous frame saw a surface like this one, whose depth there was `depth`. It looks only at
// surfaces, never at samples, so it adds no bias.
fn is_similar(surface: Surface, depth: f32, pixel: vec2u) -> bool {
    if !previous_pixel_has_surface(pixel) {
        return false;
    }
    let neighbor = load_pixel_of(pixel, true);
    return abs(previous_depth(neighbor.position) - depth) <= params.depth_threshold * abs(depth)
        && dot(surface.basis.normal, neighbor.basis.normal) >= params.normal_threshold;
}
