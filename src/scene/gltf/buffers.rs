//! Buffers and buffer views.

use super::container::Document;
use super::decoders::MESHOPT;
use super::{MAX_BUFFER_BYTES, Resolve, uri};
use crate::error::Result;
use gltf::json::buffer::View;
use restir_decoders::meshopt;
use serde_json::Value;
use std::borrow::Cow;
use std::collections::HashMap;

/// The bytes of every buffer.
pub(super) struct Buffers<'a> {
    /// Each file and data URI once, and the BIN chunk.
    sources: Vec<Cow<'a, [u8]>>,
    /// Index in `sources` and `byteLength` of each buffer; none for one that only holds the place of decompressed data.
    buffers: Vec<Option<(usize, u64)>>,
    /// The decompressed bytes of each buffer view that is compressed.
    decompressed: HashMap<usize, Vec<u8>>,
}

impl<'a> Buffers<'a> {
    /// Reads every buffer: the BIN chunk, data URIs and external files.
    pub fn load(document: &Document<'a>, resolve: Resolve) -> Result<Self> {
        let declared = document.root.buffers.iter().fold(0u64, |sum, buffer| sum.saturating_add(buffer.byte_length.0));
        document.within("its buffers", declared, MAX_BUFFER_BYTES, "bytes")?;
        let mut loaded = Buffers {
            sources: Vec::new(),
            buffers: Vec::with_capacity(document.root.buffers.len()),
            decompressed: HashMap::new(),
        };
        let mut known: HashMap<Option<&str>, usize> = HashMap::new();
        // A file may be longer than the buffer that names it.
        let mut fetched = 0u64;
        for (index, buffer) in document.root.buffers.iter().enumerate() {
            let place = format!("buffers[{index}]");
            let uri = buffer.uri.as_deref();
            let extension = buffer.extensions.as_ref().and_then(|extensions| meshopt(&extensions.others));
            let is_fallback = extension.is_some_and(|extension| extension["fallback"] == true);
            let has_no_bytes = uri.is_none() && (index > 0 || document.binary.is_none());
            if is_fallback || (has_no_bytes && MESHOPT.iter().any(|name| document.uses(name))) {
                loaded.buffers.push(None);
                continue;
            }
            let source = match (known.get(&uri), uri, document.binary) {
                (Some(&source), Some(_), _) => source,
                (_, Some(uri), _) => {
                    let mut bytes = uri::fetch(document, &format!("{place}.uri"), uri, resolve)?;
                    bytes.shrink_to_fit();
                    fetched = fetched.saturating_add(bytes.len() as u64);
                    document.within("its buffers", fetched, MAX_BUFFER_BYTES, "bytes")?;
                    loaded.add(Cow::Owned(bytes))
                }
                (_, None, Some(binary)) if index == 0 => loaded.add(Cow::Borrowed(binary)),
                (_, None, _) => return Err(document.bad(place, "it has no uri and there is no binary chunk for it")),
            };
            known.insert(uri, source);
            let (length, available) = (buffer.byte_length.0, loaded.sources.get(source).map_or(0, |bytes| bytes.len()));
            if length > available as u64 {
                let what = format!("it says {length} bytes, but there are {available}");
                return Err(document.bad(format!("{place}.byteLength"), what));
            }
            loaded.buffers.push(Some((source, length)));
        }
        loaded.decompress(document)?;
        Ok(loaded)
    }

    /// Decompresses the buffer views that EXT_meshopt_compression or KHR_meshopt_compression describe.
    fn decompress(&mut self, document: &Document) -> Result<()> {
        let mut total = 0u64;
        for (index, view) in document.root.buffer_views.iter().enumerate() {
            let extension = view.extensions.as_ref().and_then(|extensions| meshopt(&extensions.others));
            let Some(extension) = extension else { continue };
            let place = format!("bufferViews[{index}] (meshopt)");
            total = total.saturating_add(view.byte_length.0);
            document.within("its decompressed buffers", total, MAX_BUFFER_BYTES, "bytes")?;
            let bytes = self.decompressed_view(document, view, extension, &place)?;
            self.decompressed.insert(index, bytes);
        }
        Ok(())
    }

    /// One of them: as long as the view says.
    fn decompressed_view(&self, document: &Document, view: &View, extension: &Value, place: &str) -> Result<Vec<u8>> {
        let number = |name: &str, default: Option<u64>| {
            let value = extension.get(name).map_or(default, Value::as_u64);
            value.ok_or_else(|| document.bad(place, format!("its {name} is no whole number")))
        };
        let (buffer, offset) = (number("buffer", None)?, number("byteOffset", Some(0))?);
        let (length, stride, count) =
            (number("byteLength", None)?, number("byteStride", None)?, number("count", None)?);
        if count.checked_mul(stride) != Some(view.byte_length.0) {
            let what = format!("{count} elements of {stride} bytes are not the {} of the view", view.byte_length.0);
            return Err(document.bad(place, what));
        }
        let buffer = usize::try_from(buffer).unwrap_or(usize::MAX);
        let source = self.buffer(document, buffer, place)?;
        let compressed = range(source, offset, length).ok_or_else(|| {
            let what = format!("bytes {offset} + {length} lie outside the {} of its buffer", source.len());
            document.bad(place, what)
        })?;
        let mode = extension.get("mode").and_then(Value::as_str).unwrap_or_default();
        let filter = extension.get("filter").map_or("NONE", |filter| filter.as_str().unwrap_or_default());
        // Both fit: their product is within the limit of all buffers.
        document.decode(place, || {
            let layout = meshopt::Layout::new(mode, filter, count as usize, stride as usize)?;
            meshopt::decode(compressed, &layout)
        })
    }

    /// The bytes of buffer `index`.
    fn buffer(&self, document: &Document, index: usize, place: &str) -> Result<&[u8]> {
        let Some((source, size)) = document.at(&self.buffers, index, "buffers", place)? else {
            return Err(document.bad(place, format!("buffers[{index}] only stands for decompressed data")));
        };
        Ok(self.sources.get(*source).and_then(|bytes| range(bytes, 0, *size)).unwrap_or_default())
    }

    /// Keeps `bytes`; returns their index.
    fn add(&mut self, bytes: Cow<'a, [u8]>) -> usize {
        self.sources.push(bytes);
        self.sources.len() - 1
    }

    /// The bytes of buffer view `index` and its stride, if it has one.
    pub fn view(&self, document: &Document, index: usize, place: &str) -> Result<(&[u8], Option<usize>)> {
        let view = document.at(&document.root.buffer_views, index, "bufferViews", place)?;
        let place = format!("bufferViews[{index}]");
        let stride = view.byte_stride.map(|stride| stride.0);
        if let Some(bytes) = self.decompressed.get(&index) {
            return Ok((bytes, stride));
        }
        let buffer = self.buffer(document, view.buffer.value(), &place)?;
        let (offset, length) = (view.byte_offset.unwrap_or_default().0, view.byte_length.0);
        let bytes = range(buffer, offset, length).ok_or_else(|| {
            let what = format!("bytes {offset} + {length} lie outside the {} of its buffer", buffer.len());
            document.bad(&place, what)
        })?;
        Ok((bytes, stride))
    }
}

/// The extension of a compressed buffer or view.
fn meshopt(extensions: &serde_json::Map<String, Value>) -> Option<&Value> {
    MESHOPT.iter().find_map(|name| extensions.get(*name))
}

/// `length` bytes from `offset`, if they exist.
pub(super) fn range(bytes: &[u8], offset: u64, length: u64) -> Option<&[u8]> {
    let end = usize::try_from(offset.checked_add(length)?).ok()?;
    bytes.get(usize::try_from(offset).ok()?..end)
}
