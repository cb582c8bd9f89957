//! Images as RGBA8: PNG and JPEG, and by their extensions WebP and KTX2. The crate `restir-decoders` decodes them.

use super::buffers::Buffers;
use super::container::Document;
use super::decoders::{BASISU, WEBP};
use super::{MAX_IMAGE_BYTES, MAX_IMAGE_SIDE, Resolve, uri};
use crate::error::Result;
use restir_decoders::picture;
use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Arc;

/// Most bytes a decoder may allocate for one image.
const MAX_DECODER_BYTES: u64 = 512 << 20;

/// One decoded image; shared by the textures that use it.
#[derive(Clone)]
pub(super) struct Image {
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// RGBA8, row-major from the top, as stored.
    pub pixels: Arc<Vec<u8>>,
}

/// The images decoded so far, each file once.
pub(super) struct Images {
    /// Of each image, the first one with the same bytes.
    first: Vec<usize>,
    decoded: Vec<Option<Image>>,
    bytes: u64,
}

impl Images {
    /// Nothing decoded yet.
    pub fn new(document: &Document) -> Self {
        let images = &document.root.images;
        let mut known = HashMap::new();
        let first = images.iter().enumerate().map(|(index, image)| {
            // A buffer view counts where there is one, as in `get`.
            let view = image.buffer_view.map(|view| view.value());
            *known.entry((view, image.uri.as_deref().filter(|_| view.is_none()))).or_insert(index)
        });
        Images { first: first.collect(), decoded: vec![None; images.len()], bytes: 0 }
    }

    /// Image `index`, decoded at its first use.
    pub fn get(
        &mut self,
        document: &Document,
        buffers: &Buffers,
        resolve: Resolve,
        index: usize,
        place: &str,
    ) -> Result<Image> {
        let image = document.at(&document.root.images, index, "images", place)?;
        let index = self.first.get(index).copied().unwrap_or(index);
        if let Some(Some(decoded)) = self.decoded.get(index) {
            return Ok(decoded.clone());
        }
        let place = format!("images[{index}]");
        let file = match (image.buffer_view, &image.uri) {
            (Some(view), _) => Cow::Borrowed(buffers.view(document, view.value(), &place)?.0),
            (None, Some(uri)) => Cow::Owned(uri::fetch(document, &format!("{place}.uri"), uri, resolve)?),
            (None, None) => return Err(document.bad(place, "it has neither a bufferView nor a uri")),
        };
        let decoded = self.decode(document, &file, &place)?;
        if let Some(slot) = self.decoded.get_mut(index) {
            *slot = Some(decoded.clone());
        }
        Ok(decoded)
    }

    /// Decodes `file`, whose format is told by its first bytes. The size is checked before anything is allocated for it.
    fn decode(&mut self, document: &Document, file: &[u8], place: &str) -> Result<Image> {
        let left = (MAX_IMAGE_BYTES - self.bytes.min(MAX_IMAGE_BYTES)).min(MAX_DECODER_BYTES);
        let limits = picture::Limits { side: MAX_IMAGE_SIDE, bytes: left };
        let by_extension = file.starts_with(b"\xabKTX 20\xbb") || file.get(8..12) == Some(b"WEBP");
        let decoded = if by_extension {
            document.decode(place, || picture::decode(file, limits))?
        } else {
            document.decode_core(place, || picture::decode(file, limits))?
        };
        self.bytes += decoded.pixels.len() as u64;
        Ok(Image { width: decoded.width, height: decoded.height, pixels: Arc::new(decoded.pixels) })
    }
}

/// The image that a texture shows: that of KHR_texture_basisu, else that of EXT_texture_webp, else its own.
pub(super) fn source(document: &Document, texture: &gltf::json::Texture, place: &str) -> Result<usize> {
    let extensions = texture.extensions.as_ref().map(|extensions| &extensions.others);
    for name in [BASISU, WEBP] {
        let Some(extension) = extensions.and_then(|extensions| extensions.get(name)) else { continue };
        let source = extension.get("source").and_then(serde_json::Value::as_u64);
        let source = source.and_then(|source| usize::try_from(source).ok());
        return source.ok_or_else(|| document.bad(format!("{place}.extensions.{name}.source"), "it is no index"));
    }
    // The JSON crate's mark for an absent source.
    if texture.source.value() == u32::MAX as usize {
        return Err(document.bad(place, "it has no source that this loader reads"));
    }
    Ok(texture.source.value())
}
