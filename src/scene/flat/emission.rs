//! What textured emitters shine with: the mean of their emission over each triangle, by which lights are weighed.

use super::lights::luminance;
use crate::scene::{Material, Scene, Texture, TextureRef, Wrap};
use glam::{DVec2, Vec2, Vec3};

/// A triangle is cut by no more texels than this along each side of the box round it: larger ones read a coarser level.
const MAX_CELLS: f64 = 48.0;
/// Longest side of the finest level; larger textures begin with means of 2 x 2, 4 x 4, ... texels.
const MAX_SIDE: u32 = 2048;
/// Texels are taken for this much larger on every side, for the GPU rounds coordinates.
const MARGIN: f64 = 0.01;

/// Luminance of a material's emission over its emissive texture, with coarser and coarser means.
struct Map {
    reference: TextureRef,
    wrap: [Wrap; 2],
    /// Finest first.
    levels: Vec<Level>,
    /// Texels of the finest level in a unit of the coordinates.
    scale: DVec2,
    /// Whether tiles begin where texels of every level do: sides are powers of two.
    is_aligned: bool,
}

struct Level {
    width: usize,
    height: usize,
    values: Vec<f32>,
}

/// The emission of every material.
pub(super) struct Emission {
    /// Luminance of the emissive factor, and the texture's map where there is one.
    materials: Vec<(f64, Option<Map>)>,
}

impl Emission {
    pub(super) fn new(scene: &Scene) -> Self {
        let of = |material: &Material| {
            let map = material.emissive_texture.filter(|_| material.emitted() != Vec3::ZERO).and_then(|reference| {
                let texture = scene.textures.get(reference.texture as usize)?;
                let block = texture.width.max(texture.height).div_ceil(MAX_SIDE).next_power_of_two();
                Some(Map {
                    reference,
                    wrap: texture.wrap,
                    levels: levels(texture, material.emitted(), block as usize),
                    scale: DVec2::new(texture.width.into(), texture.height.into()) / f64::from(block),
                    is_aligned: texture.width.is_power_of_two() && texture.height.is_power_of_two(),
                })
            });
            (luminance(material.emitted()), map)
        };
        Emission { materials: scene.materials.iter().map(of).collect() }
    }

    /// Luminance of the emissive factor alone.
    pub(super) fn untextured(&self, material: u32) -> f64 {
        self.materials.get(material as usize).map_or(0.0, |(luminance, _)| *luminance)
    }

    /// The mean luminance of the emission over a triangle, given its texture coordinates by UV set. 0 only if no point of it
    /// shines, so that every point that does can be sampled.
    pub(super) fn mean(&self, material: u32, uvs: impl FnOnce(usize) -> [Vec2; 3]) -> f64 {
        match self.materials.get(material as usize) {
            None => 0.0,
            Some((luminance, None)) => *luminance,
            Some((_, Some(map))) => map.mean(uvs(usize::from(map.reference.uv_set == 1))),
        }
    }
}

/// IEC 61966-2-1.
fn srgb_decode(value: f32) -> f32 {
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

/// The mean of bilinear or nearest reading over every `block` x `block` texels, and over 2 x 2, 4 x 4, ... of those.
fn levels(texture: &Texture, factor: Vec3, block: usize) -> Vec<Level> {
    let (width, height) = (texture.width as usize, texture.height as usize);
    let linear: Vec<f32> = (0..=255u8).map(|byte| srgb_decode(f32::from(byte) / 255.0)).collect();
    let texel = |x: usize, y: usize| {
        let Some([r, g, b, _]) = texture.pixels.as_chunks::<4>().0.get(y * width + x) else { return 0.0 };
        let color = Vec3::new(linear[usize::from(*r)], linear[usize::from(*g)], linear[usize::from(*b)]);
        luminance(factor * color) as f32
    };
    let (columns, rows) = (width.div_ceil(block), height.div_ceil(block));
    let means = (0..columns * rows).map(|i| {
        let (x, y) = (i % columns * block, i / columns * block);
        let (ends, below) = ((x + block).min(width), (y + block).min(height));
        let sum: f32 = (y..below).flat_map(|y| (x..ends).map(move |x| (x, y))).map(|(x, y)| texel(x, y)).sum();
        sum / ((ends - x) * (below - y)) as f32
    });
    let mut finest = Level { width: columns, height: rows, values: means.collect() };
    if texture.linear_filter {
        finest = finest.filtered(texture.wrap);
    }
    let mut levels = vec![finest];
    while let Some(last) = levels.last().filter(|last| last.width.max(last.height) > 1) {
        levels.push(last.halved());
    }
    levels
}

impl Level {
    fn at(&self, x: usize, y: usize) -> f32 {
        self.values.get(y * self.width + x).copied().unwrap_or_default()
    }

    /// What bilinear reading gives on the average over each texel: a tent of (1, 6, 1) / 8 along both axes.
    fn filtered(&self, wrap: [Wrap; 2]) -> Level {
        let tent = |read: &dyn Fn(i64) -> f32, i: usize| {
            let i = i as i64;
            0.125 * (read(i - 1) + 6.0 * read(i) + read(i + 1))
        };
        let mut across =
            Level { width: self.width, height: self.height, values: Vec::with_capacity(self.values.len()) };
        for y in 0..self.height {
            let read = |x: i64| self.at(wrapped(x, self.width, wrap[0]), y);
            across.values.extend((0..self.width).map(|x| tent(&read, x)));
        }
        let mut both = Level { width: self.width, height: self.height, values: Vec::with_capacity(self.values.len()) };
        for y in 0..self.height {
            for x in 0..self.width {
                let read = |y: i64| across.at(x, wrapped(y, self.height, wrap[1]));
                both.values.push(tent(&read, y));
            }
        }
        both
    }

    /// Means of 2 x 2; the last row or column of an odd side counts twice.
    fn halved(&self) -> Level {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let values = (0..width * height).map(|i| {
            let (x, y) = (2 * (i % width), 2 * (i / width));
            let (right, below) = ((x + 1).min(self.width - 1), (y + 1).min(self.height - 1));
            0.25 * (self.at(x, y) + self.at(right, y) + self.at(x, below) + self.at(right, below))
        });
        Level { width, height, values: values.collect() }
    }
}

/// The texel that a texel outside of the texture stands for.
fn wrapped(i: i64, size: usize, wrap: Wrap) -> usize {
    let size = size as i64;
    let inside = match wrap {
        Wrap::Repeat => i.rem_euclid(size),
        Wrap::Clamp => i.clamp(0, size - 1),
        Wrap::Mirror => {
            let turned = i.rem_euclid(2 * size);
            turned.min(2 * size - 1 - turned)
        }
    };
    inside as usize
}

impl Map {
    fn mean(&self, uvs: [Vec2; 3]) -> f64 {
        let [row_u, row_v] = super::materials::uv_rows(&self.reference).map(|row| row.as_dvec3());
        let corners = uvs.map(|uv| {
            let uv = uv.as_dvec2().extend(1.0);
            DVec2::new(row_u.dot(uv), row_v.dot(uv))
        });
        let (low, high) = corners.iter().fold((corners[0], corners[0]), |(a, b), p| (a.min(*p), b.max(*p)));
        // A triangle over more than the whole texture shines with its mean, or nearly.
        let coarsest = self.levels.len() - 1;
        if !(low.is_finite() && high.is_finite()) || (high - low).max_element() > 4.0 {
            return self.levels[coarsest].at(0, 0).into();
        }
        let extent = ((high - low) * self.scale).max_element();
        let level = (extent / MAX_CELLS).log2().ceil().clamp(0.0, coarsest as f64) as usize;
        let mean = self.levels[level].mean(corners.map(|p| p * self.scale / f64::from(1u32 << level)), self.wrap);
        if self.is_aligned || (level == 0 && self.scale.fract() == DVec2::ZERO) {
            mean
        } else {
            mean.max(1e-3 * f64::from(self.levels[coarsest].at(0, 0)))
        }
    }
}

impl Level {
    /// The mean over a triangle in texels: each texel weighted by the area of its part within the triangle.
    fn mean(&self, corners: [DVec2; 3], wrap: [Wrap; 2]) -> f64 {
        let (mut sum, mut area, mut any) = (0.0, 0.0, 0f64);
        let bounds = |polygon: &[DVec2], axis: usize| {
            let ends = polygon.iter().map(|p| p[axis]);
            let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(p), b.max(p)));
            ((low - MARGIN).floor() as i64, (high + MARGIN).floor() as i64)
        };
        let (top, bottom) = bounds(&corners, 1);
        for y in top..=bottom {
            let strip = clip(clip(corners.to_vec(), 1, y as f64 - MARGIN, 1.0), 1, y as f64 + 1.0 + MARGIN, -1.0);
            if strip.is_empty() {
                continue;
            }
            let (left, right) = bounds(&strip, 0);
            for x in left..=right {
                let part = clip(clip(strip.clone(), 0, x as f64 - MARGIN, 1.0), 0, x as f64 + 1.0 + MARGIN, -1.0);
                if part.is_empty() {
                    continue;
                }
                let value: f64 = self.at(wrapped(x, self.width, wrap[0]), wrapped(y, self.height, wrap[1])).into();
                let part = polygon_area(&part);
                sum += value * part;
                area += part;
                any = any.max(value);
            }
        }
        // A line or point in the texture, or light in a sliver: little, but not nothing.
        let least = 1e-3 * any;
        if area > 0.0 { (sum / area).max(least) } else { any }
    }
}

/// The part of a convex polygon on one side of an axis-parallel line (Sutherland and Hodgman 1974).
fn clip(polygon: Vec<DVec2>, axis: usize, at: f64, side: f64) -> Vec<DVec2> {
    let inside = |p: DVec2| (p[axis] - at) * side;
    let mut out = Vec::with_capacity(polygon.len() + 1);
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (from, to) = (inside(a), inside(b));
        if from >= 0.0 {
            out.push(a);
        }
        if (from < 0.0) != (to < 0.0) {
            out.push(a.lerp(b, from / (from - to)));
        }
    }
    out
}

fn polygon_area(polygon: &[DVec2]) -> f64 {
    let Some(&first) = polygon.first() else { return 0.0 };
    let fan = polygon.windows(2).map(|pair| (pair[0] - first).perp_dot(pair[1] - first));
    0.5 * fan.sum::<f64>().abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    /// A texture that is white where `white` says so.
    fn scene(size: u32, wrap: Wrap, linear_filter: bool, white: impl Fn(u32, u32) -> bool) -> Scene {
        let pixels = (0..size * size).flat_map(|i| [if white(i % size, i / size) { 255 } else { 0 }; 4]).collect();
        let texture = Texture {
            name: String::new(),
            width: size,
            height: size,
            pixels: Arc::new(pixels),
            wrap: [wrap; 2],
            linear_filter,
        };
        let reference = TextureRef { texture: 0, uv_set: 0, offset: Vec2::ZERO, rotation: 0.0, scale: Vec2::ONE };
        let material =
            Material { emissive: Vec3::splat(2.0), emissive_texture: Some(reference), ..Material::default() };
        Scene { textures: vec![texture], materials: vec![material, Material::default()], ..Scene::default() }
    }

    fn mean(scene: &Scene, corners: [[f32; 2]; 3]) -> f64 {
        Emission::new(scene).mean(0, |_| corners.map(Vec2::from))
    }

    #[test]
    fn half_a_texture_is_half_the_light() {
        for size in [2, 16, 256] {
            let left = scene(size, Wrap::Repeat, false, |x, _| x < size / 2);
            // The lower left half of the square has three quarters of its area in the left half.
            let value = mean(&left, [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
            assert!((value / (2.0 * 0.75) - 1.0).abs() < 0.03, "{size}: {value}");
            let whole = mean(&left, [[0.1, 0.1], [0.4, 0.1], [0.1, 0.4]]);
            assert!((whole - 2.0).abs() < 1e-6, "{size}: {whole}");
            assert_eq!(mean(&left, [[0.6, 0.1], [0.9, 0.1], [0.6, 0.4]]), 0.0, "{size}: nothing shines there");
        }
    }

    /// Means over triangles of all sizes, against a fine grid of bilinear readings.
    #[test]
    fn means_are_integrals() {
        let spots = scene(64, Wrap::Repeat, true, |x, y| (x * 7 + y * 3) % 11 < 2);
        let texel = |x: i64, y: i64| f64::from(u8::from((x.rem_euclid(64) * 7 + y.rem_euclid(64) * 3) % 11 < 2)) * 2.0;
        for corners in [
            [[0.1, 0.1], [0.9, 0.2], [0.3, 0.8]],
            [[-0.3, 0.5], [0.2, 0.55], [0.1, 1.4]],
            [[0.5, 0.5], [0.56, 0.5], [0.5, 0.53]],
            [[0.2, 0.7], [0.27, 0.71], [0.22, 0.78]],
        ] {
            let [a, b, c] = corners.map(|p| Vec2::from(p).as_dvec2());
            let (n, mut sum, mut count) = (400, 0.0, 0.0);
            for i in 0..n {
                for j in 0..n - i {
                    let (u, v) = ((f64::from(i) + 0.33) / f64::from(n), (f64::from(j) + 0.33) / f64::from(n));
                    let p = (a + (b - a) * u + (c - a) * v) * 64.0 - 0.5;
                    let (x, y, f) = (p.x.floor() as i64, p.y.floor() as i64, p - p.floor());
                    let row = |y: i64| texel(x, y) * (1.0 - f.x) + texel(x + 1, y) * f.x;
                    sum += row(y) * (1.0 - f.y) + row(y + 1) * f.y;
                    count += 1.0;
                }
            }
            let (value, expected) = (mean(&spots, corners), sum / count);
            // Cells are means over whole texels: exact for triangles of many, near for few.
            assert!((value / expected - 1.0).abs() < 0.25, "{corners:?}: {value}, should be {expected}");
        }
    }

    /// One bright texel is never lost, however large or thin the triangle over it, nor where it is read across an edge.
    #[test]
    fn what_shines_a_little_weighs_something() {
        for linear in [false, true] {
            let one = scene(512, Wrap::Repeat, linear, |x, y| x == 0 && y == 511);
            assert!(mean(&one, [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]) > 0.0);
            assert!(mean(&one, [[0.0, 0.9985], [0.5, 0.9986], [0.0, 0.9987]]) > 0.0);
            assert!(mean(&one, [[-9.0, -9.0], [9.0, -9.0], [-9.0, 9.0]]) > 0.0);
            let neighbour = [[0.9985, 0.9985], [0.9990, 0.9985], [0.9985, 0.9990]];
            assert_eq!(mean(&one, neighbour) > 0.0, linear, "bilinear reading reaches a texel further");
            let point = [[0.001, 0.9985]; 3];
            assert!(mean(&one, point) > 0.0);
        }
        let clamped = scene(4, Wrap::Clamp, false, |x, _| x == 3);
        assert!((mean(&clamped, [[2.0, 0.0], [3.0, 0.0], [2.0, 1.0]]) - 2.0).abs() < 1e-9);
        let mirrored = scene(4, Wrap::Mirror, false, |x, _| x == 0);
        assert!((mean(&mirrored, [[1.8, 0.1], [1.95, 0.1], [1.8, 0.2]]) - 2.0).abs() < 1e-9);
    }

    #[test]
    fn materials_without_a_texture_are_even() {
        let scene = scene(2, Wrap::Repeat, true, |_, _| true);
        let emission = Emission::new(&scene);
        assert_eq!(emission.mean(1, |_| [Vec2::ZERO; 3]), 0.0);
        assert_eq!(emission.mean(7, |_| [Vec2::ZERO; 3]), 0.0);
        assert!((emission.mean(0, |_| [Vec2::ZERO; 3]) - 2.0).abs() < 1e-6);
    }
}
