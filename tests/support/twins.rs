//! Shader functions written again in f64, from their sources rather than from the WGSL.

use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_4, PI};

/// PCG4D (Jarzynski and Olano 2020).
pub fn pcg4d(seed: [u32; 4]) -> [u32; 4] {
    let mut v = seed.map(|x| x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    let mix = |v: &mut [u32; 4]| {
        for (i, j, k) in [(0, 1, 3), (1, 2, 0), (2, 0, 1), (3, 1, 2)] {
            v[i] = v[i].wrapping_add(v[j].wrapping_mul(v[k]));
        }
    };
    mix(&mut v);
    v = v.map(|x| x ^ (x >> 16));
    mix(&mut v);
    v
}

/// Shirley and Chiu 1997.
pub fn sample_disk(u: DVec2) -> DVec2 {
    let o = 2.0 * u - 1.0;
    if o == DVec2::ZERO {
        return DVec2::ZERO;
    }
    let (r, theta) = if o.x.abs() > o.y.abs() {
        (o.x, FRAC_PI_4 * o.y / o.x)
    } else {
        (o.y, 2.0 * FRAC_PI_4 - FRAC_PI_4 * o.x / o.y)
    };
    r * DVec2::from_angle(theta)
}

/// glTF 2.0 appendix B metallic-roughness BRDF; +z is the normal.
#[derive(Debug, Clone, Copy)]
pub struct Brdf {
    /// Linear Rec. 709.
    pub base_color: DVec3,
    /// 0 to 1.
    pub metallic: f64,
    /// Roughness squared.
    pub alpha: f64,
}

impl Brdf {
    /// The BRDF itself, without the cosine, as the specification writes it: mix(dielectric_brdf, metal_brdf, metallic)
    /// with the height-correlated Smith visibility V = G / (4 NL NV).
    pub fn value(&self, wo: DVec3, wi: DVec3) -> DVec3 {
        let h = (wo + wi).normalize();
        let a2 = self.alpha * self.alpha;
        let d = a2 / (PI * (h.z * h.z * (a2 - 1.0) + 1.0).powi(2));
        let v = 0.5 / (wi.z * (a2 + (1.0 - a2) * wo.z * wo.z).sqrt() + wo.z * (a2 + (1.0 - a2) * wi.z * wi.z).sqrt());
        let fresnel = (1.0 - wo.dot(h).clamp(0.0, 1.0)).powi(5);
        let metal = d * v * (self.base_color + (1.0 - self.base_color) * fresnel);
        let f = 0.04 + 0.96 * fresnel;
        let dielectric = self.base_color / PI * (1.0 - f) + DVec3::splat(d * v * f);
        dielectric.lerp(metal, self.metallic)
    }
}

/// IEC 61966-2-1, one channel.
pub fn srgb_encode(x: f64) -> f64 {
    if x <= 0.0031308 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

/// IEC 61966-2-1, one channel.
pub fn srgb_decode(x: f64) -> f64 {
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

/// Khronos PBR Neutral, from the published GLSL.
pub fn tone_map_neutral(color: DVec3) -> DVec3 {
    let start = 0.8 - 0.04;
    let x = color.min_element();
    let offset = if x < 0.08 { x - 6.25 * x * x } else { 0.04 };
    let color = color - offset;
    let peak = color.max_element();
    if peak < start {
        return color;
    }
    let d = 1.0 - start;
    let new_peak = 1.0 - d * d / (peak + d - start);
    let g = 1.0 - 1.0 / (0.15 * (peak - new_peak) + 1.0);
    (color * new_peak / peak).lerp(DVec3::splat(new_peak), g)
}

/// Stephen Hill's ACES fit, its matrices by rows as published.
pub fn tone_map_aces(color: DVec3) -> DVec3 {
    let apply = |rows: [[f64; 3]; 3], v: DVec3| DVec3::from_array(rows.map(|row| DVec3::from_array(row).dot(v)));
    let x = apply([[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]], color);
    let fit = (x * (x + 0.0245786) - 0.000090537) / (x * (0.983729 * x + 0.432951) + 0.238081);
    apply([[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]], fit)
}
