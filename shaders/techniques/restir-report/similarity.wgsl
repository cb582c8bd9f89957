// Whether two pixels see surfaces that are enough alike to share samples: what report 003 lacks (section 8) and plans
// (section 9, "checks for depth, normal, and surface similarity"). The thresholds are ours, those of restir-di.

const DEPTH_THRESHOLD = 0.1; // of the depth
const NORMAL_THRESHOLD = 0.9; // cosine
const ALBEDO_THRESHOLD = 0.25;

// It looks only at surfaces, never at samples, so it adds no bias. `position` is where the surface's point is, or was, for
// the camera that sees the other.
fn is_similar(surface: Surface, position: vec3f, other: Surface, camera: CameraView) -> bool {
    let depth = dot(position - camera.position, camera.forward);
    let other_depth = dot(other.position - camera.position, camera.forward);
    let difference = abs(surface.bsdf.base_color - other.bsdf.base_color);
    return abs(other_depth - depth) <= DEPTH_THRESHOLD * abs(depth)
        && dot(surface.basis.normal, other.basis.normal) >= NORMAL_THRESHOLD
        && max(difference.r, max(difference.g, difference.b)) <= ALBEDO_THRESHOLD;
}
