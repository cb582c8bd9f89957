//! Buffers and buffer views.

use super::container::Document;
use super::{MAX_BUFFER_BYTES, Resolve, uri};
use crate::error::Result;
use std::borrow::Cow;

/// The bytes of every buffer, each exactly `byteLength` long.
pub(super) struct Buffers<'a>(Vec<Cow<'a, [u8]>>);

impl<'a> Buffers<'a> {
    /// Reads every buffer: the BIN chunk, data URIs and external files.
    pub fn load(document: &Document<'a>, resolve: Resolve) -> Result<Self> {
        let total = document.root.buffers.iter().fold(0u64, |sum, buffer| sum.saturating_add(buffer.byte_length.0));
        document.within("its buffers", total, MAX_BUFFER_BYTES, "bytes")?;
        let mut buffers = Vec::with_capacity(document.root.buffers.len());
        for (index, buffer) in document.root.buffers.iter().enumerate() {
            let place = format!("buffers[{index}]");
            let mut bytes = match (&buffer.uri, document.binary) {
                (Some(uri), _) => Cow::Owned(uri::fetch(document, &format!("{place}.uri"), uri, resolve)?),
                (None, Some(binary)) if index == 0 => Cow::Borrowed(binary),
                (None, _) => return Err(document.bad(place, "it has no uri and there is no binary chunk for it")),
            };
            let length = buffer.byte_length.0 as usize;
            if bytes.len() < length {
                let what = format!("it says {length} bytes, but there are {}", bytes.len());
                return Err(document.bad(format!("{place}.byteLength"), what));
            }
            match &mut bytes {
                Cow::Owned(bytes) => {
                    bytes.truncate(length);
                    // A small buffer at the start of a large file shall not keep all of it.
                    bytes.shrink_to_fit();
                }
                Cow::Borrowed(slice) => *slice = slice.get(..length).unwrap_or_default(),
            }
            buffers.push(bytes);
        }
        Ok(Buffers(buffers))
    }

    /// The bytes of buffer view `index` and its stride, if it has one.
    pub fn view(&self, document: &Document, index: usize, place: &str) -> Result<(&[u8], Option<usize>)> {
        let view = document.at(&document.root.buffer_views, index, "bufferViews", place)?;
        let place = format!("bufferViews[{index}]");
        let buffer = document.at(&self.0, view.buffer.value(), "buffers", &place)?;
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
