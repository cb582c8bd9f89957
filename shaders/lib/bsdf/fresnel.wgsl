// Schlick's approximation of the Fresnel term (Schlick 1994), as glTF 2.0, appendix B.3.4, and KHR_materials_volume use it.

// The weight of F90: the fifth power of 1 - cos.
fn schlick_weight(cosine: f32) -> f32 {
    let x = clamp(1.0 - cosine, 0.0, 1.0);
    return x * x * x * x * x;
}

// The cosine that Schlick's formula wants, on the side of the lower index of refraction; -1 at total internal reflection.
// `eta` is the index beyond the surface over the index on the side of the cosine.
fn schlick_cosine(eta: f32, cosine: f32) -> f32 {
    let sin_2 = (1.0 - cosine * cosine) / (eta * eta);
    return select(sqrt(max(1.0 - sin_2, 0.0)), -1.0, sin_2 >= 1.0);
}

// Reflectance at normal incidence between indices of ratio `eta`.
fn normal_reflectance(eta: f32) -> f32 {
    let r = (eta - 1.0) / (eta + 1.0);
    return r * r;
}

fn max_component(color: vec3f) -> f32 {
    return max(color.r, max(color.g, color.b));
}
