//! Rendering methods and their registry. To add one: its shader folder, its file here, one line in [`ALL`], one docs page.

pub mod candidates;
mod normals;
mod path_tracer;
pub mod presets;
mod restir_di;
mod restir_di_decoupled;
mod restir_report;
pub mod reuse;
mod ris;

use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::recorder::Recorder;
use crate::params::{FilmParams, ParamSpec, Params, RenderParams};
use crate::scene::gpu_types::Layout;
use crate::view::{COMMON_VIEWS, View};
use glam::UVec2;

/// What a technique is, for menus, the command line and the docs.
#[derive(Debug)]
pub struct TechniqueInfo {
    /// Its key everywhere.
    pub id: &'static str,
    /// Its name for people.
    pub title: &'static str,
    /// What it does, in one sentence.
    pub summary: &'static str,
    /// The papers it implements.
    pub papers: &'static [&'static str],
    /// Whether its defaults are unbiased.
    pub unbiased: bool,
    /// What bias there is, and in which settings.
    pub bias: &'static str,
    /// Its parameters.
    pub params: &'static [ParamSpec],
    /// Its debug views beyond those that every technique has.
    pub views: &'static [View],
    /// Its structs that have WGSL twins.
    pub layouts: &'static [Layout],
    /// Refuses settings, as (name, value), that contradict each other when they are set one after the other: `BAD_VALUE` naming what
    /// contradicts what, as [`Technique::set`]. It needs no device. Names that are not its own are passed over.
    pub check: fn(&[(&str, &str)]) -> Result<()>,
    /// Makes one.
    pub create: fn(&Gpu) -> Box<dyn Technique>,
}

impl TechniqueInfo {
    /// The declaration of a parameter: of the technique by its name, or of a global group as `render.NAME` or `film.NAME`.
    ///
    /// # Errors
    /// `UNKNOWN_NAME` listing the names there are.
    pub fn spec(&self, key: &str) -> Result<&'static ParamSpec> {
        let (specs, name) = match key.split_once('.') {
            Some(("render", name)) => (RenderParams::SPECS, name),
            Some(("film", name)) => (FilmParams::SPECS, name),
            _ => (self.params, key),
        };
        specs.iter().find(|spec| spec.name == name).ok_or_else(|| {
            let own = self.params.iter().map(|s| s.name.to_owned());
            let render = RenderParams::SPECS.iter().map(|s| format!("render.{}", s.name));
            let film = FilmParams::SPECS.iter().map(|s| format!("film.{}", s.name));
            Error::Unknown {
                kind: "parameter",
                name: key.to_owned(),
                known: own.chain(render).chain(film).collect::<Vec<_>>().join(", "),
            }
        })
    }
}

/// Views that several techniques have.
pub(crate) mod views {
    use crate::view::{Source, View};

    pub const DIRECT: View = View::radiance("direct", "Light that comes straight from lights.");
    pub const INDIRECT: View = View::radiance("indirect", "Light that has scattered more than once.");
    pub const CONTRIBUTION_WEIGHT: View = View::magnitude(
        "contribution weight",
        "W of the reservoir: how much its sample counts, 1 / p(y) on the average; black where it holds none.",
        "1 / density",
        [1e-3, 1e3],
    );
    pub const TARGET_FUNCTION: View = View::magnitude(
        "target function",
        "p̂ of the reservoir's sample: its luminance here if nothing stands between; black where it holds none.",
        "of luminance",
        [1e-3, 1e3],
    );
    pub const CONFIDENCE_WEIGHT: View = View::number(
        "confidence weight",
        "c of the reservoir: for how many frames of candidates it speaks.",
        "frames",
        [0.0, 1.0],
    );
    pub const REJECTED_NEIGHBORS: View = View::number(
        "rejected neighbours",
        "Pixels that reuse has looked at for neighbours and found too different.",
        "pixels",
        [0.0, 1.0],
    )
    .by(Source::Rejected);
    pub const LIGHT: View = View::colors("light", "A colour for each light that is chosen; black where none is.");
}

/// A setting that makes the expected picture differ from the truth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Bias {
    /// The parameter's key: of the technique by its name, or `render.NAME`.
    pub parameter: &'static str,
    /// How the picture differs, for people.
    pub why: &'static str,
}

/// Those of `(holds, parameter, why)` that hold.
pub(crate) fn biases_that_hold(all: &[(bool, &'static str, &'static str)]) -> Vec<Bias> {
    all.iter().filter(|(holds, ..)| *holds).map(|&(_, parameter, why)| Bias { parameter, why }).collect()
}

/// The parameter that only paths obey.
pub(crate) const MAX_DEPTH: &str = "render.max_depth";

/// What darkens every technique that draws indirect light only if it is asked to.
pub(crate) const NO_INDIRECT: &str = "light that scatters more than once is left out";

/// One rendering method. It owns its buffers and records its passes; it knows nothing of windows, pages or other methods.
pub trait Technique {
    /// What it is.
    fn info(&self) -> &'static TechniqueInfo;

    /// Sets a parameter; whether the name was known.
    ///
    /// # Errors
    /// `BAD_VALUE` for a value the parameter does not take.
    fn set(&mut self, name: &str, value: &str) -> Result<bool>;

    /// Parameter values as a JSON object.
    fn values(&self) -> serde_json::Value;

    /// Which of its settings, as they are now, bias the picture; those of all techniques are in [`RenderParams::biases`].
    fn biases(&self) -> Vec<Bias> {
        Vec::new()
    }

    /// Whether a parameter of all techniques, `render.NAME`, does anything as it is set now.
    fn obeys(&self, _parameter: &str) -> bool {
        true
    }

    /// The most that a view of its own that shows a number can show as it is set now, where the settings say.
    fn highest(&self, _view: &str) -> Option<f32> {
        None
    }

    /// Makes buffers for a picture size; called before the first frame and whenever size or parameters changed.
    ///
    /// # Errors
    /// `LIMIT` if the device cannot hold them.
    fn prepare(&mut self, gpu: &Gpu, size: UVec2) -> Result<()>;

    /// Bytes on the device of what it owns: see [`bytes_of`](crate::gpu::memory::bytes_of).
    fn memory(&self) -> u64;

    /// Records one frame. Bound already: the scene, `frame`, `visibility`, `previous_visibility`, `counters` and
    /// `radiance_out`, which it must write.
    ///
    /// # Errors
    /// `SHADER` if a pass is bound wrongly.
    fn record(&mut self, recorder: &mut Recorder<'_>, size: UVec2) -> Result<()>;
}

/// Every technique, in the order of menus.
pub static ALL: &[&TechniqueInfo] = &[
    &restir_di::INFO,
    &restir_di_decoupled::INFO,
    &restir_report::INFO,
    &ris::INFO,
    &path_tracer::INFO,
    &normals::INFO,
];

/// The technique with this id.
///
/// # Errors
/// `UNKNOWN_NAME` listing the ids there are.
pub fn find(id: &str) -> Result<&'static TechniqueInfo> {
    ALL.iter().find(|info| info.id == id).copied().ok_or_else(|| Error::Unknown {
        kind: "technique",
        name: id.to_owned(),
        known: ALL.iter().map(|info| info.id).collect::<Vec<_>>().join(", "),
    })
}

/// The registry as JSON: id, title, summary, papers, unbiased, bias, views (name and meaning), params.
pub fn describe_json() -> serde_json::Value {
    ALL.iter()
        .map(|info| {
            serde_json::json!({
                "id": info.id, "title": info.title, "summary": info.summary, "papers": info.papers,
                "unbiased": info.unbiased, "bias": info.bias,
                "views": COMMON_VIEWS.iter().chain(info.views).map(|view| serde_json::json!({ "name": view.name, "meaning": view.meaning })).collect::<Vec<_>>(),
                "params": info.params.iter().map(ParamSpec::describe).collect::<Vec<_>>(),
            })
        })
        .collect()
}
