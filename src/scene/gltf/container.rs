//! From bytes to typed JSON: the GLB container, the JSON itself, the version and the required extensions.

use super::decoders::DECODED_EXTENSIONS;
use super::{Contents, Options, SUPPORTED_EXTENSIONS, tidy};
use crate::error::{Error, Result};
use gltf::json::{Root, validation::Checked};
use serde_json::Value;

/// Most JSON objects in a file: each may take a kilobyte once parsed.
const MAX_JSON_OBJECTS: u64 = 1 << 20;
/// Most JSON values outside of objects' own count.
const MAX_JSON_VALUES: u64 = 1 << 23;

/// A parsed file: its name, its JSON and its binary chunk.
pub(super) struct Document<'a> {
    /// The file as the caller named it.
    pub file: &'a str,
    /// Parsed but not validated: indices may point nowhere.
    pub root: Root,
    /// The BIN chunk of a GLB.
    pub binary: Option<&'a [u8]>,
    /// What can be chosen in the file.
    pub contents: Contents,
    /// Index of the chosen scene, if one was chosen.
    pub scene: Option<usize>,
    /// Index of the chosen variant, if one was chosen.
    pub variant: Option<usize>,
    /// Whether the file names one of [`DECODED_EXTENSIONS`].
    pub uses_decoded_extensions: bool,
    /// Channels of animations that target no node, and were taken out of `root`.
    pub pointers: Vec<Pointer>,
}

/// A channel that targets a property by its JSON pointer (KHR_animation_pointer), not a node.
pub(super) struct Pointer {
    /// Index of the animation.
    pub animation: usize,
    /// Where the channel stands in the file.
    pub place: String,
    /// Index of the sampler.
    pub sampler: Option<usize>,
    /// The pointer; empty where there is none.
    pub path: String,
}

impl Document<'_> {
    /// An [`Error::BadFile`] in this file.
    pub fn bad(&self, place: impl Into<String>, what: impl Into<String>) -> Error {
        Error::bad_file(self.file, place, what)
    }

    /// `amount` if it is at most `limit`.
    pub fn within(&self, what: &str, amount: u64, limit: u64, unit: &'static str) -> Result<()> {
        if amount <= limit {
            return Ok(());
        }
        Err(Error::Limit { what: format!("{}: {what}", self.file), wanted: amount, had: limit, unit })
    }

    /// The value of an enumerated JSON property.
    pub fn valid<T: Copy>(&self, value: &Checked<T>, place: &str) -> Result<T> {
        match value {
            Checked::Valid(value) => Ok(*value),
            Checked::Invalid => Err(self.bad(place, "is none of the values that the specification lists")),
        }
    }

    /// The element of `list` at `index`, or an error that says what is missing.
    pub fn at<'l, T>(&self, list: &'l [T], index: usize, kind: &str, place: &str) -> Result<&'l T> {
        list.get(index)
            .ok_or_else(|| self.bad(place, format!("{kind}[{index}] does not exist: there are {}", list.len())))
    }

    /// Whether the file says that it uses `extension`.
    pub fn uses(&self, extension: &str) -> bool {
        let root = &self.root;
        root.extensions_used.iter().chain(&root.extensions_required).any(|name| name == extension)
    }

    /// `values` if all are finite.
    pub fn finite<const N: usize>(&self, values: [f32; N], place: &str) -> Result<[f32; N]> {
        if values.iter().all(|value| value.is_finite()) {
            return Ok(values);
        }
        Err(self.bad(place, "is too large for a 32-bit float"))
    }
}

/// The JSON, the binary chunk of a .glb, and the header.
type Opened<'a> = (&'a [u8], Option<&'a [u8]>, Header);

/// The JSON, the BIN chunk if there is one, and the checked header.
fn open<'a>(file: &str, bytes: &'a [u8]) -> Result<Opened<'a>> {
    let (json, binary) = if bytes.starts_with(b"glTF") { split_glb(file, bytes)? } else { (bytes, None) };
    check_json_size(file, json)?;
    let header = check_header(file, json)?;
    Ok((json, binary, header))
}

/// What can be chosen in a file.
pub(super) fn contents(file: &str, bytes: &[u8]) -> Result<Contents> {
    open(file, bytes).map(|(_, _, header)| header.contents())
}

/// Splits, parses and checks version, extensions and what was chosen.
pub(super) fn parse<'a>(file: &'a str, bytes: &'a [u8], options: &Options<'a>) -> Result<Document<'a>> {
    let (json, binary, header) = open(file, bytes)?;
    let contents = header.contents();
    if let Some(scene) = options.scene.filter(|&scene| scene >= contents.scenes.len()) {
        let what = format!("{file} has no scene {scene}: there are {}", contents.scenes.len());
        return Err(Error::bad_value("scene-index", what));
    }
    let variant = options.variant.map(|name| {
        let unknown = || Error::Unknown { kind: "variant", name: tidy(name), known: contents.variants.join(", ") };
        contents.variants.iter().position(|known| known == name).ok_or_else(unknown)
    });
    let variant = variant.transpose()?;
    let pointers = header.pointers();
    let root = if pointers.is_empty() && header.scenes.iter().all(|scene| scene.nodes.is_some()) {
        serde_json::from_slice(json).map_err(|error| json_error(file, &error))?
    } else {
        // By way of text: a second deserializer, of values, would add a tenth to what the page downloads.
        let completed = serde_json::from_slice(json).and_then(|json| serde_json::to_vec(&completed(json)));
        let completed = completed.map_err(|error| json_error(file, &error))?;
        // Lines and columns of that text are not the file's.
        serde_json::from_slice(&completed).map_err(|error| Error::bad_file(file, "JSON", json_fault(&error)))?
    };
    let scene = options.scene;
    let uses_decoded_extensions = header.uses_decoded_extensions();
    Ok(Document { file, root, binary, contents, scene, variant, uses_decoded_extensions, pointers })
}

/// Gives each scene its `nodes`, which the specification lets it leave out, but the JSON crate does not; and takes away
/// the channels of animations that target no node, which extensions let leave it out.
fn completed(mut json: Value) -> Value {
    let scenes = json.get_mut("scenes").and_then(Value::as_array_mut);
    for scene in scenes.into_iter().flatten().filter_map(Value::as_object_mut) {
        scene.entry("nodes").or_insert_with(|| Value::Array(Vec::new()));
    }
    let animations = json.get_mut("animations").and_then(Value::as_array_mut);
    for animation in animations.into_iter().flatten() {
        if let Some(channels) = animation.get_mut("channels").and_then(Value::as_array_mut) {
            channels.retain(|channel| channel.get("target").is_some_and(|target| target.get("node").is_some()));
        }
    }
    json
}

/// Little-endian u32 at `offset`.
fn u32_at(bytes: &[u8], offset: usize) -> Option<u32> {
    let bytes = bytes.get(offset..offset.checked_add(4)?)?;
    Some(u32::from_le_bytes(bytes.try_into().ok()?))
}

/// The JSON chunk and the BIN chunk of binary glTF (specification, section 4). Chunks of other types are skipped.
fn split_glb<'a>(file: &str, bytes: &'a [u8]) -> Result<(&'a [u8], Option<&'a [u8]>)> {
    let bad = |place: String, what: String| Error::bad_file(file, place, what);
    let (Some(version), Some(length)) = (u32_at(bytes, 4), u32_at(bytes, 8)) else {
        return Err(bad("GLB header".into(), format!("the file ends after {} of 12 bytes", bytes.len())));
    };
    if version != 2 {
        return Err(Error::Unsupported { file: file.into(), what: format!("GLB version {version}") });
    }
    let length = length as usize;
    let Some(contents) = bytes.get(12..length) else {
        let what = format!("it says that the file has {length} bytes, but it has {}", bytes.len());
        return Err(bad("GLB header".into(), what));
    };
    let (mut json, mut binary) = (None, None);
    let mut rest = contents;
    while !rest.is_empty() {
        let place = format!("chunk at byte {}", length - rest.len());
        let (Some(size), Some(kind)) = (u32_at(rest, 0), rest.get(4..8)) else {
            return Err(bad(place, format!("{} bytes are too few for a chunk header", rest.len())));
        };
        let available = rest.len() - 8;
        let Some(chunk) = rest.get(8..).and_then(|body| body.get(..size as usize)) else {
            return Err(bad(place, format!("it says that it has {size} bytes, but {available} are left")));
        };
        match kind {
            b"JSON" if json.is_none() => json = Some(chunk),
            b"BIN\0" if json.is_some() && binary.is_none() => binary = Some(chunk),
            _ if json.is_none() => return Err(bad(place, "the first chunk is not JSON".into())),
            _ => {}
        }
        rest = rest.get(8 + size as usize..).unwrap_or_default();
    }
    let json = json.ok_or_else(|| bad("GLB header".into(), "there is no JSON chunk".into()))?;
    Ok((json, binary))
}

/// Bounds what parsing can allocate: a few bytes of JSON such as `{},` become a kilobyte of structs.
fn check_json_size(file: &str, json: &[u8]) -> Result<()> {
    let (mut objects, mut values, mut in_string, mut escaped) = (0u64, 0u64, false, false);
    for &byte in json {
        if in_string {
            in_string = escaped || byte != b'"';
            escaped = !escaped && byte == b'\\';
            continue;
        }
        match byte {
            b'"' => in_string = true,
            b'{' => objects += 1,
            b',' => values += 1,
            _ => {}
        }
    }
    for (what, amount, limit) in [("objects", objects, MAX_JSON_OBJECTS), ("values", values, MAX_JSON_VALUES)] {
        if amount > limit {
            return Err(Error::Limit { what: format!("{file}: its JSON"), wanted: amount, had: limit, unit: what });
        }
    }
    Ok(())
}

/// The part of the JSON that says whether the rest can be understood; read first, so that a file which needs more than
/// this loader has is refused for that reason and not for what the missing extension leaves out.
#[derive(serde::Deserialize)]
struct Header {
    asset: Asset,
    #[serde(default, rename = "extensionsRequired")]
    extensions_required: Vec<String>,
    #[serde(default, rename = "extensionsUsed")]
    extensions_used: Vec<String>,
    #[serde(default)]
    scene: usize,
    #[serde(default)]
    scenes: Vec<SceneHeader>,
    #[serde(default)]
    extensions: Extensions,
    #[serde(default)]
    animations: Vec<AnimationHeader>,
}

/// One of `animations` of [`Header`].
#[derive(serde::Deserialize)]
struct AnimationHeader {
    #[serde(default)]
    channels: Vec<ChannelHeader>,
}

/// One of `channels` of [`AnimationHeader`].
#[derive(serde::Deserialize)]
struct ChannelHeader {
    sampler: Option<usize>,
    target: TargetHeader,
}

/// `target` of [`ChannelHeader`].
#[derive(serde::Deserialize)]
struct TargetHeader {
    node: Option<serde::de::IgnoredAny>,
    #[serde(default)]
    extensions: TargetExtensions,
}

/// `extensions` of [`TargetHeader`].
#[derive(Default, serde::Deserialize)]
struct TargetExtensions {
    #[serde(default, rename = "KHR_animation_pointer")]
    pointer: PointerHeader,
}

/// KHR_animation_pointer of [`TargetExtensions`].
#[derive(Default, serde::Deserialize)]
struct PointerHeader {
    #[serde(default)]
    pointer: String,
}

/// One of `scenes` of [`Header`].
#[derive(serde::Deserialize)]
struct SceneHeader {
    nodes: Option<serde::de::IgnoredAny>,
    name: Option<String>,
}

/// `extensions` of [`Header`].
#[derive(Default, serde::Deserialize)]
struct Extensions {
    #[serde(default, rename = "KHR_materials_variants")]
    variants: Variants,
}

/// KHR_materials_variants of [`Extensions`].
#[derive(Default, serde::Deserialize)]
struct Variants {
    #[serde(default)]
    variants: Vec<Variant>,
}

/// One of [`Variants`].
#[derive(serde::Deserialize)]
struct Variant {
    name: String,
}

impl Header {
    /// What can be chosen. Text is made fit for a line; a variant is asked for by that.
    fn contents(&self) -> Contents {
        let name = |(index, scene): (usize, &SceneHeader)| {
            scene.name.as_deref().map_or_else(|| format!("scene {index}"), tidy)
        };
        Contents {
            scenes: self.scenes.iter().enumerate().map(name).collect(),
            scene: self.scene,
            variants: self.extensions.variants.variants.iter().map(|variant| tidy(&variant.name)).collect(),
        }
    }

    /// The channels that target no node.
    fn pointers(&self) -> Vec<Pointer> {
        let mut pointers = Vec::new();
        for (animation, AnimationHeader { channels }) in self.animations.iter().enumerate() {
            let others = channels.iter().enumerate().filter(|(_, channel)| channel.target.node.is_none());
            pointers.extend(others.map(|(position, channel)| Pointer {
                animation,
                place: format!("animations[{animation}].channels[{position}]"),
                sampler: channel.sampler,
                path: channel.target.extensions.pointer.pointer.clone(),
            }));
        }
        pointers
    }

    fn uses_decoded_extensions(&self) -> bool {
        let mut used = self.extensions_used.iter().chain(&self.extensions_required);
        used.any(|name| DECODED_EXTENSIONS.contains(&name.as_str()))
    }
}

/// `asset` of [`Header`].
#[derive(serde::Deserialize)]
struct Asset {
    version: String,
    #[serde(rename = "minVersion")]
    min_version: Option<String>,
}

/// Refuses other versions than 2.0 and extensions that are required but not supported.
fn check_header(file: &str, json: &[u8]) -> Result<Header> {
    // Of an array the parser would take the elements for the fields.
    if json.trim_ascii_start().first() == Some(&b'[') {
        return Err(Error::bad_file(file, "JSON", "it is a list instead of an object"));
    }
    let header: Header = serde_json::from_slice(json).map_err(|error| json_error(file, &error))?;
    let unsupported = |what: String| Err(Error::Unsupported { file: file.into(), what });
    // A later minor version is readable unless it says otherwise in minVersion (specification, section 3.2).
    let needed = header
        .asset
        .min_version
        .as_deref()
        .unwrap_or_else(|| if header.asset.version.starts_with("2.") { "2.0" } else { &header.asset.version });
    if needed != "2.0" {
        return unsupported(format!("glTF version {}", tidy(needed)));
    }
    match header.extensions_required.iter().find(|name| !SUPPORTED_EXTENSIONS.contains(&name.as_str())) {
        Some(name) => unsupported(format!("required extension {}", tidy(name))),
        None => Ok(header),
    }
}

/// A JSON error with its line and column, where they are known, as the place.
fn json_error(file: &str, error: &serde_json::Error) -> Error {
    let place = match error.line() {
        0 => "JSON".to_owned(),
        line => format!("JSON line {line} column {}", error.column()),
    };
    Error::bad_file(file, place, json_fault(error))
}

/// What a JSON error says, without where.
fn json_fault(error: &serde_json::Error) -> String {
    let text = error.to_string();
    tidy(text.rsplit_once(" at line ").map_or(text.as_str(), |(what, _)| what))
}
