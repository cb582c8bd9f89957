// From what the film holds to what is displayed.
#include "film/film.wgsl"
#include "lib/color.wgsl"

// sRGB-encoded RGBA8, red in the lowest byte; `automatic_exposure` in EV.
fn shown(value: vec3f, automatic_exposure: f32) -> u32 {
    var color = value;
    if film.raw == 0u {
        let ev = film.exposure + select(0.0, automatic_exposure, film.automatic_exposure == 1u);
        color = tone_map(film.tone_map, max(color * exp2(ev), vec3f(0.0)));
    }
    return pack4x8unorm(vec4f(srgb_encode(color), 1.0));
}
