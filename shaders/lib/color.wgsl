// Encoding and tone mapping. Input: linear Rec. 709 after exposure. Output: linear Rec. 709 in [0, 1], then sRGB.

const TONE_MAP_LINEAR = 0u;
const TONE_MAP_ACES = 1u;
const TONE_MAP_AGX = 2u;
const TONE_MAP_NEUTRAL = 3u;

// IEC 61966-2-1.
fn srgb_encode(c: vec3f) -> vec3f {
    let x = clamp(c, vec3f(0.0), vec3f(1.0));
    return select(1.055 * pow(x, vec3f(1.0 / 2.4)) - 0.055, 12.92 * x, x <= vec3f(0.0031308));
}

fn srgb_decode(c: vec3f) -> vec3f {
    return select(pow((c + 0.055) / 1.055, vec3f(2.4)), c / 12.92, c <= vec3f(0.04045));
}

// Stephen Hill's fit of the ACES reference and output transforms.
fn tone_map_aces(color: vec3f) -> vec3f {
    let input = mat3x3f(
        vec3f(0.59719, 0.07600, 0.02840),
        vec3f(0.35458, 0.90834, 0.13383),
        vec3f(0.04823, 0.01566, 0.83777),
    );
    let output = mat3x3f(
        vec3f(1.60475, -0.10208, -0.00327),
        vec3f(-0.53108, 1.10813, -0.07276),
        vec3f(-0.07367, -0.00605, 1.07602),
    );
    let x = input * color;
    return output * ((x * (x + 0.0245786) - 0.000090537) / (x * (0.983729 * x + 0.4329510) + 0.238081));
}

// Troy Sobotka's AgX, base look: a log2 encoding between fixed stops and a polynomial fit of its sigmoid
// (Benjamin Wrensch's minimal form). The result is display-encoded, so it is linearised here.
fn tone_map_agx(color: vec3f) -> vec3f {
    let inset = mat3x3f(
        vec3f(0.842479062253094, 0.0423282422610123, 0.0423756549057051),
        vec3f(0.0784335999999992, 0.878468636469772, 0.0784336),
        vec3f(0.0792237451477643, 0.0791661274605434, 0.879142973793104),
    );
    let outset = mat3x3f(
        vec3f(1.19687900512017, -0.0528968517574562, -0.0529716355144438),
        vec3f(-0.0980208811401368, 1.15190312990417, -0.0980434501171241),
        vec3f(-0.0990297440797205, -0.0989611768448433, 1.15107367264116),
    );
    let low = -12.47393;
    let high = 4.026069;
    let x = (clamp(log2(max(inset * color, vec3f(1e-10))), vec3f(low), vec3f(high)) - low) / (high - low);
    let x2 = x * x;
    let x4 = x2 * x2;
    let curve = 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232;
    return pow(max(outset * curve, vec3f(0.0)), vec3f(2.2));
}

// Khronos PBR Neutral: base colours come out as they went in up to 0.8, highlights are compressed and desaturated.
fn tone_map_neutral(color: vec3f) -> vec3f {
    let start = 0.8 - 0.04;
    let x = min(color.r, min(color.g, color.b));
    let offset = select(0.04, x - 6.25 * x * x, x < 0.08);
    let shifted = color - offset;
    let peak = max(shifted.r, max(shifted.g, shifted.b));
    if peak < start {
        return shifted;
    }
    let d = 1.0 - start;
    let new_peak = 1.0 - d * d / (peak + d - start);
    let g = 1.0 - 1.0 / (0.15 * (peak - new_peak) + 1.0);
    return mix(shifted * (new_peak / peak), vec3f(new_peak), g);
}

fn tone_map(kind: u32, color: vec3f) -> vec3f {
    switch kind {
        case TONE_MAP_ACES: { return tone_map_aces(color); }
        case TONE_MAP_AGX: { return tone_map_agx(color); }
        case TONE_MAP_NEUTRAL: { return tone_map_neutral(color); }
        default: { return color; }
    }
}
