//! `restir techniques`: how a scene can be rendered, and every parameter.

use crate::failure::Result;
use crate::report;
use restir::params::{FilmParams, ParamKind, ParamSpec, Params, RenderParams};
use restir::techniques::presets::{self, Preset};
use restir::techniques::{self, TechniqueInfo};
use restir::view::{COMMON_VIEWS, View};

/// List the techniques with their papers, bias, parameters and views.
#[derive(clap::Args)]
pub struct Args {
    /// Print JSON: techniques, the parameters of all of them (render, film), presets, the built-in scenes, the version.
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> Result<()> {
    if args.json {
        return report::json(&restir::describe());
    }
    let mut sections: Vec<String> = techniques::ALL.iter().map(|info| describe(info)).collect();
    for (group, specs) in [("render", RenderParams::SPECS), ("film", FilmParams::SPECS)] {
        let parameters = specs.iter().map(|spec| parameter(&format!("{group}."), spec));
        let title = std::iter::once(format!("{group}: parameters of every technique"));
        sections.push(title.chain(parameters).collect::<Vec<_>>().join("\n"));
    }
    let views = COMMON_VIEWS.iter().map(view);
    sections.push(std::iter::once("views of every technique".to_owned()).chain(views).collect::<Vec<_>>().join("\n"));
    let presets = presets::ALL.iter().map(preset);
    sections.push(std::iter::once("presets: --preset ID".to_owned()).chain(presets).collect::<Vec<_>>().join("\n"));
    report::text(&sections.join("\n\n"))
}

fn describe(info: &TechniqueInfo) -> String {
    let mut lines = vec![format!("{}: {}", info.id, info.title), format!("  {}", info.summary)];
    lines.extend(info.papers.iter().map(|paper| format!("  paper: {paper}")));
    lines.push(format!("  bias: {}", info.bias));
    lines.extend(info.params.iter().map(|spec| parameter("", spec)));
    lines.extend(info.views.iter().map(view));
    lines.join("\n")
}

fn view(View { name, meaning, .. }: &View) -> String {
    format!("  --view '{name}'\n      {meaning}")
}

fn preset(Preset { id, title, doc, technique, settings }: &Preset) -> String {
    let settings: String = settings.iter().map(|(key, value)| format!(" --set {key}={value}")).collect();
    format!("  {id}: {title}\n      {doc}\n      --technique {technique}{settings}")
}

fn parameter(prefix: &str, spec: &ParamSpec) -> String {
    let default = match spec.value_json(spec.default) {
        serde_json::Value::String(name) => name,
        other => other.to_string(),
    };
    let range = match spec.kind {
        ParamKind::Uint { min, max } => format!("{min} to {max}"),
        ParamKind::Float { min, max } => format!("{min} to {max}"),
        ParamKind::Flag => "true, false".to_owned(),
        ParamKind::Choice(names) => names.join(", "),
    };
    let unit = if spec.unit.is_empty() { String::new() } else { format!(" {}", spec.unit) };
    format!("  --set {prefix}{}={default} ({range}{unit})\n      {}", spec.name, spec.doc)
}
