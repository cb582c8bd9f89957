// From what the film holds to what is displayed.
#include "film/film.wgsl"
#include "lib/color.wgsl"

// The colour map at 0 to 1.
fn mapped(place: f32) -> vec3f {
    let step = clamp(place, 0.0, 1.0) * f32(COLOR_STEPS - 1u);
    let low = min(u32(step), COLOR_STEPS - 2u);
    return mix(film.colors[low].rgb, film.colors[low + 1u].rgb, step - f32(low));
}

// sRGB of a number. By magnitude, what is 0 has no place on the scale, and is black.
fn map_color(value: f32) -> vec3f {
    if film.scale == SCALE_NUMBER {
        return mapped((value - film.low) / (film.high - film.low));
    }
    return select(vec3f(0.0), mapped(log(max(value, 1e-37) / film.low) / log(film.high / film.low)), value > 0.0);
}

// sRGB-encoded RGBA8, red in the lowest byte; `automatic_exposure` in EV.
fn shown(value: vec3f, automatic_exposure: f32) -> u32 {
    if film.scale >= SCALE_NUMBER {
        return pack4x8unorm(vec4f(map_color(value.r), 1.0));
    }
    var color = value;
    if film.scale == SCALE_RADIANCE {
        let ev = film.exposure + select(0.0, automatic_exposure, film.automatic_exposure == 1u);
        color = tone_map(film.tone_map, max(color * exp2(ev), vec3f(0.0)));
    }
    return pack4x8unorm(vec4f(srgb_encode(color), 1.0));
}
