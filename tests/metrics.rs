//! The metrics against closed forms and against other people's code.

use restir::Error;
use restir::lab::{compare, flip, mape, mse, relmse, rmse, ssim};
use restir::output::Image;

fn image(width: u32, height: u32, f: impl Fn(u32, u32) -> [f32; 3]) -> Image {
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| f(x, y)).collect();
    Image::new(width, height, pixels).unwrap()
}

fn grey(width: u32, height: u32, value: f32) -> Image {
    image(width, height, |_, _| [value; 3])
}

fn gradient(width: u32, height: u32, scale: f32) -> Image {
    let (w, h) = (width as f32, height as f32);
    image(width, height, |x, y| {
        let (x, y) = (x as f32, y as f32);
        [x / (w - 1.0), y / (h - 1.0), (x + y) / (w + h - 2.0)].map(|v| v * scale)
    })
}

/// Half the gradient plus hashed noise in [0, 0.5).
fn noisy_gradient(width: u32, height: u32) -> Image {
    let mut noisy = gradient(width, height, 0.5);
    for (i, value) in noisy.pixels.iter_mut().flatten().enumerate() {
        let mut n = (i as u32).wrapping_mul(2654435761);
        n ^= n >> 15;
        n = n.wrapping_mul(2246822519);
        n ^= n >> 13;
        *value += 0.5 * ((n >> 8) as f32 / 16777216.0);
    }
    noisy
}

fn checker(width: u32, height: u32, square: u32) -> Image {
    image(width, height, |x, y| if (x / square + y / square) % 2 == 1 { [0.9, 0.7, 0.2] } else { [0.1, 0.2, 0.3] })
}

/// Image, reference, and what other programs say.
///
/// * FLIP: NVIDIA's `flip-evaluator` 1.7 from PyPI (LDR, linear input clamped to [0, 1], 67 pixels a degree; it works in
///   single precision).
/// * SSIM: scikit-image 0.26.0 (`gaussian_weights`, sigma 1.5, population covariance, range 1) on the sRGB-encoded
///   clamped luminance.
/// * MSE, relMSE, MAPE: their formulas in numpy 2.4.6.
fn cases() -> Vec<(Image, Image, [f64; 5])> {
    vec![
        (
            noisy_gradient(48, 32),
            gradient(48, 32, 1.0),
            [0.5141624808311462, 0.2251831714367871, 0.038567727108850904, 0.7114565703792625, 0.4631630859265021],
        ),
        (
            checker(40, 40, 5),
            grey(40, 40, 0.4),
            [0.6817309856414795, 0.026740677251338767, 0.08666666055719079, 0.5098038713309205, 0.6441336331140292],
        ),
        (
            gradient(31, 57, 3.0),
            gradient(31, 57, 1.0),
            [0.7129643559455872, 0.7981702477073597, 1.2968152243286217, 3.4716036441833062, 1.9689347774798196],
        ),
    ]
}

fn assert_close(what: &str, got: f64, want: f64, relative: f64) {
    assert!((got - want).abs() <= relative * want.abs(), "{what}: {got}, expected {want}");
}

#[test]
fn flip_agrees_with_its_authors() {
    for (a, b, [want, ..]) in cases() {
        assert_close("flip", flip(&a, &b).unwrap(), want, 1e-5);
    }
}

#[test]
fn ssim_agrees_with_scikit_image() {
    for (a, b, [_, want, ..]) in cases() {
        assert_close("ssim", ssim(&a, &b).unwrap().unwrap(), want, 1e-5);
    }
}

#[test]
fn pixel_errors_agree_with_numpy() {
    for (a, b, [_, _, mse_want, relmse_want, mape_want]) in cases() {
        assert_close("mse", mse(&a, &b).unwrap(), mse_want, 1e-6);
        assert_close("relmse", relmse(&a, &b).unwrap(), relmse_want, 1e-6);
        assert_close("mape", mape(&a, &b).unwrap(), mape_want, 1e-6);
        assert_close("rmse", rmse(&a, &b).unwrap(), mse_want.sqrt(), 1e-6);
    }
}

#[test]
fn closed_forms_of_constant_pictures() {
    let (a, b) = (grey(16, 12, 0.75), grey(16, 12, 0.5));
    let report = compare(&a, &b).unwrap();
    assert_close("mse", report.mse, 0.0625, 1e-12);
    assert_close("rmse", report.rmse, 0.25, 1e-12);
    assert_close("relmse", report.relmse, 0.0625 / 0.26, 1e-12);
    assert_close("mape", report.mape, 0.25 / 0.505, 1e-12);
    assert_close("bias", report.bias.g.absolute, 0.25, 1e-12);
    assert_close("relative bias", report.bias.luminance.relative.unwrap(), 0.5, 1e-12);
}

#[test]
fn bias_is_signed_and_a_channel() {
    let report = compare(&image(4, 4, |_, _| [0.5, 1.0, 3.0]), &image(4, 4, |_, _| [1.0, 1.0, 2.0])).unwrap();
    assert_eq!(report.bias.r.relative, Some(-0.5));
    assert_eq!(report.bias.g.absolute, 0.0);
    assert_eq!(report.bias.b.relative, Some(0.5));
    assert_close("luminance", report.bias.luminance.absolute, -0.2126 * 0.5 + 0.0722, 1e-9);
}

#[test]
fn equal_pictures_have_no_error() {
    for picture in [noisy_gradient(33, 20), grey(12, 12, 0.0)] {
        let report = compare(&picture, &picture).unwrap();
        assert_eq!((report.mse, report.rmse, report.relmse, report.mape), (0.0, 0.0, 0.0, 0.0));
        assert_close("ssim", report.ssim.unwrap(), 1.0, 1e-12);
        assert_eq!(report.flip, 0.0);
    }
}

#[test]
fn flip_of_the_farthest_colours_is_one() {
    let (green, blue) = (image(8, 8, |_, _| [0.0, 1.0, 0.0]), image(8, 8, |_, _| [0.0, 0.0, 1.0]));
    assert_close("flip", flip(&green, &blue).unwrap(), 1.0, 1e-6);
}

#[test]
fn black_references_and_small_pictures_have_stated_answers() {
    let report = compare(&grey(5, 5, 1.0), &grey(5, 5, 0.0)).unwrap();
    assert_eq!(report.ssim, None);
    assert_eq!(report.mape, f64::INFINITY);
    assert_eq!(report.bias.r.relative, None);
    assert_close("relmse", report.relmse, 100.0, 1e-12);
}

#[test]
fn pictures_that_cannot_be_compared_are_refused() {
    let error = compare(&grey(4, 3, 0.0), &grey(3, 4, 0.0)).unwrap_err();
    assert!(matches!(&error, Error::BadValue { .. }));
    assert!(error.to_string().contains("4x3") && error.to_string().contains("3x4"), "{error}");

    let mut broken = grey(4, 4, 1.0);
    broken.pixels[3] = [f32::NAN, 1.0, f32::NAN];
    broken.pixels[7][1] = f32::INFINITY;
    for (a, b, which) in [(&broken, &grey(4, 4, 1.0), "image"), (&grey(4, 4, 1.0), &broken, "reference")] {
        let message = compare(a, b).unwrap_err().to_string();
        assert_eq!(message, format!("{which}: 2 NaN and 1 infinite values"));
    }

    let empty = Image { width: 0, height: 0, pixels: vec![] };
    assert!(compare(&empty, &empty).is_err());
}
