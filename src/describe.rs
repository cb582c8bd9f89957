//! What there is, for a program that does not want to know it in advance: the page and `restir techniques --json`.

use crate::params::{FilmParams, ParamSpec, Params, RenderParams};
use crate::scene::builtin;
use crate::techniques;

/// The registry as JSON: `version`, `techniques` (as [`techniques::describe_json`]), the parameters of all techniques
/// `render.params` and `film.params` (each as [`ParamSpec::describe`]), `presets` (as [`techniques::presets::describe_json`]) and `scenes` (as
/// [`builtin::describe_json`]).
pub fn describe() -> serde_json::Value {
    let group = |specs: &[ParamSpec]| serde_json::json!({ "params": specs.iter().map(ParamSpec::describe).collect::<serde_json::Value>() });
    serde_json::json!({
        "version": env!("CARGO_PKG_VERSION"),
        "techniques": techniques::describe_json(),
        "render": group(RenderParams::SPECS),
        "film": group(FilmParams::SPECS),
        "presets": techniques::presets::describe_json(),
        "scenes": builtin::describe_json(),
    })
}
