//! The page's side of the renderer. Every method is thin.

use super::{JsResult, Lighting, OrJs, flatten, js_error, surround_by_name};
use crate::film::blit::Blit;
use crate::gpu::dissection::Dissection;
use crate::gpu::{Gpu, GpuOptions, instance};
use crate::pace::Pace;
use crate::scene::{Camera, Projection, builtin};
use crate::{Error, FlatScene, Renderer};
use glam::{UVec2, Vec3};
use std::pin::Pin;
use wasm_bindgen::prelude::*;

/// Bytes by which WebAssembly memory grows.
const WASM_PAGE: usize = 1 << 16;

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

/// A graphics device, and the pipelines made on it: one for all viewers of a page.
#[wasm_bindgen]
pub struct Device {
    instance: wgpu::Instance,
    gpu: Gpu,
}

#[wasm_bindgen]
impl Device {
    /// The first GPU, or a software adapter where there is none.
    pub async fn open() -> JsResult<Device> {
        let instance = instance();
        let gpu = Gpu::from_instance(&instance, None, &GpuOptions::default()).await.js()?;
        Ok(Device { instance, gpu })
    }

    /// Whether it was lost, or has reported an error: then it is of no use any more.
    pub fn is_lost(&self) -> bool {
        self.gpu.check().is_err()
    }
}

/// A renderer that presents to a canvas.
#[wasm_bindgen]
pub struct Viewer {
    renderer: Renderer,
    blit: Blit,
    /// The last frame that was taken apart.
    dissection: Option<Dissection>,
}

#[wasm_bindgen]
impl Viewer {
    /// A viewer of a flattened scene at `width` x `height` pixels.
    pub async fn create(
        device: &Device,
        canvas: web_sys::HtmlCanvasElement,
        flat_scene: js_sys::Uint8Array,
        width: u32,
        height: u32,
    ) -> JsResult<Viewer> {
        let mut pace = pace();
        let scene = receive(&flat_scene, &mut pace).await?;
        let surface = device
            .instance
            .create_surface(wgpu::SurfaceTarget::Canvas(canvas))
            .map_err(|e| js_error(&Error::NoAdapter(e.to_string())))?;
        let gpu = device.gpu.clone();
        let blit = Blit::new(&gpu, surface);
        let renderer = Renderer::prepare(gpu, scene, UVec2::new(width, height), &mut pace).await.js()?;
        Ok(Viewer { renderer, blit, dissection: None })
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

    /// What the colours of the view mean, as JSON ([`crate::view::legend_json`]).
    pub fn legend(&self) -> String {
        self.renderer.legend().to_string()
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

    /// Begins a frame that [`Viewer::finish`] ends and presents. Returns the number of pipelines that it waits for, each made by a call of
    /// [`Viewer::make_pipeline`]. Nothing else may be asked of the viewer meanwhile.
    pub fn begin(&mut self) -> JsResult<usize> {
        self.renderer.begin_frame().js()
    }

    /// As [`Viewer::begin`], for a frame of which is kept what its passes write: see [`Viewer::dissection`].
    pub fn begin_dissected(&mut self) -> JsResult<usize> {
        self.renderer.begin_dissected_frame().js()
    }

    /// Makes the next of these pipelines. Resolves when the device has compiled it.
    pub fn make_pipeline(&mut self) -> js_sys::Promise {
        let made = self.renderer.make_pipeline();
        wasm_bindgen_futures::future_to_promise(async move {
            made.await;
            Ok(JsValue::UNDEFINED)
        })
    }

    /// Ends the frame that was begun, and presents it.
    pub fn finish(&mut self) -> JsResult<()> {
        self.dissection = self.renderer.finish_frame().js()?;
        self.blit.present(self.renderer.gpu(), self.renderer.film()).js()
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

    /// Rays, left-out samples and pass times of the last frame, and bytes held on the device and by the modules' memory, as JSON.
    pub fn stats(&self) -> js_sys::Promise {
        let (counters, passes) = (self.renderer.counters(), self.renderer.pass_times());
        let mut memory = serde_json::json!(self.renderer.memory());
        memory["wasm"] = (core::arch::wasm32::memory_size(0) * WASM_PAGE).into();
        wasm_bindgen_futures::future_to_promise(async move {
            let mut stats = serde_json::json!(counters.await.js()?);
            stats["passes"] = serde_json::json!(passes.await.js()?);
            stats["memory"] = memory;
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
    /// The averaged picture, linear Rec. 709: three numbers a pixel, row-major from the top.
    pub fn read_picture(&self) -> js_sys::Promise {
        let read = self.renderer.read_image();
        wasm_bindgen_futures::future_to_promise(async move {
            Ok(js_sys::Float32Array::from(read.await.js()?.pixels.as_flattened()).into())
        })
    }

    /// What the last frame saw first: a part of it, in the bytes that [`Renderer::read_surfaces`] describes. One at a time, for memory that
    /// has grown stays.
    pub fn read_surfaces(&self, part: usize) -> js_sys::Promise {
        let read = self.renderer.read_surfaces(part);
        wasm_bindgen_futures::future_to_promise(async move {
            Ok(js_sys::Uint8Array::from(read.await.js()?.as_slice()).into())
        })
    }

    /// Which settings, as they are now, bias the picture, as JSON: `parameter` and `why`.
    pub fn biases(&self) -> String {
        serde_json::json!(self.renderer.biases()).to_string()
    }

    /// Has frames from now on observed at a pixel from the top left; two numbers, or none to end it.
    pub fn inspect(&mut self, pixel: &[u32]) -> JsResult<()> {
        self.renderer.inspect(pixel.first_chunk().map(|&[x, y]| UVec2::new(x, y))).js()
    }

    /// What was seen at that pixel in the last frame, as JSON: [`crate::inspect::Inspection`].
    pub fn inspection(&self) -> js_sys::Promise {
        let read = self.renderer.inspection();
        wasm_bindgen_futures::future_to_promise(
            async move { Ok(serde_json::json!(read.await.js()?).to_string().into()) },
        )
    }

    /// The passes of the last frame, if that was taken apart, as JSON: the `id` of each, its `file` in shaders/, and whether it `has_picture`.
    pub fn dissection(&self) -> String {
        let stages = self.dissection.iter().flat_map(|dissection| &dissection.stages).map(|stage| {
            serde_json::json!({"id": stage.shader.id, "file": stage.shader.file, "has_picture": stage.has_picture()})
        });
        stages.collect::<serde_json::Value>().to_string()
    }

    /// The picture of a pass of that frame: RGBA8, row-major from the top; empty where it has none.
    pub fn dissected(&self, stage: usize) -> js_sys::Promise {
        let read = self.dissection.as_ref().map(|dissection| dissection.read(self.renderer.gpu(), stage));
        wasm_bindgen_futures::future_to_promise(async move {
            match read {
                Some(read) => Ok(js_sys::Uint8Array::from(read.await.js()?.as_slice()).into()),
                None => Err(js_error(&Error::bad_value("dissected", "no frame was taken apart"))),
            }
        })
    }

    /// Lets go of that frame.
    pub fn forget_dissection(&mut self) {
        self.dissection = None;
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
