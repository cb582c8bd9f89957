// Constants and small pure functions that everything else is made of.

const PI = 3.14159265358979;
const NONE = 0xffffffffu;

// Relative luminance of linear Rec. 709.
fn luminance(color: vec3f) -> f32 {
    return dot(color, vec3f(0.2126, 0.7152, 0.0722));
}

fn square(x: f32) -> f32 {
    return x * x;
}

// Two unit vectors orthogonal to the unit vector `n` and to each other.
struct Basis {
    tangent: vec3f,
    bitangent: vec3f,
    normal: vec3f,
}

// Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
fn orthonormal_basis(n: vec3f) -> Basis {
    let s = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    return Basis(vec3f(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3f(b, s + n.y * n.y * a, -n.y), n);
}

fn basis_to_world(basis: Basis, v: vec3f) -> vec3f {
    return basis.tangent * v.x + basis.bitangent * v.y + basis.normal * v.z;
}

fn basis_to_local(basis: Basis, v: vec3f) -> vec3f {
    return vec3f(dot(v, basis.tangent), dot(v, basis.bitangent), dot(v, basis.normal));
}

// Unit vector -> [-1, 1]^2, octahedral map (Meyer et al. 2010).
fn octahedral_encode(n: vec3f) -> vec2f {
    let p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    let folded = (1.0 - abs(p.yx)) * select(vec2f(-1.0), vec2f(1.0), p >= vec2f(0.0));
    return select(folded, p, n.z >= 0.0);
}

fn octahedral_decode(p: vec2f) -> vec3f {
    let z = 1.0 - abs(p.x) - abs(p.y);
    let t = max(-z, 0.0);
    let xy = p - select(vec2f(-t), vec2f(t), p >= vec2f(0.0));
    return normalize(vec3f(xy, z));
}

// IEEE bits, because a compiler may assume that `x != x` never holds.
fn is_nan(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7fffffffu) > 0x7f800000u;
}

fn is_infinite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7fffffffu) == 0x7f800000u;
}

fn is_finite(value: f32) -> bool {
    return !is_nan(value) && !is_infinite(value);
}
