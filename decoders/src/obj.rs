//! Wavefront OBJ with its MTL, converted to binary glTF: so there is one loader, with one set of checks.
//!
//! How a material becomes metallic-roughness is written in docs/formats.md.

use crate::{Result, broken};
use serde_json::{Map, Value, json};
use std::cell::RefCell;
use std::collections::HashMap;
use std::io::Cursor;
use std::path::Path;
use tobj::{LoadError, LoadOptions, Material, Mesh, Model};

/// Reads a file beside the OBJ by its name in it; none where there is none.
pub type Resolve<'r> = &'r mut dyn FnMut(&str) -> Option<Vec<u8>>;

/// A converted file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Converted {
    /// Binary glTF; its images are URIs beside the OBJ.
    pub glb: Vec<u8>,
    /// What was left out: one line each.
    pub warnings: Vec<String>,
}

/// What follows a byte order mark, which some editors write; else the first line would be no line of OBJ.
fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

/// Converts an OBJ file; `resolve` is asked for its material libraries.
///
/// # Errors
/// [`Fault::Broken`](crate::Fault::Broken) for what cannot be parsed and for indices out of range.
pub fn to_glb(bytes: &[u8], resolve: Resolve) -> Result<Converted> {
    let resolve = RefCell::new(resolve);
    let warnings = RefCell::new(Vec::new());
    // Comments and names may be in any encoding; numbers are not.
    if bytes.contains(&0) {
        return Err(broken("OBJ: it is not text"));
    }
    let text = String::from_utf8_lossy(without_mark(bytes));
    check_indices(&text)?;
    let library = |path: &Path| {
        let name = path.to_string_lossy().replace('\\', "/");
        let bytes = (resolve.borrow_mut())(&name);
        let loaded = bytes
            .ok_or(LoadError::OpenFileFailed)
            .and_then(|mtl| tobj::load_mtl_buf(&mut Cursor::new(whole_colours(without_mark(&mtl)))));
        if let Err(error) = &loaded {
            let why = if *error == LoadError::OpenFileFailed { "it was not found".into() } else { error.to_string() };
            warnings.borrow_mut().push(format!("material library {}: {why}; its materials are grey", tidy(&name)));
        }
        loaded
    };
    let options = LoadOptions { triangulate: true, single_index: true, ignore_points: true, ignore_lines: true };
    let loaded = tobj::load_obj_buf(&mut Cursor::new(text.as_bytes()), &options, library);
    let (models, materials) = loaded.map_err(|error| broken(format!("OBJ: {error}")))?;

    let mut writer = Writer::default();
    let mut converter = Materials { json: Vec::new(), textures: Vec::new(), images: Vec::new(), known: HashMap::new() };
    for material in materials.unwrap_or_default() {
        let converted = converter.material(&material, &mut warnings.borrow_mut())?;
        converter.json.push(converted);
    }
    for Model { mesh, name } in &models {
        writer.mesh(mesh, name)?;
    }
    let nodes: Vec<Value> = (0..writer.meshes.len()).map(|mesh| json!({"mesh": mesh})).collect();
    let mut root = json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": (0..nodes.len()).collect::<Vec<_>>()}],
        "extensionsUsed": EXTENSIONS,
    });
    let lists = [
        ("nodes", nodes),
        ("meshes", writer.meshes),
        ("accessors", writer.accessors),
        ("bufferViews", writer.views),
        ("materials", converter.json),
        ("textures", converter.textures),
        ("images", converter.images),
    ];
    for (name, list) in lists {
        if !list.is_empty() {
            root[name] = Value::Array(list);
        }
    }
    if !writer.binary.is_empty() {
        root["buffers"] = json!([{"byteLength": writer.binary.len()}]);
    }
    Ok(Converted { glb: glb(root.to_string().into_bytes(), &writer.binary)?, warnings: warnings.into_inner() })
}

/// Refuses indices that do not fit in 32 bits: `tobj` multiplies them before it compares them.
fn check_indices(text: &str) -> Result<()> {
    for (line, number) in text.lines().zip(1..) {
        let mut words = line.split_whitespace();
        if !matches!(words.next(), Some("f" | "l" | "p")) {
            continue;
        }
        let absurd = |index: &str| {
            index.parse::<i64>().map_or(index.len() > 18, |index| index.unsigned_abs() > u64::from(u32::MAX))
        };
        if let Some(index) = words.flat_map(|corner| corner.split('/')).find(|index| absurd(index)) {
            return Err(broken(format!("OBJ: line {number}: {} is no index", tidy(index))));
        }
    }
    Ok(())
}

/// Material text in which every colour has three numbers, for which `tobj` waits: those left out are as the last one
/// (MTL specification: "if only r is specified, then g and b are assumed to be equal to r").
fn whole_colours(mtl: &[u8]) -> String {
    let mut out = String::with_capacity(mtl.len());
    for line in String::from_utf8_lossy(mtl).lines() {
        let words: Vec<&str> = line.split_whitespace().take(4).collect();
        match (words.first(), words.last()) {
            (Some(&("Ka" | "Kd" | "Ks" | "Ke")), Some(last)) if words.len() < 4 => {
                out.push_str(&words.join(" "));
                (words.len()..4).for_each(|_| out.extend([" ", last]));
            }
            _ => out.push_str(line),
        }
        out.push('\n');
    }
    out
}

/// What converted materials may use.
const EXTENSIONS: [&str; 4] =
    ["KHR_materials_emissive_strength", "KHR_materials_ior", "KHR_materials_transmission", "KHR_texture_transform"];

/// The binary chunk in the making, and what describes it.
#[derive(Default)]
struct Writer {
    binary: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
}

impl Writer {
    /// Appends an accessor over 32-bit values; returns its index.
    fn accessor(&mut self, kind: &str, component: u32, width: usize, values: impl Iterator<Item = [u8; 4]>) -> usize {
        let offset = self.binary.len();
        self.binary.extend(values.flatten());
        let length = self.binary.len() - offset;
        self.views.push(json!({"buffer": 0, "byteOffset": offset, "byteLength": length}));
        let count = length / 4 / width;
        self.accessors.push(
            json!({"bufferView": self.views.len() - 1, "type": kind, "componentType": component, "count": count}),
        );
        self.accessors.len() - 1
    }

    fn floats(&mut self, kind: &str, width: usize, values: impl Iterator<Item = f32>) -> usize {
        self.accessor(kind, 5126, width, values.map(f32::to_le_bytes))
    }

    /// Appends a mesh, unless it has no triangles.
    fn mesh(&mut self, mesh: &Mesh, name: &str) -> Result<()> {
        if mesh.indices.is_empty() {
            return Ok(());
        }
        let vertices = mesh.positions.len() / 3;
        if mesh.indices.iter().any(|&index| index as usize >= vertices) {
            return Err(broken(format!("OBJ: {}: an index is out of range", tidy(name))));
        }
        let mut attributes = Map::new();
        let mut add = |name: &str, accessor: usize| attributes.insert(name.into(), accessor.into());
        add("POSITION", self.floats("VEC3", 3, mesh.positions.iter().copied()));
        // Where only some faces have them, tobj leaves them out of the list, and they cannot be told apart.
        if mesh.normals.len() == vertices * 3 {
            add("NORMAL", self.floats("VEC3", 3, mesh.normals.iter().copied()));
        }
        if mesh.texcoords.len() == vertices * 2 {
            // v runs upwards in OBJ, downwards in glTF.
            let uvs = mesh.texcoords.as_chunks::<2>().0.iter().flat_map(|[u, v]| [*u, 1.0 - v]);
            add("TEXCOORD_0", self.floats("VEC2", 2, uvs));
        }
        if mesh.vertex_color.len() == vertices * 3 {
            add("COLOR_0", self.floats("VEC3", 3, mesh.vertex_color.iter().copied()));
        }
        let indices = self.accessor("SCALAR", 5125, 1, mesh.indices.iter().map(|index| index.to_le_bytes()));
        let mut primitive = json!({"attributes": attributes, "indices": indices});
        if let Some(material) = mesh.material_id {
            primitive["material"] = material.into();
        }
        self.meshes.push(json!({"name": tidy(name), "primitives": [primitive]}));
        Ok(())
    }
}

/// Materials in the making; each image stands once.
struct Materials {
    json: Vec<Value>,
    textures: Vec<Value>,
    images: Vec<Value>,
    known: HashMap<String, usize>,
}

impl Materials {
    /// MTL to metallic-roughness (docs/formats.md).
    fn material(&mut self, mtl: &Material, warnings: &mut Vec<String>) -> Result<Value> {
        let place = format!("material {}", tidy(&mtl.name));
        let other = |names: &[&str]| names.iter().find_map(|name| mtl.unknown_param.get(*name)).map(String::as_str);
        let number = |names: &[&str]| {
            let value = other(names)?.split_whitespace().next()?.parse::<f32>().ok()?;
            value.is_finite().then_some(value)
        };
        let finite = |values: [f32; 3]| values.map(|value| if value.is_finite() { value.max(0.0) } else { 0.0 });
        let color = mtl.diffuse.map_or([if mtl.diffuse_texture.is_some() { 1.0 } else { 0.6 }; 3], finite);
        let opacity = mtl.dissolve.or_else(|| number(&["Tr"]).map(|transparency| 1.0 - transparency));
        let opacity = opacity.filter(|opacity| opacity.is_finite()).unwrap_or(1.0).clamp(0.0, 1.0);
        // Refracting illumination models are glass; others let dissolve mean coverage.
        let is_glass = matches!(mtl.illumination_model, Some(4 | 6 | 7 | 9));
        let transmission = if is_glass { 1.0 - opacity } else { 0.0 };
        let alpha = if is_glass { 1.0 } else { opacity };
        // The Phong exponent n whose lobe is as wide as the microfacet one of alpha: n = 2 / alpha^2 - 2 (Walter et al.
        // 2007, section 5.2), and alpha = roughness^2.
        let shininess = mtl.shininess.filter(|n| n.is_finite()).unwrap_or(0.0).max(0.0);
        let roughness = number(&["Pr"]).unwrap_or_else(|| (2.0 / (shininess + 2.0)).powf(0.25)).clamp(0.0, 1.0);
        let metallic = number(&["Pm"]).unwrap_or(0.0).clamp(0.0, 1.0);

        let mut pbr = json!({
            "baseColorFactor": [color[0].min(1.0), color[1].min(1.0), color[2].min(1.0), alpha],
            "metallicFactor": metallic,
            "roughnessFactor": roughness,
        });
        let mut material = json!({"name": mtl.name});
        let mut extensions = Map::new();
        if let Some(map) = &mtl.diffuse_texture {
            pbr["baseColorTexture"] = self.texture(map);
        }
        if alpha < 1.0 || mtl.dissolve_texture.is_some() {
            material["alphaMode"] = "BLEND".into();
        }
        let mut emission = mtl.emissive.map_or([0.0; 3], finite);
        if let Some(map) = other(&["map_Ke", "map_ke"]) {
            material["emissiveTexture"] = self.texture(map);
            if emission == [0.0; 3] {
                emission = [1.0; 3];
            }
        }
        let strength = emission.into_iter().fold(1.0, f32::max);
        if emission != [0.0; 3] {
            material["emissiveFactor"] = json!(emission.map(|channel| channel / strength));
            if strength > 1.0 {
                extensions.insert("KHR_materials_emissive_strength".into(), json!({"emissiveStrength": strength}));
            }
        }
        if let Some(map) = other(&["norm", "map_Norm", "map_norm"]).or(mtl.normal_texture.as_deref()) {
            let mut texture = self.texture(map);
            if let Some(scale) = statement(map).scale {
                texture["scale"] = json!(scale);
            }
            material["normalTexture"] = texture;
        }
        if let Some(ior) = mtl.optical_density.filter(|ior| (1.0..=10.0).contains(ior) && is_glass) {
            extensions.insert("KHR_materials_ior".into(), json!({"ior": ior}));
        }
        if transmission > 0.0 {
            extensions.insert("KHR_materials_transmission".into(), json!({"transmissionFactor": transmission}));
        }
        material["pbrMetallicRoughness"] = pbr;
        if !extensions.is_empty() {
            material["extensions"] = Value::Object(extensions);
        }
        let ignored = [
            ("map_Ks", mtl.specular_texture.is_some()),
            ("map_Ns", mtl.shininess_texture.is_some()),
            ("map_d", mtl.dissolve_texture.is_some() && mtl.dissolve_texture != mtl.diffuse_texture),
            ("map_Pr", other(&["map_Pr"]).is_some()),
            ("map_Pm", other(&["map_Pm"]).is_some()),
        ];
        for (name, _) in ignored.iter().filter(|(_, present)| *present) {
            warnings.push(format!("{place}: {name} is not used"));
        }
        Ok(material)
    }

    /// A textureInfo for a texture statement.
    fn texture(&mut self, text: &str) -> Value {
        let statement = statement(text);
        let uri = uri(statement.file);
        let next = self.textures.len();
        let index = *self.known.entry(uri.clone()).or_insert(next);
        if index == next {
            self.images.push(json!({"uri": uri}));
            self.textures.push(json!({"source": next, "name": tidy(statement.file)}));
        }
        let mut info = json!({"index": index});
        if statement.offset != [0.0; 2] || statement.tiling != [1.0; 2] {
            let ([ou, ov], [su, sv]) = (statement.offset, statement.tiling);
            // In OBJ's upward v, v' = sv v + ov; with v = 1 - w downward that is w' = sv w + 1 - sv - ov.
            let transform = json!({"offset": [ou, 1.0 - sv - ov], "scale": [su, sv]});
            info["extensions"] = json!({"KHR_texture_transform": transform});
        }
        info
    }
}

/// A texture statement: `-option values ... file`.
struct Statement<'a> {
    file: &'a str,
    /// `-bm`.
    scale: Option<f32>,
    /// `-o`, u and v.
    offset: [f32; 2],
    /// `-s`, u and v.
    tiling: [f32; 2],
}

/// Splits a texture statement. The file's name is what follows the last option, and may have spaces.
fn statement(text: &str) -> Statement<'_> {
    let mut found = Statement { file: text.trim(), scale: None, offset: [0.0; 2], tiling: [1.0; 2] };
    while let Some((option, rest)) = found.file.strip_prefix('-').and_then(|rest| rest.split_once(char::is_whitespace))
    {
        let most = match option {
            "o" | "s" | "t" => 3,
            "mm" => 2,
            _ => 1,
        };
        found.file = rest.trim_start();
        let mut numbers = Vec::new();
        for _ in 0..most {
            let Some((word, rest)) = found.file.split_once(char::is_whitespace) else { break };
            let number = word.parse::<f32>().ok().filter(|number| number.is_finite());
            // Of three numbers the last two may be left out.
            if number.is_none() && (most == 3 || word.starts_with('-')) {
                break;
            }
            numbers.extend(number);
            found.file = rest.trim_start();
        }
        let pair =
            |default: f32| [numbers.first().copied().unwrap_or(default), numbers.get(1).copied().unwrap_or(default)];
        match option {
            "bm" => found.scale = numbers.first().copied(),
            "o" => found.offset = pair(0.0),
            "s" => found.tiling = pair(1.0),
            _ => {}
        }
    }
    found
}

/// A file name as a relative URI.
fn uri(file: &str) -> String {
    let mut uri = String::new();
    for byte in file.replace('\\', "/").bytes() {
        if byte.is_ascii_alphanumeric() || b"/._-~".contains(&byte) {
            uri.push(char::from(byte));
        } else {
            uri.push_str(&format!("%{byte:02X}"));
        }
    }
    uri
}

/// Text from a file made fit for a line.
fn tidy(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).take(120).collect()
}

/// The container of binary glTF (specification, section 4).
fn glb(mut json: Vec<u8>, binary: &[u8]) -> Result<Vec<u8>> {
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = 12 + 8 + json.len() + if binary.is_empty() { 0 } else { 8 + binary.len() };
    let length = u32::try_from(length).map_err(|_| broken("OBJ: more than 4 GiB of geometry"))?;
    let mut out = Vec::with_capacity(length as usize);
    out.extend(b"glTF");
    out.extend(2u32.to_le_bytes());
    out.extend(length.to_le_bytes());
    out.extend((json.len() as u32).to_le_bytes());
    out.extend(b"JSON");
    out.extend(json);
    if !binary.is_empty() {
        out.extend((binary.len() as u32).to_le_bytes());
        out.extend(b"BIN\0");
        out.extend_from_slice(binary);
    }
    Ok(out)
}
