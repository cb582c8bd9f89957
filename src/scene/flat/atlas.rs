//! Packing textures into layers of one size.

use super::Atlas;
use crate::error::{Error, Result};
use crate::scene::{Scene, Texture};
use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Arc;

/// Longest side of a layer and most layers: what every WebGPU device can hold.
const MAX_SIDE: u32 = 8192;
const MAX_LAYERS: u32 = 256;
const MIN_SIDE: u32 = 4;
const TEXEL_BYTES: usize = 4;
/// Most bytes of all layers: what a small device and a 32-bit address space can hold.
const MAX_BYTES: u64 = 1 << 30;

/// Where a texture lies in the atlas.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Rectangle {
    pub layer: u32,
    pub x: u32,
    pub y: u32,
    pub width: u32,
    pub height: u32,
}

/// One distinct image, small enough for a layer.
struct Picture<'a> {
    width: u32,
    height: u32,
    pixels: Cow<'a, [u8]>,
}

/// Packs all textures and tells where each one went. Textures that share their pixels share a rectangle. Without textures:
/// one small white layer.
pub(super) fn pack(scene: &Scene, warnings: &mut Vec<String>) -> Result<(Atlas, Vec<Rectangle>)> {
    let mut pictures: Vec<Picture> = Vec::new();
    let mut picture_of_texture = Vec::with_capacity(scene.textures.len());
    let mut known = HashMap::new();
    for (i, texture) in scene.textures.iter().enumerate() {
        let key = (Arc::as_ptr(&texture.pixels), texture.width, texture.height);
        let index = match known.get(&key) {
            Some(&index) => index,
            None => {
                pictures.push(fit(i, texture, warnings)?);
                known.insert(key, pictures.len() - 1);
                pictures.len() - 1
            }
        };
        picture_of_texture.push(index);
    }
    let (size, layers, places) = lay_out(&pictures);
    check_size(size, layers)?;
    let texels = draw(&pictures, &places, size, layers);
    let rectangles = picture_of_texture.into_iter().filter_map(|index| places.get(index).copied()).collect();
    Ok((Atlas { size, layers, texels }, rectangles))
}

/// Checks a texture and halves it until it fits.
fn fit<'a>(index: usize, texture: &'a Texture, warnings: &mut Vec<String>) -> Result<Picture<'a>> {
    let (width, height) = (texture.width, texture.height);
    let wanted = u64::from(width) * u64::from(height) * TEXEL_BYTES as u64;
    if wanted == 0 || wanted != texture.pixels.len() as u64 {
        let what = format!("{width}x{height} RGBA8 texels were promised, {} bytes came", texture.pixels.len());
        return Err(Error::bad_value(format!("texture {index} '{}'", texture.name), what));
    }
    let mut picture = Picture { width, height, pixels: Cow::Borrowed(texture.pixels.as_slice()) };
    while picture.width.max(picture.height) > MAX_SIDE {
        picture = halve(&picture);
    }
    if picture.width != width || picture.height != height {
        warnings.push(format!(
            "texture {index} '{}' was reduced from {width}x{height} to {}x{}, for no side may be longer than {MAX_SIDE}",
            texture.name, picture.width, picture.height
        ));
    }
    Ok(picture)
}

/// Half the size, each texel the mean of the four below it.
fn halve(picture: &Picture) -> Picture<'static> {
    let (width, height) = (picture.width.div_ceil(2), picture.height.div_ceil(2));
    let texel = |x: u32, y: u32, channel: usize| {
        let (x, y) = (x.min(picture.width - 1) as usize, y.min(picture.height - 1) as usize);
        u32::from(picture.pixels[(y * picture.width as usize + x) * TEXEL_BYTES + channel])
    };
    let mut pixels = Vec::with_capacity(width as usize * height as usize * TEXEL_BYTES);
    for y in 0..height {
        for x in 0..width {
            for c in 0..TEXEL_BYTES {
                let (x, y) = (2 * x, 2 * y);
                let sum = texel(x, y, c) + texel(x + 1, y, c) + texel(x, y + 1, c) + texel(x + 1, y + 1, c);
                pixels.push(((sum + 2) / 4) as u8);
            }
        }
    }
    Picture { width, height, pixels: Cow::Owned(pixels) }
}

/// Size of a layer, number of layers and places: those with the fewest texels, from layers that just hold the largest
/// picture, doubled and doubled again, to the largest layers.
fn lay_out(pictures: &[Picture]) -> (u32, u32, Vec<Rectangle>) {
    let largest = pictures.iter().map(|p| p.width.max(p.height)).max().unwrap_or(0);
    let mut size = largest.next_multiple_of(MIN_SIDE).max(MIN_SIDE);
    let mut best = layers_of(pictures, size);
    while size < MAX_SIDE && best.1 > 1 {
        size = (2 * size).min(MAX_SIDE);
        let larger = layers_of(pictures, size);
        let better = texels_of(larger.0, larger.1) < texels_of(best.0, best.1);
        if better || best.1 > MAX_LAYERS {
            best = larger;
        }
    }
    best
}

fn layers_of(pictures: &[Picture], size: u32) -> (u32, u32, Vec<Rectangle>) {
    let (places, layers) = shelves(pictures, size);
    (size, layers, places)
}

/// Told before the layers are allocated.
fn check_size(size: u32, layers: u32) -> Result<()> {
    let limit = |wanted, had, unit| Err(Error::Limit { what: "the texture atlas".into(), wanted, had, unit });
    let bytes = texels_of(size, layers) * TEXEL_BYTES as u64;
    if layers > MAX_LAYERS {
        return limit(u64::from(layers), u64::from(MAX_LAYERS), "layers");
    }
    if bytes > MAX_BYTES {
        return limit(bytes, MAX_BYTES, "bytes");
    }
    Ok(())
}

fn texels_of(size: u32, layers: u32) -> u64 {
    u64::from(size).pow(2) * u64::from(layers)
}

/// Rows ("shelves") from the top, tallest pictures first. Returns a place for each picture, and the number of layers.
fn shelves(pictures: &[Picture], size: u32) -> (Vec<Rectangle>, u32) {
    let mut order: Vec<usize> = (0..pictures.len()).collect();
    order.sort_by_key(|&i| std::cmp::Reverse((pictures[i].height, pictures[i].width)));
    let mut places = vec![Rectangle::default(); pictures.len()];
    let (mut layer, mut x, mut y, mut shelf_height) = (0, 0, 0, 0);
    for i in order {
        let Picture { width, height, .. } = pictures[i];
        if x + width > size {
            (x, y, shelf_height) = (0, y + shelf_height, 0);
        }
        if y + height > size {
            (layer, x, y, shelf_height) = (layer + 1, 0, 0, 0);
        }
        places[i] = Rectangle { layer, x, y, width, height };
        x += width;
        shelf_height = shelf_height.max(height);
    }
    (places, layer + 1)
}

fn draw(pictures: &[Picture], places: &[Rectangle], size: u32, layers: u32) -> Vec<u8> {
    let side = size as usize;
    let mut texels = vec![u8::MAX; side * side * layers as usize * TEXEL_BYTES];
    for (picture, place) in pictures.iter().zip(places) {
        let row_bytes = picture.width as usize * TEXEL_BYTES;
        for (row, source) in picture.pixels.chunks_exact(row_bytes).enumerate() {
            let y = place.layer as usize * side + place.y as usize + row;
            let start = (y * side + place.x as usize) * TEXEL_BYTES;
            texels[start..start + row_bytes].copy_from_slice(source);
        }
    }
    texels
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Wrap;
    use crate::scene::random::Random;

    fn texture(width: u32, height: u32, value: u8) -> Texture {
        Texture {
            name: "t".into(),
            width,
            height,
            pixels: Arc::new(vec![value; (width * height * 4) as usize]),
            wrap: [Wrap::Repeat; 2],
            linear_filter: true,
        }
    }

    fn packed(textures: Vec<Texture>) -> Result<(Atlas, Vec<Rectangle>, Vec<String>)> {
        let mut warnings = Vec::new();
        let (atlas, rectangles) = pack(&Scene { textures, ..Scene::default() }, &mut warnings)?;
        Ok((atlas, rectangles, warnings))
    }

    #[test]
    fn no_textures_is_one_white_layer() {
        let (atlas, rectangles, _) = packed(Vec::new()).unwrap();
        assert_eq!((atlas.size, atlas.layers, rectangles.len()), (4, 1, 0));
        assert_eq!(atlas.texels, vec![255; 64]);
    }

    #[test]
    fn every_texture_is_found_again() {
        let mut random = Random::new(9);
        let textures: Vec<Texture> =
            (0..200).map(|i| texture(1 + random.next_u32() % 60, 1 + random.next_u32() % 60, i as u8)).collect();
        let (atlas, rectangles, _) = packed(textures.clone()).unwrap();
        assert!(atlas.size.is_multiple_of(4) && atlas.size >= 60, "{}", atlas.size);
        let filled: usize = textures.iter().map(|texture| texture.pixels.len()).sum();
        assert!(filled * 5 > atlas.texels.len() * 3, "{filled} of {} bytes are used", atlas.texels.len());
        for (texture, place) in textures.iter().zip(&rectangles) {
            assert_eq!((texture.width, texture.height), (place.width, place.height));
            for y in place.y..place.y + place.height {
                for x in place.x..place.x + place.width {
                    let texel = ((place.layer * atlas.size + y) * atlas.size + x) as usize * 4;
                    assert_eq!(atlas.texels[texel], texture.pixels[0], "overlap");
                }
            }
        }
    }

    #[test]
    fn shared_pixels_share_a_rectangle() {
        let a = texture(8, 8, 1);
        let (_, rectangles, _) = packed(vec![a.clone(), texture(8, 8, 1), a]).unwrap();
        assert_eq!(rectangles[0], rectangles[2]);
        assert_ne!(rectangles[0], rectangles[1]);
    }

    #[test]
    fn many_small_textures_make_larger_layers() {
        let (atlas, _, _) = packed((0..300).map(|i| texture(4, 4, i as u8)).collect()).unwrap();
        assert!(atlas.layers <= MAX_LAYERS && atlas.size == 8, "{} x {}", atlas.layers, atlas.size);
    }

    #[test]
    fn layers_are_no_larger_than_they_must_be() {
        let picture = |side| Picture { width: side, height: side, pixels: Cow::Borrowed(&[]) };
        let laid_out = |count: u32, side| {
            let pictures: Vec<Picture> = (0..count).map(|_| picture(side)).collect();
            let (size, layers, _) = lay_out(&pictures);
            (size, layers, check_size(size, layers).is_ok())
        };
        assert_eq!(laid_out(1, 4097), (4100, 1, true));
        assert_eq!(laid_out(15, 4097), (4100, 15, true));
        assert_eq!(laid_out(31, 4097), (4100, 31, false));
        assert_eq!(laid_out(16, 4096), (4096, 16, true));
        assert_eq!(laid_out(17, 4096), (4096, 17, false));
        assert_eq!(laid_out(1, 8192), (8192, 1, true));
        assert_eq!(laid_out(257, 8192), (8192, 257, false));
    }

    #[test]
    fn too_large_is_halved_with_a_warning() {
        let (atlas, rectangles, warnings) = packed(vec![texture(8195, 1, 7)]).unwrap();
        assert_eq!((atlas.size, rectangles[0].width, rectangles[0].height), (4100, 4098, 1));
        assert_eq!(warnings.len(), 1);
        assert_eq!(atlas.texels[0], 7);
    }

    #[test]
    fn wrong_byte_counts_are_errors() {
        let mut short = texture(2, 2, 0);
        short.pixels = Arc::new(vec![0; 15]);
        assert!(packed(vec![short]).is_err());
        assert!(packed(vec![texture(0, 2, 0)]).is_err());
    }
}
