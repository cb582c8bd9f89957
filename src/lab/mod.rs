//! Experiments: how far one picture is from another.
//!
//! Everywhere the first picture is the one that is judged and the second is the reference; both are linear Rec. 709.

pub mod compare;
#[cfg(not(target_arch = "wasm32"))]
pub mod experiment;
pub mod flip;
#[cfg(not(target_arch = "wasm32"))]
mod key;
#[cfg(not(target_arch = "wasm32"))]
pub mod library;
#[cfg(not(target_arch = "wasm32"))]
mod measure;
pub mod metrics;
mod plane;
#[cfg(not(target_arch = "wasm32"))]
mod plot;
#[cfg(not(target_arch = "wasm32"))]
pub mod reference;
#[cfg(not(target_arch = "wasm32"))]
mod report;
#[cfg(not(target_arch = "wasm32"))]
mod results;
#[cfg(not(target_arch = "wasm32"))]
mod run;
#[cfg(not(target_arch = "wasm32"))]
pub mod settings;
pub mod ssim;
#[cfg(not(target_arch = "wasm32"))]
mod strip;
#[cfg(not(target_arch = "wasm32"))]
pub mod truth;

pub use compare::{Comparison, compare};
pub use flip::flip;
pub use metrics::{Bias, bias, luminance, mape, mean, mse, relmse, rmse};
pub use ssim::ssim;
#[cfg(not(target_arch = "wasm32"))]
pub use {
    experiment::Experiment,
    results::median,
    run::{Options, Outcome, run},
};
