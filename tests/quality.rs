//! What reuse is worth: after 20 frames of history one frame of unbiased `restir-di` has at least a quarter of the mean
//! squared error that `ris` has with as many candidates. Direct light, rays through pixel centres (so that the edges of
//! the visible lamp, which no light sampling can help, stay out of the figure). The documented figures are measured the
//! same way at a larger size: docs/techniques/restir-di.md.

mod support;

use restir::lab::mse;
use support::*;

const SIZE: [u32; 2] = [96, 64];
const SETTINGS: &[(&str, &str)] = &[("render.max_depth", "1"), ("render.pixel_filter", "center")];

/// The defaults, with the radius in proportion to so small a picture.
const REUSE: &[(&str, &str)] = &[("indirect", "no"), ("spatial_radius", "5")];

/// Mean of the error over seeds; the last of `frames` frames alone.
fn error(technique: &str, settings: &[(&str, &str)], frames: u32, reference: &restir::Image) -> f64 {
    let mut renderer = renderer(&gpu(), builtin("cornell"), SIZE, technique, &[SETTINGS, settings].concat());
    renderer.set_accumulate(false);
    let seeds = 1..=6;
    let count = f64::from(seeds.end() - seeds.start() + 1);
    let sum: f64 = seeds
        .map(|seed| {
            renderer.set_seed(seed);
            mse(&render(&mut renderer, frames), reference).expect("pictures of one size")
        })
        .sum();
    sum / count
}

#[test]
fn reuse_divides_the_error_by_four_and_more() {
    let mut reference = renderer(&gpu(), builtin("cornell"), SIZE, "path-tracer", SETTINGS);
    reference.set_seed(1000);
    let reference = render(&mut reference, 1024);
    let ris = error("ris", &[("candidates", "32")], 1, &reference);
    let first = error("restir-di", REUSE, 1, &reference);
    let reused = error("restir-di", REUSE, 21, &reference);
    println!("mse: ris {ris:.6}, restir-di first frame {first:.6}, after 20 frames {reused:.6}: {:.1}x", ris / reused);
    assert!(ris / reused >= 4.0, "only {:.2}x", ris / reused);
    // History must be part of it.
    assert!(reused < first, "history did not help");
}

/// Pixels without history join neighbours in each iteration, not in the first alone: their confidence weight is that of all.
#[test]
fn every_iteration_joins_neighbours() {
    let confidence = |iterations: &str| {
        let settings = [SETTINGS, REUSE, &[("spatial_iterations", iterations)]].concat();
        let mut renderer = renderer(&gpu(), builtin("cornell"), SIZE, "restir-di", &settings);
        renderer.set_view("confidence weight").expect("a view");
        mean(&render(&mut renderer, 1))
    };
    let (one, two, three) = (confidence("1"), confidence("2"), confidence("3"));
    println!("confidence weights as shown: {one:.4}, {two:.4}, {three:.4}");
    assert!(two > 1.5 * one && three > 1.5 * two, "{one} {two} {three}");
}
