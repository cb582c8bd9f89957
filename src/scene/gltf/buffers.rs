//! Buffers and buffer views.

use super::container::Document;
use super::{MAX_BUFFER_BYTES, Resolve, uri};
use crate::error::Result;
use std::borrow::Cow;
use std::collections::HashMap;

/// The bytes of every buffer.
pub(super) struct Buffers<'a> {
    /// Each file and data URI once, and the BIN chunk.
    sources: Vec<Cow<'a, [u8]>>,
    /// Index in `sources` and `byteLength` of each buffer.
    buffers: Vec<(usize, u64)>,
}

impl<'a> Buffers<'a> {
    /// Reads every buffer: the BIN chunk, data URIs and external files.
    pub fn load(document: &Document<'a>, resolve: Resolve) -> Result<Self> {
        let declared = document.root.buffers.iter().fold(0u64, |sum, buffer| sum.saturating_add(buffer.byte_length.0));
        document.within("its buffers", declared, MAX_BUFFER_BYTES, "bytes")?;
        let mut loaded = Buffers { sources: Vec::new(), buffers: Vec::with_capacity(document.root.buffers.len()) };
        let mut known: HashMap<Option<&str>, usize> = HashMap::new();
        // A file may be longer than the buffer that names it.
        let mut fetched = 0u64;
        for (index, buffer) in document.root.buffers.iter().enumerate() {
            let place = format!("buffers[{index}]");
            let uri = buffer.uri.as_deref();
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
            loaded.buffers.push((source, length));
        }
        Ok(loaded)
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
        let &(source, size) = document.at(&self.buffers, view.buffer.value(), "buffers", &place)?;
        let buffer = self.sources.get(source).and_then(|bytes| range(bytes, 0, size)).unwrap_or_default();
        let (offset, length) = (view.byte_offset.unwrap_or_default().0, view.byte_length.0);
        let bytes = range(buffer, offset, length).ok_or_else(|| {
            let what = format!("bytes {offset} + {length} lie outside the {} of its buffer", buffer.len());
            document.bad(&place, what)
        })?;
        Ok((bytes, view.byte_stride.map(|stride| stride.0)))
    }
}

/// `length` bytes from `offset`, if they exist.
pub(super) fn range(bytes: &[u8], offset: u64, length: u64) -> Option<&[u8]> {
    let end = usize::try_from(offset.checked_add(length)?).ok()?;
    bytes.get(usize::try_from(offset).ok()?..end)
}
