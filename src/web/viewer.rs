//! The page's side of the renderer. Every method is thin.

use super::{JsResult, Lighting, OrJs, flatten, js_error, surround_by_name};
use crate::film::blit::Blit;
use crate::gpu::{Gpu, GpuOptions, instance};
use crate::lab::metrics;
use crate::pace::Pace;
use crate::scene::{Camera, Projection, builtin};
use crate::{Error, FlatScene, Image, Renderer};
use glam::{UVec2, Vec3};
use std::cell::RefCell;
use std::pin::Pin;
use std::rc::Rc;
use wasm_bindgen::prelude::*;

/// Runs once when the module is loaded: a panic becomes a console error with a stack.
#[wasm_bindgen(start)]
pub fn start() {
    console_error_panic_hook::set_once();
}

/// The registry as JSON: what [`crate::describe`] gives.
#[wasm_bindgen]
pub fn describe() -> String {
    crate::describe().to_string()
}

/// A built-in scene as `FlatScene` bytes, surrounded by `sky...` or `white` if by anything. For a Worker.
#[wasm_bindgen]
pub fn flatten_builtin(name: &str, lighting: &Lighting, progress: &js_sys::Function) -> JsResult<Vec<u8>> {
    let mut scene = builtin::make(name).js()?;
    if let Some(name) = lighting.environment() {
        surround_by_name(&mut scene, &name).js()?;
    }
    flatten(scene, lighting, progress)
}

#[wasm_bindgen]
extern "C" {
    #[wasm_bindgen(js_name = setTimeout)]
    fn set_timeout(work: &js_sys::Function, milliseconds: i32) -> JsValue;
}

/// Lets the page draw and listen between slices of work.
fn pace() -> Pace {
    let rest = || {
        let promise = js_sys::Promise::new(&mut |resolve, _| {
            set_timeout(&resolve, 0);
        });
        let waited = wasm_bindgen_futures::JsFuture::from(promise);
        Box::pin(async move {
            let _ = waited.await;
        }) as Pin<Box<dyn Future<Output = ()>>>
    };
    Pace::sliced(js_sys::Date::now, rest)
}

/// A flattened scene from the Worker, copied in slices.
async fn receive(bytes: &js_sys::Uint8Array, pace: &mut Pace) -> JsResult<FlatScene> {
    let read = |offset: usize, part: &mut [u8]| {
        bytes.subarray(offset as u32, (offset + part.len()) as u32).copy_to(part);
    };
    FlatScene::receive(bytes.length() as usize, read, pace).await.js()
}

/// A renderer that presents to a canvas.
#[wasm_bindgen]
pub struct Viewer {
    renderer: Renderer,
    blit: Blit,
    /// What `errors` compares with. Shared with the promises that read pictures back.
    reference: Rc<RefCell<Option<Image>>>,
}

#[wasm_bindgen]
impl Viewer {
    /// A viewer of a flattened scene at `width` x `height` pixels.
    pub async fn create(
        canvas: web_sys::HtmlCanvasElement,
        flat_scene: js_sys::Uint8Array,
        width: u32,
        height: u32,
    ) -> JsResult<Viewer> {
        let mut pace = pace();
        let scene = receive(&flat_scene, &mut pace).await?;
        let instance = instance();
        let surface = instance
            .create_surface(wgpu::SurfaceTarget::Canvas(canvas))
            .map_err(|e| js_error(&Error::NoAdapter(e.to_string())))?;
        let gpu = Gpu::from_instance(&instance, Some(&surface), &GpuOptions::default()).await.js()?;
        let blit = Blit::new(&gpu, surface);
        let renderer = Renderer::prepare(gpu, scene, UVec2::new(width, height), &mut pace).await.js()?;
        Ok(Viewer { renderer, blit, reference: Rc::default() })
    }

    /// Replaces the scene by another flattened one.
    pub async fn load(&mut self, flat_scene: js_sys::Uint8Array) -> JsResult<()> {
        let mut pace = pace();
        let scene = receive(&flat_scene, &mut pace).await?;
        self.renderer.change_scene(scene, &mut pace).await.js()
    }

    /// Switches to another technique.
    pub fn set_technique(&mut self, id: &str) -> JsResult<()> {
        self.renderer.set_technique(id).js()
    }

    /// Sets a parameter: `name`, `render.name` or `film.name`.
    pub fn set(&mut self, key: &str, value: &str) -> JsResult<()> {
        self.renderer.set(key, value).js()
    }

    /// All parameter values as JSON.
    pub fn parameters(&self) -> String {
        self.renderer.parameters().to_string()
    }

    /// Shows a debug view, or `radiance`.
    pub fn set_view(&mut self, name: &str) -> JsResult<()> {
        self.renderer.set_view(name).js()
    }

    /// Sets the seed and starts again.
    pub fn set_seed(&mut self, seed: u32) {
        self.renderer.set_seed(seed);
    }

    /// Whether frames are averaged (and time stands still).
    pub fn set_accumulate(&mut self, on: bool) {
        self.renderer.set_accumulate(on);
    }

    /// Moves the camera: JSON with position, forward, up and vertical_fov or half_height.
    pub fn set_camera(&mut self, json: &str) -> JsResult<()> {
        let camera = camera_from_json(json).js()?;
        self.renderer.set_camera(&camera);
        Ok(())
    }

    /// Looks through a camera of the scene, by index, and moves with it.
    pub fn follow_camera(&mut self, index: usize) -> JsResult<()> {
        self.renderer.follow_camera(index).js()
    }

    /// The camera in use, as JSON.
    pub fn camera(&self) -> String {
        camera_to_json(self.renderer.camera()).to_string()
    }

    /// Goes to a moment of the scene, in seconds.
    pub fn set_time(&mut self, seconds: f64) {
        self.renderer.set_time(seconds);
    }

    /// The moment that is shown, in seconds.
    pub fn time(&self) -> f64 {
        self.renderer.time()
    }

    /// How fast time runs while it does.
    pub fn set_speed(&mut self, speed: f64) {
        self.renderer.set_speed(speed);
    }

    /// Plays another animation, by name or index.
    pub fn set_animation(&mut self, name: &str) -> JsResult<()> {
        self.renderer.set_animation(name).js()
    }

    /// Index of the animation that is played.
    pub fn animation(&self) -> usize {
        self.renderer.animation()
    }

    /// The scene's cameras as a JSON list.
    pub fn cameras(&self) -> String {
        self.renderer.scene().cameras.iter().map(camera_to_json).collect::<serde_json::Value>().to_string()
    }

    /// World bounds: min xyz, max xyz.
    pub fn bounds(&self) -> Vec<f32> {
        self.renderer.scene().bounds.iter().flat_map(|v| v.to_array()).collect()
    }

    /// Scene statistics, whether it moves, and warnings, as JSON.
    pub fn info(&self) -> String {
        let scene = self.renderer.scene();
        let animations =
            scene.rig.clips.iter().map(|clip| serde_json::json!({"name": clip.name, "seconds": clip.duration}));
        serde_json::json!({
            "name": scene.name, "stats": scene.stats, "warnings": scene.warnings,
            "animations": animations.collect::<Vec<_>>(), "seconds": scene.rig.duration(0),
            "moving_cameras": scene.rig.cameras.iter().map(|camera| camera.target).collect::<Vec<_>>(),
            "animated": !scene.rig.is_still(),
            "adapter": self.renderer.gpu().adapter_name(),
            "software": self.renderer.gpu().is_software(),
        })
        .to_string()
    }

    /// Changes the picture size.
    pub fn resize(&mut self, width: u32, height: u32) -> JsResult<()> {
        self.renderer.resize(UVec2::new(width, height)).js()
    }

    /// Starts again.
    pub fn reset(&mut self) {
        self.renderer.reset();
    }

    /// Renders one frame and presents it.
    pub fn render(&mut self) -> JsResult<()> {
        self.renderer.render_frame().js()?;
        self.present()
    }

    /// Presents the film as it is, without a new frame.
    pub fn present(&mut self) -> JsResult<()> {
        self.renderer.render_display().js()?;
        self.blit.present(self.renderer.gpu(), self.renderer.film()).js()
    }

    /// Frames in the picture.
    pub fn frames(&self) -> u32 {
        self.renderer.accumulated_frames()
    }

    /// Rays, left-out samples and pass times of the last frame, as JSON.
    pub fn stats(&self) -> js_sys::Promise {
        let (counters, passes) = (self.renderer.counters(), self.renderer.pass_times());
        wasm_bindgen_futures::future_to_promise(async move {
            let mut stats = serde_json::json!(counters.await.js()?);
            stats["passes"] = serde_json::json!(passes.await.js()?);
            Ok(stats.to_string().into())
        })
    }

    /// Resolves when the device has done everything submitted so far.
    pub fn idle(&self) -> js_sys::Promise {
        let wait = self.renderer.wait();
        wasm_bindgen_futures::future_to_promise(async move { wait.await.js().map(|()| JsValue::UNDEFINED) })
    }

    /// The displayed picture: RGBA8, row-major from the top.
    pub fn read_display(&mut self) -> js_sys::Promise {
        let read = self.renderer.read_display();
        wasm_bindgen_futures::future_to_promise(async move {
            Ok(js_sys::Uint8Array::from(read.await.js()?.as_slice()).into())
        })
    }
}

#[wasm_bindgen]
impl Viewer {
    /// Keeps the picture, averaged and linear, as the reference.
    pub fn keep_reference(&self) -> js_sys::Promise {
        let (read, reference) = (self.renderer.read_image(), self.reference.clone());
        wasm_bindgen_futures::future_to_promise(async move {
            let image = read.await.js()?;
            *reference.borrow_mut() = Some(image);
            Ok(JsValue::UNDEFINED)
        })
    }

    /// How far the picture is from the reference, as JSON: `mse`, `relmse`, `mape`, and `bias`, the signed one of mean luminance; the last two as
    /// fractions, null where the reference is black.
    pub fn errors(&self) -> js_sys::Promise {
        let (read, reference) = (self.renderer.read_image(), self.reference.clone());
        wasm_bindgen_futures::future_to_promise(async move {
            let image = read.await.js()?;
            let reference = reference.borrow();
            let reference = reference.as_ref().ok_or_else(|| Error::bad_value("reference", "there is none")).js()?;
            let [.., luminance] = metrics::bias(&image, reference).js()?;
            let errors = serde_json::json!({
                "mse": metrics::mse(&image, reference).js()?,
                "relmse": metrics::relmse(&image, reference).js()?,
                "mape": metrics::mape(&image, reference).js()?,
                "bias": luminance.relative,
            });
            Ok(errors.to_string().into())
        })
    }
}

fn camera_to_json(camera: &Camera) -> serde_json::Value {
    let mut json = serde_json::json!({
        "name": camera.name, "position": camera.position.to_array(),
        "forward": camera.forward.to_array(), "up": camera.up.to_array(),
    });
    match camera.projection {
        Projection::Perspective { vertical_fov } => json["vertical_fov"] = vertical_fov.into(),
        Projection::Orthographic { half_height } => json["half_height"] = half_height.into(),
    }
    json
}

fn camera_from_json(json: &str) -> crate::Result<Camera> {
    let bad = |what: &str| Error::bad_value("camera", what);
    let value: serde_json::Value = serde_json::from_str(json).map_err(|e| bad(&e.to_string()))?;
    let number = |v: &serde_json::Value| v.as_f64().map(|x| x as f32).filter(|x| x.is_finite());
    let vector = |key: &str| -> crate::Result<Vec3> {
        let list =
            value[key].as_array().filter(|a| a.len() == 3).ok_or_else(|| bad(&format!("{key} is not [x, y, z]")))?;
        let at = |i: usize| number(&list[i]).ok_or_else(|| bad(&format!("{key} is not finite")));
        Ok(Vec3::new(at(0)?, at(1)?, at(2)?))
    };
    let unit = |key: &str| vector(key)?.try_normalize().ok_or_else(|| bad(&format!("{key} has no direction")));
    let projection = match (number(&value["vertical_fov"]), number(&value["half_height"])) {
        (Some(vertical_fov), _) if vertical_fov > 0.0 && vertical_fov < std::f32::consts::PI => {
            Projection::Perspective { vertical_fov }
        }
        (_, Some(half_height)) if half_height > 0.0 => Projection::Orthographic { half_height },
        _ => return Err(bad("needs vertical_fov between 0 and pi, or half_height above 0")),
    };
    Ok(Camera {
        name: String::new(),
        position: vector("position")?,
        forward: unit("forward")?,
        up: unit("up")?,
        projection,
    })
}
