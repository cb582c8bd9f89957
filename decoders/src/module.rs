//! What the page's Worker calls. Errors are `{code, message}` objects, codes as those of restir's own errors.

use crate::{Fault, draco, map, meshopt, obj, picture};
use js_sys::{Function, Object, Reflect, Uint8Array};
use wasm_bindgen::prelude::*;

type JsResult<T> = Result<T, JsValue>;

fn object(entries: [(&str, JsValue); 2]) -> JsValue {
    let object = Object::new();
    for (key, value) in entries {
        // Setting a property of a fresh object cannot fail.
        let _ = Reflect::set(&object, &key.into(), &value);
    }
    object.into()
}

fn js_error(fault: Fault) -> JsValue {
    let (code, message) = match fault {
        Fault::Broken(what) => ("BAD_FILE", what),
        Fault::Unsupported(what) => ("UNSUPPORTED", what),
        Fault::TooLarge { pixels, most } => {
            ("LIMIT", format!("the picture has {pixels} pixels; at most {most} are read"))
        }
    };
    object([("code", code.into()), ("message", message.into())])
}

/// A Draco mesh as [`draco::Mesh::to_bytes`].
#[wasm_bindgen]
pub fn decode_draco(bytes: &[u8], max_bytes: f64) -> JsResult<Vec<u8>> {
    draco::decode(bytes, max_bytes as u64).map(|mesh| mesh.to_bytes()).map_err(js_error)
}

/// A meshopt buffer view.
#[wasm_bindgen]
pub fn decode_meshopt(bytes: &[u8], mode: &str, filter: &str, count: u32, stride: u32) -> JsResult<Vec<u8>> {
    let layout = meshopt::Layout::new(mode, filter, count as usize, stride as usize).map_err(js_error)?;
    meshopt::decode(bytes, &layout).map_err(js_error)
}

/// A PNG, JPEG, WebP or KTX2 picture as [`picture::Picture::into_bytes`].
#[wasm_bindgen]
pub fn decode_picture(bytes: &[u8], max_side: u32, max_bytes: f64) -> JsResult<Vec<u8>> {
    let limits = picture::Limits { side: max_side, bytes: max_bytes as u64 };
    picture::decode(bytes, limits).map(picture::Picture::into_bytes).map_err(js_error)
}

/// An OpenEXR or Radiance map as [`map::Map::to_bytes`].
#[wasm_bindgen]
pub fn decode_map(bytes: &[u8]) -> JsResult<Vec<u8>> {
    map::decode(bytes).map(|map| map.to_bytes()).map_err(js_error)
}

/// Wavefront OBJ as `{glb, warnings}`; `resolve(name)` gives the bytes of a file beside it, or undefined.
#[wasm_bindgen]
pub fn convert_obj(bytes: &[u8], resolve: &Function) -> JsResult<JsValue> {
    let mut find = |name: &str| {
        let found = resolve.call1(&JsValue::NULL, &name.into()).ok()?;
        found.is_instance_of::<Uint8Array>().then(|| Uint8Array::new(&found).to_vec())
    };
    let obj::Converted { glb, warnings } = obj::to_glb(bytes, &mut find).map_err(js_error)?;
    let warnings: js_sys::Array = warnings.iter().map(|line| JsValue::from_str(line)).collect();
    Ok(object([("glb", Uint8Array::from(glb.as_slice()).into()), ("warnings", warnings.into())]))
}
