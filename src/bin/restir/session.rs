//! A renderer set up from the command line, and the time its passes take: what `render` and `bench` share.

use crate::failure::{Failure, Result};
use crate::{options, report, scene};
use glam::{UVec2, Vec3};
use pollster::block_on;
use restir::scene::Camera;
use restir::scene::flat::SceneStats;
use restir::techniques::{self, TechniqueInfo, presets};
use restir::view::Shown;
use restir::{Gpu, GpuOptions, Renderer, lab};
use std::time::Instant;

/// The parameter that turns the environment, which is then something that moves.
const TURN: &str = "render.environment_rotation_rate";

/// The parameter that --max-depth sets.
const MAX_DEPTH: &str = "render.max_depth";

/// What is rendered, and how.
#[derive(clap::Args)]
pub struct Options {
    /// Technique id (see `restir techniques`).
    #[arg(long, value_name = "ID", default_value = "restir-di")]
    pub technique: String,
    /// A technique with settings that go by a name (see `restir techniques`); --set comes after it.
    #[arg(long, value_name = "ID", conflicts_with = "technique")]
    pub preset: Option<String>,
    /// Set a parameter of the technique, or of a group, as film.exposure; may be given many times.
    #[arg(long, value_name = "KEY=VALUE", value_parser = options::assignment)]
    pub set: Vec<(String, String)>,
    /// Picture size in pixels.
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = options::size)]
    pub size: UVec2,
    /// Seed of all random numbers; the same seed on the same device gives the same picture.
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub seed: u32,
    /// Camera of the scene, by index or name; the first where none is given.
    #[arg(long, value_name = "INDEX|NAME")]
    pub camera: Option<String>,
    /// Where the camera is and where it looks: position, forward and up, nine numbers with commas between, as in the page's address.
    #[arg(long, value_name = "NUMBERS", value_parser = options::pose, conflicts_with = "camera", allow_hyphen_values = true)]
    pub pose: Option<[Vec3; 3]>,
    /// Moment of the scene in seconds: where it stands still, or begins to move.
    #[arg(long, value_name = "T", default_value_t = 0.0, value_parser = options::time, allow_negative_numbers = true)]
    pub time: f64,
    /// Animation of the scene to play, by name or index; the first where none is given.
    #[arg(long, value_name = "NAME|INDEX")]
    pub animation: Option<String>,
    /// Longest path in scattering events: 1 is direct light only. Lights seen directly are always drawn.
    #[arg(long, value_name = "N", value_parser = options::max_depth)]
    pub max_depth: Option<u32>,
    /// What to show: a view that every technique has, or one of its own (see `restir techniques`).
    #[arg(long, value_name = "NAME", default_value = "radiance")]
    pub view: String,
    #[command(flatten)]
    pub choice: scene::Choice,
    #[command(flatten)]
    pub lighting: scene::Lighting,
}

impl Options {
    /// The technique and its settings: those of the preset, then those of --set.
    fn chosen(&self) -> restir::Result<(&'static TechniqueInfo, Vec<(&str, &str)>)> {
        let set = self.set.iter().map(|(key, value)| (key.as_str(), value.as_str()));
        let Some(preset) = &self.preset else { return Ok((techniques::find(&self.technique)?, set.collect())) };
        let preset = presets::find(preset)?;
        Ok((preset.technique()?, preset.settings.iter().copied().chain(set).collect()))
    }
}

/// A scene on the GPU, ready to render.
pub struct Session {
    pub renderer: Renderer,
    /// Id of the technique.
    pub technique: &'static str,
    pub adapter: String,
    pub scene: String,
    pub camera: String,
    pub stats: SceneStats,
    /// Whether something in the scene moves.
    pub moving: bool,
    pub warnings: Vec<String>,
    /// Rays of all frames measured.
    pub rays: u64,
    passes: Vec<Pass>,
}

/// Milliseconds a pass took in each frame.
struct Pass {
    name: String,
    frames: Vec<f64>,
}

/// How long a pass took on the GPU.
#[derive(Debug, serde::Serialize)]
pub struct PassReport {
    pub name: String,
    /// Of the frames in which it ran.
    pub median_ms: f64,
    pub total_ms: f64,
}

impl Session {
    /// Loads the scene and prepares the device. Warnings go to stderr.
    pub fn open(name: &str, options: &Options) -> Result<Session> {
        // A wrong name or value is told before long work.
        let (technique, settings) = options.chosen().map_err(Failure::from_option)?;
        for (key, value) in &settings {
            technique.spec(key).map_or(Ok(0), |spec| spec.parse(value)).map_err(Failure::from_option)?;
        }
        Shown::find(&options.view, technique.views).map_err(Failure::from_option)?;
        if options.max_depth.is_some() && options.set.iter().any(|(key, _)| key == MAX_DEPTH) {
            return Err(Failure::usage("max-depth", format!("--set {MAX_DEPTH} says it as well")));
        }
        (technique.check)(&settings).map_err(Failure::from_option)?;
        let flat = scene::open(name, &options.choice, Some((&options.lighting, options.seed)))?;
        report::warnings(&flat.warnings);
        let camera = scene::camera(&flat.cameras, options.camera.as_deref())?;
        let camera_name = flat.cameras.get(camera).map(|camera| camera.name.clone()).unwrap_or_default();
        let (scene, stats, warnings) = (flat.name.clone(), flat.stats.clone(), flat.warnings.clone());
        let turns =
            settings.iter().any(|(key, value)| *key == TURN && value.parse::<f32>().is_ok_and(|rate| rate != 0.0));
        let moving = turns || !flat.rig.is_still();

        let gpu = block_on(Gpu::headless(&GpuOptions { default_limits: false }))?;
        let adapter = gpu.adapter_name();
        let mut renderer = Renderer::new(gpu, flat, options.size)?;
        renderer.set_technique(technique.id).map_err(Failure::from_option)?;
        for (key, value) in settings {
            renderer.set(key, value).map_err(Failure::from_option)?;
        }
        if let Some(depth) = options.max_depth {
            renderer.set(MAX_DEPTH, &depth.to_string()).map_err(Failure::from_option)?;
        }
        if let Some(animation) = &options.animation {
            renderer.set_animation(animation).map_err(Failure::from_option)?;
        }
        renderer.set_view(&options.view).map_err(Failure::from_option)?;
        renderer.set_time(options.time);
        renderer.set_seed(options.seed);
        renderer.follow_camera(camera)?;
        if let Some([position, forward, up]) = options.pose {
            let posed = Camera { position, forward, up, ..renderer.camera().clone() };
            renderer.set_camera(&posed);
        }
        Ok(Session {
            renderer,
            technique: technique.id,
            adapter,
            scene,
            camera: camera_name,
            stats,
            moving,
            warnings,
            rays: 0,
            passes: Vec::new(),
        })
    }

    /// Renders one frame and waits until it is done. Gives its milliseconds from recording to end.
    pub fn frame(&mut self) -> Result<f64> {
        let start = Instant::now();
        self.renderer.render_frame()?;
        block_on(self.renderer.wait())?;
        Ok(1e3 * start.elapsed().as_secs_f64())
    }

    /// [`Session::frame`], then notes how many rays it took and how long each pass was.
    pub fn measured_frame(&mut self) -> Result<f64> {
        let milliseconds = self.frame()?;
        self.rays += block_on(self.renderer.counters())?.rays;
        let mut seen: Vec<&str> = Vec::new();
        for time in block_on(self.renderer.pass_times())? {
            let index = self.passes.iter().position(|pass| pass.name == time.name).unwrap_or_else(|| {
                self.passes.push(Pass { name: time.name.to_owned(), frames: Vec::new() });
                self.passes.len() - 1
            });
            let frames = &mut self.passes[index].frames;
            // A pass that runs several times in a frame counts once, with all its time.
            match frames.last_mut() {
                Some(last) if seen.contains(&time.name) => *last += time.ms,
                _ => frames.push(time.ms),
            }
            seen.push(time.name);
        }
        Ok(milliseconds)
    }

    /// Time of each pass over all measured frames.
    pub fn pass_reports(&self) -> Vec<PassReport> {
        let report = |pass: &Pass| PassReport {
            name: pass.name.clone(),
            median_ms: lab::median(&pass.frames),
            total_ms: pass.frames.iter().sum(),
        };
        self.passes.iter().map(report).collect()
    }
}
