//! Experiments: how far one picture is from another.
//!
//! Everywhere the first picture is the one that is judged and the second is the reference; both are linear Rec. 709.

pub mod compare;
pub mod flip;
pub mod metrics;
mod plane;
pub mod ssim;

pub use compare::{Comparison, compare};
pub use flip::flip;
pub use metrics::{Bias, bias, luminance, mape, mean, mse, relmse, rmse};
pub use ssim::ssim;
