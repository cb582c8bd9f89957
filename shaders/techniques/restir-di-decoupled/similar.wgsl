// Which surfaces of the previous frame are like enough to help (Wyman and Panteleev 2021, section 4.3).
#include "techniques/common/reprojection.wgsl"
#include "techniques/restir-di-decoupled/params.wgsl"
#include "techniques/restir-di-decoupled/domain.wgsl"

// Whether a pixel of the previous frame saw a surface like this one, whose depth there was `depth`. It looks only at
// surfaces, never at samples, so it adds no bias.
fn is_similar(surface: Surface, depth: f32, neighbor: DomainRecord) -> bool {
    return record_has_surface(neighbor)
        && abs(previous_depth(neighbor.position) - depth) <= params.depth_threshold * abs(depth)
        && dot(surface.basis.normal, decode_normal(neighbor.normal)) >= params.normal_threshold;
}
