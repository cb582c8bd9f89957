//! One channel of a picture and separable filters over it.

/// A row-major grid of one value a pixel.
#[derive(Debug, Clone)]
pub(super) struct Plane {
    pub width: usize,
    pub height: usize,
    pub values: Vec<f64>,
}

impl Plane {
    /// Convolves columns by `vertical` and rows by `horizontal`, both of odd length and centred; beyond the border the
    /// nearest pixel is read.
    pub fn filter(&self, horizontal: &[f64], vertical: &[f64]) -> Plane {
        let Plane { width, height, values } = self;
        let at_row = |y: usize, x: usize, tap: usize, radius: usize| {
            let x = (x + tap).saturating_sub(radius).min(width - 1);
            values[y * width + x]
        };
        let rows = convolve(*width, *height, horizontal, at_row);
        let at_column = |y: usize, x: usize, tap: usize, radius: usize| {
            let y = (y + tap).saturating_sub(radius).min(height - 1);
            rows[y * width + x]
        };
        Plane { width: *width, height: *height, values: convolve(*width, *height, vertical, at_column) }
    }

    /// Combines two planes of one size value by value.
    pub fn zip(&self, other: &Plane, f: impl Fn(f64, f64) -> f64) -> Plane {
        let values = self.values.iter().zip(&other.values).map(|(&a, &b)| f(a, b)).collect();
        Plane { values, ..*self }
    }
}

fn convolve(
    width: usize,
    height: usize,
    kernel: &[f64],
    sample: impl Fn(usize, usize, usize, usize) -> f64,
) -> Vec<f64> {
    let radius = kernel.len() / 2;
    let mut out = Vec::with_capacity(width * height);
    for y in 0..height {
        for x in 0..width {
            out.push(kernel.iter().enumerate().map(|(tap, weight)| weight * sample(y, x, tap, radius)).sum());
        }
    }
    out
}

/// `f` at -radius..=radius, its positive values divided by their sum, and its negative ones by theirs.
pub(super) fn normalised(radius: usize, f: impl Fn(f64) -> f64) -> Vec<f64> {
    let taps: Vec<f64> = (0..=2 * radius).map(|i| f(i as f64 - radius as f64)).collect();
    let positive: f64 = taps.iter().filter(|t| **t > 0.0).sum();
    let negative: f64 = -taps.iter().filter(|t| **t < 0.0).sum::<f64>();
    taps.iter()
        .map(|&t| {
            if t > 0.0 {
                t / positive
            } else if t < 0.0 {
                t / negative
            } else {
                0.0
            }
        })
        .collect()
}
