//! Equivalence: `restir-di` with the unbiased setting has the same expectation as the path tracer's direct light, by two
//! one-sided tests (TOST) on means over independent runs; and the same test catches planted biases.
//!
//! Margins (docs/testing.md): 0.2 % of the mean over the picture, 1 % over each 32x32 tile, at 95 % confidence. A plant
//! counts as caught only if its measured bias lies so far outside a margin that a repetition of the test would fail with
//! probability 0.9 or more.

mod support;

use restir::scene::Camera;
use restir::{FlatScene, Gpu, Renderer};
use std::sync::OnceLock;
use support::equivalence::{Comparison, Estimate, Margins};
use support::plants::ShaderCopy;
use support::*;

const SIZE: u32 = 64;
const TILE: u32 = 32;
const MARGINS: Margins = Margins { picture: 0.002, tile: 0.01 };

/// The Cornell box from inside: blocks, shadows and no light source in view, so that the mean is all scattered light.
fn scene() -> FlatScene {
    let mut scene = builtin("cornell");
    scene.cameras =
        vec![Camera::look_at("test", [-0.35, 0.85, 0.45].into(), [0.12, 0.05, -0.1].into(), 60f32.to_radians())];
    scene
}

const DIRECT: &[(&str, &str)] = &[("render.max_depth", "1")];

fn reference() -> &'static Estimate {
    static REFERENCE: OnceLock<Estimate> = OnceLock::new();
    REFERENCE.get_or_init(|| {
        let mut renderer = renderer(&gpu(), scene(), [SIZE; 2], "path-tracer", DIRECT);
        let reference = Estimate::radiance(&mut renderer, 16, 160, TILE);
        let (mean, error) = reference.0[0];
        println!("reference: mean {mean:.5} ± {:.3} %", 100.0 * error / mean);
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

/// The renderer's means beside the reference's, printed.
fn compare(what: &str, renderer: &mut Renderer, runs: u32) -> Comparison {
    let comparison = Comparison::new(&Estimate::radiance(renderer, runs, FRAMES, TILE), reference(), MARGINS);
    println!("{what}: {comparison}");
    comparison
}

#[test]
fn restir_di_equals_the_path_tracer() {
    let gpu = gpu();
    let unbiased = [
        &[][..],
        // As the defaults have it: spatial reuse for young pixels alone, and not fed back.
        &[("spatial_confidence_limit", "3"), ("spatial_feedback", "no"), ("reservoir_size", "4")],
        // Without visibility reuse supports are told apart by target functions alone, so this is unbiased too.
        &[("visibility_in_weights", "no"), ("visibility_reuse", "no")],
        &[("reuse_weights", "1/z")],
        &[("reuse_weights", "pairwise")],
        &[("reuse_weights", "pairwise"), ("visibility_in_weights", "no"), ("visibility_reuse", "no")],
        &[("reuse_weights", "defensive")],
        // Every choice of candidates and neighbours at once.
        &[
            ("bsdf_samples", "1"),
            ("light_choice", "uniform"),
            ("temporal_permutation", "yes"),
            ("disocclusion_neighbors", "4"),
            ("spatial_retries", "3"),
            ("spatial_pattern", "low-discrepancy"),
            ("spatial_material_threshold", "0.2"),
            ("spatial_cap", "2"),
            ("reuse_weights", "defensive"),
            ("reservoir_format", "packed"),
            ("pixel_order", "tiles-4"),
        ],
    ];
    for settings in unbiased {
        let comparison = compare(&format!("unbiased {settings:?}"), &mut restir(&gpu, settings), RUNS);
        assert!(comparison.is_equivalent(), "{settings:?} is not equivalent");
    }
}

#[test]
fn planted_biases_are_caught() {
    let gpu = gpu();
    // Biased settings are plants that need no edit.
    for (weights, visibility) in [
        ("constant", "yes"),
        ("heuristics", "yes"),
        ("1/z", "no"),
        ("balance", "no"),
        ("pairwise", "no"),
        ("defensive", "no"),
    ] {
        let settings = [("reuse_weights", weights), ("visibility_in_weights", visibility)];
        let comparison = compare(&format!("biased {settings:?}"), &mut restir(&gpu, &settings), RUNS / 4);
        assert!(comparison.is_caught(), "{settings:?} went unnoticed");
    }
    let comparison = compare("boiling_filter", &mut restir(&gpu, &[("boiling_filter", "0.5")]), RUNS / 4);
    assert!(comparison.is_caught(), "the boiling filter went unnoticed");
    // Each: what, with which weights, the file, what stands there, what is put in its place.
    let plants = [
        (
            "visibility left out of the weights",
            "balance",
            "techniques/common/combine.wgsl",
            "return select(0.0, value, sample_is_visible(surface, sample, previous));",
            "return value + select(0.0, 1e-30, sample_is_visible(surface, sample, previous));",
        ),
        (
            "history offered above its weight",
            "balance",
            "techniques/restir-di/temporal.wgsl",
            "    combination_offer(history);",
            "    history.unbiased_contribution_weight *= 1.0 + 0.1 * history.confidence_weight;\n    combination_offer(history);",
        ),
        (
            "samples weighted by the canonical pixel's share in place of their own",
            "balance",
            "techniques/common/combine.wgsl",
            "        if i == j {\n            mis_numerators[i] = share;",
            "        if j == 0u {\n            mis_numerators[i] = share;",
        ),
        (
            "the canonical sample's part of one pair left out",
            "pairwise",
            "techniques/common/combine.wgsl",
            "if denominator <= 0.0 {",
            "if denominator <= 0.0 || (i == 0u && j == 2u) {",
        ),
        (
            "the canonical sample weighed by the confidence of the others",
            "defensive",
            "techniques/common/combine.wgsl",
            "mis_numerators[0] += share * canonical *",
            "mis_numerators[0] += share * others *",
        ),
        (
            "the candidate count left out of the initial weights' mean",
            "balance",
            "techniques/common/resampling.wgsl",
            "f32(light_samples) *",
            "f32(light_samples - 1u) *",
        ),
    ];
    for (what, weights, file, old, new) in plants {
        let folder = ShaderCopy::new();
        let gpu = fresh_gpu();
        let mut renderer = restir(&gpu, &[("reuse_weights", weights)]);
        render(&mut renderer, 1);
        gpu.watch_shaders(&folder.0);
        folder.edit(file, old, new);
        let comparison = compare(what, &mut renderer, RUNS / 4);
        assert_eq!(renderer.shader_problems, Vec::<String>::new());
        assert!(comparison.is_caught(), "'{what}' went unnoticed");
    }
}
