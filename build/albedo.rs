//! The table of directional albedos that `shaders/lib/bsdf/albedo.wgsl` reads: what a surface sends back of light from
//! everywhere, over the cosine of the viewing angle and the roughness.
//!
//! Turquin 2019 keeps such a table for the energy that GGX loses; thesis 000, section 2.1.3 and table 1, integrates one
//! a material when a scene is loaded. Here it is integrated once, for all materials, when the program is built.

use std::f64::consts::{FRAC_PI_2, PI};

/// Entries along each axis.
pub const SIZE: usize = 32;
/// The shader's own limits (`ggx.wgsl`, `sheen.wgsl`).
const MINIMUM_ALPHA: f64 = 0.001;
const MINIMUM_SHEEN_ALPHA: f64 = 0.01;
/// Stands for the horizon, where the integrands are 0 / 0.
const MINIMUM_COSINE: f64 = 0.0005;
/// Steps of the midpoint rules along each dimension.
const GGX_STEPS: usize = 24;
const SHEEN_STEPS: usize = 32;
/// The same for smooth sheens, which are narrow.
const SMOOTH_SHEEN_STEPS: usize = 64;

/// RGBA8 texels, row by row: red E of GGX, green the share of F90 in it, blue E of the sheen up to 1, alpha a quarter of
/// what it has beyond 1. Rows: roughness; columns: the square root of the cosine, for all changes at the horizon. Rounded
/// up, so that what is built on them never gains light.
pub fn table() -> Vec<u8> {
    let cosine = |column: usize| (column as f64 / (SIZE - 1) as f64).powi(2).max(MINIMUM_COSINE);
    let mut texels = Vec::with_capacity(SIZE * SIZE * 4);
    let mut sheens = (0.0, Vec::new());
    for row in 0..SIZE {
        let alpha = (row as f64 / (SIZE - 1) as f64).powi(2);
        let sheen_alpha = alpha.max(MINIMUM_SHEEN_ALPHA);
        if sheens.0 != sheen_alpha {
            let sheen = Sheen::new(sheen_alpha);
            sheens = (sheen_alpha, (0..SIZE).map(|column| sheen.albedo(cosine(column))).collect());
        }
        for (column, sheen) in sheens.1.iter().enumerate() {
            let [whole, grazing] = ggx(alpha.max(MINIMUM_ALPHA), cosine(column));
            let channels = [whole, grazing, *sheen, 0.25 * (sheen - 1.0)];
            texels.extend(channels.map(|x| (x.clamp(0.0, 1.0) * 255.0).ceil() as u8));
        }
    }
    texels
}

/// Albedo of a GGX reflection with F = 1, and with F = Schlick's weight of F90: the mean of G2 / G1 over visible normals.
fn ggx(alpha: f64, cosine: f64) -> [f64; 2] {
    let lambda = |z: f64| 0.5 * ((1.0 + alpha * alpha * (1.0 - z * z).max(0.0) / (z * z)).sqrt() - 1.0);
    let wo = [(1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine];
    let stretched = normalize([alpha * wo[0], 0.0, wo[2]]);
    let (mut whole, mut grazing) = (0.0, 0.0);
    for i in 0..GGX_STEPS {
        let z = 1.0 - (i as f64 + 0.5) / GGX_STEPS as f64 * (1.0 + stretched[2]);
        let r = (1.0 - z * z).max(0.0).sqrt();
        for j in 0..GGX_STEPS {
            // Half a turn: the other half mirrors it.
            let (sin, cos) = (PI * (j as f64 + 0.5) / GGX_STEPS as f64).sin_cos();
            let cap = [r * cos + stretched[0], r * sin, z + stretched[2]];
            let h = normalize([alpha * cap[0], alpha * cap[1], cap[2]]);
            let wo_h = wo[0] * h[0] + wo[2] * h[2];
            let wi_z = 2.0 * wo_h * h[2] - wo[2];
            if wi_z <= 0.0 {
                continue;
            }
            let weight = (1.0 + lambda(cosine)) / (1.0 + lambda(cosine) + lambda(wi_z));
            whole += weight;
            grazing += weight * (1.0 - wo_h).max(0.0).powi(5);
        }
    }
    [whole, grazing].map(|sum| sum / (GGX_STEPS * GGX_STEPS) as f64)
}

/// Charlie's sheen at one roughness, with its masking kept for every step of the integral.
struct Sheen {
    alpha: f64,
    /// (cos theta_i, sin theta_i, Lambda).
    steps: Vec<[f64; 3]>,
}

impl Sheen {
    fn new(alpha: f64) -> Self {
        let count = if alpha < 0.06 { SMOOTH_SHEEN_STEPS } else { SHEEN_STEPS };
        let steps = (0..count)
            .map(|i| {
                let (sin, cos) = (FRAC_PI_2 * (i as f64 + 0.5) / count as f64).sin_cos();
                [cos, sin, sheen_lambda(alpha, cos)]
            })
            .collect();
        Sheen { alpha, steps }
    }

    /// The integral of f cos over the hemisphere by the midpoint rule in angles.
    fn albedo(&self, cosine: f64) -> f64 {
        let wo = [(1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine];
        let lambda = sheen_lambda(self.alpha, cosine);
        let count = self.steps.len();
        let mut sum = 0.0;
        for [cos_theta, sin_theta, lambda_i] in &self.steps {
            for j in 0..count {
                let (sin_phi, cos_phi) = (PI * (j as f64 + 0.5) / count as f64).sin_cos();
                let h = normalize([wo[0] + sin_theta * cos_phi, sin_theta * sin_phi, wo[2] + cos_theta]);
                let sin_2 = (1.0 - h[2] * h[2]).max(0.0);
                let d = (2.0 + 1.0 / self.alpha) * sin_2.powf(0.5 / self.alpha) / (2.0 * PI);
                sum += d / ((1.0 + lambda + lambda_i) * 4.0 * cosine) * sin_theta;
            }
        }
        // Half a turn counts twice.
        sum * 2.0 * (FRAC_PI_2 / count as f64) * (PI / count as f64)
    }
}

/// The fit of Conty Estevez and Kulla 2017, as KHR_materials_sheen prints it.
fn sheen_lambda(alpha: f64, cosine: f64) -> f64 {
    let t = (1.0 - alpha).powi(2);
    let mix = |x: f64, y: f64| x + (y - x) * t;
    let [a, b, c, d, e] = [
        mix(21.5473, 25.3245),
        mix(3.82987, 3.32435),
        mix(0.19823, 0.16801),
        mix(-1.97760, -1.27393),
        mix(-4.32054, -4.85967),
    ];
    let fit = |x: f64| a / (1.0 + b * x.powf(c)) + d * x + e;
    if cosine < 0.5 { fit(cosine).exp() } else { (2.0 * fit(0.5) - fit(1.0 - cosine)).exp() }
}

fn normalize(v: [f64; 3]) -> [f64; 3] {
    let scale = 1.0 / (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    v.map(|x| x * scale)
}
