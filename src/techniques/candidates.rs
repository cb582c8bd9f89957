//! Candidates of resampling: which lights are chosen how, and whether rays drawn for the BSDF add theirs
//! (`shaders/techniques/common/candidates.wgsl`), for every technique that resamples direct light.

use crate::gpu::shader::SceneFeatures;

/// The choices of a parameter `light_choice`.
pub const LIGHT_CHOICES: [&str; 3] = ["alias", "cdf", "uniform"];

/// Puts into `features` what passes that draw candidates are compiled with: which of [`LIGHT_CHOICES`], and whether
/// there are BSDF samples.
pub fn specialise(features: &mut SceneFeatures, light_choice: u32, bsdf_samples: u32) {
    let name = LIGHT_CHOICES.get(light_choice as usize).copied().unwrap_or_default();
    features.light_choice_cdf = name == "cdf";
    features.light_choice_uniform = name == "uniform";
    features.bsdf_candidates = bsdf_samples > 0;
}
