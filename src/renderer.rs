//! One scene, one technique, one film: what the page and the command line both drive.

mod reading;
mod settings;

pub use reading::{Auxiliary, FrameCounters};

use crate::error::{Error, Result};
use crate::film::Film;
use crate::frame::{Frame, camera_view};
use crate::gpu::Gpu;
use crate::gpu::dissection::{Dissection, Easel};
use crate::gpu::recorder::{Recorder, Recording, Timer};
use crate::gpu::shader::table;
use crate::gpu_scene::{GpuScene, environment_light, sun_light};
use crate::inspect::{Inspection, Inspector};
use crate::pace::Pace;
use crate::params::{FilmParams, RenderParams};
use crate::scene::flat::environment;
use crate::scene::stage::Stage;
use crate::scene::{Camera, Environment, FlatScene};
use crate::techniques::{self, Technique};
use crate::view::Shown;
use glam::{UVec2, Vec2};

/// Value of `environment_sampling`.
const ENVIRONMENT_BY_PYRAMID: u32 = 1;

/// Seconds of scene time between two frames.
const FRAME_TIME: f64 = 1.0 / 60.0;

/// A scene being rendered.
pub struct Renderer {
    gpu: Gpu,
    scene: FlatScene,
    gpu_scene: GpuScene,
    technique: Box<dyn Technique>,
    technique_ready: bool,
    film: Film,
    frame_uniform: wgpu::Buffer,
    /// This frame's and the previous frame's, by `frame_index & 1`.
    visibility: [wgpu::TextureView; 2],
    albedo_depth: wgpu::TextureView,
    normal: wgpu::TextureView,
    motion: wgpu::TextureView,
    timer: Option<Timer>,
    display_timer: Option<Timer>,
    render_params: RenderParams,
    film_params: FilmParams,
    /// Whether the environment was updated since its alias table was built.
    alias_is_stale: bool,
    camera: Camera,
    /// The camera of the scene that `camera` follows as it moves.
    followed: Option<usize>,
    /// The camera of the frame before, if there was one.
    previous_camera: Option<Camera>,
    /// Whether the frame before ran the technique, so that it has a history.
    has_history: bool,
    shown: Shown,
    seed: u32,
    accumulate: bool,
    frame_index: u32,
    /// What of the scene moves, as it is on the device.
    stage: Stage,
    /// The animation that is played.
    clip: usize,
    /// Scene time in seconds. It stands still while frames are accumulated.
    time: f64,
    /// Where time begins after a reset.
    start_time: f64,
    /// Whether the next frame is at `time` itself, not a step after it.
    time_was_set: bool,
    /// Seconds of scene time in a second of frames.
    speed: f64,
    /// What `time` was in the frame before.
    previous_time: f64,
    accumulated: u32,
    restart_film: bool,
    inspector: Option<Inspector>,
    /// A frame that was begun and is to be finished, and what keeps what its passes write.
    begun: Option<(Recording, Option<Dissection>)>,
    /// One line for each shader whose last edit did not compile (debug builds).
    pub shader_problems: Vec<String>,
}

impl Renderer {
    /// A renderer of `scene` at `size` pixels, with `restir-di` and the scene's first camera.
    ///
    /// # Errors
    /// `LIMIT`, with numbers, where the device is too small.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn new(gpu: Gpu, scene: FlatScene, size: UVec2) -> Result<Self> {
        pollster::block_on(Self::prepare(gpu, scene, size, &mut Pace::unbroken()))
    }

    /// As [`Renderer::new`], in slices; on the web there is only this.
    ///
    /// # Errors
    /// `LIMIT`, with numbers, where the device is too small.
    pub async fn prepare(gpu: Gpu, scene: FlatScene, size: UVec2, pace: &mut Pace) -> Result<Self> {
        let gpu_scene = GpuScene::upload(&gpu, &scene, pace).await?;
        let film = Film::new(&gpu, size)?;
        let camera = scene.cameras.first().cloned().ok_or_else(|| Error::bad_value("scene", "has no camera"))?;
        let technique = (techniques::ALL[0].create)(&gpu);
        let [albedo_depth, normal, motion] = auxiliary_textures(&gpu, size);
        let renderer = Renderer {
            gpu_scene,
            technique,
            technique_ready: false,
            film,
            frame_uniform: gpu.uniform("frame", std::mem::size_of::<Frame>() as u64),
            visibility: visibility_textures(&gpu, size),
            albedo_depth,
            normal,
            motion,
            timer: Timer::new(&gpu),
            display_timer: Timer::new(&gpu),
            render_params: RenderParams::default(),
            film_params: FilmParams::default(),
            alias_is_stale: false,
            camera,
            followed: Some(0),
            previous_camera: None,
            has_history: false,
            shown: Shown::PICTURE,
            seed: 0,
            accumulate: scene.rig.is_still(),
            frame_index: 0,
            stage: Stage::new(&scene, 0, 0.0),
            clip: 0,
            time: 0.0,
            start_time: 0.0,
            time_was_set: true,
            speed: 1.0,
            previous_time: 0.0,
            accumulated: 0,
            restart_film: true,
            inspector: None,
            begun: None,
            shader_problems: Vec::new(),
            scene,
            gpu,
        };
        renderer.gpu.check()?;
        Ok(renderer)
    }

    /// The device.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// The scene.
    pub fn scene(&self) -> &FlatScene {
        &self.scene
    }

    /// The scene as it is on the device now.
    pub fn gpu_scene(&self) -> &GpuScene {
        &self.gpu_scene
    }

    /// What of the scene moves, as the last frame showed it.
    pub fn stage(&self) -> &Stage {
        &self.stage
    }

    /// The film.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// Picture size in pixels.
    pub fn size(&self) -> UVec2 {
        self.film.size()
    }

    /// Frames in the accumulated picture.
    pub fn accumulated_frames(&self) -> u32 {
        if self.restart_film { 0 } else { self.accumulated }
    }

    /// The id of the technique in use.
    pub fn technique(&self) -> &'static str {
        self.technique.info().id
    }

    /// The camera in use.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Replaces the scene; the camera becomes the new scene's first. On error the old scene stays.
    ///
    /// # Errors
    /// As [`Renderer::new`].
    #[cfg(not(target_arch = "wasm32"))]
    pub fn set_scene(&mut self, scene: FlatScene) -> Result<()> {
        pollster::block_on(self.change_scene(scene, &mut Pace::unbroken()))
    }

    /// As [`Renderer::set_scene`], in slices; on the web there is only this.
    ///
    /// # Errors
    /// As [`Renderer::set_scene`].
    pub async fn change_scene(&mut self, scene: FlatScene, pace: &mut Pace) -> Result<()> {
        let camera = scene.cameras.first().cloned().ok_or_else(|| Error::bad_value("scene", "has no camera"))?;
        let gpu_scene = GpuScene::upload(&self.gpu, &scene, pace).await?;
        self.gpu.check()?;
        self.gpu_scene = gpu_scene;
        self.alias_is_stale = false;
        self.accumulate = scene.rig.is_still();
        self.stage = Stage::new(&scene, 0, 0.0);
        self.scene = scene;
        self.camera = camera;
        self.followed = Some(0);
        self.clip = 0;
        self.set_time(0.0);
        self.reset();
        Ok(())
    }

    /// Gives the environment other texels, for one that is streamed live. Frames go on being accumulated, and techniques
    /// keep their history. With `render.environment_sampling` at `pyramid` nothing else is needed; at `alias` the next
    /// frame waits for a table that the CPU builds.
    ///
    /// # Errors
    /// `BAD_VALUE` where the map has another size than the scene's, is black, or has a negative or infinite radiance.
    pub fn update_environment(&mut self, environment: &Environment) -> Result<()> {
        let bad = |what: &str| Error::bad_value("environment", what);
        let radiance = environment::texels(environment)?.ok_or_else(|| bad("it is black"))?;
        match &mut self.scene.environment {
            Some(current) if (current.width, current.height) == (environment.width, environment.height) => {
                current.radiance = radiance;
                self.gpu_scene.update_environment(&self.gpu, current);
                self.alias_is_stale = true;
                Ok(())
            }
            Some(current) => Err(bad(&format!("it has other sides than {} x {}", current.width, current.height))),
            None => Err(bad("the scene has none to be replaced")),
        }
    }

    /// Prepares the way in which the environment is sampled.
    fn prepare_environment(&mut self) {
        let by_pyramid = self.render_params.environment_sampling == ENVIRONMENT_BY_PYRAMID;
        self.gpu_scene.sample_by_pyramid(&self.gpu, by_pyramid);
        if !by_pyramid
            && std::mem::take(&mut self.alias_is_stale)
            && let Some(environment) = &mut self.scene.environment
        {
            environment.build_alias();
            self.gpu_scene.update_environment(&self.gpu, environment);
        }
    }

    /// Starts again: frame 0, the moment last set (0 at first), no history, an empty film.
    pub fn reset(&mut self) {
        self.frame_index = 0;
        (self.time, self.time_was_set) = (self.start_time, true);
        self.previous_camera = None;
        self.has_history = false;
        self.technique_ready = false;
        self.restart_film = true;
    }

    /// Changes the picture size and starts again. On error the old size stays.
    ///
    /// # Errors
    /// As [`Renderer::new`].
    pub fn resize(&mut self, size: UVec2) -> Result<()> {
        if size == self.size() {
            return Ok(());
        }
        let mut film = Film::new(&self.gpu, size)?;
        film.count_pixels(&self.gpu, self.view().counts())?;
        self.technique.prepare(&self.gpu, size)?;
        self.film = film;
        self.visibility = visibility_textures(&self.gpu, size);
        [self.albedo_depth, self.normal, self.motion] = auxiliary_textures(&self.gpu, size);
        self.reset();
        self.gpu.check()
    }

    /// Renders one frame and submits it.
    ///
    /// # Errors
    /// `LIMIT` if the technique's buffers do not fit; `DEVICE` for an error the device has reported.
    pub fn render_frame(&mut self) -> Result<()> {
        self.record(None, false)?.submit();
        self.note_frame()
    }

    /// Begins a frame with its display, to be ended by [`Renderer::finish_frame`]. Returns the number of pipelines that are to be made for
    /// it, each by a call of [`Renderer::make_pipeline`], between which a page can draw. Nothing else may be asked of the renderer meanwhile.
    ///
    /// # Errors
    /// As [`Renderer::render_frame`].
    pub fn begin_frame(&mut self) -> Result<usize> {
        let recording = self.record(None, true)?.finish();
        Ok(self.begin(recording, None))
    }

    /// As [`Renderer::begin_frame`], for a frame that [`Renderer::finish_frame`] returns taken apart: what each of its passes has written.
    ///
    /// # Errors
    /// As [`Renderer::render_frame`]; `LIMIT` also if the pictures do not fit.
    pub fn begin_dissected_frame(&mut self) -> Result<usize> {
        let mut dissection = Dissection::new(self.size(), self.film.exposure_state().clone());
        let easel = Easel::new(&self.gpu, self.size())?;
        let recording = self.record(Some((&mut dissection, &easel)), true)?.finish();
        Ok(self.begin(recording, Some(dissection)))
    }

    fn begin(&mut self, recording: Recording, dissection: Option<Dissection>) -> usize {
        let unmade = recording.unmade(&self.gpu);
        self.begun = Some((recording, dissection));
        unmade
    }

    /// Makes the next of the pipelines that the begun frame waits for. Resolves when the device has compiled it.
    pub fn make_pipeline(&mut self) -> impl Future<Output = ()> + use<> {
        if let Some((recording, _)) = &mut self.begun {
            recording.make_pipeline(&self.gpu);
        }
        self.gpu.taken_in()
    }

    /// Submits what is left of the begun frame. Returns it taken apart if it was begun so.
    ///
    /// # Errors
    /// `DEVICE` for an error the device has reported.
    pub fn finish_frame(&mut self) -> Result<Option<Dissection>> {
        let Some((recording, dissection)) = self.begun.take() else { return Ok(None) };
        recording.submit(&self.gpu);
        self.note_frame()?;
        Ok(dissection)
    }

    /// Has the passes of frames from now on observed at a pixel, from the top left; `None` ends it.
    ///
    /// # Errors
    /// `BAD_VALUE` for a pixel outside the picture, `LIMIT` if the device has no room.
    pub fn inspect(&mut self, pixel: Option<UVec2>) -> Result<()> {
        if let Some(pixel) = pixel
            && pixel.cmpge(self.size()).any()
        {
            let size = self.size();
            return Err(Error::bad_value("pixel", format!("{},{} is outside {}x{}", pixel.x, pixel.y, size.x, size.y)));
        }
        self.inspector = pixel.map(|pixel| Inspector::new(&self.gpu, pixel)).transpose()?;
        Ok(())
    }

    /// What was seen at the inspected pixel in the last frame.
    ///
    /// # Errors
    /// `BAD_VALUE` where no pixel is inspected, or no frame was rendered since; `DEVICE` if it cannot be read back.
    pub fn inspection(&self) -> impl Future<Output = Result<Inspection>> + use<> {
        let kinds = || self.scene.lights.iter().map(|light| light.kind).collect();
        let read = self.inspector.as_ref().map(|inspector| inspector.read(&self.gpu, kinds()));
        async move {
            match read {
                Some(read) => read.await,
                None => Err(Error::bad_value("pixel", "none is inspected")),
            }
        }
    }

    /// Records a frame, and its display if it is wanted.
    fn record<'a>(
        &'a mut self,
        dissection: Option<(&'a mut Dissection, &'a Easel)>,
        display: bool,
    ) -> Result<Recorder<'a>> {
        self.gpu.check()?;
        if let Some(problems) = self.gpu.reload_shaders() {
            self.shader_problems = problems;
        }
        let size = self.size();
        if !self.technique_ready {
            self.technique.prepare(&self.gpu, size)?;
            self.technique_ready = true;
        }
        self.advance_time();
        self.prepare_environment();
        self.gpu.queue.write_buffer(&self.frame_uniform, 0, bytemuck::bytes_of(&self.frame()));
        self.film.prepare(&self.gpu, &self.film_params, self.shown.of_film(self.technique.info().views), self.scale());

        let restart = self.restarts_film();
        let view = self.view();
        let parity = (self.frame_index & 1) as usize;
        if let Some(timer) = &mut self.display_timer {
            timer.clear();
        }
        let mut recorder = Recorder::new(&self.gpu, self.timer.as_mut());
        if let Some((dissection, easel)) = dissection {
            recorder.dissect(dissection, easel);
        }
        self.film.clear_counters(&mut recorder, restart);
        self.gpu_scene.share(&mut recorder);
        self.render_params.specialise(&mut recorder.features);
        recorder.features.counts_pixels = view.counts();
        self.film.share(&mut recorder);
        recorder.share("frame", &self.frame_uniform);
        if let Some(inspector) = &self.inspector {
            inspector.share(&mut recorder);
        }
        self.gpu_scene.record(&mut recorder)?;
        recorder.share("visibility", &self.visibility[parity]);
        recorder.share("previous_visibility", &self.visibility[1 - parity]);
        let pass = recorder.pass(&table::SCENE_VISIBILITY).inspected_by(&table::SCENE_INSPECT);
        pass.bind("visibility_out", &self.visibility[parity]).dispatch_over(size)?;
        recorder.illustrate(&table::SCENE_SEEN, &[], size)?;
        if view.runs_technique() {
            self.technique.record(&mut recorder, size)?;
        } else {
            record_auxiliary(&mut recorder, [&self.albedo_depth, &self.normal, &self.motion], size)?;
        }
        if view.is_drawn_by_film() {
            recorder
                .pass(&table::FILM_VIEW)
                .bind("albedo_depth", &self.albedo_depth)
                .bind("normal", &self.normal)
                .bind("motion", &self.motion)
                .dispatch_over(size)?;
        }
        self.film.record_accumulate(&mut recorder, restart)?;
        if display {
            self.film.record_display(&mut recorder, &self.film_params)?;
        }
        Ok(recorder)
    }

    /// Whether the frame that is recorded is the film's first.
    fn restarts_film(&self) -> bool {
        self.restart_film || !self.accumulate
    }

    /// Counts a frame that has been submitted.
    fn note_frame(&mut self) -> Result<()> {
        if let Some(inspector) = &mut self.inspector {
            inspector.set_observed();
        }
        self.accumulated = if self.restarts_film() { 1 } else { self.accumulated + 1 };
        self.restart_film = false;
        self.previous_camera = Some(self.camera.clone());
        // Views of the surface run no technique, and leave its history as old as it was.
        self.has_history = self.view().runs_technique();
        self.frame_index = self.frame_index.wrapping_add(1);
        self.gpu.check()
    }

    /// Goes on to this frame's moment. Where time stands still, nothing has moved since the frame before.
    fn advance_time(&mut self) {
        if !std::mem::take(&mut self.time_was_set) && !self.accumulate {
            self.time += self.speed * FRAME_TIME;
        }
        // Whatever time was set to since, the frame before is what was shown.
        self.previous_time = if self.frame_index == 0 { self.time } else { self.stage.time() };
        if self.frame_index == 0 {
            self.stage.start(&self.scene, self.clip, self.time);
        } else {
            self.stage.step(&self.scene, self.clip, self.time);
        }
        self.gpu_scene.take_stage(&self.gpu, &self.scene, &self.stage);
        if let Some(camera) = self.followed.and_then(|index| self.stage.camera(&self.scene, index)) {
            self.camera = camera;
        }
    }

    /// Brings the display buffer up to date with the film.
    ///
    /// # Errors
    /// `DEVICE` for an error the device has reported.
    pub fn render_display(&mut self) -> Result<()> {
        self.film.prepare(&self.gpu, &self.film_params, self.shown.of_film(self.technique.info().views), self.scale());
        let mut recorder = Recorder::new(&self.gpu, self.display_timer.as_mut());
        recorder.share("film", self.film.uniforms());
        self.film.record_display(&mut recorder, &self.film_params)?;
        recorder.submit();
        self.gpu.check()
    }

    /// Cosine and sine of the turn of environment and sun at a time in seconds.
    fn environment_turn(&self, time: f64) -> Vec2 {
        let RenderParams { environment_rotation, environment_rotation_rate, .. } = self.render_params;
        let degrees = environment_rotation + environment_rotation_rate * time as f32;
        Vec2::from_angle((degrees % 360.0).to_radians())
    }

    /// Radius of a ball round the scene, in metres.
    fn scene_radius(&self) -> f32 {
        let [low, high] = self.scene.bounds;
        0.5 * (high - low).length()
    }

    fn frame(&self) -> Frame {
        let size = self.size();
        let camera = camera_view(&self.camera, size);
        Frame {
            camera,
            previous_camera: self.previous_camera.as_ref().map_or(camera, |c| camera_view(c, size)),
            size,
            index: self.frame_index,
            seed: self.seed,
            max_depth: self.render_params.max_depth,
            mis_heuristic: self.render_params.mis_heuristic,
            roulette_start: self.render_params.roulette_start,
            roulette_minimum: self.render_params.roulette_minimum,
            roulette_threshold: self.render_params.roulette_threshold,
            light_count: self.scene.lights.len() as u32,
            environment_light: environment_light(&self.scene),
            view: self.shown.of_technique(),
            scene_radius: self.scene_radius(),
            history: (self.has_history && !self.stage.is_renumbered()).into(),
            pixel_filter: self.render_params.pixel_filter,
            top_level: self.gpu_scene.top_level(),
            texture_levels: self.render_params.texture_levels,
            sun_light: sun_light(&self.scene),
            environment_turn: self.environment_turn(self.time),
            previous_environment_turn: self.environment_turn(self.previous_time),
            previous_top_level: self.gpu_scene.previous_top_level(),
            instance_count: self.gpu_scene.instance_count(),
        }
    }
}

fn visibility_textures(gpu: &Gpu, size: UVec2) -> [wgpu::TextureView; 2] {
    [0, 1].map(|_| gpu.texture("visibility", size, wgpu::TextureFormat::Rgba32Uint))
}

fn auxiliary_textures(gpu: &Gpu, size: UVec2) -> [wgpu::TextureView; 3] {
    ["albedo and depth", "normal", "motion"].map(|label| gpu.texture(label, size, wgpu::TextureFormat::Rgba32Float))
}

fn record_auxiliary(
    recorder: &mut Recorder<'_>,
    [albedo_depth, normal, motion]: [&wgpu::TextureView; 3],
    size: UVec2,
) -> Result<()> {
    recorder
        .pass(&table::SCENE_AUXILIARY)
        .bind("albedo_depth_out", albedo_depth)
        .bind("normal_out", normal)
        .bind("motion_out", motion)
        .dispatch_over(size)
}
