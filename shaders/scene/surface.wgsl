// What a ray hit, ready for shading.
#include "scene/bvh.wgsl"
#include "lib/bsdf/bsdf.wgsl"

struct Surface {
    position: vec3f,
    geometric_normal: vec3f, // unit, on the side of wo
    basis: Basis, // round the shading normal
    wo: vec3f, // unit, world space, towards the viewer
    bsdf: Bsdf,
    emission: vec3f, // radiance towards wo
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

fn bitangent_sign(flags: u32, corner: u32) -> f32 {
    return select(1.0, -1.0, ((flags >> (TRIANGLE_BITANGENT_SHIFT + corner)) & 1u) != 0u);
}

// Not normalised: twice the area long, out of the front.
fn triangle_normal(triangle: u32) -> vec3f {
    let p0 = triangles[triangle].p0;
    return cross(triangles[triangle].p1 - p0, triangles[triangle].p2 - p0);
}

fn triangle_point(triangle: u32, uv: vec2f) -> vec3f {
    let p0 = triangles[triangle].p0;
    return p0 + uv.x * (triangles[triangle].p1 - p0) + uv.y * (triangles[triangle].p2 - p0);
}

// Radiance that a point of an emissive triangle sends out of its front; black where its alpha mask cuts it away.
fn emitted_radiance(triangle: u32, uv: vec2f) -> vec3f {
    if scene_has_alpha_masks && (triangles[triangle].flags & TRIANGLE_ALPHA_MASK) != 0u && !passes_alpha(triangle, uv) {
        return vec3f(0.0);
    }
    let material = triangles[triangle].material;
    let emissive = materials[material].emissive;
    if !scene_has_textures || materials[material].emissive_texture.width == 0u {
        return emissive;
    }
    return emissive * texture_read(materials[material].emissive_texture, triangle_uvs(triangle, uv)).rgb;
}

// The interpolated normal of a triangle, bent by its normal map, on the front side.
fn shading_normal(triangle: u32, uv: vec2f, uvs: vec4f) -> vec3f {
    let w = vec3f(1.0 - uv.x - uv.y, uv.x, uv.y);
    let n0 = decode_normal(triangles[triangle].normal_0);
    let n1 = decode_normal(triangles[triangle].normal_1);
    let n2 = decode_normal(triangles[triangle].normal_2);
    let sum = w.x * n0 + w.y * n1 + w.z * n2;
    let has_normal = dot(sum, sum) > 1e-12;
    let n = normalize(select(triangle_normal(triangle), sum, has_normal));
    let flags = triangles[triangle].flags;
    let material = triangles[triangle].material;
    if !scene_has_textures || (flags & TRIANGLE_TANGENTS) == 0u || materials[material].normal_texture.width == 0u {
        return n;
    }
    // MikkTSpace: interpolate tangent, bitangent and normal without normalising, then combine.
    let packed = triangles[triangle].tangents;
    let t0 = corner_tangent(n0, packed & 0xffffu);
    let t1 = corner_tangent(n1, packed >> 16u);
    let t2 = corner_tangent(n2, flags >> 16u);
    let t = w.x * t0 + w.y * t1 + w.z * t2;
    let b = w.x * bitangent_sign(flags, 0u) * cross(n0, t0)
        + w.y * bitangent_sign(flags, 1u) * cross(n1, t1)
        + w.z * bitangent_sign(flags, 2u) * cross(n2, t2);
    let texel = texture_read(materials[material].normal_texture, uvs).xyz * 2.0 - 1.0;
    let scale = materials[material].normal_scale;
    let bent = t * (texel.x * scale) + b * (texel.y * scale) + select(n, sum, has_normal) * texel.z;
    return select(n, normalize(bent), dot(bent, bent) > 1e-12);
}

// The surface at a point of a triangle, seen from `wo` (unit, towards the viewer).
fn load_surface(triangle: u32, uv: vec2f, wo: vec3f) -> Surface {
    let uvs = triangle_uvs(triangle, uv);
    let material = triangles[triangle].material;
    var surface: Surface;
    surface.position = triangle_point(triangle, uv);
    surface.wo = wo;
    surface.triangle = triangle;
    surface.light = triangles[triangle].light;

    let front = normalize(triangle_normal(triangle));
    let is_front = dot(front, wo) >= 0.0;
    let side = select(-1.0, 1.0, is_front);
    surface.geometric_normal = front * side;
    var n = shading_normal(triangle, uv, uvs) * side;
    // An interpolated or mapped normal may face away from the viewer; bend it back to the horizon, for the BRDF is
    // defined only above it.
    let facing = dot(n, wo);
    if facing < 1e-3 {
        n = normalize(n + wo * (1e-3 - facing));
    }
    surface.basis = orthonormal_basis(n);

    let metallic_roughness = texture_read(materials[material].metallic_roughness_texture, uvs);
    let roughness = clamp(materials[material].roughness * metallic_roughness.g, 0.0, 1.0);
    surface.bsdf.base_color = clamp(materials[material].base_color.rgb * triangle_color(triangle, uv).rgb
        * texture_read(materials[material].base_color_texture, uvs).rgb, vec3f(0.0), vec3f(1.0));
    surface.bsdf.metallic = clamp(materials[material].metallic * metallic_roughness.b, 0.0, 1.0);
    surface.bsdf.alpha = vec2f(max(roughness * roughness, MINIMUM_ALPHA));
    surface.bsdf.f0 = vec3f(0.04);
    surface.bsdf.f90 = 1.0;

    surface.emission = vec3f(0.0);
    if surface.light != NONE && (is_front || materials[material].double_sided == 1u) {
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
    return bsdf_evaluate(surface.bsdf, LOBE_ALL, basis_to_local(surface.basis, surface.wo), basis_to_local(surface.basis, wi));
}

// Density per solid angle with which `surface_sample` draws wi.
fn surface_pdf(surface: Surface, wi: vec3f) -> f32 {
    return bsdf_pdf(surface.bsdf, LOBE_ALL, basis_to_local(surface.basis, surface.wo), basis_to_local(surface.basis, wi));
}

// A world direction drawn for the BRDF; may point below the surface, where everything is zero.
fn surface_sample(surface: Surface, u: vec3f) -> vec3f {
    return normalize(basis_to_world(surface.basis,
        bsdf_sample(surface.bsdf, LOBE_ALL, basis_to_local(surface.basis, surface.wo), u).wi));
}

// Whether nothing stands between the surface and the point at `distance` along wi. The ray starts a little above the
// surface and still ends in that point: moved as a whole, it could run into a light before its end.
fn is_visible(surface: Surface, wi: vec3f, distance: f32) -> bool {
    let origin = offset_origin(surface.position, surface.geometric_normal);
    let direction = wi - (origin - surface.position) / max(distance, 1e-12);
    return traverse(origin, direction, distance, true).triangle == NONE;
}
