//! How far one picture is from another, for a worker of the page: a large one takes longer than a page may stand still.

use super::{JsResult, OrJs};
use crate::lab::{flip, metrics};
use crate::{Image, Result};
use wasm_bindgen::prelude::*;

fn image(rgb: &[f32], width: u32) -> Image {
    let pixels: Vec<[f32; 3]> = rgb.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
    Image { width, height: pixels.len() as u32 / width.max(1), pixels }
}

fn errors(picture: &Image, reference: &Image) -> Result<serde_json::Value> {
    let [.., luminance] = metrics::bias(picture, reference)?;
    Ok(serde_json::json!({
        "mse": metrics::mse(picture, reference)?,
        "relmse": metrics::relmse(picture, reference)?,
        "mape": metrics::mape(picture, reference)?,
        "bias": luminance.relative,
    }))
}

/// How far a picture is from a reference, both linear Rec. 709, three numbers a pixel, `width` pixels a row. JSON: `mse`, `relmse`, `mape`, and
/// `bias`, the signed one of mean luminance; the last two as fractions, null where the reference is black.
#[wasm_bindgen]
pub fn measure_errors(picture: &[f32], reference: &[f32], width: u32) -> JsResult<String> {
    errors(&image(picture, width), &image(reference, width)).map(|json| json.to_string()).js()
}

/// FLIP of each pixel, 0 to 1, of two such pictures.
#[wasm_bindgen]
pub fn measure_flip(picture: &[f32], reference: &[f32], width: u32) -> JsResult<Vec<f32>> {
    let map = flip::flip_map(&image(picture, width), &image(reference, width)).js()?;
    Ok(map.into_iter().map(|value| value as f32).collect())
}
