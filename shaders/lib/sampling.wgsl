// Warps from the unit square to the domains of light transport, with their densities.
#include "lib/math.wgsl"

// Unit disk, concentric map (Shirley and Chiu 1997); density 1 / pi.
fn sample_disk(u: vec2f) -> vec2f {
    let offset = 2.0 * u - 1.0;
    if offset.x == 0.0 && offset.y == 0.0 {
        return vec2f(0.0);
    }
    let x_wider = abs(offset.x) > abs(offset.y);
    let r = select(offset.y, offset.x, x_wider);
    let theta = select(PI / 2.0 - PI / 4.0 * (offset.x / offset.y), PI / 4.0 * (offset.y / offset.x), x_wider);
    return r * vec2f(cos(theta), sin(theta));
}

// Hemisphere about +z; density cos(theta) / pi.
fn sample_cosine_hemisphere(u: vec2f) -> vec3f {
    let d = sample_disk(u);
    return vec3f(d, sqrt(max(0.0, 1.0 - dot(d, d))));
}

// Barycentric weights of the corners 1 and 2 of a triangle; uniform over its area.
fn sample_triangle(u: vec2f) -> vec2f {
    let r = sqrt(u.x);
    return vec2f(r * (1.0 - u.y), r * u.y);
}

// The inverse of `sample_triangle`.
fn unsample_triangle(weights: vec2f) -> vec2f {
    let r = weights.x + weights.y;
    return vec2f(r * r, weights.y / max(r, 1e-20));
}

// The inverse of `sample_disk`.
fn unsample_disk(p: vec2f) -> vec2f {
    let x_wider = abs(p.x) > abs(p.y);
    let wide = select(p.y, p.x, x_wider);
    let narrow = select(p.x, p.y, x_wider);
    if wide == 0.0 {
        return vec2f(0.5);
    }
    let r = sign(wide) * length(p);
    let other = r * atan(narrow / wide) * (4.0 / PI);
    return 0.5 * select(vec2f(other, r), vec2f(r, other), x_wider) + 0.5;
}
