//! `restir bench`: how fast a technique is on this machine.

use crate::failure::Result;
use crate::session::{Options, PassReport, Session};
use crate::{bench_rays, progress, report};
use restir::lab;

/// Measure the GPU time of each pass and the rays a second.
#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct Args {
    #[command(subcommand)]
    what: Option<What>,
    /// A .glb, .gltf, .obj or .restir file, or builtin:NAME (see `restir scenes`).
    #[arg(value_name = "SCENE", default_value = "builtin:cornell")]
    scene: String,
    #[command(flatten)]
    options: Options,
    /// Frames to measure.
    #[arg(long, value_name = "N", default_value_t = 32, value_parser = clap::value_parser!(u32).range(1..))]
    frames: u32,
    /// Frames to render first: shaders are compiled and history is built.
    #[arg(long, value_name = "N", default_value_t = 8)]
    warm_up: u32,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

#[derive(clap::Subcommand)]
enum What {
    Rays(bench_rays::Args),
}

#[derive(serde::Serialize)]
struct Report<'a> {
    scene: &'a str,
    technique: &'a str,
    parameters: serde_json::Value,
    size: [u32; 2],
    frames: u32,
    warm_up: u32,
    adapter: &'a str,
    passes: Vec<PassReport>,
    /// Sum of the passes' medians.
    gpu_ms: f64,
    /// Median time from recording a frame to its end.
    frame_ms: f64,
    rays_per_frame: f64,
    /// Rays over the time of all frames.
    rays_per_second: f64,
}

pub fn run(args: &Args) -> Result<()> {
    if let Some(What::Rays(args)) = &args.what {
        return bench_rays::run(args);
    }
    let mut session = Session::open(&args.scene, &args.options)?;
    let bar = progress::bar(u64::from(args.warm_up) + u64::from(args.frames)).with_message("frames");
    for _ in 0..args.warm_up {
        session.frame()?;
        bar.inc(1);
    }
    let mut frame_ms = Vec::new();
    for _ in 0..args.frames {
        frame_ms.push(session.measured_frame()?);
        bar.inc(1);
    }
    bar.finish_and_clear();
    let rays = session.rays as f64;

    let passes = session.pass_reports();
    let report = Report {
        scene: &session.scene,
        technique: session.technique,
        parameters: session.renderer.parameters(),
        size: args.options.size.to_array(),
        frames: args.frames,
        warm_up: args.warm_up,
        adapter: &session.adapter,
        gpu_ms: passes.iter().map(|pass| pass.median_ms).sum(),
        passes,
        frame_ms: lab::median(&frame_ms),
        rays_per_frame: rays / f64::from(args.frames),
        rays_per_second: 1e3 * rays / frame_ms.iter().sum::<f64>(),
    };
    if args.json { report::json(&report) } else { report::text(&table(&report)) }
}

fn table(report: &Report) -> String {
    let [width, height] = report.size;
    let mut lines = vec![
        format!("{} with {} at {width}x{height} on {}", report.scene, report.technique, report.adapter),
        format!("median of {} frames after {}", report.frames, report.warm_up),
    ];
    lines.extend(report.passes.iter().map(|pass| format!("{:24} {:9.3} ms", pass.name, pass.median_ms)));
    lines.push(format!("{:24} {:9.3} ms", "all passes", report.gpu_ms));
    lines.push(format!("{:24} {:9.3} ms", "frame", report.frame_ms));
    lines.push(format!("{:24} {:9.3} Mrays/s", "rays", report.rays_per_second * 1e-6));
    lines.join("\n")
}
