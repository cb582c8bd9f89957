//! The browser's side. Two wasm modules are made of this crate: that of the page, with the feature `viewer`, and that of the
//! crate `restir-loader`, which reads files. What both share is here; errors become `{code, message}` objects.

#[cfg(feature = "viewer")]
mod measure;
#[cfg(feature = "viewer")]
mod viewer;

use crate::scene::flat::Step;
use crate::{Error, FlatScene, Scene};
use wasm_bindgen::prelude::*;

/// What exported functions return.
pub type JsResult<T> = Result<T, JsValue>;

fn js_error(error: &Error) -> JsValue {
    let object = js_sys::Object::new();
    // Setting a property of a fresh object cannot fail.
    let _ = js_sys::Reflect::set(&object, &"code".into(), &error.code().into());
    let _ = js_sys::Reflect::set(&object, &"message".into(), &error.to_string().into());
    object.into()
}

/// From this crate's results to exported ones.
pub trait OrJs<T> {
    /// The same, with a `{code, message}` object as error.
    ///
    /// # Errors
    /// Those of `self`.
    fn js(self) -> JsResult<T>;
}

impl<T> OrJs<T> for crate::Result<T> {
    fn js(self) -> JsResult<T> {
        self.map_err(|e| js_error(&e))
    }
}

#[wasm_bindgen]
extern "C" {
    /// What lights a scene beyond its own lights.
    pub type Lighting;
    /// Point lights for a scene that has no light: see [`Scene::ensure_light`].
    #[wasm_bindgen(method, getter)]
    pub fn lights(this: &Lighting) -> u32;
    /// Of their places.
    #[wasm_bindgen(method, getter)]
    pub fn seed(this: &Lighting) -> u32;
    /// What surrounds the scene instead of its own environment: `sky...`, `white`, or the name of [`map`](Lighting::map).
    #[wasm_bindgen(method, getter)]
    pub fn environment(this: &Lighting) -> Option<String>;
    /// An OpenEXR or Radiance file.
    #[wasm_bindgen(method, getter)]
    pub fn map(this: &Lighting) -> Option<Vec<u8>>;
}

/// Puts `sky...` or `white` round a scene.
///
/// # Errors
/// `UNKNOWN_NAME` for another name, `BAD_VALUE` for a sky's setting.
pub fn surround_by_name(scene: &mut Scene, name: &str) -> crate::Result<()> {
    match scene.surround(name)? {
        true => Ok(()),
        false => Err(Error::Unknown { kind: "environment", name: name.into(), known: "sky, white".into() }),
    }
}

/// A scene as `FlatScene` bytes; `progress(stage, fraction, what)` is called meanwhile.
///
/// # Errors
/// Those of [`FlatScene::build`].
pub fn flatten(mut scene: Scene, lighting: &Lighting, progress: &js_sys::Function) -> JsResult<Vec<u8>> {
    scene.ensure_light(lighting.lights(), lighting.seed().into());
    let mut report = |fraction: f32, step: Step| {
        let what = step.to_string();
        let _ = progress.call3(&JsValue::NULL, &step.stage().into(), &fraction.into(), &what.into());
    };
    Ok(FlatScene::build(&scene, &mut report).js()?.to_bytes())
}
