//! Values and cameras as the lab's files write them.

use crate::error::{Error, Result};
use crate::params::{FilmParams, ParamSpec, Params, RenderParams};
use crate::renderer::Renderer;
use crate::scene::Camera;
use crate::techniques;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

/// The value of a parameter: in a file text, number or flag; here as `--set` takes it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "Written")]
pub struct Value(pub String);

#[derive(Deserialize)]
#[serde(untagged)]
enum Written {
    Flag(bool),
    Whole(i64),
    Real(f64),
    Text(String),
}

impl From<Written> for Value {
    fn from(written: Written) -> Self {
        Value(match written {
            Written::Flag(value) => value.to_string(),
            Written::Whole(value) => value.to_string(),
            Written::Real(value) => value.to_string(),
            Written::Text(value) => value,
        })
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// Parameters of a technique and of the global groups, by key.
pub type Settings = BTreeMap<String, Value>;

/// Whether a technique takes all of these, as [`apply`] will set them.
///
/// # Errors
/// `UNKNOWN_NAME` for a technique or parameter that does not exist; `BAD_VALUE` for a value that is not taken, or not
/// beside the others.
pub fn check(technique: &str, settings: &Settings) -> Result<()> {
    let info = techniques::find(technique)?;
    settings.iter().try_for_each(|(key, value)| info.spec(key)?.parse(&value.0).map(|_| ()))?;
    let settings: Vec<_> = settings.iter().map(|(key, value)| (key.as_str(), value.0.as_str())).collect();
    (info.check)(&settings)
}

/// Sets up a technique with these settings and all others at their defaults.
///
/// # Errors
/// As [`Renderer::set_technique`] and [`Renderer::set`].
pub fn apply(renderer: &mut Renderer, technique: &str, settings: &Settings) -> Result<()> {
    renderer.set_technique(technique)?;
    for (group, specs) in [("render", RenderParams::SPECS), ("film", FilmParams::SPECS)] {
        for spec in specs {
            renderer.set(&format!("{group}.{}", spec.name), &default_text(spec))?;
        }
    }
    settings.iter().try_for_each(|(key, value)| renderer.set(key, &value.0))
}

/// A parameter's default as `set` takes it.
fn default_text(spec: &ParamSpec) -> String {
    let value = spec.value_json(spec.default);
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// `key=value` of each, comma-separated; `defaults` for none.
pub fn describe(settings: &Settings) -> String {
    let pairs: Vec<String> = settings.iter().map(|(key, value)| format!("{key}={value}")).collect();
    if pairs.is_empty() { "defaults".to_owned() } else { pairs.join(", ") }
}

/// A camera: one of the scene's by index or name, or one of the file's own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum View {
    /// Index in the scene.
    Index(usize),
    /// Name in the scene.
    Name(String),
    /// Where it stands, in metres.
    LookAt(LookAt),
}

/// A perspective camera.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LookAt {
    /// Where the eye is, metres.
    pub from: [f32; 3],
    /// A point in the middle of the picture, metres.
    pub to: [f32; 3],
    /// Vertical field of view, degrees.
    pub fov: f32,
}

impl LookAt {
    /// Whether there is such a camera; if not, why.
    pub(super) fn check(&self) -> std::result::Result<(), String> {
        let LookAt { from, to, fov } = self;
        if from == to || !from.iter().chain(to).all(|value| value.is_finite()) {
            return Err("from and to have to be two places, and every number finite".into());
        }
        // The range of a camera's angle.
        if !(*fov > 0.0 && *fov < 180.0) {
            return Err(format!("fov = {fov} is not between 0 and 180 degrees"));
        }
        Ok(())
    }
}

impl Default for View {
    fn default() -> Self {
        View::Index(0)
    }
}

impl View {
    /// The camera meant, among those of a scene.
    ///
    /// # Errors
    /// `UNKNOWN_NAME` listing the cameras there are.
    pub fn camera(&self, cameras: &[Camera]) -> Result<Camera> {
        let found = match self {
            View::Index(index) => cameras.get(*index).cloned(),
            View::Name(name) => cameras.iter().find(|camera| camera.name == *name).cloned(),
            View::LookAt(LookAt { from, to, fov }) => {
                Some(Camera::look_at("lab", (*from).into(), (*to).into(), fov.to_radians()))
            }
        };
        found.ok_or_else(|| Error::Unknown {
            kind: "camera",
            name: match self {
                View::Name(name) => name.clone(),
                other => format!("{other:?}"),
            },
            known: cameras.iter().map(|camera| camera.name.clone()).collect::<Vec<_>>().join(", "),
        })
    }
}
