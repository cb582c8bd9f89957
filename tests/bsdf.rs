//! The BSDF lobe by lobe: each equals its f64 twin, is drawn with the density it claims, is reciprocal where it should be,
//! and sends back no more light than it gets. Seeds are fixed.

mod support;

use glam::{DVec3, Vec2, Vec3};
use restir::Gpu;
use restir::gpu::albedo_table;
use restir::scene::random::Random;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use support::bsdf::{
    ALL, Bsdf, CLEARCOAT, DIFFUSE, LOBES, Model, Operation, Query, SHEEN, SPECULAR, TRANSMISSION, eval, g1,
    iridescent_fresnel, schlick, sheen_value, table_read,
};
use support::statistics::{chi_squared, significance};
use support::{fresh_gpu, gpu};

const SPECIFICATION: Model = Model { energy_compensation: false, conserving_mix: false };
const CONSERVING: Model = Model { energy_compensation: false, conserving_mix: true };
const COMPENSATED: Model = Model { energy_compensation: true, conserving_mix: true };

fn d(v: Vec3) -> DVec3 {
    v.as_dvec3()
}

fn xyz(v: [f32; 4]) -> Vec3 {
    Vec3::new(v[0], v[1], v[2])
}

fn polar(theta: f64, phi: f64) -> Vec3 {
    DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()).as_vec3()
}

/// Materials with every lobe and every mixture of them.
fn materials(random: &mut Random) -> Vec<Bsdf> {
    let mut all = Vec::new();
    for i in 0..160 {
        let mut on = |chance: f32| random.unit() < chance;
        let (metal, glass, sheen, coat, film, aniso) = (on(0.5), on(0.5), on(0.3), on(0.4), on(0.3), on(0.4));
        let mut unit = || random.unit();
        let alpha = [0.03f32, 0.1, 0.3, 0.7, 1.0][i % 5];
        let mut material = Bsdf { alpha: Vec2::splat(alpha), ..Bsdf::default() };
        material.base_color = Vec3::new(unit(), unit(), unit());
        material.metallic = if metal { unit() } else { 0.0 };
        material.f90 = if i % 3 == 0 { unit() } else { 1.0 };
        material.f0 = Vec3::new(unit(), unit(), unit()) * 0.3 * material.f90;
        if glass {
            material.transmission = if i % 2 == 0 { 1.0 } else { unit() };
            material.eta = [0.0, 1.0 / 1.5, 1.5, 1.33, 2.4, 1.0 / 2.4][i % 6];
        }
        if sheen {
            material.sheen_color = Vec3::new(unit(), unit(), unit());
            material.sheen_alpha = 0.02 + 0.98 * unit();
        }
        if coat {
            material.clearcoat = unit();
            material.clearcoat_alpha = 0.02 + 0.5 * unit();
            material.clearcoat_normal = Vec3::new(0.4 * unit() - 0.2, 0.4 * unit() - 0.2, 1.0).normalize();
        }
        if film {
            material.iridescence = unit();
            material.film_ior = 1.2 + unit();
            material.film_thickness = 800.0 * unit();
        }
        if aniso {
            material.alpha.x = material.alpha.x + unit() * (1.0 - material.alpha.x);
        }
        all.push(material);
    }
    all
}

/// Queries over a material: wo above, wi anywhere, half of them where narrow lobes are.
fn queries(materials: &[Bsdf], each: usize, lobes: u32, random: &mut Random) -> Vec<Query> {
    let mut all = Vec::new();
    for (index, material) in materials.iter().enumerate() {
        for i in 0..each {
            let mut wo = random.direction();
            wo.z = wo.z.abs().max(0.02);
            let wo = wo.normalize();
            let mut wi = random.direction();
            if i % 2 == 0 {
                let h = (Vec3::Z + material.alpha.x * random.unit() * random.direction()).normalize();
                wi = if i % 4 == 0 || material.transmission == 0.0 {
                    2.0 * wo.dot(h) * h - wo
                } else if material.eta == 0.0 {
                    (2.0 * wo.dot(h) * h - wo) * Vec3::new(1.0, 1.0, -1.0)
                } else {
                    (-wo).refract(h, 1.0 / material.eta)
                };
            }
            if wi.z.abs() > 1e-2 {
                all.push(Query { material: index, wo, b: wi.normalize(), lobes });
            }
        }
    }
    all
}

/// How many of some thousands of evaluations differ from the twin's, in value and in density, and the first of them.
fn differences(gpu: &Gpu, model: Model, lobes: u32, materials: &[Bsdf], seed: u64) -> (usize, usize, String) {
    let queries = queries(materials, 24, lobes, &mut Random::new(seed));
    let (mut values, mut densities, mut first) = (0, 0, String::new());
    for (query, output) in queries.iter().zip(eval(gpu, Operation::Evaluate, model, materials, &queries)) {
        let material = &materials[query.material];
        let (wo, wi) = (d(query.wo), d(query.b));
        let expected = material.evaluate(model, lobes, wo, wi).extend(material.pdf(lobes, wo, wi));
        let actual = glam::Vec4::from(output.a()).as_dvec4();
        // f32 near the spike of a distribution, where the half vector's last bits decide.
        let far = |c: usize| (actual[c] - expected[c]).abs() > 1e-5 + 2e-3 * expected[c].abs();
        let is_value = far(0) || far(1) || far(2);
        values += usize::from(is_value);
        densities += usize::from(far(3));
        if first.is_empty() && (is_value || far(3)) {
            first = format!("{actual} is not {expected}: {query:?} {material:?}");
        }
    }
    (values, densities, first)
}

#[test]
fn every_lobe_equals_its_twin() {
    let materials = materials(&mut Random::new(1));
    for model in [SPECIFICATION, CONSERVING, COMPENSATED] {
        for lobes in [ALL, DIFFUSE, SPECULAR, TRANSMISSION, SHEEN, CLEARCOAT, SPECULAR | TRANSMISSION] {
            let (values, densities, first) = differences(&gpu(), model, lobes, &materials, lobes.into());
            assert_eq!((values, densities), (0, 0), "{model:?}, lobes {lobes}: {first}");
        }
    }
}

/// One fault at a time in the shaders: each must be seen by the comparison with the twin.
#[test]
fn planted_faults_are_seen() {
    let materials = materials(&mut Random::new(1));
    let plants = [
        ("no Jacobian of refraction", "eta * eta * -wi_h", "-wi_h"),
        ("masking of one side only", "* ggx_masking(alpha, wi)", "* 1.0"),
        ("Schlick's cosine on the dense side", "c = schlick_cosine(bsdf.eta, cosine);", "c = cosine;"),
        ("the base not dimmed by the coat", "(1.0 - coat) * sheen_transmittance", "sheen_transmittance"),
        (
            "the film's second term left out",
            "sum += term * 2.0 * iridescent_sensitivity(2.0",
            "sum += term * 0.0 * iridescent_sensitivity(2.0",
        ),
        ("alphas of the axes swapped", "h.xy / alpha;", "h.xy / alpha.yx;"),
    ];
    for (what, old, new) in plants {
        let gpu = fresh_gpu();
        gpu.plant(old, new).expect(what);
        let (values, densities, _) = differences(&gpu, SPECIFICATION, ALL, &materials, 7);
        println!("{what}: {values} values and {densities} densities are wrong");
        assert!(values > 30, "'{what}' went unnoticed");
    }
}

#[test]
fn probabilities_equal_their_twin() {
    let mut random = Random::new(2);
    let materials = materials(&mut random);
    for lobes in [ALL, SPECULAR | DIFFUSE, SHEEN | TRANSMISSION, CLEARCOAT] {
        let queries = queries(&materials, 8, lobes, &mut random);
        let outputs = eval(&gpu(), Operation::Probabilities, SPECIFICATION, &materials, &queries);
        for (query, output) in queries.iter().zip(outputs) {
            let expected = materials[query.material].probabilities(lobes, d(query.wo));
            let actual = [output.a()[0], output.a()[1], output.a()[2], output.a()[3], output.b()[0]];
            for (actual, expected) in actual.into_iter().zip(expected) {
                assert!((f64::from(actual) - expected).abs() < 1e-3, "{actual} is not {expected}: {query:?}");
            }
        }
    }
}

/// What one named lobe does adds up to what all do together.
#[test]
fn lobes_add_up() {
    let mut random = Random::new(3);
    let materials = materials(&mut random);
    let whole = queries(&materials, 16, ALL, &mut random);
    let of = |lobes: u32| -> Vec<DVec3> {
        let queries: Vec<_> = whole.iter().map(|q| Query { lobes, ..*q }).collect();
        let outputs = eval(&gpu(), Operation::Evaluate, SPECIFICATION, &materials, &queries);
        outputs.iter().map(|o| d(xyz(o.a()))).collect()
    };
    let parts = LOBES.map(|(lobe, _)| of(lobe));
    for (i, sum) in of(ALL).into_iter().enumerate() {
        let added: DVec3 = parts.iter().map(|part| part[i]).sum();
        assert!(added.distance(sum) <= 1e-5 + 1e-4 * sum.length(), "{added} is not {sum}: {:?}", whole[i]);
    }
    // And each is somewhere something.
    for (part, (_, name)) in parts.iter().zip(LOBES) {
        assert!(part.iter().filter(|v| v.max_element() > 0.01).count() > 100, "{name}");
    }
}

/// f(wo, wi) = f(wi, wo) for reflections; for refraction f / eta^2 is (Walter et al. 2007, without the scale of radiance).
/// Not for the clearcoat, whose Fresnel factor looks at the viewer only, nor what lies below it, nor with energy
/// compensation: the extension and Turquin trade it for simplicity.
#[test]
fn lobes_are_reciprocal() {
    let mut random = Random::new(4);
    let mut materials = materials(&mut random);
    materials.iter_mut().for_each(|m| m.clearcoat = 0.0);
    let across: Vec<Bsdf> =
        materials.iter().map(|m| Bsdf { eta: if m.eta == 0.0 { 0.0 } else { 1.0 / m.eta }, ..*m }).collect();
    for (lobes, model) in [
        (DIFFUSE, SPECIFICATION),
        (DIFFUSE, CONSERVING),
        (SPECULAR, SPECIFICATION),
        (SHEEN, SPECIFICATION),
        (SHEEN, CONSERVING),
        (TRANSMISSION, SPECIFICATION),
    ] {
        let there = queries(&materials, 24, lobes, &mut random);
        // Seen from the other side, "up" is down.
        let flip = |w: Vec3, turn: bool| if turn { w * Vec3::new(1.0, 1.0, -1.0) } else { w };
        let back: Vec<_> = there
            .iter()
            .map(|q| {
                let turn = q.b.z < 0.0;
                Query { wo: flip(q.b, turn), b: flip(q.wo, turn), ..*q }
            })
            .collect();
        let there_values = eval(&gpu(), Operation::Evaluate, model, &materials, &there);
        let mut back_values = eval(&gpu(), Operation::Evaluate, model, &materials, &back);
        let crossed = eval(&gpu(), Operation::Evaluate, model, &across, &back);
        let mut compared = 0;
        for (i, query) in there.iter().enumerate() {
            let material = &materials[query.material];
            let mut scale = 1.0;
            if query.b.z < 0.0 {
                back_values[i] = crossed[i];
                if material.eta != 0.0 {
                    scale = f64::from(material.eta).powi(2);
                }
            }
            for c in 0..3 {
                let f = f64::from(there_values[i].a()[c] / query.b.z.abs()) / scale;
                let g = f64::from(back_values[i].a()[c] / query.wo.z);
                assert!((f - g).abs() <= 1e-5 + 3e-3 * g, "lobe {lobes}: {f} there, {g} back: {query:?} {material:?}");
                compared += usize::from(g > 1e-3);
            }
        }
        assert!(compared > 500, "lobe {lobes}: {compared}");
    }
}

#[test]
fn nothing_is_scattered_along_the_horizon() {
    let material = Bsdf { transmission: 0.5, sheen_color: Vec3::ONE, clearcoat: 1.0, ..Bsdf::default() };
    let (up, flat) = (Vec3::new(0.6, 0.0, 0.8), Vec3::X);
    let queries =
        [(up, flat), (flat, up), (-up, up), (flat, flat)].map(|(wo, b)| Query { material: 0, wo, b, lobes: ALL });
    for output in eval(&gpu(), Operation::Evaluate, SPECIFICATION, &[material], &queries) {
        assert_eq!(output.a(), [0.0; 4]);
    }
    // A lobe that is not there is black, its density zero, and so is a wall that lets nothing through.
    let plain = Bsdf::default();
    let mut asked: Vec<_> = [TRANSMISSION, SHEEN, CLEARCOAT]
        .map(|lobes| Query { material: 0, wo: up, b: Vec3::new(0.0, 0.6, 0.8), lobes })
        .to_vec();
    asked.push(Query { material: 0, wo: up, b: -up, lobes: ALL });
    for output in eval(&gpu(), Operation::Evaluate, SPECIFICATION, &[plain], &asked) {
        assert_eq!(output.a(), [0.0; 4]);
    }
}

/// Bins over the sphere: polar angle times azimuth; the last one is for samples that draw nothing.
const POLAR: usize = 24;
const AZIMUTH: usize = 12;
const POLAR_STEPS: usize = 24;
const AZIMUTH_STEPS: usize = 48;
const SAMPLES: usize = 20_000;

fn bin_of(w: DVec3) -> usize {
    if w.z.abs() <= 1e-6 {
        return POLAR * AZIMUTH;
    }
    let polar = (w.z.clamp(-1.0, 1.0).acos() / PI * POLAR as f64) as usize;
    let azimuth = ((w.y.atan2(w.x) / TAU).rem_euclid(1.0) * AZIMUTH as f64) as usize;
    polar.min(POLAR - 1) * AZIMUTH + azimuth.min(AZIMUTH - 1)
}

/// The probability of every bin under a density, by the midpoint rule; what is missing to 1 is not drawn.
fn integrate(pdf: impl Fn(DVec3) -> f64) -> Vec<f64> {
    let (polar_steps, azimuth_steps) = (POLAR * POLAR_STEPS, AZIMUTH * AZIMUTH_STEPS);
    let (d_theta, d_phi) = (PI / polar_steps as f64, TAU / azimuth_steps as f64);
    let mut bins = vec![0.0; POLAR * AZIMUTH];
    for i in 0..polar_steps {
        let (sin, cos) = ((i as f64 + 0.5) * d_theta).sin_cos();
        for j in 0..azimuth_steps {
            let (sin_phi, cos_phi) = ((j as f64 + 0.5) * d_phi).sin_cos();
            let w = DVec3::new(sin * cos_phi, sin * sin_phi, cos);
            bins[(i / POLAR_STEPS) * AZIMUTH + j / AZIMUTH_STEPS] += pdf(w) * sin * d_theta * d_phi;
        }
    }
    let drawn: f64 = bins.iter().sum();
    assert!(drawn < 1.003, "the density integrates to {drawn}");
    bins.push((1.0 - drawn).max(0.0));
    bins
}

fn histogram(material: &Bsdf, lobes: u32, wo: Vec3, seed: u64) -> Vec<f64> {
    let mut random = Random::new(seed);
    let queries: Vec<_> = (0..SAMPLES)
        .map(|_| Query { material: 0, wo, b: Vec3::new(random.unit(), random.unit(), random.unit()), lobes })
        .collect();
    let mut counts = vec![0.0; POLAR * AZIMUTH + 1];
    for output in eval(&gpu(), Operation::Sample, SPECIFICATION, &[*material], &queries) {
        let wi = d(xyz(output.a()));
        assert!((wi.length() - 1.0).abs() < 1e-4, "{wi}");
        let drawn = output.a[3];
        assert!(drawn == 0 || drawn & lobes == drawn, "lobe {drawn} of {lobes}");
        assert!(drawn != 0 || wi.z.abs() < 1e-6, "nothing was drawn, but {wi}");
        assert_eq!(output.b()[3] > 0.0, drawn != 0, "{wi} of lobe {drawn} has density {}", output.b()[3]);
        counts[bin_of(wi)] += 1.0;
    }
    counts
}

fn p_value(counts: &[f64], probabilities: &[f64]) -> f64 {
    let n: f64 = counts.iter().sum();
    chi_squared(counts, &probabilities.iter().map(|p| p * n).collect::<Vec<_>>())
}

/// Chi-squared of each lobe's sampler, and of the whole, against the density that the twin gives; and against a density
/// a little wrong, which must be rejected.
#[test]
fn every_lobe_is_sampled_with_its_density() {
    let glass = Bsdf { transmission: 1.0, ..Bsdf::default() };
    let everything = Bsdf {
        base_color: Vec3::new(0.8, 0.5, 0.2),
        transmission: 0.5,
        metallic: 0.2,
        sheen_color: Vec3::new(0.3, 0.5, 0.6),
        clearcoat: 1.0,
        clearcoat_alpha: 0.2,
        clearcoat_normal: Vec3::new(0.2, -0.1, 1.0).normalize(),
        alpha: Vec2::new(0.5, 0.2),
        ..Bsdf::default()
    };
    let rough = |material: Bsdf, x: f32, y: f32| Bsdf { alpha: Vec2::new(x, y), ..material };
    let plain = Bsdf { base_color: Vec3::new(0.8, 0.5, 0.2), ..Bsdf::default() };
    let cases = [
        ("diffuse", plain, DIFFUSE),
        ("specular", rough(plain, 0.15, 0.15), SPECULAR),
        ("specular, rough", rough(plain, 1.0, 1.0), SPECULAR),
        ("specular, anisotropic", rough(plain, 0.6, 0.15), SPECULAR),
        ("thin transmission", Bsdf { eta: 0.0, ..rough(glass, 0.4, 0.4) }, TRANSMISSION),
        ("thin transmission, anisotropic", Bsdf { eta: 0.0, ..rough(glass, 0.7, 0.2) }, TRANSMISSION),
        ("refraction into glass", rough(glass, 0.3, 0.3), TRANSMISSION),
        ("refraction into diamond", Bsdf { eta: 2.4, ..rough(glass, 0.5, 0.5) }, TRANSMISSION),
        ("refraction out of glass", Bsdf { eta: 1.0 / 1.5, ..rough(glass, 0.3, 0.3) }, TRANSMISSION),
        ("refraction out, anisotropic", Bsdf { eta: 1.0 / 1.3, ..rough(glass, 0.6, 0.25) }, TRANSMISSION),
        ("rough glass", rough(glass, 0.4, 0.4), ALL),
        ("rough glass from inside", Bsdf { eta: 1.0 / 1.5, ..rough(glass, 0.4, 0.4) }, ALL),
        ("sheen", Bsdf { sheen_color: Vec3::ONE, ..plain }, SHEEN),
        ("clearcoat, tilted", everything, CLEARCOAT),
        ("plastic", rough(plain, 0.3, 0.3), ALL),
        ("metal", Bsdf { metallic: 1.0, ..rough(plain, 0.4, 0.4) }, ALL),
        ("everything", everything, ALL),
        ("specular and sheen of everything", everything, SPECULAR | SHEEN),
    ];
    let angles = [0.4, 1.25];
    let significance = significance(cases.len() * angles.len());
    for (i, (name, material, lobes)) in cases.into_iter().enumerate() {
        for (j, theta) in angles.into_iter().enumerate() {
            let wo = polar(theta, 0.7);
            let counts = histogram(&material, lobes, wo, (200 + 2 * i + j) as u64);
            let p = p_value(&counts, &integrate(|wi| material.pdf(lobes, d(wo), wi)));
            println!("{name}, theta {theta}: p = {p:.3}");
            assert!(p > significance, "{name}, theta {theta}: p = {p:e}");
            let wrong = if lobes & (SPECULAR | TRANSMISSION) == 0 {
                // A tenth of the samples uniform over the sphere.
                integrate(|wi| 0.9 * material.pdf(lobes, d(wo), wi) + 0.1 / (2.0 * TAU))
            } else {
                let other = Bsdf { alpha: material.alpha * 0.6, ..material };
                integrate(|wi| other.pdf(lobes, d(wo), wi))
            };
            let p = p_value(&counts, &wrong);
            assert!(p < significance, "{name}, theta {theta}: a wrong density passed with p = {p:e}");
        }
    }
}

/// Albedo of one lobe towards wo: the mean of f |cos| / density over a regular grid of random numbers.
fn lobe_albedos(model: Model, materials: &[Bsdf], lobes: &[u32], cosines: &[f32]) -> Vec<Vec<Vec<f64>>> {
    const STEPS: u32 = 48;
    let each = (STEPS * STEPS) as usize;
    let mut queries = Vec::new();
    for material in 0..materials.len() {
        for &cosine in cosines {
            let wo = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
            for &lobes in lobes {
                queries.extend((0..STEPS * STEPS).map(|i| {
                    let u = [i % STEPS, i / STEPS].map(|k| (k as f32 + 0.5) / STEPS as f32);
                    Query { material, wo, b: Vec3::new(u[0], u[1], 0.5), lobes }
                }));
            }
        }
    }
    let outputs = eval(&gpu(), Operation::Sample, model, materials, &queries);
    let albedo = |outputs: &[support::harness::TestOutput]| {
        let weight = |o: &support::harness::TestOutput| {
            let [r, g, b, pdf] = o.b();
            if pdf > 0.0 { f64::from(r.max(g).max(b) / pdf) } else { 0.0 }
        };
        outputs.iter().map(weight).sum::<f64>() / each as f64
    };
    outputs
        .chunks(each * lobes.len() * cosines.len())
        .map(|m| m.chunks(each * lobes.len()).map(|c| c.chunks(each).map(albedo).collect()).collect())
        .collect()
}

const ROUGHNESS: [f32; 5] = [0.0, 0.15, 0.3, 0.6, 1.0];
const COSINES: [f32; 4] = [1.0, 0.7, 0.3, 0.05];

/// (what, material of a roughness, its lobes, model, most that may come back).
type Furnace = (&'static str, fn(f32) -> Bsdf, &'static [u32], Model, f64);

fn alpha(roughness: f32) -> f32 {
    (roughness * roughness).max(0.001)
}

fn rough(roughness: f32) -> Bsdf {
    Bsdf { alpha: Vec2::splat(alpha(roughness)), ..Bsdf::default() }
}

fn metal(roughness: f32) -> Bsdf {
    Bsdf { metallic: 1.0, ..rough(roughness) }
}

fn glass(roughness: f32, eta: f32) -> Bsdf {
    let index = if eta == 0.0 { 1.5 } else { eta };
    let f0 = ((index - 1.0) / (index + 1.0)).powi(2);
    Bsdf { transmission: 1.0, eta, f0: Vec3::splat(f0), ..rough(roughness) }
}

fn velvet(roughness: f32, base: Vec3) -> Bsdf {
    let sheen_alpha = (roughness * roughness).max(0.01);
    Bsdf { base_color: base, sheen_color: Vec3::ONE, sheen_alpha, ..rough(0.5) }
}

fn filmed(roughness: f32, metallic: f32) -> Bsdf {
    Bsdf { iridescence: 1.0, film_ior: 1.8, film_thickness: 350.0, metallic, ..rough(roughness) }
}

/// The white furnace: what comes back of light 1 from everywhere. The limit is 1 and the grid's error, but for what the
/// specification itself gains.
const FURNACE: [Furnace; 18] = [
    ("diffuse under the specular layer, specification", rough, &[DIFFUSE], SPECIFICATION, 1.002),
    ("specular layer alone, index 1.5", rough, &[SPECULAR], SPECIFICATION, 1.002),
    ("metal", metal, &[SPECULAR], SPECIFICATION, 1.002),
    ("metal, energy compensation", metal, &[SPECULAR], COMPENSATED, 1.005),
    ("dielectric, specification", rough, &[DIFFUSE, SPECULAR], SPECIFICATION, 1.75),
    ("dielectric, conserving mix", rough, &[DIFFUSE, SPECULAR], CONSERVING, 1.002),
    ("dielectric, conserving mix and energy compensation", rough, &[DIFFUSE, SPECULAR], COMPENSATED, 1.005),
    ("thin wall, index 1.5", |r| glass(r, 0.0), &[SPECULAR, TRANSMISSION], SPECIFICATION, 1.002),
    ("into glass, index 1.5", |r| glass(r, 1.5), &[SPECULAR, TRANSMISSION], SPECIFICATION, 1.002),
    ("out of glass, index 1.5", |r| glass(r, 1.0 / 1.5), &[SPECULAR, TRANSMISSION], SPECIFICATION, 1.002),
    ("into diamond, index 2.4", |r| glass(r, 2.4), &[SPECULAR, TRANSMISSION], SPECIFICATION, 1.002),
    ("out of diamond, index 2.4", |r| glass(r, 1.0 / 2.4), &[SPECULAR, TRANSMISSION], SPECIFICATION, 1.002),
    ("sheen alone, specification", |r| velvet(r, Vec3::ZERO), &[SHEEN], SPECIFICATION, 1.2),
    ("sheen alone, conserving", |r| velvet(r, Vec3::ZERO), &[SHEEN], CONSERVING, 1.002),
    ("sheen over white, conserving mix", |r| velvet(r, Vec3::ONE), &[DIFFUSE, SPECULAR, SHEEN], CONSERVING, 1.002),
    (
        "clearcoat over white metal",
        |r| Bsdf { clearcoat: 1.0, clearcoat_alpha: alpha(r), ..metal(0.3) },
        &[SPECULAR, CLEARCOAT],
        SPECIFICATION,
        1.002,
    ),
    ("film on metal", |r| filmed(r, 1.0), &[SPECULAR], SPECIFICATION, 1.002),
    (
        "film on glass",
        |r| Bsdf { transmission: 1.0, eta: 0.0, ..filmed(r, 0.0) },
        &[SPECULAR, TRANSMISSION],
        SPECIFICATION,
        1.002,
    ),
];

/// The table of docs/materials.md: `cargo test --test bsdf furnace -- --nocapture` prints it.
#[test]
fn no_lobe_passes_the_white_furnace_but_the_one_that_is_known() {
    println!("| | {} |", ROUGHNESS.map(|r| format!("roughness {r}")).join(" | "));
    println!("|---|{}", "---|".repeat(ROUGHNESS.len()));
    let mut known: f64 = 0.0;
    let mut problems = Vec::new();
    for (what, make, lobes, model, limit) in FURNACE {
        let materials = ROUGHNESS.map(make);
        let albedos = lobe_albedos(model, &materials, lobes, &COSINES);
        let mut cells = Vec::new();
        for (roughness, of_material) in ROUGHNESS.iter().zip(albedos) {
            let sums: Vec<f64> = of_material.iter().map(|of_cosine| of_cosine.iter().sum()).collect();
            for (cosine, sum) in COSINES.iter().zip(&sums) {
                if *sum > limit {
                    problems.push(format!("{what}: {sum} at roughness {roughness}, cosine {cosine}"));
                }
                if what == "dielectric, specification" && *roughness == 0.15 {
                    known = known.max(*sum);
                }
                // With energy compensation a white metal loses nothing.
                if what == "metal, energy compensation" && *sum < 0.98 {
                    problems.push(format!("{what}: only {sum} at roughness {roughness}, cosine {cosine}"));
                }
            }
            cells.push(sums.iter().map(|sum| format!("{sum:.3}")).collect::<Vec<_>>().join(" "));
        }
        println!("| {what} | {} |", cells.join(" | "));
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
    assert!((known - 1.585).abs() < 0.01, "the specification's mix is known to gain light at grazing angles: {known}");
}

/// The table that build.rs makes equals integrals done here, to its 8 bits and the error of interpolation.
#[test]
fn the_albedo_table_is_the_integral() {
    let mut worst = [0.0f64; 3];
    for roughness in [0.45, 0.53, 0.62, 0.9] {
        let a: f64 = roughness * roughness;
        for cosine in [0.05, 0.13, 0.3, 0.55, 0.8, 0.99] {
            let wo = DVec3::new((1.0f64 - cosine * cosine).sqrt(), 0.0, cosine);
            let (mut whole, mut grazing, mut sheen) = (0.0, 0.0, 0.0);
            let (rings, sectors) = (400, 400);
            for i in 0..rings {
                let (sin, cos) = ((f64::from(i) + 0.5) / f64::from(rings) * FRAC_PI_2).sin_cos();
                for j in 0..sectors {
                    let (sin_phi, cos_phi) = ((f64::from(j) + 0.5) / f64::from(sectors) * PI).sin_cos();
                    let wi = DVec3::new(sin * cos_phi, sin * sin_phi, cos);
                    let h = (wo + wi).normalize();
                    let lambda = |w: DVec3| 1.0 / g1(glam::DVec2::splat(a), w) - 1.0;
                    let d = support::bsdf::distribution(glam::DVec2::splat(a), h);
                    let f = d / (1.0 + lambda(wo) + lambda(wi)) / (4.0 * wo.z);
                    whole += f * sin;
                    grazing += f * schlick(wo.dot(h)) * sin;
                    sheen += sheen_value(a, wo, wi) * wi.z * sin;
                }
            }
            let step = 2.0 * (FRAC_PI_2 / f64::from(rings)) * (PI / f64::from(sectors));
            let expected = [whole * step, grazing * step, sheen * step];
            let table = table_read(cosine, roughness);
            let actual = [table.x, table.y, table.z + 4.0 * table.w];
            for channel in 0..3 {
                let error = actual[channel] - expected[channel];
                worst[channel] = worst[channel].max(error.abs());
                assert!(
                    error > -0.012 && error < 0.02,
                    "channel {channel}: {} at roughness {roughness}, cosine {cosine} is not {}",
                    actual[channel],
                    expected[channel]
                );
            }
        }
    }
    println!("largest errors: {worst:.4?}");
    // The shader reads the same.
    let points = [(0.31f32, 0.77f32), (0.0, 0.0), (1.0, 1.0), (0.99, 0.02)];
    let queries = points.map(|(cosine, roughness)| Query {
        material: 0,
        wo: Vec3::Z,
        b: Vec3::new(cosine, roughness, 0.0),
        lobes: ALL,
    });
    let outputs = eval(&gpu(), Operation::Iridescence, SPECIFICATION, &[Bsdf::default()], &queries);
    for ((cosine, roughness), output) in points.into_iter().zip(outputs) {
        let expected = table_read(cosine.into(), roughness.into());
        let actual = glam::Vec4::from(output.b()).as_dvec4();
        assert!(actual.distance(expected) < 1e-4, "{cosine} {roughness}");
    }
    assert_eq!(albedo_table::TEXELS.len(), 4 * (albedo_table::SIZE * albedo_table::SIZE) as usize);
}

/// The film's reflectance equals its twin, and far from interference (a film much thicker than the coherence of daylight)
/// the closed form of a stack of two interfaces: R12 + T12^2 R23 / (1 - R12 R23).
#[test]
fn films_interfere() {
    let mut random = Random::new(6);
    let mut films = Vec::new();
    for i in 0..200 {
        let f0 = Vec3::new(random.unit(), random.unit(), random.unit());
        let film_thickness = if i % 2 == 0 { 1000.0 * random.unit() } else { 1e5 };
        films.push(Bsdf { f0, film_ior: 1.0 + 1.5 * random.unit(), film_thickness, ..Bsdf::default() });
    }
    let queries: Vec<_> = (0..films.len())
        .map(|material| Query {
            material,
            wo: polar(FRAC_PI_2 * f64::from(random.unit()), 0.0),
            b: Vec3::ZERO,
            lobes: 0,
        })
        .collect();
    let mut colourful = 0;
    for (query, output) in queries.iter().zip(eval(&gpu(), Operation::Iridescence, SPECIFICATION, &films, &queries)) {
        let film = &films[query.material];
        let cosine = f64::from(query.wo.z);
        let (ior, thickness, f0) = (f64::from(film.film_ior), f64::from(film.film_thickness), d(film.f0));
        let expected = iridescent_fresnel(ior, thickness, f0, cosine);
        let actual = d(xyz(output.a()));
        assert!(actual.distance(expected) < 2e-3, "{actual} is not {expected}: {film:?}");
        if thickness < 1e4 {
            colourful += usize::from((expected.x - expected.z).abs() > 0.05);
            continue;
        }
        let sin_2 = (1.0 - cosine * cosine) / (ior * ior);
        let r12 = ((ior - 1.0) / (ior + 1.0)).powi(2);
        let r12 = r12 + (1.0 - r12) * schlick(cosine);
        for c in 0..3 {
            let n = (1.0 + f0[c].sqrt()) / (1.0 - f0[c].sqrt());
            let r23 = ((n - ior) / (n + ior)).powi(2);
            let r23 = r23 + (1.0 - r23) * schlick((1.0 - sin_2).sqrt());
            let incoherent = r12 + (1.0 - r12).powi(2) * r23 / (1.0 - r12 * r23);
            assert!((actual[c] - incoherent).abs() < 5e-3, "{} is not {incoherent}: {film:?}", actual[c]);
        }
    }
    assert!(colourful > 30, "{colourful}");
}
