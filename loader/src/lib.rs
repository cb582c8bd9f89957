//! What the page's Worker calls for a scene or an environment that comes from a file. Visitors of built-in scenes do not
//! download it.
#![cfg(target_arch = "wasm32")]

use js_sys::{Function, Uint8Array};
use restir::scene::flat::cooked;
use restir::scene::{builtin, environment, gltf, obj};
use restir::web::{JsResult, Lighting, OrJs, flatten, surround_by_name};
use restir::{Error, Scene};
use wasm_bindgen::prelude::*;

/// Runs once when the module is loaded: a panic becomes a console error with a stack.
#[wasm_bindgen(start)]
pub fn start() {
    console_error_panic_hook::set_once();
}

#[wasm_bindgen]
extern "C" {
    /// What of a glTF file is shown.
    pub type Choice;
    #[wasm_bindgen(method, getter)]
    fn scene(this: &Choice) -> Option<u32>;
    #[wasm_bindgen(method, getter)]
    fn variant(this: &Choice) -> Option<String>;
}

/// What can be chosen in a glTF file, as JSON ([`gltf::Contents`]).
#[wasm_bindgen]
pub fn contents_of(name: &str, bytes: &[u8]) -> JsResult<String> {
    Ok(serde_json::json!(gltf::contents(name, bytes).js()?).to_string())
}

/// The `FlatScene` bytes in a cooked file, checked in full.
#[wasm_bindgen]
pub fn uncook(name: &str, bytes: &[u8]) -> JsResult<Vec<u8>> {
    cooked::from_file(name, bytes).js()?;
    Ok(cooked::contents(name, bytes).js()?.to_vec())
}

/// A glTF file, or an OBJ file by its name, as `FlatScene` bytes. `resolve(uri)` gives the bytes of a file beside it, or undefined.
#[wasm_bindgen]
pub fn flatten_file(
    name: &str,
    bytes: &[u8],
    resolve: &Function,
    choice: &Choice,
    lighting: &Lighting,
    progress: &Function,
) -> JsResult<Vec<u8>> {
    let mut find = |uri: &str| {
        let found = resolve.call1(&JsValue::NULL, &uri.into()).ok();
        let found = found.filter(|value| value.is_instance_of::<Uint8Array>());
        let missing = "refers to a file that was not given; choose all its files at once";
        found.map(|value| Uint8Array::new(&value).to_vec()).ok_or_else(|| Error::bad_file(name, uri, missing))
    };
    let scene = if name.to_ascii_lowercase().ends_with(".obj") {
        obj::load_bytes(name, bytes, &mut find).js()?
    } else {
        let variant = choice.variant();
        let options = gltf::Options { scene: choice.scene().map(|scene| scene as usize), variant: variant.as_deref() };
        gltf::load_bytes_with(name, bytes, &options, &mut find).js()?
    };
    surrounded(scene, lighting, progress)
}

/// A built-in scene as `FlatScene` bytes, surrounded by a map.
#[wasm_bindgen]
pub fn flatten_builtin(name: &str, lighting: &Lighting, progress: &Function) -> JsResult<Vec<u8>> {
    surrounded(builtin::make(name).js()?, lighting, progress)
}

fn surrounded(mut scene: Scene, lighting: &Lighting, progress: &Function) -> JsResult<Vec<u8>> {
    match (lighting.environment(), lighting.map()) {
        (Some(name), Some(map)) => environment::surround(&mut scene, &name, &map).js()?,
        (Some(name), None) => surround_by_name(&mut scene, &name).js()?,
        (None, _) => {}
    }
    flatten(scene, lighting, progress)
}
