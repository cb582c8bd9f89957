// Primitives other than triangles, all held by three points p0, p1, p2. With e1 = p1 - p0 and e2 = p2 - p0 a rectangle
// is the parallelogram of the edges, a disk the ellipse round p0 with the edges for half axes (conjugate ones, so that
// any affine map of a disk is one), a sphere has its centre in p0 and the radius |e1|.
#include "lib/math.wgsl"
#include "lib/sampling.wgsl"

const SHAPE_TRIANGLE = 0u;
const SHAPE_RECTANGLE = 1u;
const SHAPE_DISK = 2u;
const SHAPE_SPHERE = 3u;

// Whether the point p0 + u e1 + v e2 belongs to a flat shape.
fn shape_contains(shape: u32, uv: vec2f) -> bool {
    switch shape {
        case SHAPE_RECTANGLE: { return all(uv >= vec2f(0.0)) && all(uv <= vec2f(1.0)); }
        case SHAPE_DISK: { return dot(uv, uv) <= 1.0; }
        default: { return uv.x >= 0.0 && uv.y >= 0.0 && uv.x + uv.y <= 1.0; }
    }
}

// A point of a flat shape, uniform over its area; of a sphere, the point of its octahedral map.
fn shape_sample(shape: u32, u: vec2f) -> vec2f {
    switch shape {
        case SHAPE_RECTANGLE, SHAPE_SPHERE: { return u; }
        case SHAPE_DISK: { return sample_disk(u); }
        default: { return sample_triangle(u); }
    }
}

// The inverse of `shape_sample`.
fn shape_unsample(shape: u32, uv: vec2f) -> vec2f {
    switch shape {
        case SHAPE_RECTANGLE, SHAPE_SPHERE: { return uv; }
        case SHAPE_DISK: { return unsample_disk(uv); }
        default: { return unsample_triangle(uv); }
    }
}

// The area of a flat shape over |e1 x e2|.
fn shape_area_factor(shape: u32) -> f32 {
    switch shape {
        case SHAPE_RECTANGLE: { return 1.0; }
        case SHAPE_DISK: { return PI; }
        default: { return 0.5; }
    }
}

// Points of a sphere by the square of its octahedral map.
fn sphere_normal(uv: vec2f) -> vec3f {
    return octahedral_decode(2.0 * uv - 1.0);
}

fn sphere_uv(normal: vec3f) -> vec2f {
    return 0.5 * octahedral_encode(normal) + 0.5;
}

// Where a ray enters a sphere from outside, or a negative number. `origin` is relative to the centre. The discriminant
// from the ray's nearest point, and the near root by way of the product of both: neither cancels for a small sphere far
// away (Haines, Günther and Akenine-Möller 2019, Ray Tracing Gems, chapter 7).
fn enter_sphere(origin: vec3f, direction: vec3f, radius: f32) -> f32 {
    let a = dot(direction, direction);
    let b = -dot(origin, direction);
    let nearest = origin + direction * (b / a);
    let discriminant = radius * radius - dot(nearest, nearest);
    let c = dot(origin, origin) - radius * radius;
    if b <= 0.0 || c <= 0.0 || discriminant < 0.0 {
        return -1.0;
    }
    return c / (b + sqrt(a * discriminant));
}

// 1 - cos of the half angle under which a sphere is seen from a point at `distance_2` (squared) from its centre, outside.
fn sphere_cone_height(distance_2: f32, radius: f32) -> f32 {
    let sin_2 = radius * radius / distance_2;
    return sin_2 / (1.0 + sqrt(max(0.0, 1.0 - sin_2)));
}

// The normal of a point of a sphere that is seen from a point, uniform in solid angle over the cone (Pharr, Jakob and
// Humphreys, Physically Based Rendering, 6.2.4). `center` is relative to the viewer, outside of the sphere.
fn sample_visible_sphere(center: vec3f, radius: f32, u: vec2f) -> vec3f {
    let distance_2 = dot(center, center);
    let height = u.x * sphere_cone_height(distance_2, radius); // 1 - cos(theta)
    let sin_2 = height * (2.0 - height);
    let distance = sqrt(distance_2);
    // To the near side along the direction that was drawn.
    let t = distance * (1.0 - height) - sqrt(max(0.0, radius * radius - distance_2 * sin_2));
    let phi = 2.0 * PI * u.y;
    let r = sqrt(sin_2);
    let basis = orthonormal_basis(center / distance);
    let direction = basis_to_world(basis, vec3f(r * cos(phi), r * sin(phi), 1.0 - height));
    return normalize(t * direction - center);
}
