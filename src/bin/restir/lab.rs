//! `restir lab`: experiments.

use crate::failure::{Failure, Result};
use crate::{options, progress, report, scene};
use glam::UVec2;
use indicatif::ProgressBar;
use pollster::block_on;
use restir::lab::{self, Experiment, library, reference};
use restir::{Error, Gpu, GpuOptions};
use std::cell::RefCell;
use std::path::{Path, PathBuf};

/// Carry out an experiment: measure, and write page, table, plots and pictures. It can be stopped at any time; the next
/// call goes on from there.
#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct Args {
    #[command(subcommand)]
    what: Option<What>,
    /// An experiment of `restir lab list`, `all`, or a file of one's own (.toml; docs/lab.md).
    #[arg(value_name = "EXPERIMENT", required = true)]
    experiment: Option<String>,
    /// Small pictures and few runs: minutes on a machine without a GPU.
    #[arg(long)]
    quick: bool,
    /// Folder to write to, and to keep what was measured in.
    #[arg(long, value_name = "DIR", default_value = "lab-results")]
    out: PathBuf,
    /// Picture size in pixels in place of the experiment's.
    #[arg(long, value_name = "WxH", value_parser = options::size)]
    size: Option<UVec2>,
    /// Folder to keep references in; restir/references in the user's cache folder where none is given.
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
    /// Measure again what was measured before.
    #[arg(long)]
    fresh: bool,
    /// Print JSON: for each experiment how many runs were measured and kept, and the files written.
    #[arg(long)]
    json: bool,
}

#[derive(clap::Subcommand)]
enum What {
    List(ListArgs),
}

/// List the experiments with their sources.
#[derive(clap::Args)]
struct ListArgs {
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> Result<()> {
    if let Some(What::List(args)) = &args.what {
        return list(args);
    }
    let experiments = experiments(args.experiment.as_deref().unwrap_or_default())?;
    let gpu = block_on(Gpu::headless(&GpuOptions { default_limits: false }))?;
    let default_cache = reference::default_folder();
    let mut outcomes = serde_json::Map::new();
    for (name, experiment) in experiments {
        let mut experiment = if args.quick { experiment.quick() } else { experiment };
        if args.size.is_some_and(|size| !experiment.set_size(size.to_array())) {
            report::warnings([&format!("{name} sweeps its size: --size changes nothing")]);
        }
        let bar = Bar::default();
        let outcome = lab::run(
            &name,
            &experiment,
            &gpu,
            &lab::Options {
                out: &args.out,
                references: args.cache.as_deref().unwrap_or(&default_cache),
                fresh: args.fresh,
                command: &command(&name, args),
                load: &load,
                progress: &|what, done, of| bar.show(&format!("{name}: {what}"), done, of),
            },
        )?;
        bar.clear();
        if !args.json {
            let page = outcome.files.first().map(|path| path.display().to_string()).unwrap_or_default();
            report::text(&format!("{page}: {} runs measured, {} kept", outcome.measured, outcome.kept))?;
        }
        outcomes.insert(name, serde_json::json!(outcome));
    }
    if args.json { report::json(&outcomes) } else { Ok(()) }
}

/// The experiments meant by a name, `all` or a path. All files are checked before anything is measured.
fn experiments(name: &str) -> Result<Vec<(String, Experiment)>> {
    if name == "all" {
        let each = |(name, _): &(&str, &str)| Ok(((*name).to_owned(), library::find(name)?));
        return library::FILES.iter().map(each).collect();
    }
    let path = Path::new(name);
    if path.extension().is_none_or(|extension| extension != "toml") {
        return Ok(vec![(name.to_owned(), library::find(name).map_err(Failure::from_option)?)]);
    }
    let text = std::fs::read_to_string(path).map_err(|source| Error::Io { path: name.to_owned(), source })?;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    Ok(vec![(stem, Experiment::parse(name, &text)?)])
}

/// How the page is made again; folders are the reader's own.
fn command(name: &str, args: &Args) -> String {
    // One file of one's own is called by its path.
    let own = args.experiment.as_deref().is_some_and(|given| given != "all" && given != name);
    let name = if own { format!("{name}.toml") } else { name.to_owned() };
    let quick = if args.quick { " --quick" } else { "" };
    let size = args.size.map_or(String::new(), |size| format!(" --size {}x{}", size.x, size.y));
    format!("restir lab {name}{quick}{size}")
}

/// A scene by name, as `render` takes it.
pub fn load(name: &str) -> restir::Result<restir::FlatScene> {
    let lighting = scene::Lighting::default();
    scene::open(name, &scene::Choice::default(), Some((&lighting, 0))).map_err(|failure| match failure {
        Failure::Usage(error) | Failure::Failed(error) => error,
        other => Error::bad_value("scene", format!("{other:?}")),
    })
}

/// One bar for each kind of work in turn.
#[derive(Default)]
struct Bar(RefCell<Option<(String, ProgressBar)>>);

impl Bar {
    fn show(&self, what: &str, done: u64, of: u64) {
        let mut slot = self.0.borrow_mut();
        if slot.as_ref().is_none_or(|(shown, _)| shown != what) {
            if let Some((_, old)) = slot.take() {
                old.finish_and_clear();
            }
            *slot = Some((what.to_owned(), progress::bar(of).with_message(what.to_owned())));
        }
        if let Some((_, bar)) = slot.as_ref() {
            bar.set_length(of);
            bar.set_position(done);
        }
    }

    fn clear(&self) {
        if let Some((_, bar)) = self.0.borrow_mut().take() {
            bar.finish_and_clear();
        }
    }
}

fn list(args: &ListArgs) -> Result<()> {
    let mut lines = Vec::new();
    let mut entries = Vec::new();
    for (name, _) in library::FILES {
        let experiment = library::find(name)?;
        lines.push(format!("{name:24} {} ({})", experiment.title, experiment.source));
        entries.push(serde_json::json!({"name": name, "title": experiment.title, "source": experiment.source}));
    }
    if args.json { report::json(&entries) } else { report::text(&lines.join("\n")) }
}
