//! What a technique claims, as its file `lab/truth/TECHNIQUE.toml` declares it, and the proof.

use super::equivalence::{Comparison, Estimate, Margins, Proof, counted_pictures};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::lab::reference::refuse_broken;
use crate::lab::settings::{self, Settings, View};
use crate::renderer::Renderer;
use crate::scene::FlatScene;
use serde::{Deserialize, Serialize};

/// (technique, text) of each file `lab/truth/TECHNIQUE.toml`, by technique.
static FILES: &[(&str, &str)] = include!(concat!(env!("OUT_DIR"), "/claims.rs"));

/// How far an unbiased setting may be off: docs/testing.md.
const MARGINS: Margins = Margins { picture: 0.002, tile: 0.01 };

/// The claims of one technique, and how they are put to the proof.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Trial {
    /// Its id.
    pub technique: String,
    /// The scene in which it is compared with the path tracer.
    pub scene: String,
    /// Where from: no light source should be in view, so that the mean is all scattered light.
    #[serde(default)]
    pub camera: View,
    /// Width and height of the picture in pixels.
    pub size: u32,
    /// Width and height of a tile in pixels.
    pub tile: u32,
    /// Settings that technique and path tracer share.
    #[serde(default)]
    pub render: Settings,
    /// Settings that all claims share.
    #[serde(default)]
    pub settings: Settings,
    /// Of the path tracer.
    pub reference: Effort,
    /// Of each unbiased setting.
    pub unbiased: Effort,
    /// Of each biased setting and each planted fault.
    pub biased: Effort,
    /// What is claimed.
    #[serde(rename = "claim")]
    pub claims: Vec<Claim>,
    /// Faults that must be caught.
    #[serde(default, rename = "plant")]
    pub plants: Vec<Plant>,
}

/// Independent runs, and frames averaged in each.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Effort {
    /// Runs, each with a seed of its own.
    pub runs: u32,
    /// Frames of a run.
    pub frames: u32,
}

/// A claim about settings.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    /// Beyond those that all claims share.
    #[serde(default)]
    pub settings: Settings,
    /// Whether the expectation is right.
    pub unbiased: bool,
    /// Why, in a few words.
    pub because: String,
}

/// A fault planted in the shaders.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plant {
    /// What is wrong then.
    pub what: String,
    /// The file below `shaders/` that has it, for people.
    pub file: String,
    /// What stands there.
    pub old: String,
    /// What is put in its place.
    pub new: String,
    /// Beyond those that all claims share.
    #[serde(default)]
    pub settings: Settings,
}

/// What the numbers say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Every mean lies within its margin, at 95 % confidence.
    Equivalent,
    /// A mean lies outside its margin, at 95 % confidence.
    Biased,
    /// Neither can be said.
    Undecided,
}

/// What is put to the proof.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Step {
    /// A setting said to be unbiased.
    Unbiased,
    /// A setting said to be biased.
    Biased,
    /// A planted fault.
    Plant,
}

/// The outcome for one claim or plant.
#[derive(Debug, Clone, Serialize)]
pub struct Finding {
    /// The technique.
    pub technique: String,
    /// What was put to the proof.
    pub step: Step,
    /// The settings, or what was planted.
    pub what: String,
    /// Signed relative bias of the picture's mean.
    pub bias: f64,
    /// Its standard error.
    pub standard_error: f64,
    /// Samples that were not finite, and so are in no mean.
    pub not_finite: u64,
    /// What the numbers say.
    pub verdict: Verdict,
    /// Whether that is as it should be: where no bias is claimed, with every sample.
    pub passed: bool,
    /// Relative difference, standard error and margin of the picture, then of each tile.
    pub regions: Comparison,
}

impl Claim {
    /// Its settings in words.
    pub fn what(&self) -> String {
        if self.settings.is_empty() {
            "the settings shared by all".to_owned()
        } else {
            settings::describe(&self.settings)
        }
    }
}

impl Trial {
    /// The techniques that have one.
    pub fn techniques() -> impl Iterator<Item = &'static str> {
        FILES.iter().map(|(technique, _)| *technique)
    }

    /// That of a technique.
    ///
    /// # Errors
    /// `UNKNOWN_NAME` listing the techniques that have one; as [`Trial::parse`].
    pub fn find(technique: &str) -> Result<Self> {
        let file = FILES.iter().find(|(known, _)| *known == technique).ok_or_else(|| Error::Unknown {
            kind: "technique with claims",
            name: technique.to_owned(),
            known: Self::techniques().collect::<Vec<_>>().join(", "),
        })?;
        Self::parse(&format!("lab/truth/{technique}.toml"), file.1)
    }

    /// Reads and checks a file; `name` is for errors.
    ///
    /// # Errors
    /// `BAD_FILE` where it is none; `UNKNOWN_NAME` and `BAD_VALUE` for a technique, parameter or value that does not exist.
    pub fn parse(name: &str, text: &str) -> Result<Self> {
        let trial: Trial = toml::from_str(text).map_err(|error| Error::bad_file(name, "file", error.message()))?;
        let bad = |what: &str| Err(Error::bad_file(name, "file", what));
        if trial.size == 0 || trial.tile == 0 || !trial.size.is_multiple_of(trial.tile) {
            return bad("tiles do not fill the picture");
        }
        for effort in [trial.reference, trial.unbiased, trial.biased] {
            // Two are left of a quick proof, the fewest that have a variance.
            if effort.runs < 8 || effort.frames == 0 {
                return bad("8 runs and 1 frame are the fewest");
            }
        }
        settings::check("path-tracer", &trial.render)?;
        for own in trial.claims.iter().map(|c| &c.settings).chain(trial.plants.iter().map(|p| &p.settings)) {
            settings::check(&trial.technique, &trial.settings_with(own))?;
        }
        Ok(trial)
    }

    /// Of each kind the first alone: a setting that is unbiased, one that is biased, a plant.
    #[must_use]
    pub fn abridged(mut self) -> Self {
        let first = |unbiased| self.claims.iter().find(|claim| claim.unbiased == unbiased).cloned();
        self.claims = [first(true), first(false)].into_iter().flatten().collect();
        self.plants.truncate(1);
        self
    }

    fn settings_with(&self, own: &Settings) -> Settings {
        let all = self.render.iter().chain(&self.settings).chain(own);
        all.map(|(key, value)| (key.clone(), value.clone())).collect()
    }

    /// A renderer of the trial's picture.
    fn renderer(&self, gpu: Gpu, scene: &FlatScene) -> Result<Renderer> {
        let camera = self.camera.camera(&scene.cameras)?;
        let mut renderer = Renderer::new(gpu, scene.clone(), [self.size; 2].into())?;
        renderer.set_accumulate(true);
        renderer.set_camera(&camera);
        Ok(renderer)
    }
}

/// Puts all claims of a trial to the proof, one after the other, then all plants. `device` makes devices: one for the
/// claims and one for each plant. `heard` is told what comes next, how many are done and how many there are.
///
/// A quick proof is one of unbiased settings alone: what is biased must be seen beyond the same margins, with as many runs.
///
/// # Errors
/// Those of rendering; `SHADER` for a plant whose text is no longer in the shaders; `BAD_VALUE` where the reference has
/// samples that are not finite, for then it is none.
pub fn check(
    trial: &Trial,
    proof: Proof,
    scene: &FlatScene,
    device: &dyn Fn() -> Result<Gpu>,
    heard: &dyn Fn(&str, usize, usize),
) -> Result<Vec<Finding>> {
    let of = 1 + trial.claims.len() + trial.plants.len();
    let less = |effort: Effort| Effort { runs: proof.effort(effort.runs), ..effort };
    let estimate = |renderer: &mut Renderer, effort: Effort| {
        let (pictures, not_finite) = counted_pictures(renderer, effort.runs, effort.frames)?;
        Ok::<_, Error>((Estimate::of_pictures(&pictures, trial.tile), not_finite))
    };
    heard("reference", 0, of);
    let gpu = device()?;
    let mut renderer = trial.renderer(gpu, scene)?;
    settings::apply(&mut renderer, "path-tracer", &trial.render)?;
    let (reference, not_finite) = estimate(&mut renderer, less(trial.reference))?;
    refuse_broken(not_finite)?;
    let mut findings = Vec::new();
    for claim in &trial.claims {
        let what = claim.what();
        heard(&what, 1 + findings.len(), of);
        settings::apply(&mut renderer, &trial.technique, &trial.settings_with(&claim.settings))?;
        let (step, effort, margins) = match claim.unbiased {
            true => (Step::Unbiased, less(trial.unbiased), proof.margins(MARGINS)),
            false => (Step::Biased, trial.biased, MARGINS),
        };
        let (estimate, not_finite) = estimate(&mut renderer, effort)?;
        let regions = Comparison::new(&estimate, &reference, margins);
        findings.push(Finding::new(&trial.technique, step, what, regions, not_finite));
    }
    for plant in &trial.plants {
        heard(&plant.what, 1 + findings.len(), of);
        let gpu = device()?;
        gpu.plant(&plant.old, &plant.new)?;
        let mut renderer = trial.renderer(gpu, scene)?;
        settings::apply(&mut renderer, &trial.technique, &trial.settings_with(&plant.settings))?;
        let (estimate, not_finite) = estimate(&mut renderer, trial.biased)?;
        let regions = Comparison::new(&estimate, &reference, MARGINS);
        findings.push(Finding::new(&trial.technique, Step::Plant, plant.what.clone(), regions, not_finite));
    }
    Ok(findings)
}

impl Finding {
    fn new(technique: &str, step: Step, what: String, regions: Comparison, not_finite: u64) -> Self {
        let verdict = match (regions.is_equivalent(), regions.is_caught()) {
            (true, _) => Verdict::Equivalent,
            (_, true) => Verdict::Biased,
            _ => Verdict::Undecided,
        };
        let passed = match step {
            // What is left out may be what would have made the mean wrong.
            Step::Unbiased => verdict == Verdict::Equivalent && not_finite == 0,
            Step::Biased | Step::Plant => verdict == Verdict::Biased,
        };
        let (bias, standard_error) = regions.bias();
        let technique = technique.to_owned();
        Finding { technique, step, what, bias, standard_error, not_finite, verdict, passed, regions }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_claim_holds_only_with_all_its_samples() {
        let passed = |step, mean, not_finite| {
            let [estimate, reference] = [mean, 1.0].map(|mean| Estimate(vec![(mean, 1e-4)]));
            let regions = Comparison::new(&estimate, &reference, MARGINS);
            Finding::new("ris", step, String::new(), regions, not_finite).passed
        };
        assert!(passed(Step::Unbiased, 1.0, 0) && !passed(Step::Unbiased, 1.0, 1) && !passed(Step::Unbiased, 1.1, 0));
        // A fault may well make them.
        assert!(passed(Step::Plant, 1.1, 1) && passed(Step::Biased, 1.1, 1) && !passed(Step::Plant, 1.0, 1));
    }
}
