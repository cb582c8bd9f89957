//! FLIP for low dynamic range (Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, "FLIP: A Difference
//! Evaluator for Alternating Images", 2020). Section and equation names below are the paper's.

use super::metrics::check_pair;
use super::plane::{Plane, normalised};
use crate::error::Result;
use crate::output::Image;
use std::f64::consts::PI;

/// Pixels a degree of visual angle: the paper's default observer, 0.7 m from a 0.7 m wide monitor of 3840 pixels.
pub const PIXELS_PER_DEGREE: f64 = 67.0;

/// Mean FLIP: 0 for equal pictures, at most 1; what an observer perceives when flipping between the two.
///
/// # Errors
/// As [`check_pair`].
pub fn flip(image: &Image, reference: &Image) -> Result<f64> {
    let map = flip_map(image, reference)?;
    Ok(map.iter().sum::<f64>() / map.len() as f64)
}

/// FLIP of each pixel, row-major from the top.
///
/// Radiance is clamped to [0, 1] at exposure 0, as an sRGB display would show it.
///
/// # Errors
/// As [`check_pair`].
pub fn flip_map(image: &Image, reference: &Image) -> Result<Vec<f64>> {
    check_pair(image, reference)?;
    let (test, reference) = (Opponent::new(image), Opponent::new(reference));
    let colour = colour_difference(&test, &reference);
    let feature = feature_difference(&test.luma, &reference.luma);
    // Section 4.3: the feature difference raises the colour difference.
    Ok(colour.zip(&feature, |colour, feature| colour.powf(1.0 - feature)).values)
}

/// Linear sRGB to XYZ, from the primaries' chromaticities.
const RGB_TO_XYZ: [[f64; 3]; 3] = [
    [10135552.0 / 24577794.0, 8788810.0 / 24577794.0, 4435075.0 / 24577794.0],
    [2613072.0 / 12288897.0, 8788810.0 / 12288897.0, 887015.0 / 12288897.0],
    [1425312.0 / 73733382.0, 8788810.0 / 73733382.0, 70074185.0 / 73733382.0],
];

/// XYZ of linear sRGB over XYZ of white.
fn rgb_to_relative_xyz(rgb: [f64; 3]) -> [f64; 3] {
    RGB_TO_XYZ.map(|row| (row[0] * rgb[0] + row[1] * rgb[1] + row[2] * rgb[2]) / (row[0] + row[1] + row[2]))
}

/// Inverse of [`rgb_to_relative_xyz`], by Cramer's rule.
fn relative_xyz_to_rgb(xyz: [f64; 3]) -> [f64; 3] {
    let column = |j: usize| std::array::from_fn::<f64, 3, _>(|i| RGB_TO_XYZ[i][j] / RGB_TO_XYZ[i].iter().sum::<f64>());
    let (r, g, b) = (column(0), column(1), column(2));
    let determinant = |a: [f64; 3], b: [f64; 3], c: [f64; 3]| {
        a[0] * (b[1] * c[2] - b[2] * c[1]) - b[0] * (a[1] * c[2] - a[2] * c[1]) + c[0] * (a[1] * b[2] - a[2] * b[1])
    };
    let all = determinant(r, g, b);
    [determinant(xyz, g, b) / all, determinant(r, xyz, b) / all, determinant(r, g, xyz) / all]
}

/// A picture in the linearised opponent space YCxCz (section 4.1.1).
struct Opponent {
    luma: Plane,
    red_green: Plane,
    blue_yellow: Plane,
}

impl Opponent {
    fn new(image: &Image) -> Self {
        let mut planes = [const { Vec::new() }; 3];
        for pixel in &image.pixels {
            let [x, y, z] = rgb_to_relative_xyz(pixel.map(|v| f64::from(v).clamp(0.0, 1.0)));
            for (plane, value) in planes.iter_mut().zip([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]) {
                plane.push(value);
            }
        }
        let [luma, red_green, blue_yellow] =
            planes.map(|values| Plane { width: image.width as usize, height: image.height as usize, values });
        Opponent { luma, red_green, blue_yellow }
    }

    /// Blurs each channel by the eye's contrast sensitivity, and gives Hunt-adjusted L*a*b* (sections 4.1.1 and 4.1.2).
    fn perceived(&self) -> Vec<[f64; 3]> {
        let luma = contrast_sensitivity(&self.luma, &[(1.0, 0.0047)]);
        let red_green = contrast_sensitivity(&self.red_green, &[(1.0, 0.0053)]);
        let blue_yellow = contrast_sensitivity(&self.blue_yellow, &[(34.1, 0.04), (13.5, 0.025)]);
        let channels = luma.values.iter().zip(&red_green.values).zip(&blue_yellow.values);
        channels
            .map(|((&luma, &red_green), &blue_yellow)| {
                let y = (luma + 16.0) / 116.0;
                let rgb = relative_xyz_to_rgb([y + red_green / 500.0, y, y - blue_yellow / 200.0]);
                hunt_lab(rgb.map(|v| v.clamp(0.0, 1.0)))
            })
            .collect()
    }
}

/// Filters by a sum of Gaussians a sqrt(pi / b) exp(-pi^2 d^2 / b) of d degrees, each term `(a, b)` of table 1.
fn contrast_sensitivity(plane: &Plane, terms: &[(f64, f64)]) -> Plane {
    // One radius for all channels: three standard deviations of the widest Gaussian.
    let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as usize;
    let gaussian = |b: f64| move |x: f64| (-(PI * x / PIXELS_PER_DEGREE).powi(2) / b).exp();
    let weight = |&(a, b): &(f64, f64)| {
        let sum: f64 = (0..=2 * radius).map(|i| gaussian(b)(i as f64 - radius as f64)).sum();
        a * (PI / b).sqrt() * sum * sum
    };
    let total: f64 = terms.iter().map(weight).sum();
    let mut out = Plane { values: vec![0.0; plane.values.len()], ..*plane };
    for term in terms {
        let kernel = normalised(radius, gaussian(term.1));
        let share = weight(term) / total;
        out = out.zip(&plane.filter(&kernel, &kernel), |sum, value| sum + share * value);
    }
    out
}

/// L*a*b* of linear sRGB with chroma scaled by lightness: the Hunt effect (section 4.1.2).
fn hunt_lab(rgb: [f64; 3]) -> [f64; 3] {
    let delta: f64 = 6.0 / 29.0;
    let f = |t: f64| if t > delta.powi(3) { t.cbrt() } else { t / (3.0 * delta * delta) + 4.0 / 29.0 };
    let [x, y, z] = rgb_to_relative_xyz(rgb).map(f);
    let lightness = 116.0 * y - 16.0;
    [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
}

/// HyAB distance raised to q_c = 0.7 (section 4.1.3).
fn colour_distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    ((a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])).powf(0.7)
}

/// Colour difference in [0, 1]: up to p_c = 0.4 of the largest distance takes p_t = 0.95 of the range (section 4.1.3).
fn colour_difference(test: &Opponent, reference: &Opponent) -> Plane {
    let largest = colour_distance(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0]));
    let (knee, share) = (0.4 * largest, 0.95);
    let values = test.perceived().into_iter().zip(reference.perceived()).map(|(a, b)| {
        let distance = colour_distance(a, b);
        if distance < knee {
            share / knee * distance
        } else {
            share + (distance - knee) / (largest - knee) * (1.0 - share)
        }
    });
    Plane { values: values.collect(), ..test.luma }
}

/// Difference of edges and points, to the power q_f = 0.5 (section 4.2).
fn feature_difference(test: &Plane, reference: &Plane) -> Plane {
    // Standard deviation of a feature detector that spans 0.082 degrees.
    let sigma = 0.5 * 0.082 * PIXELS_PER_DEGREE;
    let radius = (3.0 * sigma).ceil() as usize;
    let gaussian = |x: f64| (-x * x / (2.0 * sigma * sigma)).exp();
    let smooth = normalised(radius, gaussian);
    let edge = normalised(radius, |x| -x * gaussian(x));
    let point = normalised(radius, |x| (x * x / (sigma * sigma) - 1.0) * gaussian(x));
    let strength = |luma: &Plane, detector: &[f64]| {
        let luma = Plane { values: luma.values.iter().map(|y| (y + 16.0) / 116.0).collect(), ..*luma };
        luma.filter(detector, &smooth).zip(&luma.filter(&smooth, detector), f64::hypot)
    };
    let difference =
        |detector: &[f64]| strength(test, detector).zip(&strength(reference, detector), |a, b| (a - b).abs());
    difference(&edge).zip(&difference(&point), |edge, point| (edge.max(point) / 2f64.sqrt()).sqrt())
}
