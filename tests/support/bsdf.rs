//! The BSDF of `shaders/lib/bsdf`: its struct, its functions on the GPU, and the same functions written again in f64 from
//! the glTF specification, appendix B, and the extensions' texts rather than from the WGSL.

use super::harness::{TestInput, TestOutput, TestRun};
use glam::{DVec2, DVec3, DVec4, Vec2, Vec3};
use restir::Gpu;
use restir::gpu::albedo_table;
use restir::gpu::recorder::Recorder;
use restir::gpu::shader::{SceneFeatures, table};
use std::f64::consts::{PI, TAU};

restir::gpu_struct! {
/// A material at one point, as `bsdf.wgsl` declares it.
pub struct Bsdf {
    /// Linear Rec. 709.
    pub base_color: Vec3,
    /// 0 to 1.
    pub metallic: f32,
    /// Dielectric reflectance at normal incidence, times `f90`.
    pub f0: Vec3,
    /// Dielectric reflectance at grazing incidence: KHR_materials_specular's strength.
    pub f90: f32,
    /// GGX alpha along x and y.
    pub alpha: Vec2,
    /// 0 to 1.
    pub transmission: f32,
    /// Index of refraction below over above, or 0 for a thin wall.
    pub eta: f32,
    /// Linear Rec. 709.
    pub sheen_color: Vec3,
    /// Sheen roughness squared.
    pub sheen_alpha: f32,
    /// Unit.
    pub clearcoat_normal: Vec3,
    /// 0 to 1.
    pub clearcoat: f32,
    /// Clearcoat roughness squared.
    pub clearcoat_alpha: f32,
    /// 0 to 1.
    pub iridescence: f32,
    /// Index of refraction of the film.
    pub film_ior: f32,
    /// Nanometres.
    pub film_thickness: f32,
}
}

pub const DIFFUSE: u32 = 1;
pub const SPECULAR: u32 = 2;
pub const TRANSMISSION: u32 = 4;
pub const SHEEN: u32 = 8;
pub const CLEARCOAT: u32 = 16;
pub const ALL: u32 = 31;
/// Each lobe with its name.
pub const LOBES: [(u32, &str); 5] = [
    (DIFFUSE, "diffuse"),
    (SPECULAR, "specular"),
    (TRANSMISSION, "transmission"),
    (SHEEN, "sheen"),
    (CLEARCOAT, "clearcoat"),
];

/// The settings that change formulas.
#[derive(Debug, Clone, Copy, Default)]
pub struct Model {
    pub energy_compensation: bool,
    pub conserving_mix: bool,
}

impl Default for Bsdf {
    /// The specification's default dielectric: white, of index 1.5.
    fn default() -> Self {
        Bsdf {
            base_color: Vec3::ONE,
            metallic: 0.0,
            f0: Vec3::splat(0.04),
            f90: 1.0,
            alpha: Vec2::splat(0.25),
            transmission: 0.0,
            eta: 1.5,
            sheen_color: Vec3::ZERO,
            sheen_alpha: 0.25,
            clearcoat_normal: Vec3::Z,
            clearcoat: 0.0,
            clearcoat_alpha: 0.01,
            iridescence: 0.0,
            film_ior: 1.3,
            film_thickness: 400.0,
        }
    }
}

/// Operations of `shaders/tests/bsdf.wgsl`.
#[derive(Debug, Clone, Copy)]
pub enum Operation {
    Evaluate,
    Sample,
    Probabilities,
    Iridescence,
}

/// One question to the GPU: a material by its index, wo, then wi or random numbers, and the lobes it is about.
#[derive(Debug, Clone, Copy)]
pub struct Query {
    pub material: usize,
    pub wo: Vec3,
    pub b: Vec3,
    pub lobes: u32,
}

/// Answers queries on the GPU.
pub fn eval(gpu: &Gpu, operation: Operation, model: Model, materials: &[Bsdf], queries: &[Query]) -> Vec<TestOutput> {
    let inputs: Vec<_> = queries
        .iter()
        .map(|q| {
            let word = |v: Vec3, w: u32| [v.x.to_bits(), v.y.to_bits(), v.z.to_bits(), w];
            TestInput::new(&[word(q.wo, q.material as u32), word(q.b, q.lobes)])
        })
        .collect();
    let shader = &table::TESTS_BSDF;
    let run = TestRun { operation: operation as u32, count: inputs.len() as u32 };
    let uniform = gpu.uniform("test run", size_of::<TestRun>() as u64);
    gpu.queue.write_buffer(&uniform, 0, bytemuck::bytes_of(&run));
    let input = gpu.storage_of("test inputs", &inputs).expect("inputs fit");
    let materials = gpu.storage_of("test materials", materials).expect("materials fit");
    let size = (inputs.len() * size_of::<TestOutput>()) as u64;
    let output = gpu.storage("test outputs", size).expect("outputs fit");
    let mut recorder = Recorder::new(gpu, None);
    recorder.features = SceneFeatures {
        energy_compensation: model.energy_compensation,
        conserving_mix: model.conserving_mix,
        ..SceneFeatures::ALL
    };
    recorder
        .pass(shader)
        .bind("test_run", &uniform)
        .bind("test_inputs", &input)
        .bind("test_materials", &materials)
        .bind("test_outputs", &output)
        .dispatch([run.count.div_ceil(shader.workgroup_size[0]), 1, 1])
        .expect("everything is bound");
    recorder.submit();
    let bytes = pollster::block_on(gpu.read_buffer(&output, size)).expect("no device error");
    bytemuck::pod_collect_to_vec(&bytes)
}

fn d(v: Vec3) -> DVec3 {
    v.as_dvec3()
}

fn luminance(c: DVec3) -> f64 {
    c.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

/// (1 - x)^5.
pub fn schlick(x: f64) -> f64 {
    (1.0 - x.clamp(0.0, 1.0)).powi(5)
}

/// Anisotropic GGX as KHR_materials_anisotropy writes it.
pub fn distribution(alpha: DVec2, h: DVec3) -> f64 {
    let t = (h.x / alpha.x).powi(2) + (h.y / alpha.y).powi(2) + h.z * h.z;
    1.0 / (PI * alpha.x * alpha.y * t * t)
}

/// Smith's G1 of a direction, chi+ left to the caller.
pub fn g1(alpha: DVec2, w: DVec3) -> f64 {
    let slope = ((alpha.x * w.x).powi(2) + (alpha.y * w.y).powi(2)) / (w.z * w.z);
    2.0 / (1.0 + (1.0 + slope).sqrt())
}

/// Height-correlated V = G2 / (4 NL NV), in the anisotropic extension's form.
fn visibility(alpha: DVec2, wo: DVec3, wi: DVec3) -> f64 {
    let length = |w: DVec3| DVec3::new(alpha.x * w.x, alpha.y * w.y, w.z).length();
    0.5 / (wi.z * length(wo) + wo.z * length(wi))
}

/// KHR_materials_iridescence, with the base's reflectance kept below 1 as the WGSL says it is.
pub fn iridescent_fresnel(film_ior: f64, thickness: f64, f0: DVec3, cosine: f64) -> DVec3 {
    let f0_of = |transmitted: f64, incident: f64| ((transmitted - incident) / (transmitted + incident)).powi(2);
    let sin_2 = (1.0 / film_ior).powi(2) * (1.0 - cosine * cosine);
    if sin_2 > 1.0 {
        return DVec3::ONE;
    }
    let cosine_2 = (1.0 - sin_2).sqrt();
    let r0 = f0_of(film_ior, 1.0);
    let r12 = r0 + (1.0 - r0) * schlick(cosine);
    let t121 = 1.0 - r12;
    let phi12 = if film_ior < 1.0 { PI } else { 0.0 };
    let difference = 2.0 * film_ior * thickness * cosine_2;
    // Per channel everything but the spectral integral, whose colour mixes phases of all three.
    let mut r23 = DVec3::ZERO;
    let mut phi = DVec3::ZERO;
    for c in 0..3 {
        let root = (f0[c] + 0.0001).min(0.9999).sqrt();
        let base_ior = (1.0 + root) / (1.0 - root);
        let r1 = f0_of(base_ior, film_ior);
        r23[c] = r1 + (1.0 - r1) * schlick(cosine_2);
        phi[c] = (PI - phi12) + if base_ior < film_ior { PI } else { 0.0 };
    }
    let r123 = (r12 * r23).clamp(DVec3::splat(1e-5), DVec3::splat(0.9999));
    let rs = t121 * t121 * r23 / (1.0 - r123);
    let mut sum = DVec3::splat(r12) + rs;
    let mut cm = rs - t121;
    for m in 1..=2 {
        cm *= DVec3::new(r123.x.sqrt(), r123.y.sqrt(), r123.z.sqrt());
        sum += cm * 2.0 * sensitivity(f64::from(m) * difference, f64::from(m) * phi);
    }
    sum.clamp(DVec3::ZERO, DVec3::ONE)
}

fn sensitivity(difference: f64, shift: DVec3) -> DVec3 {
    let phase = TAU * difference * 1e-9;
    let gaussian = |value: f64, position: f64, variance: f64, shift: f64| {
        value * (TAU * variance).sqrt() * (position * phase + shift).cos() * (-phase * phase * variance).exp()
            / 1.0685e-7
    };
    let x = gaussian(5.4856e-13, 1.6810e6, 4.3278e9, shift.x) + gaussian(9.7470e-14, 2.2399e6, 4.5282e9, shift.x);
    let y = gaussian(4.4201e-13, 1.7953e6, 9.3046e9, shift.y);
    let z = gaussian(5.2481e-13, 2.2084e6, 6.6121e9, shift.z);
    DVec3::new(
        3.2404542 * x - 1.5371385 * y - 0.4985314 * z,
        -0.9692660 * x + 1.8760108 * y + 0.0415560 * z,
        0.0556434 * x - 0.2040259 * y + 1.0572252 * z,
    )
}

/// Charlie's sheen without colour and cosine.
pub fn sheen_value(alpha: f64, wo: DVec3, wi: DVec3) -> f64 {
    let h = (wo + wi).normalize();
    let sin_2 = h.x * h.x + h.y * h.y;
    let distribution = (2.0 + 1.0 / alpha) * sin_2.powf(0.5 / alpha) / TAU;
    let l = |x: f64| {
        let t = (1.0 - alpha) * (1.0 - alpha);
        let mix = |a: f64, b: f64| a * (1.0 - t) + b * t;
        mix(21.5473, 25.3245) / (1.0 + mix(3.82987, 3.32435) * x.powf(mix(0.19823, 0.16801)))
            + mix(-1.97760, -1.27393) * x
            + mix(-4.32054, -4.85967)
    };
    let lambda = |x: f64| if x < 0.5 { l(x).exp() } else { (2.0 * l(0.5) - l(1.0 - x)).exp() };
    distribution / ((1.0 + lambda(wo.z) + lambda(wi.z)) * 4.0 * wo.z * wi.z)
}

/// The albedo table (E, share of F90, sheen up to 1, a quarter of what is beyond), read bilinearly.
pub fn table_read(cosine: f64, roughness: f64) -> DVec4 {
    let last = f64::from(albedo_table::SIZE - 1);
    let p = DVec2::new(cosine.max(0.0).sqrt(), roughness).clamp(DVec2::ZERO, DVec2::ONE) * last;
    let (x, y) = ((p.x as usize).min(30), (p.y as usize).min(30));
    let texel = |x: usize, y: usize| {
        let at = (y * albedo_table::SIZE as usize + x) * 4;
        DVec4::from_array([0, 1, 2, 3].map(|c| f64::from(albedo_table::TEXELS[at + c]) / 255.0))
    };
    let f = p - DVec2::new(x as f64, y as f64);
    texel(x, y).lerp(texel(x + 1, y), f.x).lerp(texel(x, y + 1).lerp(texel(x + 1, y + 1), f.x), f.y)
}

impl Bsdf {
    fn alphas(&self) -> DVec2 {
        self.alpha.as_dvec2()
    }

    fn is_thin(&self) -> bool {
        self.eta == 0.0
    }

    /// KHR_materials_volume's three cases of Schlick's term, with the film mixed in.
    fn dielectric_fresnel(&self, cosine: f64) -> DVec3 {
        let eta = f64::from(self.eta);
        let mut c = cosine;
        if !self.is_thin() && eta < 1.0 {
            let sin_2 = (1.0 - cosine * cosine) / (eta * eta);
            if sin_2 >= 1.0 {
                return DVec3::ONE;
            }
            c = (1.0 - sin_2).sqrt();
        }
        let plain = d(self.f0).lerp(DVec3::splat(self.f90.into()), schlick(c));
        plain.lerp(self.film(d(self.f0), c), self.iridescence.into())
    }

    fn film(&self, f0: DVec3, cosine: f64) -> DVec3 {
        iridescent_fresnel(self.film_ior.into(), self.film_thickness.into(), f0, cosine)
    }

    fn metal_fresnel(&self, cosine: f64) -> DVec3 {
        let base = d(self.base_color);
        base.lerp(DVec3::ONE, schlick(cosine)).lerp(self.film(base, cosine), self.iridescence.into())
    }

    fn roughness(&self) -> f64 {
        (f64::from(self.alpha.x) * f64::from(self.alpha.y)).powf(0.25)
    }

    /// The half vector of a transmission, above the surface.
    fn half_vector(&self, wo: DVec3, wi: DVec3) -> DVec3 {
        if self.is_thin() {
            return (wo + DVec3::new(wi.x, wi.y, -wi.z)).normalize();
        }
        let h = -(wo + f64::from(self.eta) * wi).normalize();
        if h.z < 0.0 { -h } else { h }
    }

    /// Density of the direction through a visible microfacet.
    fn transmission_pdf(&self, wo: DVec3, wi: DVec3) -> f64 {
        let h = self.half_vector(wo, wi);
        let (oh, ih, eta) = (wo.dot(h), wi.dot(h), f64::from(self.eta));
        // Visible normals: G1(wo) (wo.h) D(h) / cos.
        let visible = g1(self.alphas(), wo) * oh * distribution(self.alphas(), h) / wo.z;
        if self.is_thin() {
            return visible / (4.0 * oh);
        }
        if oh <= 0.0 || ih >= 0.0 {
            return 0.0;
        }
        visible * eta * eta * ih.abs() / (oh + eta * ih).powi(2)
    }

    /// The BTDF as the extensions print it.
    fn btdf(&self, wo: DVec3, wi: DVec3) -> f64 {
        let h = self.half_vector(wo, wi);
        let (oh, ih, eta) = (wo.dot(h), wi.dot(h), f64::from(self.eta));
        let dg = distribution(self.alphas(), h) * g1(self.alphas(), wo) * g1(self.alphas(), wi);
        if self.is_thin() {
            return dg / (4.0 * wo.z * wi.z.abs());
        }
        if oh <= 0.0 || ih >= 0.0 {
            return 0.0;
        }
        oh * ih.abs() / (wo.z * wi.z.abs()) * eta * eta * dg / (oh + eta * ih).powi(2)
    }

    fn coat_weight(&self, wo: DVec3) -> f64 {
        let cosine = d(self.clearcoat_normal).dot(wo).abs();
        f64::from(self.clearcoat) * (0.04 + 0.96 * schlick(cosine))
    }

    /// wo and wi in a frame whose z is the clearcoat's normal, if both lie above it.
    fn coat_frame(&self, wo: DVec3, wi: DVec3) -> Option<(DVec3, DVec3)> {
        let n = d(self.clearcoat_normal);
        let x = n.any_orthonormal_vector();
        let local = |w: DVec3| DVec3::new(w.dot(x), w.dot(n.cross(x)), w.dot(n));
        let (o, i) = (local(wo), local(wi));
        (o.z > 1e-6 && i.z > 1e-6).then_some((o, i))
    }

    fn sheen_albedo(&self, cosine: f64) -> f64 {
        let table = table_read(cosine.abs(), f64::from(self.sheen_alpha).sqrt());
        table.z + 4.0 * table.w
    }

    fn sheen_scale(&self, cosine: f64) -> f64 {
        d(self.sheen_color).max_element() * self.sheen_albedo(cosine)
    }

    /// Albedo of the dielectric's specular layer, for the conserving mix.
    fn layer_albedo(&self, cosine: f64, model: Model) -> f64 {
        let e = table_read(cosine, self.roughness());
        let mut albedo = d(self.f0) * (e.x - e.y) + f64::from(self.f90) * e.y;
        if self.iridescence > 0.0 || (!self.is_thin() && self.eta < 1.0) {
            albedo = self.dielectric_fresnel(cosine) * e.x;
        }
        if model.energy_compensation {
            albedo *= 1.0 + d(self.f0) * (1.0 - e.x) / e.x;
        }
        albedo.max_element().min(1.0)
    }

    /// f |cos| of the lobes.
    pub fn evaluate(&self, model: Model, lobes: u32, wo: DVec3, wi: DVec3) -> DVec3 {
        if wo.z <= 1e-6 || wi.z.abs() <= 1e-6 {
            return DVec3::ZERO;
        }
        let on = |lobe: u32| f64::from(u8::from(lobes & lobe != 0));
        let coat = self.coat_weight(wo);
        let sheen_scaling = (1.0 - self.sheen_scale(wo.z)).min(1.0 - self.sheen_scale(wi.z)).max(0.0);
        let (base, metallic) = (d(self.base_color), f64::from(self.metallic));
        let transmission = f64::from(self.transmission);
        if wi.z < 0.0 {
            let f = self.dielectric_fresnel(wo.dot(self.half_vector(wo, wi))).max_element();
            let dielectric = (1.0 - f) * transmission * base * self.btdf(wo, wi);
            let material = dielectric * (1.0 - metallic) * on(TRANSMISSION);
            return material * sheen_scaling * (1.0 - coat) * wi.z.abs();
        }
        let h = (wo + wi).normalize();
        let cosine = wo.dot(h);
        let fresnel = self.dielectric_fresnel(cosine);
        let share = if model.conserving_mix {
            (1.0 - self.layer_albedo(wo.z, model)).min(1.0 - self.layer_albedo(wi.z, model))
        } else {
            1.0 - fresnel.max_element()
        };
        let diffuse = base / PI * (1.0 - transmission) * share * (1.0 - metallic);
        let brdf = distribution(self.alphas(), h) * visibility(self.alphas(), wo, wi);
        let mut specular = fresnel.lerp(self.metal_fresnel(cosine), metallic) * brdf;
        if model.energy_compensation {
            let e = table_read(wo.z, self.roughness()).x;
            specular *= 1.0 + d(self.f0).lerp(base, metallic) * (1.0 - e) / e;
        }
        let mut sheen = d(self.sheen_color) * sheen_value(self.sheen_alpha.into(), wo, wi);
        if model.conserving_mix {
            sheen /= self.sheen_albedo(wo.z).max(self.sheen_albedo(wi.z)).max(1.0);
        }
        let clearcoat = match self.coat_frame(wo, wi) {
            Some((o, i)) => {
                let alpha = DVec2::splat(self.clearcoat_alpha.into());
                // The coat's own cosine in place of the base's: it is a BRDF about another normal.
                distribution(alpha, (o + i).normalize()) * visibility(alpha, o, i) * i.z / wi.z
            }
            None => 0.0,
        };
        let material = (diffuse * on(DIFFUSE) + specular * on(SPECULAR)) * sheen_scaling + sheen * on(SHEEN);
        (material * (1.0 - coat) + clearcoat * coat * on(CLEARCOAT)) * wi.z
    }

    /// Probabilities of the lobes of a mask, in the order of [`LOBES`].
    pub fn probabilities(&self, lobes: u32, wo: DVec3) -> [f64; 5] {
        let coat = self.coat_weight(wo);
        let sheen_albedo = self.sheen_albedo(wo.z).min(1.0);
        let below = (1.0 - coat) * (1.0 - d(self.sheen_color).max_element() * sheen_albedo);
        let fresnel = self.dielectric_fresnel(wo.z);
        let (metallic, transmission) = (f64::from(self.metallic), f64::from(self.transmission));
        let base = (1.0 - metallic) * luminance(d(self.base_color));
        let through = below * base * (1.0 - fresnel.max_element());
        let specular = below * luminance(fresnel.lerp(self.metal_fresnel(wo.z), metallic));
        let weights = [
            (through * (1.0 - transmission), base * (1.0 - transmission) > 0.0),
            (specular, true),
            (through * transmission, base * transmission > 0.0),
            ((1.0 - coat) * luminance(d(self.sheen_color)) * sheen_albedo, self.sheen_color != Vec3::ZERO),
            (coat, self.clearcoat > 0.0),
        ];
        let mut index = 0;
        let asked = weights.map(|(weight, present)| {
            let on = lobes & LOBES[index].0 != 0;
            index += 1;
            (if on { weight } else { 0.0 }, present && on)
        });
        let sum: f64 = asked.iter().map(|(weight, _)| weight).sum();
        let raised = asked.map(|(weight, present)| if present { (weight / sum.max(1e-20)).max(0.1) } else { 0.0 });
        let total: f64 = raised.iter().sum();
        raised.map(|p| p / total.max(1e-20))
    }

    /// Density of the sampler for a mask.
    pub fn pdf(&self, lobes: u32, wo: DVec3, wi: DVec3) -> f64 {
        if wo.z <= 1e-6 || wi.z.abs() <= 1e-6 {
            return 0.0;
        }
        let [diffuse, specular, transmission, sheen, clearcoat] = self.probabilities(lobes, wo);
        if wi.z < 0.0 {
            return transmission * self.transmission_pdf(wo, wi);
        }
        let reflection =
            |alpha: DVec2, o: DVec3, i: DVec3| g1(alpha, o) * distribution(alpha, (o + i).normalize()) / (4.0 * o.z);
        let coat =
            self.coat_frame(wo, wi).map_or(0.0, |(o, i)| reflection(DVec2::splat(self.clearcoat_alpha.into()), o, i));
        diffuse * wi.z / PI + specular * reflection(self.alphas(), wo, wi) + sheen / TAU + clearcoat * coat
    }
}
