//! Builds small glTF files in memory.

use serde_json::{Value, json};

/// JSON and one binary buffer in the making.
pub struct Writer {
    /// The JSON, free to be changed before it is written.
    pub json: Value,
    binary: Vec<u8>,
}

/// Component types of accessors.
pub const U8: u32 = 5121;
pub const U16: u32 = 5123;
pub const U32: u32 = 5125;
pub const F32: u32 = 5126;

impl Writer {
    /// `json` with the asset, and whatever else `parts` has.
    pub fn new(parts: Value) -> Self {
        let mut json = json!({"asset": {"version": "2.0"}, "bufferViews": [], "accessors": []});
        for (key, value) in parts.as_object().unwrap() {
            json[key] = value.clone();
        }
        Writer { json, binary: Vec::new() }
    }

    /// Appends a buffer view; returns its index.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        let offset = self.binary.len();
        self.binary.extend_from_slice(bytes);
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        self.push("bufferViews", json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}))
    }

    /// Appends an accessor over a view of its own; returns its index.
    pub fn accessor(&mut self, kind: &str, component: u32, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        let normalized = component != F32 && kind != "SCALAR";
        self.push(
            "accessors",
            json!({"bufferView": view, "type": kind, "componentType": component, "count": count,
                   "normalized": normalized}),
        )
    }

    /// Appends an accessor of f32; returns its index.
    pub fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let width = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            _ => 4,
        };
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.accessor(kind, F32, values.len() / width, &bytes)
    }

    /// Appends an accessor of u16 indices; returns its index.
    pub fn indices(&mut self, values: &[u16]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.accessor("SCALAR", U16, values.len(), &bytes)
    }

    /// Appends to a list of the JSON; returns the index.
    pub fn push(&mut self, list: &str, value: Value) -> usize {
        if self.json[list].is_null() {
            self.json[list] = json!([]);
        }
        let list = self.json[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    /// Binary glTF.
    pub fn glb(mut self) -> Vec<u8> {
        if !self.binary.is_empty() && self.json["buffers"].is_null() {
            self.json["buffers"] = json!([{"byteLength": self.binary.len()}]);
        }
        glb(self.json.to_string().as_bytes(), &self.binary)
    }

    /// JSON glTF whose buffer is `uri`, and that buffer.
    pub fn gltf(mut self, uri: &str) -> (Vec<u8>, Vec<u8>) {
        self.json["buffers"] = json!([{"byteLength": self.binary.len(), "uri": uri}]);
        (self.json.to_string().into_bytes(), self.binary)
    }
}

/// A GLB container of a JSON and a BIN chunk.
pub fn glb(json: &[u8], binary: &[u8]) -> Vec<u8> {
    let mut json = json.to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut chunks = Vec::new();
    for (kind, bytes) in [(b"JSON", &json[..]), (b"BIN\0", binary)] {
        if !bytes.is_empty() {
            chunks.extend((bytes.len() as u32).to_le_bytes());
            chunks.extend(kind);
            chunks.extend(bytes);
        }
    }
    let mut file = b"glTF".to_vec();
    file.extend(2u32.to_le_bytes());
    file.extend((12 + chunks.len() as u32).to_le_bytes());
    file.extend(chunks);
    file
}

/// RFC 4648 base64 with padding.
pub fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for group in bytes.chunks(3) {
        let bits = group.iter().enumerate().fold(0u32, |bits, (i, &byte)| bits | u32::from(byte) << (16 - 8 * i));
        for i in 0..4 {
            let symbol = ALPHABET[(bits >> (18 - 6 * i)) as usize & 63];
            text.push(if i <= group.len() { symbol as char } else { '=' });
        }
    }
    text
}

/// An RGBA8 image as a PNG or JPEG file.
pub fn image_file(width: u32, height: u32, rgba: &[u8], format: image::ImageFormat) -> Vec<u8> {
    let picture = image::RgbaImage::from_raw(width, height, rgba.to_vec()).unwrap();
    let mut file = std::io::Cursor::new(Vec::new());
    let picture = image::DynamicImage::from(picture);
    if format == image::ImageFormat::Jpeg {
        picture.into_rgb8().write_to(&mut file, format).unwrap();
    } else {
        picture.write_to(&mut file, format).unwrap();
    }
    file.into_inner()
}
