//! Reuse weights: how passes that include `shaders/techniques/common/combine.wgsl` join reservoirs of several pixels.

use crate::error::{Error, Result};
use crate::gpu::shader::SceneFeatures;

/// The choices of a parameter `reuse_weights`, from the least to the most careful.
pub const WEIGHTS: [&str; 6] = ["constant", "heuristics", "1/z", "balance", "pairwise", "defensive"];

/// Puts into `features` what passes that include `techniques/common/combine.wgsl` are compiled with: which of
/// [`WEIGHTS`], whether visibility is a factor of target functions in them, and whether every reservoir that they join
/// holds a sample that was seen by a shadow ray (visibility reuse).
pub fn specialise(features: &mut SceneFeatures, weights: u32, visibility: bool, visibility_reuse: bool) {
    let name = WEIGHTS.get(weights as usize).copied().unwrap_or_default();
    features.reuse_constant = matches!(name, "constant" | "heuristics");
    features.reuse_everything = name == "constant";
    features.reuse_valid = name == "1/z";
    features.reuse_pairwise = matches!(name, "pairwise" | "defensive");
    features.reuse_defensive = name == "defensive";
    features.reuse_visibility = visibility && !features.reuse_constant;
    features.reservoirs_are_visible = features.reuse_visibility && visibility_reuse;
}

/// The parameter that [`WEIGHTS`] and `visibility_in_weights` were one in, before pairwise weights.
pub const OLD_NAME: &str = "bias_correction";

/// What a value of it is now, as names and values.
///
/// # Errors
/// `BAD_VALUE` for one that it did not take.
pub fn from_old(value: &str) -> Result<[(&'static str, &'static str); 2]> {
    let (weights, visibility) = match value {
        "none" => ("heuristics", "no"),
        "1/z" => ("1/z", "no"),
        "mis" => ("balance", "no"),
        "mis-visibility" => ("balance", "yes"),
        _ => {
            let what = format!("'{value}' is not one of none, 1/z, mis, mis-visibility; see reuse_weights");
            return Err(Error::bad_value(OLD_NAME, what));
        }
    };
    Ok([("reuse_weights", weights), ("visibility_in_weights", visibility)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn old_values_mean_what_they_meant() {
        assert_eq!(from_old("mis").ok(), Some([("reuse_weights", "balance"), ("visibility_in_weights", "no")]));
        for value in ["none", "1/z", "mis", "mis-visibility"] {
            let [(_, weights), _] = from_old(value).expect("an old value");
            assert!(WEIGHTS.contains(&weights), "{value}");
        }
        assert!(from_old("balance").is_err());
    }

    /// 1/M asks nothing of samples, so it must not trace rays for them.
    #[test]
    fn constant_weights_trace_nothing() {
        for (index, name) in WEIGHTS.iter().enumerate() {
            let mut features = SceneFeatures::NONE;
            specialise(&mut features, index as u32, true, true);
            assert_eq!(features.reuse_visibility, !matches!(*name, "constant" | "heuristics"), "{name}");
        }
    }
}
