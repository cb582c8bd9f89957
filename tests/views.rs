//! Debug views say what they claim: counts are those of the frame, numbers get the colours of the legend, and what is not finite is
//! found where it is.

mod support;

use pollster::block_on;
use restir::techniques;
use restir::view::{COLOR_MAPS, COMMON_VIEWS, Scale};
use support::*;

const SIZE: [u32; 2] = [32, 16];

/// The view that is black where all is well.
const BLACK: &str = "not finite";

/// The numbers of a view after so many frames.
fn numbers(renderer: &mut restir::Renderer, view: &str, frames: u32) -> Vec<f32> {
    renderer.set_view(view).expect("a view");
    renderer.reset();
    let image = render(renderer, frames);
    assert!(image.pixels.iter().all(|[r, g, b]| r == g && g == b), "{view}: a number is the same in each channel");
    image.pixels.iter().map(|pixel| pixel[0]).collect()
}

#[test]
fn every_view_of_every_technique_renders() {
    for info in techniques::ALL {
        // Lit by lights of every strategy, so that no view of one is black; and a few pixels are far for the report's neighbours.
        let settings = if info.id == "restir-report" { &[("spatial_radius", "0.2")][..] } else { &[] };
        let mut renderer = renderer(&gpu(), builtin("cornell-64"), SIZE, info.id, settings);
        for view in COMMON_VIEWS.iter().chain(info.views) {
            let what = format!("{} as {}", info.id, view.name);
            renderer.set_view(view.name).expect("a view");
            renderer.reset();
            let image = render(&mut renderer, 2);
            let counters = block_on(renderer.counters()).expect("counters");
            assert_eq!((counters.nan, counters.inf), (0, 0), "{what}");
            assert!(
                image.pixels.iter().flatten().all(|c| c.is_finite() && *c >= 0.0),
                "{what}: not finite, or negative"
            );
            assert_eq!(mean(&image) > 0.0, view.name != BLACK, "{what}: {}", mean(&image));
        }
        assert!(matches!(renderer.set_view("nonesuch"), Err(restir::Error::Unknown { .. })));
    }
}

#[test]
fn rays_of_all_pixels_are_the_rays_of_the_frame() {
    for info in techniques::ALL {
        let mut renderer = renderer(&gpu(), builtin("cornell-64"), SIZE, info.id, &[]);
        let mut frame = renderer_counts(&mut renderer, "radiance");
        let rays: f64 = numbers(&mut renderer, "rays", 1).iter().map(|&count| f64::from(count)).sum();
        assert_eq!(rays, frame, "{}", info.id);
        frame = renderer_counts(&mut renderer, "BVH steps");
        let nodes = numbers(&mut renderer, "BVH steps", 1);
        let sum: f64 = nodes.iter().map(|&count| f64::from(count)).sum();
        // A ray visits the root, and no more nodes than there are.
        println!("{}: {rays} rays, {sum} nodes", info.id);
        assert!(sum >= frame && sum <= 64.0 * frame, "{}: {sum} nodes for {frame} rays", info.id);
        assert!(nodes.iter().all(|&count| count >= 1.0), "{}: a pixel whose ray visits no root", info.id);
    }
}

/// Rays of a first frame, as the counters of all pixels have them.
fn renderer_counts(renderer: &mut restir::Renderer, view: &str) -> f64 {
    renderer.set_view(view).expect("a view");
    renderer.reset();
    render(renderer, 1);
    block_on(renderer.counters()).expect("counters").rays as f64
}

/// Looking at a view changes nothing of what is rendered afterwards.
#[test]
fn a_picture_is_the_same_before_and_after_pixels_were_counted() {
    let mut renderer = renderer(&gpu(), builtin("cornell"), SIZE, "restir-di", &[]);
    let before = render(&mut renderer, 3);
    for view in ["rays", "rejected neighbours", "radiance"] {
        renderer.set_view(view).expect("a view");
        render(&mut renderer, 1);
    }
    renderer.reset();
    assert_same(&render(&mut renderer, 3), &before, "after the views");
}

#[test]
fn neighbours_are_rejected_where_surfaces_differ() {
    let rejected = |threshold: &str| {
        let settings =
            [("spatial_normal_threshold", threshold), ("spatial_depth_threshold", "10"), ("spatial_radius", "5")];
        let mut renderer = renderer(&gpu(), builtin("cornell"), SIZE, "restir-di", &settings);
        numbers(&mut renderer, "rejected neighbours", 1).iter().sum::<f32>()
    };
    let (some, none) = (rejected("0.9"), rejected("-1"));
    println!("rejected: {some}, and {none} where no normal is too different");
    assert!(some > 0.0);
    // What lies beyond the box has no surface, which is rejected in any case.
    assert!(none < some);
}

#[test]
fn weights_and_targets_make_the_light_that_no_shadow_takes() {
    let settings = [("candidates", "1"), ("light_choice", "uniform")];
    let mut renderer = renderer(&gpu(), builtin("cornell"), SIZE, "ris", &settings);
    let (weights, targets) =
        (numbers(&mut renderer, "contribution weight", 1), numbers(&mut renderer, "target function", 1));
    renderer.set_view("radiance").expect("a view");
    renderer.reset();
    let lit = render(&mut renderer, 1);
    let (mut shown, mut dark) = (0, 0);
    for (i, [r, g, b]) in lit.pixels.iter().enumerate() {
        let luminance = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        let estimate = weights[i] * targets[i];
        // The lamp itself shines, what has no sample is dark, and so is what its sample does not reach.
        if (luminance - estimate).abs() <= 1e-3 * estimate.max(1e-3) {
            shown += 1;
        } else {
            assert!(luminance == 0.0 || luminance > 1.0, "pixel {i}: {luminance} with W p-hat = {estimate}");
            dark += 1;
        }
    }
    println!("{shown} pixels show W p-hat, {dark} are in shadow or shine themselves");
    assert!(shown > 300, "{shown}");
}

/// sRGB of a number by the legend that people see.
fn legend_color(legend: &serde_json::Value, value: f32) -> [f32; 3] {
    let number = |key: &str| legend[key].as_f64().expect(key) as f32;
    let colors: Vec<[f32; 3]> = legend["colors"]
        .as_array()
        .expect("colors")
        .iter()
        .map(|color| {
            let word = u32::from_str_radix(&color.as_str().expect("a colour")[1..], 16).expect("a colour");
            [16, 8, 0].map(|shift| (word >> shift & 255) as f32)
        })
        .collect();
    let (low, high) = (number("low"), number("high"));
    let place = if legend["logarithmic"] == true {
        if value <= 0.0 {
            return [0.0; 3];
        }
        (value / low).ln() / (high / low).ln()
    } else {
        (value - low) / (high - low)
    };
    let step = place.clamp(0.0, 1.0) * (colors.len() - 1) as f32;
    let at = (step as usize).min(colors.len() - 2);
    [0, 1, 2].map(|c| colors[at][c] + (step - at as f32) * (colors[at + 1][c] - colors[at][c]))
}

#[test]
fn numbers_get_the_colours_of_the_legend() {
    let mut renderer = renderer(&gpu(), builtin("cornell"), SIZE, "restir-di", &[]);
    let views = ["depth", "rays", "contribution weight", "duplicates", "confidence weight"];
    for (view, map) in views.into_iter().zip(COLOR_MAPS.into_iter().cycle()) {
        renderer.set("film.color_map", map).expect("a map");
        for range in [None, Some(["0.5", "4"])] {
            let [low, high] = range.unwrap_or(["0", "0"]);
            renderer.set("film.range_low", low).expect("a range");
            renderer.set("film.range_high", high).expect("a range");
            let values = numbers(&mut renderer, view, 1);
            let legend = renderer.legend();
            if let Some([low, high]) = range {
                assert_eq!(
                    [legend["low"].to_string(), legend["high"].to_string()],
                    [low.to_owned(), format!("{high}.0")]
                );
            }
            let display = block_on(renderer.read_display()).expect("a display");
            for (i, &value) in values.iter().enumerate() {
                let expected = legend_color(&legend, value);
                for (c, channel) in expected.into_iter().enumerate() {
                    let shown = f32::from(display[4 * i + c]);
                    assert!(
                        (shown - channel).abs() <= 1.0,
                        "{view} by {map}, pixel {i}, {value}: {shown}, not {channel}"
                    );
                }
            }
        }
    }
}

/// By magnitude there is nothing below 0: a range that ends there is the view's own.
#[test]
fn a_range_below_zero_is_no_range_of_magnitudes() {
    let mut renderer = renderer(&gpu(), builtin("cornell"), SIZE, "restir-di", &[]);
    renderer.set_view("contribution weight").expect("a view");
    let own = renderer.legend();
    for [low, high] in [["-5", "-1"], ["-5", "0"]] {
        renderer.set("film.range_low", low).expect("a range");
        renderer.set("film.range_high", high).expect("a range");
        assert_eq!(renderer.legend(), own, "{low} to {high}");
    }
    renderer.set("film.range_high", "8").expect("a range");
    let [low, high] = ["low", "high"].map(|end| renderer.legend()[end].as_f64().expect("an end"));
    assert!(0.0 < low && low < high && high == 8.0, "{low} to {high}");
}

/// Every number within its range's ends is told apart: a view all of one colour says nothing.
#[test]
fn ranges_suit_what_is_seen() {
    for info in techniques::ALL {
        let mut renderer = renderer(&gpu(), builtin("cornell-64"), SIZE, info.id, &[]);
        for view in COMMON_VIEWS.iter().chain(info.views).filter(|view| view.name != BLACK) {
            let Scale::Number { .. } = view.scale else { continue };
            let values = numbers(&mut renderer, view.name, 2);
            let legend = renderer.legend();
            let [low, high] = ["low", "high"].map(|end| legend[end].as_f64().expect("an end") as f32);
            let beyond = values.iter().filter(|&&value| value > high || (value > 0.0 && value < low)).count();
            println!("{} as {}: {low} to {high}, {beyond} of {} beyond", info.id, view.name, values.len());
            assert!(beyond * 20 <= values.len(), "{} as {}", info.id, view.name);
        }
    }
}

#[test]
fn what_is_not_finite_is_shown_where_it_is() {
    let settings = [("configuration", "e-both"), ("fault_unguarded_pdf", "true")];
    let mut renderer = renderer(&gpu(), builtin("cornell-64"), SIZE, "restir-report", &settings);
    renderer.set_accumulate(true);
    let frames = 4;
    render(&mut renderer, frames);
    let counters = block_on(renderer.counters()).expect("counters");
    let left_out = counters.not_finite() as f32;
    assert!(left_out > 0.0, "the fault makes none");
    let share: f32 = numbers(&mut renderer, "not finite", frames).iter().sum();
    assert_eq!((share * frames as f32).round(), left_out);
}
