//! The images that materials read, in a few texture arrays with their mip chains.

use super::mips::{self, Level, Texels, level_count, side};
use super::packing::{self, MAX_LAYERS, MAX_SIDE, Spot};
use super::{TextureArray, TextureStats};
use crate::error::{Error, Result};
use crate::scene::{Scene, Texture};
use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Arc;

const TEXEL_BYTES: usize = 4;
/// Most bytes of all arrays: what a small device, or a 32-bit address space, can hold.
const MAX_BYTES: u64 = if cfg!(target_pointer_width = "32") { 1 << 30 } else { 4 << 30 };

/// Where an image lies, and how large it is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Place {
    pub spot: Spot,
    pub width: u32,
    pub height: u32,
}

/// The images that materials ask for, each once however often it is asked for.
pub(super) struct Images<'a> {
    scene: &'a Scene,
    /// Of each texture, the first one with the same size and pixels.
    first: Vec<usize>,
    /// Number of each image, by its texture and the meaning of its texels.
    known: HashMap<(usize, Texels), usize>,
    images: Vec<(usize, Texels)>,
}

impl<'a> Images<'a> {
    /// Nothing asked for yet.
    ///
    /// # Errors
    /// `BAD_VALUE` for a texture whose pixels are not as many as its size says.
    pub fn new(scene: &'a Scene) -> Result<Self> {
        for (i, texture) in scene.textures.iter().enumerate() {
            check(i, texture)?;
        }
        Ok(Images { scene, first: first_alike(&scene.textures), known: HashMap::new(), images: Vec::new() })
    }

    /// The number of the image of a texture, or none if there is no such texture.
    pub fn ask(&mut self, texture: usize, texels: Texels) -> Option<usize> {
        let key = (*self.first.get(texture)?, texels);
        Some(*self.known.entry(key).or_insert_with(|| {
            self.images.push(key);
            self.images.len() - 1
        }))
    }

    /// Places all images and makes their mip chains. Returns the arrays and the place of each image.
    ///
    /// # Errors
    /// `LIMIT` where they need more layers or bytes than there may be.
    pub fn pack(
        &self,
        warnings: &mut Vec<String>,
        progress: &mut dyn FnMut(f32),
    ) -> Result<(Vec<TextureArray>, Vec<Place>)> {
        let sizes: Vec<(u32, u32)> =
            self.images.iter().map(|(texture, _)| fitted(&self.scene.textures[*texture])).collect();
        let (layers, spots) = packing::pack(&sizes);
        let place =
            |(spot, (width, height)): (&Spot, &(u32, u32))| Place { spot: *spot, width: *width, height: *height };
        let places: Vec<Place> = spots.iter().zip(&sizes).map(place).collect();
        let mut arrays: Vec<TextureArray> = Vec::with_capacity(layers.len());
        let mut bytes = 0;
        for (i, layers) in layers.iter().enumerate() {
            let limit = |wanted, had, unit| Error::Limit { what: format!("texture array {i}"), wanted, had, unit };
            if layers.count > MAX_LAYERS {
                return Err(limit(layers.count.into(), MAX_LAYERS.into(), "layers"));
            }
            let longest = places.iter().filter(|place| place.spot.array as usize == i);
            let levels = longest.map(|place| level_count(place.width, place.height)).max().unwrap_or(1);
            let array = TextureArray {
                width: layers.width,
                height: layers.height,
                layers: layers.count,
                levels,
                texels: Vec::new(),
            };
            bytes += array.expected_bytes();
            arrays.push(array);
        }
        // Told before they are allocated.
        if bytes > MAX_BYTES {
            return Err(Error::Limit { what: "textures".into(), wanted: bytes, had: MAX_BYTES, unit: "bytes" });
        }
        for array in &mut arrays {
            array.texels = vec![0; array.expected_bytes() as usize];
        }
        for (i, ((texture, texels), place)) in self.images.iter().zip(&places).enumerate() {
            progress(i as f32 / self.images.len() as f32);
            if let Some(array) = arrays.get_mut(place.spot.array as usize) {
                draw(&self.scene.textures[*texture], *texels, *place, array);
            }
        }
        self.warn(&sizes, warnings);
        Ok((arrays, places))
    }

    /// Says which images were made smaller.
    fn warn(&self, sizes: &[(u32, u32)], warnings: &mut Vec<String>) {
        for ((index, _), (width, height)) in self.images.iter().zip(sizes) {
            let texture = &self.scene.textures[*index];
            if (texture.width, texture.height) != (*width, *height) {
                warnings.push(format!(
                    "texture {index} '{}' was reduced from {}x{} to {width}x{height}, for no side may be longer than {MAX_SIDE}",
                    texture.name, texture.width, texture.height
                ));
            }
        }
    }
}

/// Figures of the arrays for reports.
pub(super) fn stats(arrays: &[TextureArray], places: &[Place]) -> Vec<TextureStats> {
    let each = arrays.iter().enumerate().map(|(i, array)| {
        let own = places.iter().filter(|place| place.spot.array as usize == i);
        let texels = |place: &Place| -> u64 {
            let level = |k| u64::from(side(place.width, k)) * u64::from(side(place.height, k));
            (0..level_count(place.width, place.height)).map(level).sum()
        };
        TextureStats {
            width: array.width,
            height: array.height,
            layers: array.layers,
            levels: array.levels,
            images: own.clone().count() as u64,
            bytes: array.texels.len() as u64,
            used_bytes: own.map(texels).sum::<u64>() * TEXEL_BYTES as u64,
        }
    });
    each.collect()
}

/// Whether there are as many pixels as the size says.
fn check(index: usize, texture: &Texture) -> Result<()> {
    let (width, height) = (texture.width, texture.height);
    let wanted = u64::from(width) * u64::from(height) * TEXEL_BYTES as u64;
    if wanted == 0 || wanted != texture.pixels.len() as u64 {
        let what = format!("{width}x{height} RGBA8 texels were promised, {} bytes came", texture.pixels.len());
        return Err(Error::bad_value(format!("texture {index} '{}'", texture.name), what));
    }
    Ok(())
}

/// Of each texture, the first one with the same size and pixels. Only images with the same size and the same few texels
/// are compared whole.
fn first_alike(textures: &[Texture]) -> Vec<usize> {
    let mut known: HashMap<_, Vec<usize>> = HashMap::new();
    let each = textures.iter().enumerate().map(|(i, texture)| {
        let stride = (texture.pixels.len() / 64).max(1);
        let sample: Vec<u8> = texture.pixels.iter().copied().step_by(stride).collect();
        let alike = known.entry((texture.width, texture.height, sample)).or_default();
        let same = |j: &&usize| {
            let other = &textures[**j].pixels;
            Arc::ptr_eq(other, &texture.pixels) || *other == texture.pixels
        };
        alike.iter().find(same).copied().unwrap_or_else(|| {
            alike.push(i);
            i
        })
    });
    each.collect()
}

/// Levels of a texture that are too large for a layer.
fn skipped(texture: &Texture) -> u32 {
    (0..).find(|k| side(texture.width.max(texture.height), *k) <= MAX_SIDE).unwrap_or(0)
}

/// The size of the first level that fits a layer.
fn fitted(texture: &Texture) -> (u32, u32) {
    let skipped = skipped(texture);
    (side(texture.width, skipped), side(texture.height, skipped))
}

/// Writes an image and its chain to its place.
fn draw(texture: &Texture, texels: Texels, place: Place, array: &mut TextureArray) {
    let (width, height) = (texture.width, texture.height);
    let whole = (width, height, Cow::Borrowed(texture.pixels.as_slice()));
    let chain = mips::chain(width, height, &texture.pixels, texels);
    let smaller = chain.map(|Level { width, height, pixels }| (width, height, Cow::Owned(pixels)));
    let levels = std::iter::once(whole).chain(smaller).skip(skipped(texture) as usize);
    for ((width, _, pixels), level) in levels.zip(0..) {
        for (row, source) in pixels.chunks_exact(width as usize * TEXEL_BYTES).enumerate() {
            let at = array.offset(level, place.spot.layer, place.spot.x >> level, (place.spot.y >> level) + row as u32);
            if let Some(target) = array.texels.get_mut(at..at + source.len()) {
                target.copy_from_slice(source);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Wrap;
    use crate::scene::random::Random;

    fn texture(width: u32, height: u32, value: impl FnMut() -> u8) -> Texture {
        let mut value = value;
        Texture {
            name: "t".into(),
            width,
            height,
            pixels: Arc::new((0..width * height * 4).map(|_| value()).collect()),
            wrap: [Wrap::Repeat; 2],
            linear_filter: true,
        }
    }

    /// All textures of a scene, asked for in order.
    fn packed(textures: Vec<Texture>, texels: Texels) -> (Vec<TextureArray>, Vec<Place>, Vec<String>) {
        let scene = Scene { textures, ..Scene::default() };
        let mut images = Images::new(&scene).expect("sound textures");
        let asked: Vec<usize> = (0..scene.textures.len()).map(|i| images.ask(i, texels).expect("there")).collect();
        let mut warnings = Vec::new();
        let (arrays, places) = images.pack(&mut warnings, &mut |_| ()).expect("they fit");
        (arrays, asked.into_iter().map(|image| places[image]).collect(), warnings)
    }

    #[test]
    fn every_level_of_every_image_is_found_again() {
        let mut random = Random::new(9);
        let sizes =
            [(1, 1), (3, 5), (64, 64), (60, 33), (128, 16), (16, 128), (4097, 33), (7, 1), (256, 200), (255, 255)];
        let textures: Vec<Texture> =
            sizes.iter().map(|(width, height)| texture(*width, *height, || random.next_u32() as u8)).collect();
        for texels in [Texels::Color, Texels::MaskedColor, Texels::Normal, Texels::Data] {
            let (arrays, places, warnings) = packed(textures.clone(), texels);
            assert!(warnings.is_empty());
            for (texture, place) in textures.iter().zip(&places) {
                let whole = Level { width: texture.width, height: texture.height, pixels: texture.pixels.to_vec() };
                let chain = mips::chain(texture.width, texture.height, &texture.pixels, texels);
                let array = &arrays[place.spot.array as usize];
                for (level, k) in std::iter::once(whole).chain(chain).zip(0..) {
                    for (y, row) in level.pixels.chunks_exact(level.width as usize * 4).enumerate() {
                        let y = (place.spot.y >> k) + y as u32;
                        let at = array.offset(k, place.spot.layer, place.spot.x >> k, y);
                        assert_eq!(array.texels[at..at + row.len()], *row, "{place:?} level {k}");
                    }
                }
            }
            let stats = stats(&arrays, &places);
            assert_eq!(stats.iter().map(|array| array.images).sum::<u64>(), sizes.len() as u64);
            assert!(stats.iter().all(|array| array.used_bytes <= array.bytes));
        }
    }

    #[test]
    fn equal_images_are_kept_once_for_each_meaning() {
        let image = |value| texture(8, 8, move || value);
        let scene = Scene { textures: vec![image(1), image(2), image(1)], ..Scene::default() };
        let mut images = Images::new(&scene).unwrap();
        let asked = [(0, Texels::Color), (1, Texels::Color), (2, Texels::Color), (0, Texels::Data), (2, Texels::Data)]
            .map(|(texture, texels)| images.ask(texture, texels).unwrap());
        assert_eq!(asked, [0, 1, 0, 2, 2]);
        assert_eq!(images.ask(3, Texels::Color), None);
    }

    #[test]
    fn without_images_there_are_no_arrays() {
        assert!(packed(Vec::new(), Texels::Color).0.is_empty());
    }

    #[test]
    fn too_large_is_reduced_with_a_warning() {
        let (arrays, places, warnings) = packed(vec![texture(8195, 1, || 7)], Texels::Data);
        assert_eq!((arrays[0].width, places[0].width, places[0].height), (4097, 4097, 1));
        assert_eq!(warnings.len(), 1);
        assert!(arrays[0].texels.iter().all(|byte| *byte == 7));
    }

    #[test]
    fn wrong_byte_counts_are_errors() {
        let mut short = texture(2, 2, || 0);
        short.pixels = Arc::new(vec![0; 15]);
        for texture in [short, texture(0, 2, || 0)] {
            assert!(Images::new(&Scene { textures: vec![texture], ..Scene::default() }).is_err());
        }
    }

    #[test]
    fn too_many_bytes_are_an_error_before_they_are_allocated() {
        let scene = Scene { textures: vec![texture(4096, 4096, || 0)], ..Scene::default() };
        let mut images = Images::new(&scene).unwrap();
        images.images = vec![(0, Texels::Data); 64];
        let error = images.pack(&mut Vec::new(), &mut |_| ()).err().unwrap();
        assert_eq!(error.code(), "LIMIT");
        assert!(error.to_string().contains("5726622976"), "{error}");
    }
}
