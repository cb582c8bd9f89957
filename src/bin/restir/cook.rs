//! `restir cook`: a scene made ready once, to be opened at once ever after.

use crate::failure::Result;
use crate::{report, scene};
use restir::output::{check_writable, write_atomic};
use restir::scene::flat::cooked;
use std::path::PathBuf;

/// Flatten a scene, with BVH and light table, into a .restir file that `render`, `bench`, `info` and the page open at once.
#[derive(clap::Args)]
pub struct Args {
    /// A .glb, .gltf or .obj file, or builtin:NAME (see `restir scenes`).
    #[arg(value_name = "SCENE")]
    scene: String,
    #[command(flatten)]
    choice: scene::Choice,
    #[command(flatten)]
    lighting: scene::Lighting,
    /// Seed of the lights that --lights scatters.
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u32,
    /// The file to write, .restir; replaced only when the whole scene is there.
    #[arg(long, value_name = "FILE", value_parser = out_file)]
    out: PathBuf,
    /// Print a JSON report.
    #[arg(long)]
    json: bool,
}

#[derive(serde::Serialize)]
struct Report {
    out: String,
    bytes: usize,
    warnings: Vec<String>,
}

/// A path that ends in `.restir`.
fn out_file(text: &str) -> restir::Result<PathBuf> {
    let path = PathBuf::from(text);
    match path.extension() {
        Some(extension) if extension.eq_ignore_ascii_case("restir") => Ok(path),
        _ => Err(restir::Error::bad_value("out", format!("'{text}' does not end in .restir"))),
    }
}

pub fn run(args: &Args) -> Result<()> {
    check_writable(&args.out)?;
    let flat = scene::open(&args.scene, &args.choice, Some((&args.lighting, args.seed)))?;
    let file = cooked::to_file(&flat);
    write_atomic(&args.out, &file)?;
    let report = Report { out: args.out.display().to_string(), bytes: file.len(), warnings: flat.warnings };
    if args.json {
        return report::json(&report);
    }
    report::warnings(&report.warnings);
    report::text(&format!("{}: {} triangles, {} bytes", report.out, flat.stats.triangles, report.bytes))
}
