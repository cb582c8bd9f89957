//! The written pages agree with the program: parameter tables, technique pages, links and command lines.
//! `UPDATE_DOCS=1 cargo test --test docs` rewrites the tables of parameters and claims.

use restir::lab::settings;
use restir::lab::truth::Trial;
use restir::params::{FilmParams, ParamKind, ParamSpec, Params, RenderParams};
use restir::techniques::presets::{self, Preset};
use restir::techniques::{self, TechniqueInfo};
use restir::view::{COMMON_VIEWS, Scale, View};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

/// What every technique page has, in this order.
const SECTIONS: [&str; 6] = ["What it computes", "Passes", "Parameters", "Bias", "Limits", "Figures"];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

fn technique_page(info: &TechniqueInfo) -> PathBuf {
    root().join(format!("docs/techniques/{}.md", info.id))
}

/// Every page: those in the root and those below `docs/`.
fn pages() -> Vec<PathBuf> {
    fn collect(folder: &Path, deep: bool, out: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).expect("a readable folder") {
            let path = entry.expect("a readable folder").path();
            if path.is_dir() && deep {
                collect(&path, deep, out);
            } else if path.extension().is_some_and(|e| e == "md") {
                out.push(path);
            }
        }
    }
    let mut out = Vec::new();
    collect(&root(), false, &mut out);
    collect(&root().join("docs"), true, &mut out);
    out
}

/// A value's bits as a person types it.
fn value(kind: ParamKind, bits: u32) -> String {
    match kind {
        ParamKind::Uint { .. } => bits.to_string(),
        ParamKind::Float { .. } => f32::from_bits(bits).to_string(),
        ParamKind::Flag => (bits != 0).to_string(),
        ParamKind::Choice(names) => names[bits as usize].to_owned(),
    }
}

/// A Markdown table of parameters, each key as `--set`, the URL and the panel take it.
fn parameter_table(prefix: &str, specs: &[ParamSpec]) -> String {
    if specs.is_empty() {
        return "No parameters of its own.\n".to_owned();
    }
    let mut table = String::from("| parameter | default | values | unit | meaning |\n|---|---|---|---|---|\n");
    for spec in specs {
        let values = match spec.kind {
            ParamKind::Uint { min, max } => format!("{min} to {max}, whole"),
            ParamKind::Float { min, max } => format!("{min} to {max}"),
            ParamKind::Flag => "`true`, `false`".to_owned(),
            ParamKind::Choice(names) => names.iter().map(|n| format!("`{n}`")).collect::<Vec<_>>().join(", "),
        };
        let (default, doc) = (value(spec.kind, spec.default), spec.doc.replace('|', "\\|"));
        table += &format!("| `{prefix}{}` | `{default}` | {values} | {} | {doc} |\n", spec.name, spec.unit);
    }
    table
}

/// A Markdown table of views.
fn view_table(views: &[View]) -> String {
    let mut table = String::from("| view | shows | as |\n|---|---|---|\n");
    for View { name, meaning, scale, .. } in views {
        let shown = match scale {
            Scale::Radiance => "light, as the picture is".to_owned(),
            Scale::Colors => "colours".to_owned(),
            Scale::Number { unit, is_logarithmic: false, .. } => format!("a number, {unit}"),
            Scale::Number { unit, .. } => format!("a number by magnitude, {unit}"),
        };
        table += &format!("| `{name}` | {meaning} | {shown} |\n");
    }
    table
}

/// A Markdown table of presets.
fn preset_table() -> String {
    let mut table = String::from("| preset | technique | settings | stands for |\n|---|---|---|---|\n");
    for Preset { id, title, doc, technique, settings } in presets::ALL {
        let settings: Vec<String> = settings.iter().map(|(key, value)| format!("`{key}={value}`")).collect();
        let doc = doc.replace('|', "\\|");
        table += &format!(
            "| `{id}` | [{technique}](techniques/{technique}.md) | {} | {title}. {doc} |\n",
            settings.join(", ")
        );
    }
    table
}

/// Every generated table with the page it belongs to and its name there.
fn tables() -> Vec<(PathBuf, &'static str, &'static str, String)> {
    let global = root().join("docs/parameters.md");
    let mut tables = vec![
        (global.clone(), "parameters", "render", parameter_table("render.", RenderParams::SPECS)),
        (global.clone(), "parameters", "film", parameter_table("film.", FilmParams::SPECS)),
        (global.clone(), "presets", "all", preset_table()),
        (global, "views", "common", view_table(COMMON_VIEWS)),
    ];
    tables.extend(techniques::ALL.iter().map(|info| {
        let mut table = parameter_table("", info.params);
        if !info.views.is_empty() {
            table += &format!("\nViews of its own:\n\n{}", view_table(info.views));
        }
        (technique_page(info), "parameters", info.id, table)
    }));
    tables.extend(Trial::techniques().map(|id| {
        let info = techniques::find(id).expect("a technique");
        (technique_page(info), "claims", id, claims_table(id))
    }));
    tables
}

/// What a technique claims, as its trial puts it to the proof.
fn claims_table(technique: &str) -> String {
    let trial = Trial::find(technique).expect("a sound file");
    let mut table = String::from("| settings | claim | because |\n|---|---|---|\n");
    for claim in &trial.claims {
        let says = if claim.unbiased { "unbiased" } else { "biased" };
        table += &format!("| {} | {says} | {} |\n", claim.what(), claim.because);
    }
    let shared = settings::describe(&trial.settings);
    let plants: Vec<&str> = trial.plants.iter().map(|plant| plant.what.as_str()).collect();
    table + &format!("\nShared by all: {shared}. Faults that must be caught: {}.\n", plants.join("; "))
}

/// `page` with what stands between the markers of `name` replaced by `table`.
fn with_table(page: &str, kind: &str, name: &str, table: &str) -> Option<String> {
    let (opening, closing) = (format!("<!-- {kind}:{name} -->\n"), format!("<!-- /{kind} -->"));
    let (before, rest) = page.split_once(&opening)?;
    let (_, after) = rest.split_once(&closing)?;
    Some(format!("{before}{opening}{table}{closing}{after}"))
}

#[test]
fn parameter_tables_are_those_of_the_declarations() {
    let update = std::env::var_os("UPDATE_DOCS").is_some();
    for (path, kind, name, table) in tables() {
        let page = read(&path);
        let fresh = with_table(&page, kind, name, &table)
            .unwrap_or_else(|| panic!("{}: no <!-- {kind}:{name} --> ... <!-- /{kind} -->", path.display()));
        if update {
            std::fs::write(&path, fresh).expect("a writable page");
        } else {
            assert!(page == fresh, "{}: run UPDATE_DOCS=1 cargo test --test docs", path.display());
        }
    }
}

#[test]
fn a_stale_table_is_seen() {
    let page = "a\n<!-- parameters:x -->\nold\n<!-- /parameters -->\nz\n";
    let fresh = with_table(page, "parameters", "x", "new\n").expect("markers");
    assert_eq!(fresh, "a\n<!-- parameters:x -->\nnew\n<!-- /parameters -->\nz\n");
    assert_eq!(with_table(page, "parameters", "y", ""), None);
}

#[test]
fn every_technique_has_a_page_and_every_page_a_technique() {
    for info in techniques::ALL {
        let page = read(&technique_page(info));
        let sections: Vec<&str> = page.lines().filter_map(|line| line.strip_prefix("## ")).collect();
        assert_eq!(sections, SECTIONS, "docs/techniques/{}.md", info.id);
    }
    let ids: BTreeSet<String> = techniques::ALL.iter().map(|info| info.id.to_owned()).collect();
    let files = std::fs::read_dir(root().join("docs/techniques")).expect("docs/techniques");
    let named: BTreeSet<String> = files
        .map(|file| file.expect("docs/techniques").path())
        .filter_map(|path| Some(path.file_stem()?.to_str()?.to_owned()))
        .collect();
    assert_eq!(named, ids);
}

/// The lines of a page outside its code blocks.
fn prose(page: &str) -> Vec<&str> {
    let mut code = false;
    page.lines()
        .filter(|line| {
            let fence = line.trim_start().starts_with("```");
            code ^= fence;
            !code && !fence
        })
        .collect()
}

/// How many cells a row of a Markdown table has. A `|` ends one, in code as well, unless it is escaped.
fn cells(row: &str) -> usize {
    row.trim().replace("\\|", "").matches('|').count() - 1
}

/// Rows of tables that have another number of cells than their head, and how many rows there are.
fn uneven_rows(page: &str) -> (Vec<&str>, usize) {
    let (mut uneven, mut rows, mut head) = (Vec::new(), 0, None);
    for line in prose(page) {
        if line.starts_with('|') {
            rows += 1;
            uneven.extend((*head.get_or_insert(cells(line)) != cells(line)).then_some(line));
        } else {
            head = None;
        }
    }
    (uneven, rows)
}

#[test]
fn every_row_of_a_table_has_as_many_cells_as_its_head() {
    let mut seen = 0;
    for path in pages() {
        let page = read(&path);
        let (uneven, rows) = uneven_rows(&page);
        seen += rows;
        assert!(uneven.is_empty(), "{}: not as many cells as the head:\n{}", path.display(), uneven.join("\n"));
    }
    assert!(seen > 0, "no tables were found");
}

#[test]
fn an_uneven_row_is_seen() {
    let page = "| a | b |\n|---|---|\n| 1/\\|Z\\| | 2 |\n| 1/|Z| | 2 |\n| 1 |\n\n| a |\n|---|\n| `x` |\n";
    assert_eq!(uneven_rows(page), (vec!["| 1/|Z| | 2 |", "| 1 |"], 8));
}

/// The targets of all links and pictures.
fn links(page: &str) -> Vec<String> {
    let parts = prose(page).into_iter().flat_map(|line| line.split("](").skip(1));
    parts.filter_map(|rest| rest.split_once(')').map(|(target, _)| target.to_owned())).collect()
}

/// The anchors that a page's headings make, as GitHub spells them.
fn anchors(page: &str) -> BTreeSet<String> {
    let headings = prose(page).into_iter().filter(|line| line.starts_with('#'));
    headings
        .map(|line| {
            let title = line.trim_start_matches('#').trim().to_lowercase();
            let kept = title.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
            kept.map(|c| if c == ' ' { '-' } else { c }).collect()
        })
        .collect()
}

#[test]
fn every_relative_link_resolves() {
    let mut broken = Vec::new();
    let mut seen = 0;
    for path in pages() {
        for link in links(&read(&path)).into_iter().filter(|link| !link.contains("://")) {
            seen += 1;
            let (file, anchor) = link.split_once('#').unwrap_or((&link, ""));
            let folder = path.parent().expect("a page lies in a folder");
            let target = if file.is_empty() { path.clone() } else { folder.join(file) };
            if !target.exists() || (!anchor.is_empty() && !anchors(&read(&target)).contains(anchor)) {
                broken.push(format!("{}: {link}", path.display()));
            }
        }
    }
    assert!(seen > 0, "no links were found");
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

/// Every `restir ...` line in the code blocks of a page, continued lines joined.
fn command_lines(page: &str) -> Vec<String> {
    let outside: BTreeSet<*const u8> = prose(page).into_iter().map(str::as_ptr).collect();
    let code: Vec<&str> = page.lines().filter(|line| !outside.contains(&line.as_ptr())).collect();
    let joined = code.join("\n").replace("\\\n", " ");
    joined.lines().map(str::trim).filter(|line| line.starts_with("restir ")).map(str::to_owned).collect()
}

#[test]
fn command_lines_name_real_subcommands_and_options() {
    let mut known_help: BTreeMap<Vec<String>, Option<String>> = BTreeMap::new();
    let mut help_of = |path: &[String]| {
        let ask = || {
            let output = Command::new(env!("CARGO_BIN_EXE_restir")).args(path).arg("--help").output();
            let output = output.expect("the restir binary runs");
            output.status.success().then(|| String::from_utf8_lossy(&output.stdout).into_owned())
        };
        known_help.entry(path.to_vec()).or_insert_with(ask).clone()
    };
    let mut seen = 0;
    for path in pages() {
        for line in command_lines(&read(&path)) {
            seen += 1;
            let place = format!("{}: {line}", path.display());
            // What follows # is a remark, what follows | another program.
            let command = line.split(['#', '|']).next().unwrap_or_default();
            let mut words = command.split_whitespace().skip(1).peekable();
            let mut path = vec![words.next().unwrap_or_else(|| panic!("{place}: no subcommand")).to_owned()];
            let mut help = help_of(&path).unwrap_or_else(|| panic!("{place}: there is no subcommand '{}'", path[0]));
            // A subcommand of a subcommand stands in the list of the other's help.
            while let Some(word) = words.next_if(|word| help.lines().any(|l| l.starts_with(&format!("  {word} ")))) {
                path.push(word.to_owned());
                help = help_of(&path).unwrap_or_else(|| panic!("{place}: no help"));
            }
            let subcommand = path.join(" ");
            for option in words.map(|w| w.trim_matches(['[', ']', '.'])).filter(|w| w.starts_with("--")) {
                let name = option.split('=').next().unwrap_or_default();
                let known = help.split([' ', ',', '\n', '=']).any(|word| word == name);
                assert!(known, "{place}: '{subcommand}' has no {name}");
            }
        }
    }
    assert!(seen > 0, "no command lines were found");
}
