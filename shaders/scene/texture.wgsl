// Textures: every image of the scene is a rectangle in one layer of the atlas. Filtering is done here rather than by a
// sampler so that wrapping works inside a rectangle, sRGB is decoded before filtering whatever the format, and every
// driver gives the same answer.
#include "scene/bindings.wgsl"
#include "lib/color.wgsl"

const TEXTURE_UV_SET_1 = 1u;
const TEXTURE_SRGB = 2u;
const TEXTURE_LINEAR_FILTER = 4u;

fn wrap_texel(i: i32, size: i32, mode: u32) -> u32 {
    switch mode {
        case 1u: { // mirror
            let period = 2 * size;
            let m = ((i % period) + period) % period;
            return u32(select(m, period - 1 - m, m >= size));
        }
        case 2u: { // clamp
            return u32(clamp(i, 0, size - 1));
        }
        default: { // repeat
            return u32(((i % size) + size) % size);
        }
    }
}

fn texture_texel(slot: TextureSlot, p: vec2i) -> vec4f {
    let x = wrap_texel(p.x, i32(slot.width), (slot.flags >> 4u) & 3u);
    let y = wrap_texel(p.y, i32(slot.height), (slot.flags >> 6u) & 3u);
    let texel = textureLoad(atlas, vec2u(slot.x + x, slot.y + y), slot.layer, 0);
    if (slot.flags & TEXTURE_SRGB) != 0u {
        return vec4f(srgb_decode(texel.rgb), texel.a);
    }
    return texel;
}

// Linear RGBA at the texture coordinates `uvs` (set 0 in xy, set 1 in zw); white where there is no texture.
fn texture_read(slot: TextureSlot, uvs: vec4f) -> vec4f {
    if !scene_has_textures || slot.width == 0u {
        return vec4f(1.0);
    }
    let uv = vec3f(select(uvs.xy, uvs.zw, (slot.flags & TEXTURE_UV_SET_1) != 0u), 1.0);
    // Wrapped to a range where i32 and f32 are exact; 2 is the mirror's period.
    var st = vec2f(dot(slot.row_u, uv), dot(slot.row_v, uv));
    st = select(clamp(st, vec2f(-1.0), vec2f(2.0)), st - 2.0 * floor(st * 0.5),
        vec2<bool>(((slot.flags >> 4u) & 3u) != 2u, ((slot.flags >> 6u) & 3u) != 2u));
    let p = st * vec2f(f32(slot.width), f32(slot.height));
    if (slot.flags & TEXTURE_LINEAR_FILTER) == 0u {
        return texture_texel(slot, vec2i(floor(p)));
    }
    let base = floor(p - 0.5);
    let f = p - 0.5 - base;
    let i = vec2i(base);
    let top = mix(texture_texel(slot, i), texture_texel(slot, i + vec2i(1, 0)), f.x);
    let bottom = mix(texture_texel(slot, i + vec2i(0, 1)), texture_texel(slot, i + vec2i(1, 1)), f.x);
    return mix(top, bottom, f.y);
}
