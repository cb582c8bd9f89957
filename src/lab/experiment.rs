//! One experiment as its file declares it. docs/lab.md explains every field.

use super::settings::{self, Settings, Value, View};
use crate::error::{Error, Result};
use crate::output::MAX_SIDE;
use crate::scene::builtin;
use crate::techniques;
use crate::view::Shown;
use serde::{Deserialize, Serialize};

/// What is measured, of what, against what.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    /// For the page's head and the list.
    pub title: String,
    /// Paper and table or figure.
    pub source: String,
    /// What the paper found, and what is measured in its place.
    #[serde(default)]
    pub about: String,
    /// Our reading of the full figures; left out of quick pages.
    #[serde(default)]
    pub reading: String,
    /// Each gets a table, plots and a strip of its own.
    #[serde(rename = "scene")]
    pub scenes: Vec<Place>,
    /// Picture size in pixels.
    pub size: [u32; 2],
    /// Technique of each series that names none.
    #[serde(default = "default_technique")]
    pub technique: String,
    /// Settings that all series share.
    #[serde(default)]
    pub settings: Settings,
    /// Whether the frames of a run are averaged, or each is judged alone.
    #[serde(default)]
    pub accumulate: bool,
    /// Frames of a run, counted from 1, whose pictures are judged.
    pub frames: Vec<u32>,
    /// Independent runs, each with a seed of its own.
    pub runs: u32,
    /// What the tables and plots show; the CSV has all.
    pub metrics: Vec<Metric>,
    /// What is drawn along the horizontal axis; where it is not said: the first sweep, else frames if there are several,
    /// else the series side by side.
    #[serde(default)]
    pub x: Option<Axis>,
    /// At most two parameters that are varied; the second makes a series of each of its values.
    #[serde(default, rename = "sweep")]
    pub sweeps: Vec<Sweep>,
    /// What is compared; one nameless series of the shared settings where there is none.
    #[serde(default)]
    pub series: Vec<Series>,
    /// What the pictures are judged by.
    pub reference: Reference,
    /// Adds a table of errors at equal time.
    #[serde(default)]
    pub equal_time: Option<EqualTime>,
    /// What moves during a run.
    #[serde(default)]
    pub motion: Option<Motion>,
    /// A debug view that the strip shows in place of pictures.
    #[serde(default)]
    pub view: Option<String>,
    /// What `--quick` puts in place of the above.
    #[serde(default)]
    pub quick: Quick,
}

fn default_technique() -> String {
    techniques::ALL[0].id.to_owned()
}

/// A scene and where it is seen from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Place {
    /// A file or `builtin:NAME`; `*` stands for the value of a sweep over `scene`.
    pub name: String,
    /// Its first camera where none is given.
    #[serde(default)]
    pub camera: View,
    /// Settings for this scene alone.
    #[serde(default)]
    pub settings: Settings,
}

/// What is judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Metric {
    /// [`super::mse`].
    Mse,
    /// [`super::rmse`].
    Rmse,
    /// [`super::relmse`].
    Relmse,
    /// [`super::mape`].
    Mape,
    /// Signed relative difference of mean luminance, percent.
    Bias,
    /// Wall time of a frame, milliseconds.
    FrameMs,
    /// Time of all passes of a frame, milliseconds by GPU timestamps.
    GpuMs,
    /// Time of the technique's passes, without visibility buffer and film, milliseconds by GPU timestamps.
    LightingMs,
    /// Rays a pixel and frame.
    Rays,
    /// Samples left out of the picture because they were not finite.
    NotFinite,
}

impl Metric {
    /// Every metric, in the order of the CSV's columns.
    pub const ALL: [Metric; 10] = [
        Metric::Mse,
        Metric::Rmse,
        Metric::Relmse,
        Metric::Mape,
        Metric::Bias,
        Metric::FrameMs,
        Metric::GpuMs,
        Metric::LightingMs,
        Metric::Rays,
        Metric::NotFinite,
    ];

    /// Its name in files.
    pub fn key(self) -> &'static str {
        match self {
            Metric::Mse => "mse",
            Metric::Rmse => "rmse",
            Metric::Relmse => "relmse",
            Metric::Mape => "mape",
            Metric::Bias => "bias",
            Metric::FrameMs => "frame-ms",
            Metric::GpuMs => "gpu-ms",
            Metric::LightingMs => "lighting-ms",
            Metric::Rays => "rays",
            Metric::NotFinite => "not-finite",
        }
    }

    /// Its name for people, with the unit.
    pub fn title(self) -> &'static str {
        match self {
            Metric::Mse => "MSE",
            Metric::Rmse => "RMSE",
            Metric::Relmse => "relative MSE",
            Metric::Mape => "MAPE",
            Metric::Bias => "signed bias, %",
            Metric::FrameMs => "frame, ms",
            Metric::GpuMs => "all passes, ms",
            Metric::LightingMs => "lighting, ms",
            Metric::Rays => "rays a pixel",
            Metric::NotFinite => "samples not finite",
        }
    }

    /// Whether it is a distance from the reference, which falls with time by powers; the signed bias is none.
    pub fn is_error(self) -> bool {
        matches!(self, Metric::Mse | Metric::Rmse | Metric::Relmse | Metric::Mape)
    }

    /// Whether it is a time: one number a run, however many of its frames are judged.
    pub fn is_time(self) -> bool {
        matches!(self, Metric::FrameMs | Metric::GpuMs | Metric::LightingMs)
    }
}

/// A horizontal axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Axis {
    /// The values of the first sweep.
    Sweep,
    /// The frame that is judged.
    Frame,
    /// Milliseconds that the picture took: all frames where they are averaged, else one.
    Time,
    /// The series side by side.
    Series,
}

/// A parameter and the values it takes: one of a technique, `scene` or `size`.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sweep {
    /// The parameter.
    pub key: String,
    /// Its values in order.
    pub values: Vec<Value>,
}

/// One curve.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Series {
    /// For legends and tables.
    #[serde(default)]
    pub name: String,
    /// The experiment's where there is none.
    #[serde(default)]
    pub technique: Option<String>,
    /// Added to the shared settings.
    #[serde(default)]
    pub settings: Settings,
    /// The experiment's where it is not said.
    #[serde(default)]
    pub accumulate: Option<bool>,
    /// The experiment's where there are none.
    #[serde(default)]
    pub frames: Option<Vec<u32>>,
}

/// What pictures are judged by: averaged frames of `path-tracer`.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reference {
    /// In all; half of them is a chain of its own, and how far the halves differ says what the reference's own noise is.
    pub frames: u32,
    /// Of the path tracer.
    #[serde(default)]
    pub settings: Settings,
}

/// Errors at equal time: each picture beside one of the baseline that took as long.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EqualTime {
    /// The name of a series that averages several frames.
    pub baseline: String,
}

/// What moves while a run goes on. The last frame, the one that is judged, is seen from the scene's camera.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motion {
    /// Metres that the camera moves a frame.
    #[serde(default)]
    pub camera_step: [f32; 3],
    /// Seconds of scene time that a frame takes, in sixtieths.
    #[serde(default)]
    pub speed: f64,
    /// The moment of the last frame, seconds.
    #[serde(default)]
    pub time: f64,
}

impl Motion {
    fn is_finite(&self) -> bool {
        self.camera_step.iter().all(|step| step.is_finite()) && self.speed.is_finite() && self.time.is_finite()
    }
}

/// What a quick run does less of.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quick {
    /// In place of [`Experiment::scenes`].
    #[serde(default, rename = "scene")]
    pub scenes: Option<Vec<Place>>,
    /// In place of [`Experiment::size`].
    pub size: Option<[u32; 2]>,
    /// In place of [`Experiment::frames`]; series that have their own keep them.
    pub frames: Option<Vec<u32>>,
    /// In place of [`Experiment::runs`].
    pub runs: Option<u32>,
    /// In place of the first sweep's values.
    pub values: Option<Vec<Value>>,
    /// In place of [`Reference::frames`].
    pub reference_frames: Option<u32>,
}

/// Most frames of a run, and runs.
const MOST_FRAMES: u32 = 1 << 24;
const MOST_RUNS: u32 = 10_000;

impl Experiment {
    /// Reads and checks a file; `name` is for errors.
    ///
    /// # Errors
    /// `BAD_FILE` where it is no experiment or contradicts itself; `UNKNOWN_NAME` and `BAD_VALUE` for a technique, parameter,
    /// scene or value that does not exist.
    pub fn parse(name: &str, text: &str) -> Result<Self> {
        let experiment: Experiment = toml::from_str(text).map_err(|error| {
            let before = error.span().map_or(0, |span| span.start).min(text.len());
            let line = text.as_bytes()[..before].iter().filter(|byte| **byte == b'\n').count() + 1;
            Error::bad_file(name, format!("line {line}"), error.message())
        })?;
        experiment.check(name)?;
        experiment.quick().check(name)?;
        Ok(experiment)
    }

    /// The same, shortened.
    pub fn quick(&self) -> Self {
        let mut short = self.clone();
        let quick = std::mem::take(&mut short.quick);
        short.scenes = quick.scenes.unwrap_or(short.scenes);
        short.size = quick.size.unwrap_or(short.size);
        short.frames = quick.frames.unwrap_or(short.frames);
        short.runs = quick.runs.unwrap_or(short.runs);
        if let (Some(values), Some(sweep)) = (quick.values, short.sweeps.first_mut()) {
            sweep.values = values;
        }
        short.reference.frames = quick.reference_frames.unwrap_or(short.reference.frames);
        short.reading.clear();
        short
    }

    /// The series that are drawn: those of the file, each with every value of the second sweep.
    pub fn curves(&self) -> Vec<Series> {
        let own = if self.series.is_empty() { vec![Series::default()] } else { self.series.clone() };
        let Some(second) = self.sweeps.get(1) else { return own };
        let with = |series: &Series, value: &Value| {
            let mut series = series.clone();
            let label = format!("{} = {value}", second.key);
            series.name = if series.name.is_empty() { label } else { format!("{}, {label}", series.name) };
            series.settings.insert(second.key.clone(), value.clone());
            series
        };
        own.iter().flat_map(|series| second.values.iter().map(move |value| with(series, value))).collect()
    }

    /// What is drawn along the horizontal axis.
    pub fn axis(&self) -> Axis {
        let several =
            self.frames.len() > 1 || self.series.iter().any(|s| s.frames.as_ref().is_some_and(|f| f.len() > 1));
        let natural = match (self.sweeps.is_empty(), several) {
            (false, _) => Axis::Sweep,
            (true, true) => Axis::Frame,
            (true, false) => Axis::Series,
        };
        self.x.unwrap_or(natural)
    }

    /// The technique of a series.
    pub fn technique<'a>(&'a self, series: &'a Series) -> &'a str {
        series.technique.as_deref().unwrap_or(&self.technique)
    }

    /// The judged frames of a series.
    pub fn frames<'a>(&'a self, series: &'a Series) -> &'a [u32] {
        series.frames.as_deref().unwrap_or(&self.frames)
    }

    /// Whether a series averages its frames.
    pub fn accumulates(&self, series: &Series) -> bool {
        series.accumulate.unwrap_or(self.accumulate)
    }

    /// Gives all pictures another size. Where the size is what is swept nothing changes, and this is `false`.
    pub fn set_size(&mut self, size: [u32; 2]) -> bool {
        let is_free = self.size_sweep().is_none();
        if is_free {
            self.size = size;
        }
        is_free
    }

    fn size_sweep(&self) -> Option<&Sweep> {
        self.sweeps.first().filter(|sweep| sweep.key == "size")
    }

    /// Picture sizes: those that are swept, else the one there is.
    ///
    /// # Errors
    /// `BAD_FILE` for a value that is none; `name` is for that.
    pub(super) fn sizes(&self, name: &str) -> Result<Vec<[u32; 2]>> {
        match self.size_sweep() {
            Some(sweep) => sweep.values.iter().map(|value| parse_size(name, value)).collect(),
            None => Ok(vec![self.size]),
        }
    }

    fn check(&self, name: &str) -> Result<()> {
        let bad = |place: &str, what: String| Err(Error::bad_file(name, place, what));
        if self.scenes.is_empty() {
            return bad("scene", "there is none".into());
        }
        if self.size.iter().any(|side| !(1..=MAX_SIDE).contains(side)) {
            return bad("size", format!("each side is 1 to {MAX_SIDE} pixels"));
        }
        if self.motion.as_ref().is_some_and(|motion| !motion.is_finite()) {
            return bad("motion", "every number has to be finite".into());
        }
        if self.metrics.is_empty() {
            return bad("metrics", "there is none".into());
        }
        if !(1..=MOST_RUNS).contains(&self.runs) {
            return bad("runs", format!("1 to {MOST_RUNS} are possible"));
        }
        if !(2..=MOST_FRAMES).contains(&self.reference.frames) {
            return bad("reference.frames", format!("2 to {MOST_FRAMES} are possible"));
        }
        if self.quick.values.is_some() && self.sweeps.is_empty() {
            return bad("quick.values", "there is no sweep that they could shorten".into());
        }
        if self.sweeps.len() > 2 {
            return bad("sweep", "at most two parameters are varied".into());
        }
        if let Some(sweep) = self.sweeps.iter().find(|sweep| sweep.values.is_empty()) {
            return bad("sweep", format!("'{}' has no values", sweep.key));
        }
        if self.sweeps.get(1).is_some_and(|sweep| ["scene", "size"].contains(&sweep.key.as_str())) {
            return bad("sweep", "scenes and sizes can be swept first only".into());
        }
        let keys: Vec<&str> = self.sweeps.iter().map(|sweep| sweep.key.as_str()).collect();
        // A swept value takes the place of a shared one; with a scene's or a series' own it would be a contradiction.
        let places = self.scenes.iter().map(|place| &place.settings);
        for settings in places.chain(self.series.iter().map(|series| &series.settings)) {
            if let Some(key) = keys.iter().find(|key| settings.contains_key(**key)) {
                return bad("sweep", format!("'{key}' is swept, and a scene or a series sets it as well"));
            }
        }
        if has_twins(&keys) || self.sweeps.iter().any(|sweep| has_twins(&sweep.values)) {
            return bad("sweep", "the same key or value stands there twice".into());
        }
        if has_twins(&self.metrics) {
            return bad("metrics", "one stands there twice".into());
        }
        if has_twins(&self.scenes) {
            return bad("scene", "the same one stands there twice".into());
        }
        if self.series.iter().any(|series| series.name.is_empty()) {
            return bad("series", "one has an empty name".into());
        }
        if self.axis() == Axis::Sweep && self.sweeps.is_empty() {
            return bad("x", "there is no sweep".into());
        }
        settings::check("path-tracer", &self.reference.settings)?;
        self.sizes(name)?;
        for place in &self.scenes {
            self.check_scene(name, place)?;
        }
        let curves = self.curves();
        for key in self.settings.keys().chain(self.scenes.iter().flat_map(|place| place.settings.keys())) {
            let known = curves.iter().map(|series| techniques::find(self.technique(series)).and_then(|t| t.spec(key)));
            // Techniques may differ in what they have; one at least has it.
            known.reduce(|one, other| one.or(other)).unwrap_or_else(|| techniques::ALL[0].spec(key))?;
        }
        for series in &curves {
            let frames = self.frames(series);
            let rising = frames.windows(2).all(|pair| pair[0] < pair[1]);
            if frames.is_empty() || frames[0] == 0 || frames.iter().any(|f| *f > MOST_FRAMES) || !rising {
                return bad("frames", format!("rising numbers from 1 to {MOST_FRAMES} are wanted"));
            }
            if curves.iter().filter(|other| other.name == series.name).count() > 1 {
                return bad("series", format!("two are called '{}'", series.name));
            }
            if self.motion.is_some() && (self.accumulates(series) || frames.len() > 1) {
                return bad("motion", "what moves is judged in one frame, which is not averaged".into());
            }
            let technique = self.technique(series);
            if let Some(view) = self.view.as_deref().filter(|view| !has_view(technique, view)) {
                return bad("view", format!("{technique} has no view '{view}'"));
            }
            // Those of each point as a whole, for settings may contradict each other.
            let values = self.sweeps.first().map_or(vec![None], |sweep| sweep.values.iter().map(Some).collect());
            for (place, value) in self.scenes.iter().flat_map(|place| values.iter().map(move |value| (place, *value))) {
                settings::check(technique, &self.settings_of(place, series, value))?;
            }
        }
        let Some(EqualTime { baseline }) = &self.equal_time else { return Ok(()) };
        let Some(series) = curves.iter().find(|series| series.name == *baseline) else {
            return bad("equal_time.baseline", format!("no series is called '{baseline}'"));
        };
        // Between two of its frames lies what it would have had at another time.
        if !self.accumulates(series) || self.frames(series).len() < 2 {
            return bad("equal_time.baseline", format!("'{baseline}' does not average several frames"));
        }
        if !self.metrics.iter().any(|metric| metric.is_error()) {
            return bad("equal_time", "no metric is an error".into());
        }
        Ok(())
    }

    /// Whether scene names can be right; what is in a file is seen when it is read.
    fn check_scene(&self, name: &str, place: &Place) -> Result<()> {
        if let View::LookAt(view) = &place.camera {
            view.check().map_err(|what| Error::bad_file(name, "scene.camera", what))?;
        }
        let swept = self.sweeps.first().filter(|sweep| sweep.key == "scene");
        let names: Vec<String> = match swept {
            Some(sweep) => sweep.values.iter().map(|value| place.name.replace('*', &value.0)).collect(),
            None => vec![place.name.clone()],
        };
        if swept.is_some() != place.name.contains('*') {
            return Err(Error::bad_file(name, "scene", "a '*' in a scene's name and a sweep over 'scene' go together"));
        }
        names.iter().filter_map(|scene| scene.strip_prefix("builtin:")).try_for_each(builtin::check_name)
    }

    /// Settings of a point: those that all share and its technique has, those of the series, and the swept one.
    pub fn settings_of(&self, place: &Place, series: &Series, value: Option<&Value>) -> Settings {
        let has = |key: &str| techniques::find(self.technique(series)).is_ok_and(|info| info.spec(key).is_ok());
        let shared = self.settings.iter().chain(&place.settings).filter(|(key, _)| has(key));
        let mut all: Settings = shared.chain(&series.settings).map(|(k, v)| (k.clone(), v.clone())).collect();
        if let (Some(sweep), Some(value)) = (self.sweeps.first(), value)
            && !["scene", "size"].contains(&sweep.key.as_str())
        {
            all.insert(sweep.key.clone(), value.clone());
        }
        all
    }
}

fn has_view(technique: &str, view: &str) -> bool {
    techniques::find(technique).is_ok_and(|info| Shown::find(view, info.views).is_ok())
}

/// `WIDTHxHEIGHT` of a sweep over sizes.
pub(super) fn parse_size(name: &str, value: &Value) -> Result<[u32; 2]> {
    let sides = value.0.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    sides
        .filter(|sides: &[u32; 2]| sides.iter().all(|side| (1..=MAX_SIDE).contains(side)))
        .ok_or_else(|| Error::bad_file(name, "sweep", format!("'{value}' is no size, WIDTHxHEIGHT up to {MAX_SIDE}")))
}

/// Whether two are alike.
fn has_twins<T: PartialEq>(list: &[T]) -> bool {
    list.iter().enumerate().any(|(i, one)| list[..i].contains(one))
}
