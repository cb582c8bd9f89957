// Reflectance of a thin film over a base (Belcour and Barla 2017), in the approximation that KHR_materials_iridescence
// states: Schlick's Fresnel terms at both interfaces, no polarisation, and the sum over bounces in the film integrated
// over the spectrum by Gaussian fits to the colour matching functions, cut after two terms.
#include "lib/math.wgsl"
#include "lib/bsdf/fresnel.wgsl"

// The spectral integral of one term, in linear Rec. 709: `difference` is the optical path difference in nanometres,
// `shift` the phase that the interfaces add.
fn iridescent_sensitivity(difference: f32, shift: vec3f) -> vec3f {
    let phase = 2.0e-9 * PI * difference;
    // Gaussians in frequency for X, Y and Z, and a second one for the short end of X: height, centre, variance.
    let height = vec3f(5.4856e-13, 4.4201e-13, 5.2481e-13);
    let center = vec3f(1.6810e6, 1.7953e6, 2.2084e6);
    let variance = vec3f(4.3278e9, 9.3046e9, 6.6121e9);
    var xyz = height * sqrt(2.0 * PI * variance) * cos(center * phase + shift) * exp(-variance * phase * phase);
    xyz.x += 9.7470e-14 * sqrt(2.0 * PI * 4.5282e9) * cos(2.2399e6 * phase + shift.x) * exp(-4.5282e9 * phase * phase);
    xyz /= 1.0685e-7;
    return vec3f(
        dot(xyz, vec3f(3.2404542, -1.5371385, -0.4985314)),
        dot(xyz, vec3f(-0.9692660, 1.8760108, 0.0415560)),
        dot(xyz, vec3f(0.0556434, -0.2040259, 1.0572252)));
}

// Reflectance in air of a film of index `film_ior`, `thickness` nanometres thick, over a base that alone would reflect
// `base_f0` at normal incidence. Cut to [0, 1]: the truncated sum can leave it by a little, and the base below would
// then be lit negatively.
fn iridescent_reflectance(film_ior: f32, thickness: f32, base_f0: vec3f, cosine: f32) -> vec3f {
    let cosine_2_squared = 1.0 - (1.0 - cosine * cosine) / (film_ior * film_ior);
    if cosine_2_squared < 0.0 {
        return vec3f(1.0);
    }
    let cosine_2 = sqrt(cosine_2_squared);

    // Air to film.
    let r12 = mix(normal_reflectance(film_ior), 1.0, schlick_weight(cosine));
    let t121 = 1.0 - r12;
    let phi21 = select(PI, 0.0, film_ior < 1.0);

    // Film to base, whose index follows from its reflectance in air. The guard keeps a perfect mirror's index finite.
    let root = sqrt(min(base_f0 + 0.0001, vec3f(0.9999)));
    let base_ior = (1.0 + root) / (1.0 - root);
    let r = (base_ior - film_ior) / (base_ior + film_ior);
    let r23 = mix(r * r, vec3f(1.0), schlick_weight(cosine_2));
    let phi = phi21 + select(vec3f(0.0), vec3f(PI), base_ior < vec3f(film_ior));

    let difference = 2.0 * film_ior * thickness * cosine_2;
    let r123 = clamp(r12 * r23, vec3f(1e-5), vec3f(0.9999));
    let amplitude = sqrt(r123);
    let rs = t121 * t121 * r23 / (1.0 - r123);
    var sum = r12 + rs;
    var term = (rs - t121) * amplitude;
    sum += term * 2.0 * iridescent_sensitivity(difference, phi);
    term *= amplitude;
    sum += term * 2.0 * iridescent_sensitivity(2.0 * difference, 2.0 * phi);
    return clamp(sum, vec3f(0.0), vec3f(1.0));
}
