// Ray cones: how wide a ray has become, and how much of a texture it therefore stands for.
// Sources: Akenine-Möller et al. 2019 (Ray Tracing Gems, chapter 20) and 2021 (JCGT 10(1)); docs/textures.md says where
// this departs from them.
#include "scene/camera.wgsl"
#include "scene/bvh.wgsl"

const TEXTURE_LEVELS_CONE = 0u;
const TEXTURE_LEVELS_FINEST = 1u;

// A footprint is never counted as more than this much longer than wide: what it covers beyond is left to the pixel's
// many samples, for one level of a texture can blur only along both axes at once.
const LEAST_COSINE = 1.0 / 16.0;
// A scattered ray stands for this part of its lobe.
const SHARE_OF_LOBE = 1.0 / 16.0;
// Widest a cone becomes, in radians: that share of a diffuse lobe at its peak.
const WIDEST_SPREAD = 0.5;

// What a pixel's cone gains in width over a metre; 0 for parallel rays.
fn camera_spread(camera: CameraView) -> f32 {
    return select(2.0 * length(camera.up) / f32(frame.size.y), 0.0, camera.orthographic == 1u);
}

// Width of a pixel's cone at a point that the camera sees, in metres.
fn camera_footprint(camera: CameraView, position: vec3f) -> f32 {
    let pixel = 2.0 * length(camera.up) / f32(frame.size.y);
    return select(pixel * distance(camera.position, position), pixel, camera.orthographic == 1u);
}

// How fast the normal turns over a triangle, in radians a metre: the most of its three edges. A mesh that is scaled
// unevenly is taken as scaled evenly.
fn triangle_curvature(instance: u32, triangle: u32) -> f32 {
    let t = load_triangle(triangle);
    let normals = load_normals(triangle);
    let n0 = decode_normal(normals.x);
    let n1 = decode_normal(normals.y);
    let n2 = decode_normal(normals.z);
    let e0 = t.p1 - t.p0;
    let e1 = t.p2 - t.p1;
    let e2 = t.p0 - t.p2;
    let turns = abs(vec3f(dot(n1 - n0, e0), dot(n2 - n1, e1), dot(n0 - n2, e2)));
    let each = turns / max(vec3f(dot(e0, e0), dot(e1, e1), dot(e2, e2)), vec3f(1e-30));
    let curvature = max(each.x, max(each.y, each.z));
    if !scene_has_instances {
        return curvature;
    }
    let world = triangle_normal(instance, triangle);
    return curvature * sqrt(length(cross(e0, e1)) / max(length(world), 1e-30));
}

// The spread of a cone after it has met a surface with `spread` and `width` and gone on in a direction drawn with density
// `pdf` per solid angle. A curved surface turns the two sides of the cone by twice as much as its normal turns between
// them; a lobe gives the ray its share of the solid angle 1 / pdf, in which roughness lies.
fn scattered_spread(instance: u32, triangle: u32, spread: f32, width: f32, pdf: f32) -> f32 {
    if !scene_has_textures {
        return 0.0;
    }
    let mirrored = spread + 2.0 * triangle_curvature(instance, triangle) * width;
    let lobe = 4.0 / PI * SHARE_OF_LOBE / pdf;
    return min(sqrt(mirrored * mirrored + lobe), WIDEST_SPREAD);
}

// Twice the area of a triangle in each set of texture coordinates.
fn triangle_uv_areas(triangle: u32) -> vec2f {
    let a = load_attributes(triangle);
    let first = vec4f(a.uv_a.zw - a.uv_a.xy, a.uv_b.xy - a.uv_a.xy);
    let second = vec4f(a.uv_c.xy - a.uv_b.zw, a.uv_c.zw - a.uv_b.zw);
    return abs(vec2f(first.x * first.w - first.y * first.z, second.x * second.w - second.y * second.z));
}

// The coordinates at a point of a triangle that a cone of `width` meets from `wo`; of width 0 for what is to be read as
// fine as it is.
fn texture_coordinates(instance: u32, triangle: u32, uv: vec2f, wo: vec3f, width: f32) -> TextureCoordinates {
    let uvs = triangle_uvs(triangle, uv);
    if !scene_has_textures || frame.texture_levels == TEXTURE_LEVELS_FINEST {
        return TextureCoordinates(uvs, vec2f(0.0));
    }
    let scaled_normal = triangle_normal(instance, triangle);
    let twice_area = max(length(scaled_normal), 1e-30);
    let cosine = max(abs(dot(scaled_normal, wo)) / twice_area, LEAST_COSINE);
    return TextureCoordinates(uvs, triangle_uv_areas(triangle) * (width * width / (cosine * twice_area)));
}
