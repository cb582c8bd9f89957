//! `restir scenes`: the built-in scenes.

use crate::failure::Result;
use crate::report;
use restir::scene::builtin;

/// List the built-in scenes.
#[derive(clap::Args)]
pub struct Args {
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> Result<()> {
    if args.json {
        return report::json(&builtin::describe_json());
    }
    let lines = builtin::ALL.iter().map(|scene| format!("builtin:{:20} {}. {}", scene.example, scene.title, scene.doc));
    report::text(&lines.collect::<Vec<_>>().join("\n"))
}
