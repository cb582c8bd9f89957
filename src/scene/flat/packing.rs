//! Where images go: a few arrays of layers, each array with layers of one size, so that little is left empty.
//!
//! Images of about one size share an array. In a layer they stand on shelves, or alone in its corner. Level k of an image
//! lies in level k of its layer, at `(x >> k, y >> k)`: no two levels overlap as long as an image is given room whose
//! sides are both at least its longest side, rounded down to a power of two. An image that stands alone needs no such room.

use super::mips::level_count;
use std::collections::BTreeMap;

/// Most arrays: what `TextureSlot` can name, and what leaves other passes enough of the 16 textures of a stage.
pub(super) const MAX_ARRAYS: usize = 4;
/// Most layers of an array and longest side of a layer: what every WebGPU device can hold.
pub(super) const MAX_LAYERS: u32 = 256;
pub(super) const MAX_SIDE: u32 = 8192;
/// Images begin at multiples of this, so that `TextureSlot` can say where.
pub(super) const ALIGNMENT: u32 = 8;
/// One array less is worth a sixteenth more texels: shaders may have to look at each array.
const MERGING: f64 = 1.0 / 16.0;

/// Where an image lies.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Spot {
    pub array: u32,
    pub layer: u32,
    pub x: u32,
    pub y: u32,
}

/// The layers of one array.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layers {
    pub width: u32,
    pub height: u32,
    pub count: u32,
}

impl Layers {
    fn texels(self) -> u64 {
        u64::from(self.width) * u64::from(self.height) * u64::from(self.count)
    }
}

/// Places every image (width, height; at most [`MAX_SIDE`] each). Arrays may have more than [`MAX_LAYERS`] layers where
/// there is no other way.
pub(super) fn pack(images: &[(u32, u32)]) -> (Vec<Layers>, Vec<Spot>) {
    let mut spots = vec![Spot::default(); images.len()];
    let mut arrays = Vec::new();
    for group in groups(images) {
        for (image, spot) in group.members.iter().zip(&group.layout.spots) {
            spots[*image] = Spot { array: arrays.len() as u32, ..*spot };
        }
        arrays.push(group.layout.layers);
    }
    (arrays, spots)
}

/// Images that share an array.
#[derive(Clone)]
struct Group {
    members: Vec<usize>,
    layout: Layout,
}

#[derive(Clone)]
struct Layout {
    layers: Layers,
    /// Of each member.
    spots: Vec<Spot>,
}

/// Images by the powers of two below their sides; then the two groups that lose least by it become one, until there are
/// few enough, and on as long as little is lost.
fn groups(images: &[(u32, u32)]) -> Vec<Group> {
    let mut by_size: BTreeMap<(u32, u32), Vec<usize>> = BTreeMap::new();
    for (i, (width, height)) in images.iter().enumerate() {
        by_size.entry((width.ilog2(), height.ilog2())).or_default().push(i);
    }
    let group = |members: Vec<usize>| Group { layout: lay_out(images, &members), members };
    // Largest first. Keys stay with their groups, so that each pair is laid out once.
    let mut groups: BTreeMap<usize, Group> = by_size.into_values().rev().map(group).enumerate().collect();
    let mut pairs: BTreeMap<(usize, usize), Group> = BTreeMap::new();
    let texels = |groups: &BTreeMap<usize, Group>| groups.values().map(|g| g.layout.layers.texels()).sum::<u64>();
    let allowed = (texels(&groups) as f64 * (1.0 + MERGING)) as u64;
    while groups.len() > 1 {
        let mut best: Option<(u64, (usize, usize))> = None;
        for (&a, first) in &groups {
            for (&b, second) in groups.range(a + 1..) {
                let both = pairs
                    .entry((a, b))
                    .or_insert_with(|| group([&first.members[..], &second.members].concat()))
                    .layout
                    .layers;
                let apart = first.layout.layers.texels() + second.layout.layers.texels();
                // Too many layers are worth avoiding at any price.
                let lost = if both.count > MAX_LAYERS { u64::MAX / 4 } else { both.texels().saturating_sub(apart) };
                if best.is_none_or(|(least, _)| lost < least) {
                    best = Some((lost, (a, b)));
                }
            }
        }
        let Some((lost, pair)) = best else { break };
        if groups.len() <= MAX_ARRAYS && texels(&groups) + lost > allowed {
            break;
        }
        let Some(both) = pairs.remove(&pair) else { break };
        groups.remove(&pair.1);
        groups.insert(pair.0, both);
        pairs.retain(|(a, b), _| ![*a, *b].iter().any(|key| [pair.0, pair.1].contains(key)));
    }
    groups.into_values().collect()
}

/// The layers with the fewest texels that hold these images.
fn lay_out(images: &[(u32, u32)], members: &[usize]) -> Layout {
    let sizes: Vec<(u32, u32)> = members.iter().map(|&i| images[i]).collect();
    let mut best = alone(&sizes);
    let rooms: Vec<(u32, u32)> = sizes.iter().map(|size| room(*size)).collect();
    let widest = rooms.iter().map(|room| room.0).max().unwrap_or(1);
    let widths = (0..).map(|k| widest << k).take_while(|width| *width <= MAX_SIDE);
    for layout in widths.flat_map(|width| shelves(&rooms, width)) {
        let key = |layout: &Layout| (layout.layers.count.max(MAX_LAYERS), layout.layers.texels());
        if key(&layout) < key(&best) {
            best = layout;
        }
    }
    best
}

/// What an image and its levels need where it does not stand alone.
fn room((width, height): (u32, u32)) -> (u32, u32) {
    let least = 1 << (level_count(width, height) - 1);
    (width.max(least).next_multiple_of(ALIGNMENT), height.max(least).next_multiple_of(ALIGNMENT))
}

/// A layer for each image.
fn alone(sizes: &[(u32, u32)]) -> Layout {
    let (width, height) = sizes.iter().fold((1, 1), |(w, h), size| (w.max(size.0), h.max(size.1)));
    let count = sizes.len() as u32;
    let spots = (0..count).map(|layer| Spot { layer, ..Spot::default() }).collect();
    Layout { layers: Layers { width, height, count }, spots }
}

/// Shelves as wide as a layer, the highest rooms first, dealt to few or many layers.
fn shelves(rooms: &[(u32, u32)], width: u32) -> Vec<Layout> {
    let mut order: Vec<usize> = (0..rooms.len()).collect();
    order.sort_by_key(|&i| std::cmp::Reverse((rooms[i].1, rooms[i].0)));
    let mut heights: Vec<u32> = Vec::new();
    // (shelf, x) of each room.
    let mut stands = vec![(0, 0); rooms.len()];
    let mut x = width;
    for i in order {
        if x + rooms[i].0 > width {
            heights.push(rooms[i].1);
            x = 0;
        }
        stands[i] = (heights.len() - 1, x);
        x += rooms[i].0;
    }
    let total: u32 = heights.iter().fold(0, |sum: u32, height| sum.saturating_add(*height));
    let highest = heights.first().copied().unwrap_or(ALIGNMENT);
    let wanted = (1..=16).chain((5..=8).map(|k| 1 << k)).take_while(|count| *count <= heights.len() as u32);
    let candidates = wanted.map(|count| highest.max(total.div_ceil(count)).next_multiple_of(ALIGNMENT));
    candidates
        .filter(|height| *height <= MAX_SIDE.max(highest))
        .map(|height| stack(&heights, &stands, width, height))
        .collect()
}

/// Shelves one below the other, on to the next layer where one is full.
fn stack(heights: &[u32], stands: &[(usize, u32)], width: u32, height: u32) -> Layout {
    let (mut layer, mut y) = (0, 0);
    let mut shelves = Vec::with_capacity(heights.len());
    for shelf in heights {
        if y + shelf > height {
            (layer, y) = (layer + 1, 0);
        }
        shelves.push((layer, y));
        y += shelf;
    }
    let spots =
        stands.iter().map(|(shelf, x)| Spot { array: 0, layer: shelves[*shelf].0, x: *x, y: shelves[*shelf].1 });
    Layout { spots: spots.collect(), layers: Layers { width, height, count: layer + 1 } }
}

#[cfg(test)]
mod tests {
    use super::super::mips::side;
    use super::*;
    use crate::scene::random::Random;

    /// Packs, checks that no level of an image meets another's or leaves its layer, and returns the arrays with the share
    /// of their texels that no image uses.
    #[track_caller]
    fn packed(images: &[(u32, u32)]) -> (Vec<Layers>, f64) {
        let (arrays, spots) = pack(images);
        assert!(arrays.len() <= MAX_ARRAYS);
        for array in &arrays {
            assert!(array.width <= MAX_SIDE && array.height <= MAX_SIDE && array.count <= MAX_LAYERS, "{array:?}");
        }
        let places: Vec<((u32, u32), Spot)> = images.iter().copied().zip(spots).collect();
        for (i, &((width, height), spot)) in places.iter().enumerate() {
            assert!(spot.x.is_multiple_of(ALIGNMENT) && spot.y.is_multiple_of(ALIGNMENT));
            let array = arrays[spot.array as usize];
            assert!(spot.layer < array.count);
            let levels = level_count(width, height);
            assert!(levels <= level_count(array.width, array.height));
            let at = |spot: Spot, (w, h): (u32, u32), k: u32| {
                let (x, y) = (spot.x >> k, spot.y >> k);
                (x, y, x + side(w, k), y + side(h, k))
            };
            for k in 0..levels {
                let (_, _, right, bottom) = at(spot, (width, height), k);
                assert!(right <= side(array.width, k) && bottom <= side(array.height, k), "{spot:?} level {k}");
            }
            for &(size, other) in &places[..i] {
                if (other.array, other.layer) == (spot.array, spot.layer) {
                    for k in 0..levels.min(level_count(size.0, size.1)) {
                        let (a, b) = (at(spot, (width, height), k), at(other, size, k));
                        let apart = a.2 <= b.0 || b.2 <= a.0 || a.3 <= b.1 || b.3 <= a.1;
                        assert!(apart, "level {k} of {spot:?} {width}x{height} and {other:?} {size:?}");
                    }
                }
            }
        }
        let all: u64 = arrays.iter().map(|array| array.texels()).sum();
        let used: u64 = images.iter().map(|(width, height)| u64::from(*width) * u64::from(*height)).sum();
        (arrays, 1.0 - used as f64 / all as f64)
    }

    #[test]
    fn images_of_one_size_waste_nothing() {
        let (arrays, waste) = packed(&vec![(1024, 1024); 63]);
        assert_eq!((arrays, waste), (vec![Layers { width: 1024, height: 1024, count: 63 }], 0.0));
        let (arrays, waste) = packed(&[(4097, 33)]);
        assert_eq!((arrays, waste), (vec![Layers { width: 4097, height: 33, count: 1 }], 0.0));
    }

    #[test]
    fn powers_of_two_share_an_array() {
        let mixed = [vec![(2048, 2048); 3], vec![(1024, 1024); 9], vec![(512, 512); 20], vec![(4, 4); 12]].concat();
        let (arrays, waste) = packed(&mixed);
        assert!(arrays.len() <= 2 && waste < 0.07, "{arrays:?} {waste}");
    }

    #[test]
    fn a_small_image_does_not_cost_a_large_layer() {
        let (arrays, waste) = packed(&[(4096, 4096), (64, 64)]);
        assert!(waste < 0.04, "{arrays:?} {waste}");
    }

    #[test]
    fn long_images_do_not_cost_squares() {
        let long = [vec![(2048, 256); 6], vec![(512, 4096); 3], vec![(1024, 1024); 10], vec![(4097, 33)]].concat();
        let (arrays, waste) = packed(&long);
        assert!(waste < 0.1, "{arrays:?} {waste}");
    }

    #[test]
    fn many_small_images_share_layers() {
        let (arrays, waste) = packed(&vec![(8, 8); 3000]);
        assert!(waste < 0.05, "{arrays:?} {waste}");
        packed(&vec![(1, 1); 3000]);
    }

    #[test]
    fn any_sizes_fit_without_overlap() {
        let mut random = Random::new(9);
        let mut most = 0.0f64;
        for seed in 0..12 {
            let mut side = |largest: f32| (largest.powf(random.unit()) as u32).clamp(1, largest as u32);
            let images: Vec<_> = (0..20 + 20 * seed).map(|_| (side(300.0), side(300.0))).collect();
            most = most.max(packed(&images).1);
        }
        // Sides are independent here, which those of images in files are not: most are far from square.
        assert!(most < 0.7, "{most}");
    }

    #[test]
    fn photographs_waste_little() {
        let mut random = Random::new(3);
        let mut around = |side: f32| (side * (0.8 + 0.4 * random.unit())) as u32;
        let images: Vec<_> =
            (0..40).map(|i| (around([1600.0, 800.0][i % 2]), around([1100.0, 700.0][i % 2]))).collect();
        let (arrays, waste) = packed(&images);
        assert!(waste < 0.3, "{arrays:?} {waste}");
    }

    #[test]
    fn nothing_is_no_array() {
        assert_eq!(pack(&[]), (Vec::new(), Vec::new()));
    }

    #[test]
    fn too_many_large_images_are_said_to_take_too_many_layers() {
        let (arrays, _) = pack(&vec![(8192, 8192); 257 * MAX_ARRAYS]);
        assert!(arrays.iter().any(|array| array.count > MAX_LAYERS));
    }
}
