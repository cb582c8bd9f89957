//! Equivalence: `restir-di` with the unbiased setting has the same expectation as the path tracer's direct light, by two
//! one-sided tests (TOST) on means over independent runs; and the same test catches planted biases.
//!
//! Margins (docs/testing.md): 0.2 % of the mean over the picture, 1 % over each 32x32 tile, at 95 % confidence. A plant
//! counts as caught only if its measured bias lies so far outside a margin that a repetition of the test would fail with
//! probability 0.9 or more.

mod support;

use restir::scene::Camera;
use restir::{FlatScene, Gpu, Image, Renderer};
use std::sync::OnceLock;
use support::plants::ShaderCopy;
use support::*;

const SIZE: u32 = 64;
const TILE: u32 = 32;
const GLOBAL_MARGIN: f64 = 0.002;
const TILE_MARGIN: f64 = 0.01;
/// One-sided 95 % quantile of the normal distribution; runs are many enough.
const Z_95: f64 = 1.645;

/// The Cornell box from inside: blocks, shadows and no light source in view, so that the mean is all scattered light.
fn scene() -> FlatScene {
    let mut scene = builtin("cornell");
    scene.cameras =
        vec![Camera::look_at("test", [-0.35, 0.85, 0.45].into(), [0.12, 0.05, -0.1].into(), 60f32.to_radians())];
    scene
}

/// Mean radiance of the picture, then of each tile.
fn means(image: &Image) -> Vec<f64> {
    let tiles = SIZE / TILE;
    let mut sums = vec![0.0; 1 + (tiles * tiles) as usize];
    for (i, pixel) in image.pixels.iter().enumerate() {
        let value: f64 = pixel.iter().map(|c| f64::from(*c)).sum::<f64>() / 3.0;
        let (x, y) = (i as u32 % SIZE / TILE, i as u32 / SIZE / TILE);
        sums[0] += value / f64::from(SIZE * SIZE);
        sums[1 + (y * tiles + x) as usize] += value / f64::from(TILE * TILE);
    }
    sums
}

/// Mean and standard error of each region over independent runs.
struct Estimate {
    mean: Vec<f64>,
    error: Vec<f64>,
}

fn estimate(renderer: &mut Renderer, runs: u32, frames: u32) -> Estimate {
    let samples: Vec<Vec<f64>> = (0..runs)
        .map(|run| {
            renderer.set_seed(1000 + run);
            means(&render(renderer, frames))
        })
        .collect();
    let n = f64::from(runs);
    let mean: Vec<f64> = (0..samples[0].len()).map(|i| samples.iter().map(|s| s[i]).sum::<f64>() / n).collect();
    let error = (0..mean.len())
        .map(|i| (samples.iter().map(|s| (s[i] - mean[i]).powi(2)).sum::<f64>() / (n * (n - 1.0))).sqrt())
        .collect();
    Estimate { mean, error }
}

/// Relative difference and its standard error, region by region, with the region's margin.
fn differences(estimate: &Estimate, reference: &Estimate) -> Vec<(f64, f64, f64)> {
    (0..reference.mean.len())
        .map(|i| {
            let difference = estimate.mean[i] / reference.mean[i] - 1.0;
            let error = estimate.error[i].hypot(reference.error[i]) / reference.mean[i];
            (difference, error, if i == 0 { GLOBAL_MARGIN } else { TILE_MARGIN })
        })
        .collect()
}

fn is_equivalent(differences: &[(f64, f64, f64)]) -> bool {
    differences.iter().all(|(d, e, margin)| d.abs() + Z_95 * e < *margin)
}

/// Whether the bias lies beyond a margin with 95 % confidence; then a repetition of the test fails far more often than
/// nine times in ten.
fn is_caught(differences: &[(f64, f64, f64)]) -> bool {
    differences.iter().any(|(d, e, margin)| d.abs() - Z_95 * e > *margin)
}

fn show(name: &str, differences: &[(f64, f64, f64)]) {
    let parts: Vec<_> = differences.iter().map(|(d, e, _)| format!("{:+.3}±{:.3} %", 100.0 * d, 100.0 * e)).collect();
    println!("{name}: {}", parts.join(", "));
}

const DIRECT: &[(&str, &str)] = &[("render.max_depth", "1")];

fn reference() -> &'static Estimate {
    static REFERENCE: OnceLock<Estimate> = OnceLock::new();
    REFERENCE.get_or_init(|| {
        let mut renderer = renderer(&gpu(), scene(), [SIZE; 2], "path-tracer", DIRECT);
        let reference = estimate(&mut renderer, 16, 160);
        println!("reference: mean {:.5} ± {:.3} %", reference.mean[0], 100.0 * reference.error[0] / reference.mean[0]);
        reference
    })
}

/// All reuse on, with a short memory, so that frames of a run are less correlated and more runs' worth of samples.
fn restir(gpu: &Gpu, settings: &[(&str, &str)]) -> Renderer {
    let base = [
        ("indirect", "no"),
        ("light_samples", "4"),
        ("history_cap", "4"),
        ("spatial_neighbors", "2"),
        ("spatial_iterations", "2"),
        ("spatial_radius", "10"),
        ("spatial_confidence_limit", "10000"),
        ("spatial_feedback", "yes"),
    ];
    renderer(gpu, scene(), [SIZE; 2], "restir-di", &[&base[..], DIRECT, settings].concat())
}

const RUNS: u32 = 64;
const FRAMES: u32 = 16;

#[test]
fn restir_di_equals_the_path_tracer() {
    let gpu = gpu();
    let reference = reference();
    let unbiased = [
        &[][..],
        // As the defaults have it: spatial reuse for young pixels alone, and not fed back.
        &[("spatial_confidence_limit", "3"), ("spatial_feedback", "no"), ("reservoir_size", "4")],
        // Without visibility reuse supports are told apart by target functions alone, so this is unbiased too.
        &[("bias_correction", "mis"), ("visibility_reuse", "no")],
    ];
    for settings in unbiased {
        let differences = differences(&estimate(&mut restir(&gpu, settings), RUNS, FRAMES), reference);
        show(&format!("unbiased {settings:?}"), &differences);
        assert!(is_equivalent(&differences), "{settings:?} is not equivalent");
    }
}

#[test]
fn planted_biases_are_caught() {
    let gpu = gpu();
    let reference = reference();
    // Biased settings are plants that need no edit.
    for bias_correction in ["none", "mis"] {
        let mut renderer = restir(&gpu, &[("bias_correction", bias_correction)]);
        let differences = differences(&estimate(&mut renderer, RUNS / 4, FRAMES), reference);
        show(bias_correction, &differences);
        assert!(is_caught(&differences), "bias_correction = {bias_correction} went unnoticed");
    }
    // Each: what, the file, what stands there, what is put in its place.
    let plants = [
        (
            "visibility left out of the weights",
            "techniques/restir-di/combine.wgsl",
            "return select(0.0, value, sample_is_visible(surface, sample, previous));",
            "return value + select(0.0, 1e-30, sample_is_visible(surface, sample, previous));",
        ),
        (
            "history offered above its weight",
            "techniques/restir-di/temporal.wgsl",
            "    combination_offer(history);",
            "    history.unbiased_contribution_weight *= 1.0 + 0.1 * history.confidence_weight;\n    combination_offer(history);",
        ),
        (
            "samples weighted by the canonical pixel's share in place of their own",
            "techniques/restir-di/combine.wgsl",
            "        if i == j {\n            mis_numerators[i] = share;",
            "        if j == 0u {\n            mis_numerators[i] = share;",
        ),
        (
            "the candidate count left out of the initial weights' mean",
            "techniques/common/resampling.wgsl",
            "(pdf * f32(candidate_count))",
            "(pdf * f32(candidate_count - 1u))",
        ),
    ];
    for (what, file, old, new) in plants {
        let folder = ShaderCopy::new();
        let gpu = fresh_gpu();
        let mut renderer = restir(&gpu, &[]);
        render(&mut renderer, 1);
        gpu.watch_shaders(&folder.0);
        folder.edit(file, old, new);
        let differences = differences(&estimate(&mut renderer, RUNS / 4, FRAMES), reference);
        assert_eq!(renderer.shader_problems, Vec::<String>::new());
        show(what, &differences);
        assert!(is_caught(&differences), "'{what}' went unnoticed");
    }
}
