// What a ray hit, ready for shading.
#include "scene/bvh.wgsl"
#include "scene/ray_cone.wgsl"
#include "scene/material_bsdf.wgsl"

struct Surface {
    position: vec3f,
    position_error: f32, // how far along the normal rounding may have moved the position, or a ray's view of the triangle
    geometric_normal: vec3f, // unit, on the side of wo
    basis: Basis, // round the shading normal
    wo: vec3f, // unit, world space, towards the viewer
    bsdf: Bsdf,
    emission: vec3f, // radiance towards wo
    instance: u32,
    triangle: u32,
    light: u32, // index of the light this surface is, or NONE
    footprint: f32, // width of the cone that met it, in metres
    is_front: bool,
    material: u32,
    // Of transmissive surfaces (scene/media.wgsl):
    boundary: u32, // the material, if the surface bounds a medium, or NONE
    specular_color: vec3f, // KHR_materials_specular, before the Fresnel term
    absorption_above: vec3f, // of the medium on the side of wo, 1/m
    absorption_below: vec3f,
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
    var point = t.p0 + uv.x * (t.p1 - t.p0) + uv.y * (t.p2 - t.p0);
    if scene_has_shapes && is_sphere(t.flags) {
        point = t.p0 + length(t.p1 - t.p0) * sphere_normal(uv);
    }
    if !scene_has_instances {
        return point;
    }
    return instance_point(instance, TO_WORLD, point);
}

// Unit, out of the front of any primitive at a point of it.
fn front_normal(instance: u32, triangle: u32, uv: vec2f) -> vec3f {
    if !scene_has_shapes || !is_sphere(load_triangle(triangle).flags) {
        return normalize(triangle_normal(instance, triangle));
    }
    if !scene_has_instances {
        return sphere_normal(uv);
    }
    return normalize(instance_normal(instance, sphere_normal(uv)));
}

// A bound on the distance, along the normal, between a point computed on a triangle and the plane that rays from there are
// tested against: the rounding of the point and of the differences to the corners (8 units of roundoff of the largest
// coordinates), and that of the cross product, which grows as the triangle becomes a sliver. After Pharr, Jakob and
// Humphreys 2016, section 3.9; the constants are ours and tests/watertight.rs tests them.
fn triangle_error(instance: u32, triangle: u32, unit_normal: vec3f) -> f32 {
    let corners = triangle_corners(instance, triangle);
    var largest = max(max(abs(corners.p0), abs(corners.p1)), abs(corners.p2));
    let e1 = corners.p1 - corners.p0;
    let e2 = corners.p2 - corners.p0;
    if scene_has_shapes {
        // Their points may lie beyond the corners.
        largest += abs(e1) + abs(e2);
    }
    let lengths = vec2f(length(e1), length(e2));
    let sliver = lengths.x * lengths.y * max(lengths.x, lengths.y) / max(length(cross(e1, e2)), 1e-30);
    let error = 4.8e-7 * dot(abs(unit_normal), largest) + 2.4e-7 * sliver;
    // Rays go through a matrix on the way to an instance's triangles, points on the way back.
    return select(error, 4.0 * (error + 1.2e-7 * max(largest.x, max(largest.y, largest.z))), scene_has_instances);
}

// Radiance that a point of an emissive triangle sends out of its front at full power, at a cosine to its normal; black where its alpha
// mask cuts it away. A clearcoat dims it (KHR_materials_clearcoat). Read at level 0 however it was found, and dimmed by the
// mesh's own normal, so that a light is the same to the ray that hits it and to the sample that chose it.
fn emitted_radiance(triangle: u32, uv: vec2f, cosine: f32) -> vec3f {
    let t = load_triangle(triangle);
    if scene_has_alpha_masks && (t.flags & TRIANGLE_ALPHA_MASK) != 0u && !passes_alpha(triangle, uv) {
        return vec3f(0.0);
    }
    let uvs = texture_finest(triangle_uvs(triangle, uv));
    var radiance = load_emissive_factor(t.material) * texture_read(load_emissive_slot(t.material), uvs).rgb;
    if scene_has_clearcoat {
        let extensions = load_extensions(t.material);
        let coat = extensions.clearcoat * texture_read(extensions.clearcoat_texture, uvs).r;
        radiance *= 1.0 - coat * mix(CLEARCOAT_F0, 1.0, schlick_weight(cosine));
    }
    return radiance;
}

// Factor on what an emissive triangle sends out, in this frame or in the previous one.
fn emitter_power(light: u32, previous: bool) -> f32 {
    if !scene_has_dimmed_emitters {
        return 1.0;
    }
    return select(lights[light].intensity.x, lights[light].intensity.y, previous);
}

// The frame of a triangle's point in its mesh's space, on the front side. MikkTSpace interpolates all three without
// normalising.
struct ShadingFrame {
    tangent: vec3f,
    bitangent: vec3f,
    normal: vec3f,
    has_tangents: bool,
}

fn shading_frame(triangle: u32, uv: vec2f) -> ShadingFrame {
    if scene_has_shapes && is_sphere(load_triangle(triangle).flags) {
        return ShadingFrame(vec3f(0.0), vec3f(0.0), sphere_normal(uv), false);
    }
    let w = vec3f(1.0 - uv.x - uv.y, uv.x, uv.y);
    let normals = load_normals(triangle);
    let n0 = decode_normal(normals.x);
    let n1 = decode_normal(normals.y);
    let n2 = decode_normal(normals.z);
    let sum = w.x * n0 + w.y * n1 + w.z * n2;
    let t = load_triangle(triangle);
    let face = cross(t.p1 - t.p0, t.p2 - t.p0);
    let n = select(normalize(face), sum, dot(sum, sum) > 1e-12);
    if !(scene_has_textures || scene_has_anisotropy) || (t.flags & TRIANGLE_TANGENTS) == 0u {
        return ShadingFrame(vec3f(0.0), vec3f(0.0), n, false);
    }
    let tangent_2 = load_colors(triangle).w;
    let t0 = corner_tangent(n0, normals.w & 0xffffu);
    let t1 = corner_tangent(n1, normals.w >> 16u);
    let t2 = corner_tangent(n2, tangent_2 & 0xffffu);
    return ShadingFrame(w.x * t0 + w.y * t1 + w.z * t2,
        w.x * bitangent_sign(tangent_2, 0u) * cross(n0, t0)
            + w.y * bitangent_sign(tangent_2, 1u) * cross(n1, t1)
            + w.z * bitangent_sign(tangent_2, 2u) * cross(n2, t2),
        n, true);
}

// The frame's normal, bent by a normal map; unit.
fn mapped_normal(frame: ShadingFrame, map: TextureSlot, scale: f32, uvs: TextureCoordinates) -> vec3f {
    let n = normalize(frame.normal);
    if !scene_has_textures || !frame.has_tangents || !texture_exists(map) {
        return n;
    }
    let texel = texture_read(map, uvs).xyz * 2.0 - 1.0;
    let bent = frame.tangent * (texel.x * scale) + frame.bitangent * (texel.y * scale) + frame.normal * texel.z;
    return select(n, normalize(bent), dot(bent, bent) > 1e-12);
}

// The normal that a material is shaded with, in its mesh's space.
fn shading_normal(triangle: u32, uv: vec2f, uvs: TextureCoordinates) -> vec3f {
    let material = load_material(load_triangle(triangle).material);
    return mapped_normal(shading_frame(triangle, uv), material.normal_texture, material.normal_scale, uvs);
}

// A normal of a mesh's front in the world, on the viewer's side. An interpolated or mapped normal may face away from the
// viewer; it is bent back to the horizon, for the BSDF is defined only above it.
fn viewed_normal(instance: u32, normal: vec3f, side: f32, wo: vec3f) -> vec3f {
    var n = normal * side;
    if scene_has_instances {
        n = normalize(instance_normal(instance, n));
    }
    let facing = dot(n, wo);
    if facing < 1e-3 {
        n = normalize(n + wo * (1e-3 - facing));
    }
    return n;
}

// The surface at a point of a triangle, seen from `wo` (unit, towards the viewer) by a cone that is `footprint` metres
// wide there.
fn load_surface(instance: u32, triangle: u32, uv: vec2f, wo: vec3f, footprint: f32) -> Surface {
    let uvs = texture_coordinates(instance, triangle, uv, wo, footprint);
    let triangle_record = load_triangle(triangle);
    let material = load_material(triangle_record.material);
    var surface: Surface;
    surface.position = triangle_point(instance, triangle, uv);
    surface.wo = wo;
    surface.instance = instance;
    surface.triangle = triangle;
    surface.material = triangle_record.material;
    surface.footprint = footprint;
    surface.light = triangle_record.light;
    if scene_has_instances && triangle_record.light != NONE {
        surface.light += instance_first_light(instance);
    }

    let front = front_normal(instance, triangle, uv);
    surface.is_front = dot(front, wo) >= 0.0;
    let side = select(-1.0, 1.0, surface.is_front);
    surface.geometric_normal = front * side;
    surface.position_error = triangle_error(instance, triangle, front);
    let shading = shading_frame(triangle, uv);
    let normal = mapped_normal(shading, material.normal_texture, material.normal_scale, uvs);
    surface.basis = orthonormal_basis(viewed_normal(instance, normal, side, wo));
    surface.bsdf = core_bsdf(material, uvs, triangle_color(triangle, uv).rgb);

    surface.emission = vec3f(0.0);
    if surface.light != NONE && (surface.is_front || material.double_sided == 1u) {
        surface.emission = emitted_radiance(triangle, uv, abs(dot(front, wo))) * emitter_power(surface.light, false);
    }
    extend_surface(&surface, shading, uvs, side);
    return surface;
}

// Adds what the material has from glTF's extensions.
fn extend_surface(surface: ptr<function, Surface>, shading: ShadingFrame, uvs: TextureCoordinates,
    side: f32) {
    let extensions = load_extensions((*surface).material);
    var bsdf = (*surface).bsdf;
    extend_bsdf(&bsdf, extensions, uvs);
    if scene_has_anisotropy && shading.has_tangents {
        let anisotropy = load_anisotropy(extensions, uvs);
        var along = shading.tangent * anisotropy.direction.x + shading.bitangent * anisotropy.direction.y;
        if scene_has_instances {
            along = instance_vector((*surface).instance, TO_WORLD, along);
        }
        let n = (*surface).basis.normal;
        let tangent = along - n * dot(n, along);
        if anisotropy.strength > 0.0 && dot(tangent, tangent) > 1e-12 {
            let t = normalize(tangent);
            (*surface).basis = Basis(t, cross(n, t), n);
            bsdf.alpha.x = mix(bsdf.alpha.x, 1.0, anisotropy.strength * anisotropy.strength);
        }
    }
    if scene_has_clearcoat {
        let normal = mapped_normal(shading, extensions.clearcoat_normal_texture, extensions.clearcoat_normal_scale, uvs);
        bsdf.clearcoat_normal = basis_to_local((*surface).basis,
            viewed_normal((*surface).instance, normal, side, (*surface).wo));
    }
    (*surface).boundary = NONE;
    if scene_has_volumes && (extensions.flags & MATERIAL_VOLUME) != 0u {
        (*surface).boundary = (*surface).material;
    }
    if scene_has_unlit && (extensions.flags & MATERIAL_UNLIT) != 0u {
        // Shown as it is, and nothing reflected.
        (*surface).emission = bsdf.base_color;
        bsdf.base_color = vec3f(0.0);
        bsdf.metallic = 0.0;
        bsdf.f90 = 0.0;
    }
    if scene_has_specular {
        (*surface).specular_color =
            extensions.specular_color * texture_read(extensions.specular_color_texture, uvs).rgb;
        bsdf.f0 = dielectric_f0(extensions.ior, (*surface).specular_color, bsdf.f90);
    } else {
        bsdf.f0 *= bsdf.f90;
    }
    (*surface).bsdf = bsdf;
    if scene_has_volumes {
        let own = (*surface).boundary;
        surface_set_media(surface, select(own, NONE, (*surface).is_front), select(NONE, own, (*surface).is_front),
            ALL_CHANNELS);
    }
}

// Whether a direction leaves the surface on the viewer's side of the real geometry.
fn above_surface(surface: Surface, wi: vec3f) -> bool {
    return dot(surface.geometric_normal, wi) > 0.0;
}

// The index of refraction of a medium for a colour: red, green or blue counted from 1, or ALL_CHANNELS
// (KHR_materials_dispersion's spread over three colours).
const ALL_CHANNELS = 0u;

fn medium_ior(medium: u32, channel: u32) -> f32 {
    if medium == NONE {
        return 1.0;
    }
    let factors = extension_factors(medium, 3u); // index of refraction, dispersion
    if !scene_has_dispersion || channel == ALL_CHANNELS {
        return factors.x;
    }
    let half_spread = (factors.x - 1.0) * 0.025 * factors.y;
    return max(factors.x + (f32(channel) - 2.0) * half_spread, 1.0);
}

fn medium_absorption(medium: u32) -> vec3f {
    if medium == NONE {
        return vec3f(0.0);
    }
    return extension_factors(medium, 1u).xyz;
}

// Index-matched media are kept this far apart: at 1 a refraction's half vector has no direction.
const MINIMUM_BEND = 0.002;

// Tells a surface which media are above and below it.
fn surface_set_media(surface: ptr<function, Surface>, above: u32, below: u32, channel: u32) {
    (*surface).absorption_above = medium_absorption(above);
    (*surface).absorption_below = medium_absorption(below);
    // What is no boundary reflects by its own index, whatever lies behind it.
    let is_boundary = (*surface).boundary != NONE;
    let own = select((*surface).material, below, is_boundary);
    let eta = medium_ior(own, channel) / medium_ior(above, channel);
    (*surface).bsdf.f0 = dielectric_f0(eta, (*surface).specular_color, (*surface).bsdf.f90);
    if is_boundary {
        let least = select(1.0 - MINIMUM_BEND, 1.0 + MINIMUM_BEND, (*surface).is_front);
        (*surface).bsdf.eta = select(eta, least, abs(eta - 1.0) < MINIMUM_BEND);
    }
}

// f(wo, wi) |cos| of the lobes of a mask for a world direction. A direction must lie on the same side of the geometric
// and of the shading surface; else nothing is scattered there.
fn surface_evaluate_lobes(surface: Surface, lobes: u32, wi: vec3f) -> vec3f {
    let local = basis_to_local(surface.basis, wi);
    if above_surface(surface, wi) != (local.z > 0.0) {
        return vec3f(0.0);
    }
    return bsdf_evaluate(surface.bsdf, lobes, basis_to_local(surface.basis, surface.wo), local);
}

// The same of all lobes.
fn surface_evaluate(surface: Surface, wi: vec3f) -> vec3f {
    return surface_evaluate_lobes(surface, LOBE_ALL, wi);
}

// What a medium leaves of light over `distance` from the surface along wi (Beer and Lambert).
fn surface_transmittance(surface: Surface, wi: vec3f, distance: f32) -> vec3f {
    if !scene_has_volumes {
        return vec3f(1.0);
    }
    return exp(-distance * select(surface.absorption_below, surface.absorption_above, above_surface(surface, wi)));
}

// What the surface scatters towards wo of radiance that starts out at `distance` along wi: f |cos| and what the medium
// leaves of it.
fn surface_scatter(surface: Surface, wi: vec3f, distance: f32) -> vec3f {
    return surface_evaluate(surface, wi) * surface_transmittance(surface, wi, distance);
}

// Density per solid angle with which `surface_sample` draws wi.
fn surface_pdf(surface: Surface, wi: vec3f) -> f32 {
    return bsdf_pdf(surface.bsdf, LOBE_ALL, basis_to_local(surface.basis, surface.wo), basis_to_local(surface.basis, wi));
}

// A world direction drawn for the BSDF, above or below the surface; in the horizon, where everything is zero, if nothing
// was drawn.
fn surface_sample(surface: Surface, u: vec3f) -> vec3f {
    return normalize(basis_to_world(surface.basis,
        bsdf_sample(surface.bsdf, LOBE_ALL, basis_to_local(surface.basis, surface.wo), u).wi));
}

// Where a ray that leaves the surface towards `direction` begins: off the surface on that side, by no more than rounding
// makes necessary, so that it cannot hit the triangle it comes from.
fn ray_origin(surface: Surface, direction: vec3f) -> vec3f {
    let side = select(-1.0, 1.0, dot(surface.geometric_normal, direction) >= 0.0);
    return surface.position + surface.geometric_normal * (side * surface.position_error);
}

// Whether nothing stands between the surface and the point at `distance` along wi. The ray starts a little off the
// surface, on the side of wi, and still ends in that point: moved as a whole, it could run into a light before its end.
fn is_visible(surface: Surface, wi: vec3f, distance: f32) -> bool {
    return is_visible_from(frame.top_level, surface, wi, distance);
}

// The same in the scene of a frame, this one's or the previous one's, whose root is `top_level`.
fn is_visible_from(top_level: u32, surface: Surface, wi: vec3f, distance: f32) -> bool {
    let origin = ray_origin(surface, wi);
    let direction = wi - (origin - surface.position) / max(distance, 1e-12);
    return traverse_from(top_level, origin, direction, distance, true).triangle == NONE;
}
