//! `restir render`: a picture of a scene.

use crate::failure::{Failure, Result};
use crate::options::{self, Format, Length, OutFile};
use crate::session::{Options, PassReport, Session};
use crate::{progress, report};
use pollster::block_on;
use restir::output::{ExrPicture, check_writable, encode_exr, write_atomic, write_png};
use restir::renderer::Auxiliary;
use restir::scene::flat::SceneStats;
use std::time::Instant;

/// Frames where neither --frames nor --spp nor --seconds is given.
const DEFAULT_FRAMES: u32 = 16;

/// Render a scene to a PNG (tone-mapped) or OpenEXR (linear) file.
#[derive(clap::Args)]
pub struct Args {
    /// A .glb, .gltf, .obj or .restir file, or builtin:NAME (see `restir scenes`).
    #[arg(value_name = "SCENE")]
    scene: String,
    #[command(flatten)]
    options: Options,
    #[command(flatten)]
    length: LengthArgs,
    /// Write a numbered picture for each of --frames moments, this many to a second of scene time, from --time on;
    /// --spp samples are averaged in each (1 where it is not given).
    #[arg(long, value_name = "FPS", value_parser = options::rate, conflicts_with_all = ["seconds", "accumulate"])]
    animate: Option<f64>,
    /// Average all frames, with everything that moves held still; `no` keeps the last frame alone and lets things move.
    /// Without this: `yes`, but `no` for a scene in which something moves.
    #[arg(long, value_name = "yes|no")]
    accumulate: Option<YesNo>,
    /// The file to write, .png or .exr; replaced only when the whole picture is there. With --animate the pictures are
    /// numbered: picture.png becomes picture-0000.png and so on.
    #[arg(long, value_name = "FILE", value_parser = options::out_file)]
    out: OutFile,
    /// Print a JSON report: scene, times of each pass, counters, warnings.
    #[arg(long)]
    json: bool,
}

#[derive(clap::Args)]
struct LengthArgs {
    /// Frames to render, or pictures of an animation; 16 where nothing else is asked for.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), conflicts_with = "seconds")]
    frames: Option<u32>,
    /// Samples a pixel to accumulate.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), conflicts_with = "seconds")]
    spp: Option<u32>,
    /// Render until this many seconds have passed.
    #[arg(long, value_name = "T", value_parser = options::seconds)]
    seconds: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum YesNo {
    Yes,
    No,
}

#[derive(serde::Serialize)]
struct Report<'a> {
    out: String,
    scene: &'a str,
    stats: &'a SceneStats,
    camera: &'a str,
    /// Moment of the last picture in seconds.
    time: f64,
    technique: &'a str,
    parameters: serde_json::Value,
    size: [u32; 2],
    seed: u32,
    accumulate: bool,
    frames: u32,
    /// From the first frame to the last, without loading.
    seconds: f64,
    adapter: &'a str,
    passes: Vec<PassReport>,
    counters: Counters,
    warnings: &'a [String],
}

#[derive(serde::Serialize)]
struct Counters {
    /// Of all frames.
    rays: u64,
    /// Samples left out of the picture because they were not numbers.
    nan: u64,
    /// Samples left out of the picture because they were infinite.
    inf: u64,
}

pub fn run(args: &Args) -> Result<()> {
    let length = length(args)?;
    let first = if args.animate.is_some() { args.out.numbered(0, args.pictures()) } else { args.out.clone() };
    check_writable(&first.path)?;
    let mut session = Session::open(&args.scene, &args.options)?;
    let by_default = args.length.spp.is_some() || args.animate.is_some() || !session.moving;
    let accumulate = args.accumulate.map_or(by_default, |choice| choice == YesNo::Yes);
    session.renderer.set_accumulate(accumulate);

    let start = Instant::now();
    let frames = match args.animate {
        Some(rate) => animate(&mut session, args, rate)?,
        None => render(&mut session, length)?,
    };
    let seconds = start.elapsed().as_secs_f64();
    if args.animate.is_none() {
        write(&mut session, args, &args.out, None, frames)?;
    }

    let counters = block_on(session.renderer.counters())?;
    let broken = counters.not_finite();
    if broken > 0 {
        session.warnings.push(format!("{broken} samples were not finite and were left out"));
        report::warnings(session.warnings.last());
    }
    let out = first.path.display().to_string();
    if !args.json {
        let size = args.options.size;
        return report::text(&format!(
            "{out}: {}x{}, {frames} frames in {seconds:.2} s, {}",
            size.x, size.y, session.adapter
        ));
    }
    report::json(&Report {
        out,
        scene: &session.scene,
        stats: &session.stats,
        camera: &session.camera,
        time: session.renderer.time(),
        technique: session.technique,
        parameters: session.renderer.parameters(),
        size: args.options.size.to_array(),
        seed: args.options.seed,
        accumulate,
        frames,
        seconds,
        adapter: &session.adapter,
        passes: session.pass_reports(),
        counters: Counters { rays: session.rays, nan: counters.nan, inf: counters.inf },
        warnings: &session.warnings,
    })
}

impl Args {
    /// Pictures of an animation.
    fn pictures(&self) -> u32 {
        self.length.frames.unwrap_or(DEFAULT_FRAMES)
    }
}

fn length(args: &Args) -> Result<Length> {
    if args.animate.is_none() && args.length.spp.is_some() && args.length.frames.is_some() {
        return Err(Failure::usage("--spp", "it is how many frames are averaged, as --frames: give one of them"));
    }
    if args.length.spp.is_some() && args.accumulate == Some(YesNo::No) {
        return Err(Failure::usage("--spp", "samples are accumulated, which --accumulate no forbids; use --frames"));
    }
    // Every technique takes one sample a pixel and frame.
    let frames = args.length.spp.or(args.length.frames).unwrap_or(DEFAULT_FRAMES);
    Ok(args.length.seconds.map_or(Length::Frames(frames), Length::Seconds))
}

/// Renders, with progress on stderr; returns how many frames it were.
fn render(session: &mut Session, length: Length) -> Result<u32> {
    let bar = match length {
        Length::Frames(frames) => progress::bar(frames.into()).with_message("frames"),
        Length::Seconds(seconds) => progress::bar(seconds.ceil() as u64).with_message("seconds"),
    };
    let start = Instant::now();
    let mut frames = 0;
    loop {
        session.measured_frame()?;
        frames += 1;
        let elapsed = start.elapsed().as_secs_f64();
        let done = match length {
            Length::Frames(wanted) => {
                bar.set_position(frames.into());
                frames >= wanted
            }
            Length::Seconds(wanted) => {
                bar.set_position(elapsed as u64);
                elapsed >= wanted
            }
        };
        if done {
            bar.finish_and_clear();
            return Ok(frames);
        }
    }
}

/// Renders and writes the pictures of an animation; returns how many frames they took. Time stands still while the samples
/// of a picture are taken, and the technique keeps its history from picture to picture.
fn animate(session: &mut Session, args: &Args, rate: f64) -> Result<u32> {
    let (pictures, samples) = (args.pictures(), args.length.spp.unwrap_or(1));
    let bar = progress::bar(pictures.into()).with_message("pictures");
    for picture in 0..pictures {
        session.renderer.set_time(args.options.time + f64::from(picture) / rate);
        let mut auxiliary = None;
        for sample in 0..samples {
            session.measured_frame()?;
            // Motion is that from picture to picture: the later samples have seen nothing move.
            if sample == 0 && args.out.format == Format::Exr {
                auxiliary = Some(block_on(session.renderer.read_auxiliary())?);
            }
        }
        write(session, args, &args.out.numbered(picture, pictures), auxiliary, samples)?;
        bar.set_position(u64::from(picture) + 1);
    }
    bar.finish_and_clear();
    Ok(pictures.saturating_mul(samples))
}

fn write(session: &mut Session, args: &Args, file: &OutFile, auxiliary: Option<Auxiliary>, frames: u32) -> Result<()> {
    let renderer = &mut session.renderer;
    let OutFile { path, format } = file;
    match format {
        Format::Png => {
            let size = args.options.size;
            write_png(path, size.x, size.y, &block_on(renderer.read_display())?)?;
        }
        Format::Exr => {
            let image = block_on(renderer.read_image())?;
            let auxiliary = auxiliary.map_or_else(|| block_on(renderer.read_auxiliary()), Ok)?;
            let picture = ExrPicture {
                image: &image,
                albedo: Some(&auxiliary.albedo),
                normal: Some(&auxiliary.normal),
                depth: Some(&auxiliary.depth),
                motion: Some(&auxiliary.motion),
                technique: session.technique,
                parameters: &renderer.parameters().to_string(),
                seed: args.options.seed,
                frames,
            };
            write_atomic(path, &encode_exr(&picture)?)?;
        }
    }
    Ok(())
}
