//! One run of one point: what is measured, and where it is kept.

use super::experiment::{Metric, Motion};
use super::key;
use super::metrics::{bias, mape, mse, relmse};
use super::results::median;
use super::settings::{self, Settings};
use crate::error::{Error, Result};
use crate::output::{Image, write_atomic};
use crate::renderer::Renderer;
use crate::scene::Camera;
use crate::view::COMMON_VIEWS;
use pollster::block_on;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::{Duration, Instant};

/// Fewest frames that a time is the median of.
const FEWEST_TIMES: u32 = 5;

/// How long a GPU works before it is timed.
const WARM_UP: Duration = Duration::from_millis(100);

/// Everything that determines the numbers of a run.
#[derive(Debug, Clone)]
pub struct Task<'a> {
    /// Hash of the flat scene.
    pub scene: &'a str,
    /// Where the judged picture is seen from.
    pub camera: &'a Camera,
    /// What moves, if anything does.
    pub motion: Option<&'a Motion>,
    /// Picture size in pixels.
    pub size: [u32; 2],
    /// Technique id.
    pub technique: &'a str,
    /// Its settings that are not defaults.
    pub settings: Settings,
    /// Whether frames are averaged.
    pub accumulate: bool,
    /// Frames that are judged, rising, from 1.
    pub frames: &'a [u32],
    /// Of the random numbers.
    pub seed: u32,
}

/// The numbers of one run, as they are kept.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Median wall time of a frame from recording to its end, milliseconds.
    pub frame_ms: f64,
    /// Median time of all passes of a frame, milliseconds; none where the device cannot time.
    pub gpu_ms: Option<f64>,
    /// Median time of the technique's passes in a frame, milliseconds; none where the device cannot time.
    pub lighting_ms: Option<f64>,
    /// One a judged frame.
    pub readings: Vec<Reading>,
}

/// The picture after one frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// Counted from 1.
    pub frame: u32,
    /// [`super::mse`].
    pub mse: f64,
    /// [`super::relmse`].
    pub relmse: f64,
    /// [`super::mape`]; none where it is infinite.
    pub mape: Option<f64>,
    /// Relative difference of mean luminance; none for a black reference.
    pub bias: Option<f64>,
    /// Rays a pixel in this frame.
    pub rays: f64,
    /// Samples left out of the picture because they were not finite.
    pub not_finite: u64,
}

impl Run {
    /// A metric after a frame; none where it does not exist.
    pub fn value(&self, metric: Metric, frame: u32) -> Option<f64> {
        let reading = self.readings.iter().find(|reading| reading.frame == frame)?;
        match metric {
            Metric::Mse => Some(reading.mse),
            Metric::Rmse => Some(reading.mse.sqrt()),
            Metric::Relmse => Some(reading.relmse),
            Metric::Mape => reading.mape,
            Metric::Bias => reading.bias.map(|fraction| 100.0 * fraction),
            Metric::FrameMs => Some(self.frame_ms),
            Metric::GpuMs => self.gpu_ms,
            Metric::LightingMs => self.lighting_ms,
            Metric::Rays => Some(reading.rays),
            Metric::NotFinite => Some(reading.not_finite as f64),
        }
    }

    /// A kept run, if there is one and it is whole.
    pub fn read(path: &Path) -> Option<Self> {
        serde_json::from_slice::<Kept>(&std::fs::read(path).ok()?).ok().map(|kept| kept.run)
    }
}

/// A file of a kept run: the numbers, and for people what they are of.
#[derive(Serialize, Deserialize)]
struct Kept {
    of: String,
    run: Run,
}

impl Task<'_> {
    /// What the numbers are of, in words that differ wherever the numbers may; but for the Rust code that records passes.
    pub fn identity(&self, reference: &str, adapter: &str) -> String {
        let shaders = key::shaders(|folder| !["tests", "bench"].contains(&folder));
        let Task { scene, camera, motion, size, technique, settings, accumulate, frames, seed } = self;
        let settings = settings::describe(settings);
        format!(
            "run 4|shaders {shaders}|scene {scene}|{camera:?}|{motion:?}|{size:?}|{technique}|{settings}|accumulate \
             {accumulate}|frames {frames:?}|seed {seed}|reference {reference}|{adapter}"
        )
    }

    /// Sets the renderer, of the task's scene, up for the first frame.
    fn prepare(&self, renderer: &mut Renderer) -> Result<()> {
        settings::apply(renderer, self.technique, &self.settings)?;
        renderer.resize(self.size.into())?;
        renderer.set_accumulate(self.accumulate);
        let steps = f64::from(self.frames.last().copied().unwrap_or(1) - 1);
        let (speed, time) = self.motion.map_or((0.0, 0.0), |motion| (motion.speed, motion.time));
        renderer.set_speed(speed);
        renderer.set_time(time - speed / 60.0 * steps);
        renderer.set_camera(&self.camera_at(1));
        renderer.set_seed(self.seed);
        Ok(())
    }

    /// The camera of a frame: the last judged one has the scene's.
    fn camera_at(&self, frame: u32) -> Camera {
        let mut camera = self.camera.clone();
        if let Some(motion) = self.motion {
            let ahead = self.frames.last().copied().unwrap_or(1) as f32 - frame as f32;
            camera.position -= glam::Vec3::from(motion.camera_step) * ahead;
        }
        camera
    }

    /// Compiles what the run needs, so that no measured frame waits for that, and keeps a GPU at work until its clock is up
    /// again: one that slept while pictures were judged runs its next frames at half speed.
    ///
    /// # Errors
    /// Those of rendering.
    pub fn warm_up(&self, renderer: &mut Renderer) -> Result<()> {
        self.prepare(renderer)?;
        let frames = 2.min(self.frames.last().copied().unwrap_or(1));
        let mut compiled: Option<Instant> = None;
        let mut frame = 0;
        while frame < frames || compiled.is_none_or(|since| since.elapsed() < WARM_UP) {
            frame += 1;
            if self.motion.is_some() {
                renderer.set_camera(&self.camera_at(frame.min(frames)));
            }
            renderer.render_frame()?;
            block_on(renderer.wait())?;
            compiled.get_or_insert_with(Instant::now);
        }
        Ok(())
    }

    /// A debug view of the frame after the last one measured, as it is displayed: sRGB, 4 bytes a pixel, row-major from the top.
    ///
    /// # Errors
    /// Those of rendering; `UNKNOWN_NAME` where the technique has no such view.
    pub fn look(&self, renderer: &mut Renderer, view: &str) -> Result<Vec<u8>> {
        renderer.set_view(view)?;
        let seen = renderer.render_frame().and_then(|()| block_on(renderer.read_display()));
        renderer.set_view(COMMON_VIEWS[0].name)?;
        seen
    }

    /// Renders and judges. Gives the numbers and the picture of the last frame. Samples that are not finite are left out
    /// of pictures, and counted.
    ///
    /// # Errors
    /// Those of rendering; `BAD_VALUE` where a picture has values that are not finite all the same, as sums may overflow.
    pub fn measure(&self, renderer: &mut Renderer, reference: &Image) -> Result<(Run, Image)> {
        self.prepare(renderer)?;
        let pixels = f64::from(self.size[0]) * f64::from(self.size[1]);
        let (mut frame_ms, mut gpu_ms, mut lighting_ms) = (Vec::new(), Vec::new(), Vec::new());
        let mut readings = Vec::new();
        let mut last = None;
        let length = self.frames.last().copied().unwrap_or(1);
        // One frame is no median: a short run is made again, the same, for its times alone.
        let repetitions = FEWEST_TIMES.div_ceil(length);
        // A software adapter's timestamps are not those of its work.
        let has_timestamps = !renderer.gpu().is_software();
        for (repetition, frame) in (0..repetitions).flat_map(|r| (1..=length).map(move |frame| (r, frame))) {
            if repetition > 0 && frame == 1 {
                self.prepare(renderer)?;
            }
            if self.motion.is_some() {
                renderer.set_camera(&self.camera_at(frame));
            }
            let start = Instant::now();
            renderer.render_frame()?;
            block_on(renderer.wait())?;
            frame_ms.push(1e3 * start.elapsed().as_secs_f64());
            let times = block_on(renderer.pass_times())?;
            if has_timestamps && !times.is_empty() {
                gpu_ms.push(times.iter().map(|time| time.ms).sum());
                let own = times.iter().filter(|t| !t.name.starts_with("scene/") && !t.name.starts_with("film/"));
                lighting_ms.push(own.map(|time| time.ms).sum());
            }
            if repetition > 0 || !self.frames.contains(&frame) {
                continue;
            }
            let image = block_on(renderer.read_image())?;
            let counters = block_on(renderer.counters())?;
            let mape = Some(mape(&image, reference)?).filter(|value| value.is_finite());
            let [.., luminance] = bias(&image, reference)?;
            readings.push(Reading {
                frame,
                mse: mse(&image, reference)?,
                relmse: relmse(&image, reference)?,
                mape,
                bias: luminance.relative,
                rays: counters.rays as f64 / pixels,
                not_finite: counters.not_finite(),
            });
            last = Some(image);
        }
        let last = last.ok_or_else(|| Error::bad_value("frames", "there is none to judge"))?;
        let some = |times: &[f64]| (!times.is_empty()).then(|| median(times));
        let run = Run { frame_ms: median(&frame_ms), gpu_ms: some(&gpu_ms), lighting_ms: some(&lighting_ms), readings };
        Ok((run, last))
    }
}

/// Keeps a run. Gives it as [`Run::read`] will: JSON may change a number's last bit.
///
/// # Errors
/// `IO`.
pub fn keep(path: &Path, identity: &str, run: Run) -> Result<Run> {
    let io = |error: serde_json::Error| Error::Io { path: path.display().to_string(), source: error.into() };
    let text = serde_json::to_string_pretty(&Kept { of: identity.to_owned(), run }).map_err(io)?;
    write_atomic(path, text.as_bytes())?;
    serde_json::from_str::<Kept>(&text).map(|kept| kept.run).map_err(io)
}
