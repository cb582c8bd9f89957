// What glTF's extensions add to a material: one record a material of the data texture `material_extensions`, which only
// scenes that use an extension have (src/scene/flat/extensions.rs). Loaders read whole records; what a scene does not
// use, its `scene_has_` overrides leave out.
#include "scene/data.wgsl"
#include "lib/bsdf/lobes.wgsl"

struct MaterialExtensions {
    specular_color: vec3f,
    specular: f32,
    absorption: vec3f, // 1/m
    transmission: f32,
    sheen_color: vec3f,
    sheen_roughness: f32,
    ior: f32,
    dispersion: f32,
    clearcoat: f32,
    clearcoat_roughness: f32,
    anisotropy_direction: vec2f,
    anisotropy: f32,
    clearcoat_normal_scale: f32,
    iridescence: f32,
    film_ior: f32,
    film_thickness_minimum: f32, // nanometres
    film_thickness_maximum: f32,
    flags: u32,
    padding_0: u32,
    padding_1: u32,
    padding_2: u32,
    specular_texture: TextureSlot,
    specular_color_texture: TextureSlot,
    transmission_texture: TextureSlot,
    clearcoat_texture: TextureSlot,
    clearcoat_roughness_texture: TextureSlot,
    clearcoat_normal_texture: TextureSlot,
    sheen_color_texture: TextureSlot,
    sheen_roughness_texture: TextureSlot,
    anisotropy_texture: TextureSlot,
    iridescence_texture: TextureSlot,
    iridescence_thickness_texture: TextureSlot,
}

const MATERIAL_UNLIT = 1u;
const MATERIAL_VOLUME = 2u;

override scene_has_volumes: bool = true;
override scene_has_dispersion: bool = true;
override scene_has_unlit: bool = true;
override scene_has_anisotropy: bool = true;
override scene_has_specular: bool = true;

@group(0) @binding(21) var material_extensions: texture_2d<u32>;

fn extension_texel(material: u32, texel: u32) -> vec4u {
    return textureLoad(material_extensions, data_texel(material * 29u + texel), 0);
}

fn extension_factors(material: u32, texel: u32) -> vec4f {
    return bitcast<vec4f>(extension_texel(material, texel));
}

fn extension_slot(material: u32, index: u32) -> TextureSlot {
    if !scene_has_textures {
        return TextureSlot();
    }
    let u = extension_texel(material, 7u + 2u * index);
    let v = extension_texel(material, 8u + 2u * index);
    return TextureSlot(bitcast<vec3f>(u.xyz), u.w, bitcast<vec3f>(v.xyz), v.w);
}

fn load_extensions(material: u32) -> MaterialExtensions {
    if !(scene_has_specular || scene_has_transmission || scene_has_volumes || scene_has_unlit || scene_has_anisotropy
        || scene_has_sheen || scene_has_clearcoat || scene_has_iridescence) {
        return MaterialExtensions();
    }
    let specular = extension_factors(material, 0u);
    let volume = extension_factors(material, 1u);
    let sheen = extension_factors(material, 2u);
    let factors = extension_factors(material, 3u);
    let anisotropy = extension_factors(material, 4u);
    let film = extension_factors(material, 5u);
    let flags = extension_texel(material, 6u);
    return MaterialExtensions(
        specular.xyz, specular.w, volume.xyz, volume.w, sheen.xyz, sheen.w,
        factors.x, factors.y, factors.z, factors.w, anisotropy.xy, anisotropy.z, anisotropy.w,
        film.x, film.y, film.z, film.w, flags.x, flags.y, flags.z, flags.w,
        extension_slot(material, 0u), extension_slot(material, 1u), extension_slot(material, 2u),
        extension_slot(material, 3u), extension_slot(material, 4u), extension_slot(material, 5u),
        extension_slot(material, 6u), extension_slot(material, 7u), extension_slot(material, 8u),
        extension_slot(material, 9u), extension_slot(material, 10u));
}
