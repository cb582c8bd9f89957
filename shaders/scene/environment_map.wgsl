// The equirectangular map that surrounds the scene (docs/conventions.md): its coordinates, texels and solid angles.
#include "scene/bindings.wgsl"

// acos(y) by way of atan2, which drivers compute a hundred times more accurately. At the poles, where atan2 is
// undefined, the middle column.
fn environment_uv(direction: vec3f) -> vec2f {
    let r = length(direction.xz);
    let z = select(-direction.z, 1.0, r == 0.0);
    return vec2f(0.5 + atan2(direction.x, z) / (2.0 * PI), atan2(r, direction.y) / PI);
}

// The inverse of `environment_uv`.
fn environment_direction(uv: vec2f) -> vec3f {
    let phi = 2.0 * PI * (uv.x - 0.5);
    let theta = PI * uv.y;
    let r = sin(theta);
    return vec3f(r * sin(phi), cos(theta), -r * cos(phi));
}

fn environment_texel(p: vec2i, size: vec2i) -> vec3f {
    let x = ((p.x % size.x) + size.x) % size.x;
    return textureLoad(environment_radiance, vec2i(x, clamp(p.y, 0, size.y - 1)), 0).rgb;
}

// Radiance at a point of the map, bilinear.
fn environment_read(uv: vec2f) -> vec3f {
    let size = vec2i(textureDimensions(environment_radiance));
    let p = uv * vec2f(size) - 0.5;
    let base = floor(p);
    let f = p - base;
    let i = vec2i(base);
    let top = mix(environment_texel(i, size), environment_texel(i + vec2i(1, 0), size), f.x);
    let bottom = mix(environment_texel(i + vec2i(0, 1), size), environment_texel(i + vec2i(1, 1), size), f.x);
    return mix(top, bottom, f.y);
}

// Solid angle of a texel of a row. cos(a) - cos(b) as a product, and from the nearer pole: neither loses digits there.
fn environment_texel_solid_angle(row: u32, size: vec2u) -> f32 {
    let from_pole = f32(min(2u * row + 1u, 2u * (size.y - row) - 1u));
    let half = 0.5 * PI / f32(size.y);
    return 4.0 * PI / f32(size.x) * sin(from_pole * half) * sin(half);
}
