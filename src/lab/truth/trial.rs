//! What a technique claims, as its file `lab/truth/TECHNIQUE.toml` declares it, and the proof.

use super::equivalence::{Comparison, Estimate, Margins};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::lab::settings::{self, Settings, View};
use crate::renderer::Renderer;
use crate::scene::FlatScene;
use serde::{Deserialize, Serialize};

/// (technique, text) of each file `lab/truth/TECHNIQUE.toml`, by technique.
static FILES: &[(&str, &str)] = include!(concat!(env!("OUT_DIR"), "/claims.rs"));

/// How far an unbiased setting may be off: docs/testing.md.
const MARGINS: Margins = Margins { picture: 0.002, tile: 0.01 };

/// A quick check makes this share of the runs, which widens errors to twice what they were, and margins with them.
const QUICK: u32 = 4;

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
    /// What the numbers say.
    pub verdict: Verdict,
    /// Whether that is as it should be.
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
            if effort.runs < 2 * QUICK || effort.frames == 0 {
                return bad("8 runs and 1 frame are the fewest");
            }
        }
        settings::check("path-tracer", &trial.render)?;
        for own in trial.claims.iter().map(|c| &c.settings).chain(trial.plants.iter().map(|p| &p.settings)) {
            settings::check(&trial.technique, &trial.settings_with(own))?;
        }
        Ok(trial)
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
/// A quick check makes a quarter of the runs for unbiased settings and asks of them no more than it can tell: twice the margin.
///
/// # Errors
/// Those of rendering; `SHADER` for a plant whose text is no longer in the shaders.
pub fn check(
    trial: &Trial,
    quick: bool,
    scene: &FlatScene,
    device: &dyn Fn() -> Result<Gpu>,
    heard: &dyn Fn(&str, usize, usize),
) -> Result<Vec<Finding>> {
    let wide = Margins { picture: 2.0 * MARGINS.picture, tile: 2.0 * MARGINS.tile };
    let of = 1 + trial.claims.len() + trial.plants.len();
    let less = |effort: Effort| if quick { Effort { runs: effort.runs / QUICK, ..effort } } else { effort };
    let estimate =
        |renderer: &mut Renderer, effort: Effort| Estimate::radiance(renderer, effort.runs, effort.frames, trial.tile);
    heard("reference", 0, of);
    let gpu = device()?;
    let mut renderer = trial.renderer(gpu, scene)?;
    settings::apply(&mut renderer, "path-tracer", &trial.render)?;
    let reference = estimate(&mut renderer, less(trial.reference))?;
    let mut findings = Vec::new();
    for claim in &trial.claims {
        let what = claim.what();
        heard(&what, 1 + findings.len(), of);
        settings::apply(&mut renderer, &trial.technique, &trial.settings_with(&claim.settings))?;
        let (step, effort, margins) = match claim.unbiased {
            true if quick => (Step::Unbiased, less(trial.unbiased), wide),
            true => (Step::Unbiased, trial.unbiased, MARGINS),
            false => (Step::Biased, trial.biased, MARGINS),
        };
        let regions = Comparison::new(&estimate(&mut renderer, effort)?, &reference, margins);
        findings.push(Finding::new(&trial.technique, step, what, regions));
    }
    for plant in &trial.plants {
        heard(&plant.what, 1 + findings.len(), of);
        let gpu = device()?;
        gpu.plant(&plant.old, &plant.new)?;
        let mut renderer = trial.renderer(gpu, scene)?;
        settings::apply(&mut renderer, &trial.technique, &trial.settings_with(&plant.settings))?;
        let regions = Comparison::new(&estimate(&mut renderer, trial.biased)?, &reference, MARGINS);
        findings.push(Finding::new(&trial.technique, Step::Plant, plant.what.clone(), regions));
    }
    Ok(findings)
}

impl Finding {
    fn new(technique: &str, step: Step, what: String, regions: Comparison) -> Self {
        let verdict = match (regions.is_equivalent(), regions.is_caught()) {
            (true, _) => Verdict::Equivalent,
            (_, true) => Verdict::Biased,
            _ => Verdict::Undecided,
        };
        let passed = match step {
            Step::Unbiased => verdict == Verdict::Equivalent,
            Step::Biased | Step::Plant => verdict == Verdict::Biased,
        };
        let (bias, standard_error) = regions.bias();
        Finding { technique: technique.to_owned(), step, what, bias, standard_error, verdict, passed, regions }
    }
}
