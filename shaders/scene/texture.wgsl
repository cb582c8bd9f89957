// Textures: every image of the scene is a rectangle in one layer of a texture array, with its mip chain in the levels of
// that layer. Filtering is done here rather than by a sampler so that wrapping works inside a rectangle, sRGB is decoded
// before filtering whatever the format, and every driver gives the same answer.
// Sources: Williams 1983 for the levels; Akenine-Möller et al. 2019 (Ray Tracing Gems, chapter 20) and 2021 (JCGT 10(1))
// for choosing one along a ray. docs/textures.md says where this departs from them.
#include "scene/data.wgsl"
#include "lib/color.wgsl"

const WRAP_REPEAT = 0u;
const WRAP_MIRROR = 1u;
const WRAP_CLAMP = 2u;

// Where a texture is read, and how much of it counts.
struct TextureCoordinates {
    uvs: vec4f, // set 0 in xy, set 1 in zw
    areas: vec2f, // of the ray's footprint in units of set 0 and set 1; 0 reads level 0
}

// Level 0 at the texture coordinates `uvs`.
fn texture_finest(uvs: vec4f) -> TextureCoordinates {
    return TextureCoordinates(uvs, vec2f(0.0));
}

// A TextureSlot unpacked.
struct TextureImage {
    array: u32,
    layer: u32,
    origin: vec2u, // texels, in level 0
    size: vec2u, // texels, in level 0
    wrap: vec2u, // WRAP_*
    srgb: bool,
    linear_filter: bool,
}

fn texture_exists(slot: TextureSlot) -> bool {
    return (slot.place >> 31u) != 0u;
}

fn texture_image(slot: TextureSlot) -> TextureImage {
    return TextureImage(
        (slot.place >> 28u) & 3u,
        (slot.place >> 20u) & 0xffu,
        8u * ((vec2u(slot.place) >> vec2u(0u, 10u)) & vec2u(0x3ffu)),
        1u + ((vec2u(slot.size) >> vec2u(0u, 13u)) & vec2u(0x1fffu)),
        (vec2u(slot.size) >> vec2u(26u, 28u)) & vec2u(3u),
        (slot.size & 0x40000000u) != 0u,
        (slot.size & 0x80000000u) != 0u,
    );
}

// Coordinates as `wrap_texel` wants them: one period of the pattern, or near enough to the edge that is held.
fn wrap_coordinate(x: f32, mode: u32) -> f32 {
    let period = select(1.0, 2.0, mode == WRAP_MIRROR);
    return select(x - period * floor(x / period), clamp(x, -1.0, 2.0), mode == WRAP_CLAMP);
}

// The texel at `i`, which is at most one off the period.
fn wrap_texel(i: i32, size: i32, mode: u32) -> i32 {
    let repeated = select(select(i, i - size, i >= size), i + size, i < 0);
    let mirrored = select(i, 2 * size - 1 - i, i >= size);
    return clamp(select(select(i, mirrored, mode == WRAP_MIRROR), repeated, mode == WRAP_REPEAT), 0, size - 1);
}

// One texel of one level, as it is stored.
fn texture_load(array: u32, texel: vec2u, layer: u32, level: u32) -> vec4f {
    if scene_has_textures_1 && array == 1u {
        return textureLoad(textures_1, texel, layer, level);
    }
    if scene_has_textures_2 && array == 2u {
        return textureLoad(textures_2, texel, layer, level);
    }
    if scene_has_textures_3 && array == 3u {
        return textureLoad(textures_3, texel, layer, level);
    }
    return textureLoad(textures_0, texel, layer, level);
}

fn texture_texel(image: TextureImage, x: i32, y: i32, level: u32) -> vec4f {
    let texel = texture_load(image.array, (image.origin >> vec2u(level)) + vec2u(vec2i(x, y)), image.layer, level);
    return vec4f(select(texel.rgb, srgb_decode(texel.rgb), image.srgb), texel.a);
}

// One level at wrapped coordinates: bilinear, or the texel that they lie in.
fn texture_filter(image: TextureImage, st: vec2f, level: u32, nearest: bool) -> vec4f {
    let size = vec2i(max(image.size >> vec2u(level), vec2u(1u)));
    let p = st * vec2f(size);
    let from_center = select(p - 0.5, floor(p), nearest);
    let base = floor(from_center);
    let f = from_center - base;
    let i = vec2i(base);
    let x0 = wrap_texel(i.x, size.x, image.wrap.x);
    let x1 = wrap_texel(i.x + 1, size.x, image.wrap.x);
    let y0 = wrap_texel(i.y, size.y, image.wrap.y);
    let y1 = wrap_texel(i.y + 1, size.y, image.wrap.y);
    let top = mix(texture_texel(image, x0, y0, level), texture_texel(image, x1, y0, level), f.x);
    let bottom = mix(texture_texel(image, x0, y1, level), texture_texel(image, x1, y1, level), f.x);
    return mix(top, bottom, f.y);
}

// The level whose texel is as large as the footprint: half the base-2 logarithm of the texels it covers in level 0.
fn texture_level(slot: TextureSlot, size: vec2u, area: f32) -> f32 {
    let scale = abs(slot.row_u.x * slot.row_v.y - slot.row_u.y * slot.row_v.x);
    let texels = area * scale * f32(size.x) * f32(size.y);
    return clamp(0.5 * log2(max(texels, 1.0)), 0.0, f32(firstLeadingBit(max(size.x, size.y))));
}

// Linear RGBA; white where there is no texture. Trilinear: between the two levels round the footprint's.
fn texture_read(slot: TextureSlot, coordinates: TextureCoordinates) -> vec4f {
    if !scene_has_textures || !texture_exists(slot) {
        return vec4f(1.0);
    }
    let image = texture_image(slot);
    let is_set_1 = (slot.place & 0x40000000u) != 0u;
    let uv = vec3f(select(coordinates.uvs.xy, coordinates.uvs.zw, is_set_1), 1.0);
    let st = vec2f(wrap_coordinate(dot(slot.row_u, uv), image.wrap.x), wrap_coordinate(dot(slot.row_v, uv), image.wrap.y));
    let level = texture_level(slot, image.size, select(coordinates.areas.x, coordinates.areas.y, is_set_1));
    let f = fract(level);
    var value = vec4f(0.0);
    // A loop, so that what reads a level stands in a kernel once for each texture, and is run once where f is 0.
    for (var k = 0u; k < select(1u, 2u, f > 0.0); k += 1u) {
        let nearest = level == 0.0 && !image.linear_filter;
        value += select(f, 1.0 - f, k == 0u) * texture_filter(image, st, u32(level) + k, nearest);
    }
    return value;
}
