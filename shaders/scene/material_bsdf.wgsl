// The BSDF of a material at a point: factors times textures, as glTF and its extensions put them together.
#include "scene/texture.wgsl"
#include "scene/material_extensions.wgsl"
#include "lib/bsdf/bsdf.wgsl"

// What the dielectric reflects at normal incidence, between indices of refraction of ratio `eta`.
fn dielectric_f0(eta: f32, specular_color: vec3f, strength: f32) -> vec3f {
    return min(normal_reflectance(eta) * specular_color, vec3f(1.0)) * strength;
}

// A material of the core specification. `color` is the vertex colour.
fn core_bsdf(material: Material, uvs: TextureCoordinates, color: vec3f) -> Bsdf {
    var bsdf: Bsdf;
    let metallic_roughness = texture_read(material.metallic_roughness_texture, uvs);
    let roughness = clamp(material.roughness * metallic_roughness.g, 0.0, 1.0);
    bsdf.base_color = clamp(material.base_color.rgb * color * texture_read(material.base_color_texture, uvs).rgb,
        vec3f(0.0), vec3f(1.0));
    bsdf.metallic = clamp(material.metallic * metallic_roughness.b, 0.0, 1.0);
    bsdf.alpha = vec2f(max(roughness * roughness, MINIMUM_ALPHA));
    bsdf.f0 = vec3f(0.04);
    bsdf.f90 = 1.0;
    return bsdf;
}

// Adds what the extensions have. Seen in air from the front; a medium changes `eta` and `f0` (scene/media.wgsl).
// Anisotropy and the clearcoat's normal are set where the surface's tangents are known.
fn extend_bsdf(bsdf: ptr<function, Bsdf>, extensions: MaterialExtensions, uvs: TextureCoordinates) {
    if scene_has_specular {
        (*bsdf).f90 = extensions.specular * texture_read(extensions.specular_texture, uvs).a;
    }
    if scene_has_transmission {
        (*bsdf).transmission = extensions.transmission * texture_read(extensions.transmission_texture, uvs).r;
        (*bsdf).eta = THIN_WALLED;
    }
    if scene_has_sheen {
        let roughness = extensions.sheen_roughness * texture_read(extensions.sheen_roughness_texture, uvs).a;
        (*bsdf).sheen_color = extensions.sheen_color * texture_read(extensions.sheen_color_texture, uvs).rgb;
        (*bsdf).sheen_alpha = max(roughness * roughness, MINIMUM_SHEEN_ALPHA);
    }
    if scene_has_clearcoat {
        let roughness = extensions.clearcoat_roughness * texture_read(extensions.clearcoat_roughness_texture, uvs).g;
        (*bsdf).clearcoat = extensions.clearcoat * texture_read(extensions.clearcoat_texture, uvs).r;
        (*bsdf).clearcoat_alpha = max(roughness * roughness, MINIMUM_ALPHA);
        (*bsdf).clearcoat_normal = vec3f(0.0, 0.0, 1.0);
    }
    if scene_has_iridescence {
        (*bsdf).iridescence = extensions.iridescence * texture_read(extensions.iridescence_texture, uvs).r;
        (*bsdf).film_ior = extensions.film_ior;
        (*bsdf).film_thickness = mix(extensions.film_thickness_minimum, extensions.film_thickness_maximum,
            texture_read(extensions.iridescence_thickness_texture, uvs).g);
    }
}

struct Anisotropy {
    direction: vec2f, // unit, in the plane of tangent and bitangent
    strength: f32,
}

// KHR_materials_anisotropy: the direction in which highlights are stretched.
fn load_anisotropy(extensions: MaterialExtensions, uvs: TextureCoordinates) -> Anisotropy {
    let turn = extensions.anisotropy_direction;
    if !scene_has_textures || !texture_exists(extensions.anisotropy_texture) {
        return Anisotropy(turn, extensions.anisotropy);
    }
    let texel = texture_read(extensions.anisotropy_texture, uvs).rgb;
    let d = texel.rg * 2.0 - 1.0;
    let direction = select(vec2f(1.0, 0.0), normalize(d), dot(d, d) > 1e-12);
    return Anisotropy(vec2f(turn.x * direction.x - turn.y * direction.y, turn.y * direction.x + turn.x * direction.y),
        extensions.anisotropy * texel.b);
}
