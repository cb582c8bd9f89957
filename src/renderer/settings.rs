//! What a renderer shows, and how: technique, parameters, view, camera, time, seed.

use super::Renderer;
use crate::error::{Error, Result};
use crate::params::{FilmParams, Params};
use crate::scene::Camera;
use crate::techniques::{self, Bias};
use crate::view::{Scale, Shown, View, legend_json};

impl Renderer {
    /// Switches to another technique, with its default parameters. On error the old technique stays.
    ///
    /// # Errors
    /// `UNKNOWN_NAME` listing the ids there are; `LIMIT` if its buffers do not fit.
    pub fn set_technique(&mut self, id: &str) -> Result<()> {
        let mut technique = (techniques::find(id)?.create)(&self.gpu);
        technique.prepare(&self.gpu, self.size())?;
        if matches!(self.shown, Shown::Own(_)) {
            self.film.count_pixels(&self.gpu, false)?;
            self.shown = Shown::PICTURE;
        }
        self.technique = technique;
        self.reset();
        Ok(())
    }

    /// Sets a parameter: of the technique by its name, or of a global group as `render.NAME` or `film.NAME`. On error the
    /// old value stays.
    ///
    /// # Errors
    /// `UNKNOWN_NAME` listing the names there are; `BAD_VALUE` saying what the parameter takes; `LIMIT` if what the
    /// technique needs with it does not fit.
    pub fn set(&mut self, key: &str, value: &str) -> Result<()> {
        let known = match key.split_once('.') {
            Some(("film", name)) => {
                // How the picture is shown does not touch what was accumulated.
                if self.film_params.set(name, value)? {
                    return Ok(());
                }
                false
            }
            Some(("render", name)) => self.render_params.set(name, value)?,
            _ => self.set_of_technique(key, value)?,
        };
        if known {
            self.reset();
            return Ok(());
        }
        self.technique.info().spec(key).map(|_| ())
    }

    /// Sets a parameter of the technique, or leaves it where the device has no room for what it needs then. Whether the
    /// name was known.
    fn set_of_technique(&mut self, name: &str, value: &str) -> Result<bool> {
        let before = self.technique.values();
        let known = self.technique.set(name, value)?;
        if known && let Err(error) = self.technique.prepare(&self.gpu, self.size()) {
            if let Some(old) = before.get(name) {
                self.technique.set(name, &old.as_str().map_or_else(|| old.to_string(), str::to_owned))?;
                self.technique.prepare(&self.gpu, self.size())?;
            }
            return Err(error);
        }
        Ok(known)
    }

    /// All parameter values: `{"technique": {...}, "render": {...}, "film": {...}}`.
    pub fn parameters(&self) -> serde_json::Value {
        serde_json::json!({
            "technique": self.technique.values(),
            "render": self.render_params.values(),
            "film": self.film_params.values(),
        })
    }

    /// Which settings, as they are now, bias the picture.
    pub fn biases(&self) -> Vec<Bias> {
        let of_all = self.render_params.biases().into_iter().filter(|bias| self.technique.obeys(bias.parameter));
        self.technique.biases().into_iter().chain(of_all).collect()
    }

    /// Shows a debug view, or `radiance`.
    ///
    /// # Errors
    /// `UNKNOWN_NAME` listing the views there are; `LIMIT` where there is no room for what it counts.
    pub fn set_view(&mut self, name: &str) -> Result<()> {
        let own = self.technique.info().views;
        let shown = Shown::find(name, own)?;
        self.film.count_pixels(&self.gpu, shown.view(own).counts())?;
        self.shown = shown;
        self.restart_film = true;
        Ok(())
    }

    /// The view that is shown.
    pub(super) fn view(&self) -> &'static View {
        self.shown.view(self.technique.info().views)
    }

    /// How its values become colours: in the range that `film` asks for, or that settings and scene give, or its own.
    pub(super) fn scale(&self) -> Scale {
        let Scale::Number { unit, mut low, mut high, is_logarithmic } = self.view().scale else {
            return self.view().scale;
        };
        let FilmParams { range_low, range_high, .. } = self.film_params;
        // By magnitude there is nothing below 0.
        if range_low < range_high && (range_high > 0.0 || !is_logarithmic) {
            (low, high) = (range_low, range_high);
        } else if self.view().is_depth() {
            high = 4.0 * self.scene_radius();
        } else if let Some(highest) = self.technique.highest(self.view().name) {
            high = highest;
        }
        // Equal ratios have no beginning at 0.
        if is_logarithmic {
            low = low.max(1e-6 * high);
        }
        Scale::Number { unit, low, high, is_logarithmic }
    }

    /// What the colours of the view mean, as [`legend_json`].
    pub fn legend(&self) -> serde_json::Value {
        legend_json(self.view(), self.scale(), self.film_params.color_map)
    }

    /// Moves the camera. The film starts again; the technique keeps its history and reprojects it.
    pub fn set_camera(&mut self, camera: &Camera) {
        self.camera = camera.clone();
        self.followed = None;
        self.restart_film = true;
    }

    /// Looks through camera `index` of the scene, and moves with it. From another camera this is a cut: history is dropped.
    ///
    /// # Errors
    /// `UNKNOWN_NAME` listing the cameras there are.
    pub fn follow_camera(&mut self, index: usize) -> Result<()> {
        let Some(camera) = self.stage.camera(&self.scene, index).filter(|_| index < self.scene.cameras.len()) else {
            return Err(Error::Unknown {
                kind: "camera",
                name: index.to_string(),
                known: (0..self.scene.cameras.len()).map(|i| i.to_string()).collect::<Vec<_>>().join(", "),
            });
        };
        if self.followed != Some(index) {
            self.previous_camera = None;
            self.has_history = false;
        }
        self.camera = camera;
        self.followed = Some(index);
        self.restart_film = true;
        Ok(())
    }

    /// Plays another animation of the scene, by name or index, from the moment that time is at.
    ///
    /// # Errors
    /// `UNKNOWN_NAME` listing the animations there are.
    pub fn set_animation(&mut self, name: &str) -> Result<()> {
        self.clip = self.scene.rig.find_clip(name)?;
        self.set_time(self.time);
        Ok(())
    }

    /// Goes to a moment, in seconds: the next frame shows it. The film starts again; the technique keeps its history and
    /// reprojects it. A reset comes back to this moment. Times that are not finite are ignored.
    pub fn set_time(&mut self, seconds: f64) {
        if seconds.is_finite() {
            (self.time, self.start_time, self.time_was_set) = (seconds, seconds, true);
            self.restart_film = true;
        }
    }

    /// The moment that the last frame showed, or that [`Renderer::set_time`] asks the next one for.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Sets how fast time runs while it does: 1 is a 60th of a second a frame, negative is backwards.
    pub fn set_speed(&mut self, speed: f64) {
        if speed.is_finite() {
            self.speed = speed;
        }
    }

    /// Sets the seed of all random numbers and starts again.
    pub fn set_seed(&mut self, seed: u32) {
        self.seed = seed;
        self.reset();
    }

    /// Whether frames are averaged. On, time stands still where it is; off, it runs, and each frame is shown alone.
    pub fn set_accumulate(&mut self, accumulate: bool) {
        self.accumulate = accumulate;
        self.restart_film = true;
    }
}
