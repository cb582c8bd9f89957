// What a ray hit, ready for shading.
#include "scene/bvh.wgsl"
#include "lib/brdf.wgsl"

struct Surface {
    position: vec3f,
    position_error: f32, // how far along the normal rounding may have moved the position, or a ray's view of the triangle
    geometric_normal: vec3f, // unit, on the side of wo
    basis: Basis, // round the shading normal
    wo: vec3f, // unit, world space, towards the viewer
    brdf: Brdf,
    emission: vec3f, // radiance towards wo
    instance: u32,
    triangle: u32,
    light: u32, // index of the light this surface is, or NONE
}

fn decode_normal(packed: u32) -> vec3f {
    return octahedral_decode(unpack2x16snorm(packed));
}

// The tangent of one corner: an angle in the basis of its normal.
fn corner_tangent(normal: vec3f, angle: u32) -> vec3f {
    let basis = orthonormal_basis(normal);
    let phi = f32(angle) * (2.0 * PI / 65536.0);
    return basis.tangent * cos(phi) + basis.bitangent * sin(phi);
}

fn bitangent_sign(tangent_2: u32, corner: u32) -> f32 {
    return select(1.0, -1.0, ((tangent_2 >> (BITANGENT_SHIFT + corner)) & 1u) != 0u);
}

// A triangle's corners in the world.
struct Corners {
    p0: vec3f,
    p1: vec3f,
    p2: vec3f,
}

fn triangle_corners(instance: u32, triangle: u32) -> Corners {
    let t = load_triangle(triangle);
    if !scene_has_instances {
        return Corners(t.p0, t.p1, t.p2);
    }
    return Corners(instance_point(instance, TO_WORLD, t.p0), instance_point(instance, TO_WORLD, t.p1),
        instance_point(instance, TO_WORLD, t.p2));
}

// Not normalised: twice the area long, out of the front.
fn triangle_normal(instance: u32, triangle: u32) -> vec3f {
    let corners = triangle_corners(instance, triangle);
    let normal = cross(corners.p1 - corners.p0, corners.p2 - corners.p0);
    if !scene_has_instances {
        return normal;
    }
    // A mirror turns the corners round, but not the front.
    let t = load_triangle(triangle);
    let front = instance_normal(instance, cross(t.p1 - t.p0, t.p2 - t.p0));
    return select(-normal, normal, dot(normal, front) >= 0.0);
}

fn triangle_point(instance: u32, triangle: u32, uv: vec2f) -> vec3f {
    let t = load_triangle(triangle);
    let point = t.p0 + uv.x * (t.p1 - t.p0) + uv.y * (t.p2 - t.p0);
    if !scene_has_instances {
        return point;
    }
    return instance_point(instance, TO_WORLD, point);
}

// A bound on the distance, along the normal, between a point computed on a triangle and the plane that rays from there are
// tested against: the rounding of the point and of the differences to the corners (8 units of roundoff of the largest
// coordinates), and that of the cross product, which grows as the triangle becomes a sliver. After Pharr, Jakob and
// Humphreys 2016, section 3.9; the constants are ours and tests/watertight.rs tests them.
fn triangle_error(instance: u32, triangle: u32, unit_normal: vec3f) -> f32 {
    let corners = triangle_corners(instance, triangle);
    let largest = max(max(abs(corners.p0), abs(corners.p1)), abs(corners.p2));
    let e1 = corners.p1 - corners.p0;
    let e2 = corners.p2 - corners.p0;
    let lengths = vec2f(length(e1), length(e2));
    let sliver = lengths.x * lengths.y * max(lengths.x, lengths.y) / max(length(cross(e1, e2)), 1e-30);
    let error = 4.8e-7 * dot(abs(unit_normal), largest) + 2.4e-7 * sliver;
    // Rays go through a matrix on the way to an instance's triangles, points on the way back.
    return select(error, 4.0 * (error + 1.2e-7 * max(largest.x, max(largest.y, largest.z))), scene_has_instances);
}

// Radiance that a point of an emissive triangle sends out of its front; black where its alpha mask cuts it away.
fn emitted_radiance(triangle: u32, uv: vec2f) -> vec3f {
    let t = load_triangle(triangle);
    if scene_has_alpha_masks && (t.flags & TRIANGLE_ALPHA_MASK) != 0u && !passes_alpha(triangle, uv) {
        return vec3f(0.0);
    }
    let material = load_material(t.material);
    if !scene_has_textures || material.emissive_texture.width == 0u {
        return material.emissive;
    }
    return material.emissive * texture_read(material.emissive_texture, triangle_uvs(triangle, uv)).rgb;
}

// The interpolated normal of a triangle in its mesh's space, bent by its normal map, on the front side; unit.
fn shading_normal(triangle: u32, uv: vec2f, uvs: vec4f) -> vec3f {
    let w = vec3f(1.0 - uv.x - uv.y, uv.x, uv.y);
    let a = load_attributes(triangle);
    let n0 = decode_normal(a.normals.x);
    let n1 = decode_normal(a.normals.y);
    let n2 = decode_normal(a.normals.z);
    let sum = w.x * n0 + w.y * n1 + w.z * n2;
    let has_normal = dot(sum, sum) > 1e-12;
    let triangle_record = load_triangle(triangle);
    let face = cross(triangle_record.p1 - triangle_record.p0, triangle_record.p2 - triangle_record.p0);
    let n = normalize(select(face, sum, has_normal));
    if !scene_has_textures || (triangle_record.flags & TRIANGLE_TANGENTS) == 0u {
        return n;
    }
    let material = load_material(triangle_record.material);
    if material.normal_texture.width == 0u {
        return n;
    }
    // MikkTSpace: interpolate tangent, bitangent and normal without normalising, then combine.
    let t0 = corner_tangent(n0, a.tangents_01 & 0xffffu);
    let t1 = corner_tangent(n1, a.tangents_01 >> 16u);
    let t2 = corner_tangent(n2, a.tangent_2 & 0xffffu);
    let t = w.x * t0 + w.y * t1 + w.z * t2;
    let b = w.x * bitangent_sign(a.tangent_2, 0u) * cross(n0, t0)
        + w.y * bitangent_sign(a.tangent_2, 1u) * cross(n1, t1)
        + w.z * bitangent_sign(a.tangent_2, 2u) * cross(n2, t2);
    let texel = texture_read(material.normal_texture, uvs).xyz * 2.0 - 1.0;
    let scale = material.normal_scale;
    let bent = t * (texel.x * scale) + b * (texel.y * scale) + select(n, sum, has_normal) * texel.z;
    return select(n, normalize(bent), dot(bent, bent) > 1e-12);
}

// The surface at a point of a triangle, seen from `wo` (unit, towards the viewer).
fn load_surface(instance: u32, triangle: u32, uv: vec2f, wo: vec3f) -> Surface {
    let uvs = triangle_uvs(triangle, uv);
    let triangle_record = load_triangle(triangle);
    let material = load_material(triangle_record.material);
    var surface: Surface;
    surface.position = triangle_point(instance, triangle, uv);
    surface.wo = wo;
    surface.instance = instance;
    surface.triangle = triangle;
    surface.light = triangle_record.light;
    if scene_has_instances && triangle_record.light != NONE {
        surface.light += instance_first_light(instance);
    }

    let front = normalize(triangle_normal(instance, triangle));
    let is_front = dot(front, wo) >= 0.0;
    let side = select(-1.0, 1.0, is_front);
    surface.geometric_normal = front * side;
    surface.position_error = triangle_error(instance, triangle, front);
    var n = shading_normal(triangle, uv, uvs) * side;
    if scene_has_instances {
        n = normalize(instance_normal(instance, n));
    }
    // An interpolated or mapped normal may face away from the viewer; bend it back to the horizon, for the BRDF is
    // defined only above it.
    let facing = dot(n, wo);
    if facing < 1e-3 {
        n = normalize(n + wo * (1e-3 - facing));
    }
    surface.basis = orthonormal_basis(n);

    let metallic_roughness = texture_read(material.metallic_roughness_texture, uvs);
    let roughness = clamp(material.roughness * metallic_roughness.g, 0.0, 1.0);
    surface.brdf.base_color = clamp(material.base_color.rgb * triangle_color(triangle, uv).rgb
        * texture_read(material.base_color_texture, uvs).rgb, vec3f(0.0), vec3f(1.0));
    surface.brdf.metallic = clamp(material.metallic * metallic_roughness.b, 0.0, 1.0);
    surface.brdf.alpha = max(roughness * roughness, MINIMUM_ALPHA);

    surface.emission = vec3f(0.0);
    if surface.light != NONE && (is_front || material.double_sided == 1u) {
        surface.emission = emitted_radiance(triangle, uv);
    }
    return surface;
}

// Whether a direction leaves the surface on the viewer's side of the real geometry.
fn above_surface(surface: Surface, wi: vec3f) -> bool {
    return dot(surface.geometric_normal, wi) > 0.0;
}

// f(wo, wi) |cos| for a world direction; zero below the geometric or the shading horizon.
fn surface_evaluate(surface: Surface, wi: vec3f) -> vec3f {
    if !above_surface(surface, wi) {
        return vec3f(0.0);
    }
    return brdf_evaluate(surface.brdf, basis_to_local(surface.basis, surface.wo), basis_to_local(surface.basis, wi));
}

// Density per solid angle with which `surface_sample` draws wi.
fn surface_pdf(surface: Surface, wi: vec3f) -> f32 {
    return brdf_pdf(surface.brdf, basis_to_local(surface.basis, surface.wo), basis_to_local(surface.basis, wi));
}

// A world direction drawn for the BRDF; may point below the surface, where everything is zero.
fn surface_sample(surface: Surface, u: vec3f) -> vec3f {
    return normalize(basis_to_world(surface.basis,
        brdf_sample(surface.brdf, basis_to_local(surface.basis, surface.wo), u)));
}

// Where a ray that leaves the surface towards `direction` begins: off the surface on that side, by no more than rounding
// makes necessary, so that it cannot hit the triangle it comes from.
fn ray_origin(surface: Surface, direction: vec3f) -> vec3f {
    let side = select(-1.0, 1.0, dot(surface.geometric_normal, direction) >= 0.0);
    return surface.position + surface.geometric_normal * (side * surface.position_error);
}

// Whether nothing stands between the surface and the point at `distance` along wi. The ray starts a little above the
// surface and still ends in that point: moved as a whole, it could run into a light before its end.
fn is_visible(surface: Surface, wi: vec3f, distance: f32) -> bool {
    return is_visible_from(frame.top_level, surface, wi, distance);
}

// The same in the scene of a frame, this one's or the previous one's, whose root is `top_level`.
fn is_visible_from(top_level: u32, surface: Surface, wi: vec3f, distance: f32) -> bool {
    let origin = ray_origin(surface, wi);
    let direction = wi - (origin - surface.position) / max(distance, 1e-12);
    return traverse_from(top_level, origin, direction, distance, true).triangle == NONE;
}
