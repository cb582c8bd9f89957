//! The flattened BVH: a binary tree built by obvhs, which [`wide`] turns into what shaders walk.

pub mod wide;

use super::gpu_types::{BvhNode, Triangle};
use glam::Vec3;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, leaf_collapser::collapse, reinsertion::ReinsertionOptimizer};
use obvhs::ploc::morton::morton_encode_u128_unorm;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

/// No path from the root is longer than this, in nodes.
pub const MAX_DEPTH: u32 = 60;
/// No path of a top level is longer than this, in nodes: more than log2 of the instances there can be.
pub const MAX_TOP_DEPTH: u32 = 24;
/// Most triangles in a leaf.
pub const MAX_LEAF: u32 = 4;

/// How much work goes into a tree. Rates of rays and times of building are in `docs/performance.md`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Preset {
    /// Five eighths to three quarters of the time to build, for rays a twentieth slower: for the page, and for meshes rebuilt
    /// while they move.
    Quick,
    /// For everything else.
    Thorough,
}

impl Preset {
    /// Both.
    pub const ALL: [Preset; 2] = [Preset::Quick, Preset::Thorough];

    /// (how far a box looks for its nearest in Morton order, which fraction of the nodes the first pass of reinsertion tries
    /// to move).
    fn effort(self) -> (PlocSearchDistance, f32) {
        match self {
            Preset::Quick => (PlocSearchDistance::Medium, 0.05),
            Preset::Thorough => (PlocSearchDistance::High, 0.2),
        }
    }
}

impl Default for Preset {
    fn default() -> Self {
        // A page builds with one thread, before its reader.
        if cfg!(target_arch = "wasm32") { Preset::Quick } else { Preset::Thorough }
    }
}

/// A binary BVH over triangles: node 0 is the root, the two children of an inner node are adjacent.
#[derive(Debug, Clone, PartialEq)]
pub struct Bvh {
    /// Leaves count positions in `order`.
    pub nodes: Vec<BvhNode>,
    /// The triangle at each position, a permutation.
    pub order: Vec<u32>,
    /// Longest path from the root, in nodes.
    pub depth: u32,
}

/// Builds over `triangles`: at least one, all corners finite.
///
/// Clustered bottom-up by obvhs (PLOC, Meister and Bittner 2018), improved by reinsertion (the same, 2018), leaves merged
/// by SAH. Where clustering would take too long, or the tree comes out deeper than [`MAX_DEPTH`] or wants a larger stack than
/// [`wide::MAX_STACK`], halves by count are used instead, whose depth is logarithmic.
pub fn build(triangles: &[Triangle]) -> Bvh {
    build_with(triangles, Preset::default())
}

/// [`build`] with a stated effort.
pub fn build_with(triangles: &[Triangle], preset: Preset) -> Bvh {
    let boxes: Vec<Aabb> = triangles.iter().map(bounds_of).collect();
    if clusters_quickly(&boxes) {
        let clustered = layout(&cluster(&boxes, preset));
        if clustered.depth <= MAX_DEPTH && wide::collapse(&clustered.nodes, 0, 0, 0).stack <= wide::MAX_STACK {
            return clustered;
        }
    }
    halve(&boxes, MAX_LEAF)
}

/// Builds a top level over boxes (low and high corner; at least one): leaves hold one box each, `first` is its index.
pub fn build_top(boxes: &[[Vec3; 2]]) -> Vec<BvhNode> {
    let boxes: Vec<Aabb> = boxes.iter().map(|&[min, max]| Aabb::new(min.into(), max.into())).collect();
    let mut bvh = halve(&boxes, 1);
    if clusters_quickly(&boxes) {
        let clustered =
            layout(&run_ploc(&mut PlocBuilder::with_capacity(boxes.len()), &boxes, PlocSearchDistance::Medium));
        let stack = wide::collapse(&clustered.nodes, 0, 0, 0).stack;
        if clustered.depth <= MAX_TOP_DEPTH && stack <= wide::MAX_TOP_STACK {
            bvh = clustered;
        }
    }
    for node in bvh.nodes.iter_mut().filter(|node| node.count != 0) {
        node.first = bvh.order[node.first as usize];
    }
    bvh.nodes
}

/// Makes the boxes of `nodes` fit `triangles` again, after those have moved; the tree stays. Nodes and triangles count from
/// the bottom level's own first, and children stand after their parent.
pub fn refit(nodes: &mut [BvhNode], triangles: &[Triangle]) {
    for i in (0..nodes.len()).rev() {
        let BvhNode { first, count, .. } = nodes[i];
        let first = first as usize;
        let (mut min, mut max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        if count == 0 {
            for child in nodes.get(first..first + 2).unwrap_or_default() {
                (min, max) = (min.min(child.min), max.max(child.max));
            }
        } else {
            for t in triangles.get(first..first + count as usize).unwrap_or_default() {
                (min, max) = (min.min(t.p0).min(t.p1).min(t.p2), max.max(t.p0).max(t.p1).max(t.p2));
            }
        }
        (nodes[i].min, nodes[i].max) = (min, max);
    }
}

/// SAH cost for a ray that hits the root's box: 1 for a node tested, 1 for a triangle tested.
pub fn cost(nodes: &[BvhNode]) -> f32 {
    let half_area = |node: &BvhNode| {
        let d = (node.max - node.min).as_dvec3();
        d.x * d.y + d.y * d.z + d.z * d.x
    };
    let root = nodes.first().map_or(0.0, half_area);
    if root <= 0.0 {
        return nodes.len() as f32;
    }
    let sum: f64 = nodes.iter().map(|node| half_area(node) * f64::from(node.count.max(1))).sum();
    // A huge node beside a tiny root is still a number, which reports can hold.
    (sum / root).min(f64::from(f32::MAX)) as f32
}

fn bounds_of(triangle: &Triangle) -> Aabb {
    let [min, max] = triangle.bounds();
    Aabb::new(min.into(), max.into())
}

/// Clusters and optimises. obvhs's own one-call builders ask for the time, which panics on wasm; this is what they do.
fn cluster(boxes: &[Aabb], preset: Preset) -> Bvh2 {
    /// Reinsertion can deepen the tree, and panics where its stack, of twice this, is full.
    const STACK_DEPTH: usize = 512;
    let (distance, batch) = preset.effort();
    let mut tree = run_ploc(&mut PlocBuilder::with_capacity(boxes.len()), boxes, distance);
    tree.max_depth = tree.max_depth.max(STACK_DEPTH);
    let mut optimizer = ReinsertionOptimizer::default();
    optimizer.run(&mut tree, batch, None);
    collapse(&mut tree, MAX_LEAF, 1.0);
    optimizer.run(&mut tree, 2.0 * batch, None);
    tree
}

fn run_ploc(builder: &mut PlocBuilder, boxes: &[Aabb], distance: PlocSearchDistance) -> Bvh2 {
    /// The first passes look only at direct neighbours, which is faster.
    const SINGLE_NEIGHBOR_PASSES: usize = 3;
    let indices = (0..boxes.len() as u32).collect();
    // With 42 bits an axis, a small thing in a large scene is ordered well, too.
    builder.build(distance, boxes, indices, SortPrecision::U128, SINGLE_NEIGHBOR_PASSES)
}

/// Whether PLOC takes few passes, or the boxes are few.
///
/// A pass merges the boxes that are each other's nearest within the search distance, in Morton order: normally a fixed
/// fraction of all. But where boxes coincide, lie within each other or ever farther apart, each is nearest to the next: a
/// pass merges one pair, and n boxes take n passes of up to n. Such a run takes as many passes in a part of the order as
/// in the whole, so clustering it block by block shows it, in time linear in the number of blocks.
fn clusters_quickly(boxes: &[Aabb]) -> bool {
    /// Boxes of a block; so many are clustered in milliseconds at worst.
    const BLOCK: usize = 1024;
    /// Most passes for a block; about 20 are normal.
    const MAX_PASSES: usize = 256;
    /// Most boxes with the same Morton code: their order is that of the file, which a block need not show.
    const MAX_EQUAL: usize = 64;
    if boxes.len() <= BLOCK {
        return true;
    }
    let bounds = boxes.iter().fold(Aabb::empty(), |all, part| all.union(part));
    let scale = bounds.diagonal().as_dvec3().recip();
    let code = |part: &Aabb| morton_encode_u128_unorm((part.center() - bounds.min).as_dvec3() * scale);
    let mut order: Vec<(u128, u32)> = boxes.iter().map(code).zip(0..).collect();
    order.sort_unstable();
    if order.windows(MAX_EQUAL + 1).any(|run| run[0].0 == run[MAX_EQUAL].0) {
        return false;
    }
    // With the corners of the whole, the Morton order of a block is that of the whole.
    let corners = [bounds.min, bounds.max].map(Aabb::from_point);
    let mut builder = PlocBuilder::new();
    order.chunks(BLOCK).all(|block| {
        let part: Vec<Aabb> = block.iter().map(|&(_, i)| boxes[i as usize]).chain(corners).collect();
        // obvhs sets this to the number of passes where that is above 96.
        run_ploc(&mut builder, &part, PlocSearchDistance::Medium).max_depth <= MAX_PASSES
    })
}

/// Splits at the median along the longest axis of the centers until a leaf is full: depth log2(n), whatever the shape.
fn halve(boxes: &[Aabb], max_leaf: u32) -> Bvh {
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let mut nodes: Vec<BvhNode> = vec![bytemuck::Zeroable::zeroed()];
    let mut deepest = 0;
    let center = |i: u32| boxes[i as usize].center();
    // (node, its part of the order, depth)
    let mut pending = vec![(0usize, 0..order.len(), 1u32)];
    while let Some((target, range, depth)) = pending.pop() {
        deepest = deepest.max(depth);
        let part = &mut order[range.clone()];
        let (mut bounds, mut centers) = (Aabb::empty(), Aabb::empty());
        for &i in part.iter() {
            bounds = bounds.union(&boxes[i as usize]);
            centers.extend(center(i));
        }
        let (min, max) = (bounds.min.into(), bounds.max.into());
        nodes[target] = if part.len() <= max_leaf as usize {
            BvhNode { min, first: range.start as u32, max, count: part.len() as u32 }
        } else {
            let axis = centers.diagonal().max_position();
            let middle = part.len() / 2;
            part.select_nth_unstable_by(middle, |&a, &b| center(a)[axis].total_cmp(&center(b)[axis]));
            let left = nodes.len();
            nodes.resize(left + 2, bytemuck::Zeroable::zeroed());
            pending.push((left + 1, range.start + middle..range.end, depth + 1));
            pending.push((left, range.start..range.start + middle, depth + 1));
            BvhNode { min, first: left as u32, max, count: 0 }
        };
    }
    Bvh { nodes, order, depth: deepest }
}

/// Copies an obvhs tree depth first, siblings together, so that what is near in the tree is near in memory.
fn layout(bvh: &Bvh2) -> Bvh {
    let mut out = Bvh {
        nodes: Vec::with_capacity(bvh.nodes.len()),
        order: Vec::with_capacity(bvh.primitive_indices.len()),
        depth: 0,
    };
    out.nodes.push(bytemuck::Zeroable::zeroed());
    // (node there, node here, depth)
    let mut pending = vec![(0usize, 0usize, 1u32)];
    while let Some((source, target, depth)) = pending.pop() {
        let node = &bvh.nodes[source];
        let (min, max) = (node.aabb().min.into(), node.aabb().max.into());
        out.depth = out.depth.max(depth);
        let first = node.first_index as usize;
        out.nodes[target] = if node.is_leaf() {
            let start = out.order.len() as u32;
            out.order.extend_from_slice(&bvh.primitive_indices[first..first + node.prim_count as usize]);
            BvhNode { min, first: start, max, count: node.prim_count }
        } else {
            let left = out.nodes.len();
            out.nodes.resize(left + 2, bytemuck::Zeroable::zeroed());
            pending.push((first + 1, left + 1, depth + 1));
            pending.push((first, left, depth + 1));
            BvhNode { min, first: left as u32, max, count: 0 }
        };
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::random::Random;
    use glam::UVec3;
    use std::f32::consts::{PI, TAU};
    use std::time::{Duration, Instant};

    fn triangle(corners: [Vec3; 3]) -> Triangle {
        let [p0, p1, p2] = corners;
        Triangle { p0, p1, p2, ..bytemuck::Zeroable::zeroed() }
    }

    pub(super) fn soup(count: usize, seed: u64) -> Vec<Triangle> {
        let mut random = Random::new(seed);
        (0..count)
            .map(|_| {
                let center = random.in_box(Vec3::NEG_ONE, Vec3::ONE);
                let size = 0.3 * random.unit().powi(3) + 1e-3;
                triangle([0; 3].map(|_| center + size * random.direction()))
            })
            .collect()
    }

    /// Every triangle is in exactly one leaf; boxes hold their contents; children are adjacent and used once; the depth
    /// is as stated and not too large.
    fn check(bvh: &Bvh, triangles: &[Triangle]) {
        let mut seen = vec![false; triangles.len()];
        let mut visited = vec![false; bvh.nodes.len()];
        let mut deepest = 0;
        let mut pending = vec![(0usize, 1)];
        while let Some((i, depth)) = pending.pop() {
            deepest = deepest.max(depth);
            assert!(!std::mem::replace(&mut visited[i], true), "node {i} twice");
            let node = bvh.nodes[i];
            let inside = |min: Vec3, max: Vec3| min.cmpge(node.min).all() && max.cmple(node.max).all();
            if node.count == 0 {
                for child in [node.first as usize, node.first as usize + 1] {
                    assert!(inside(bvh.nodes[child].min, bvh.nodes[child].max));
                    pending.push((child, depth + 1));
                }
            } else {
                assert!(node.count <= MAX_LEAF);
                for position in node.first..node.first + node.count {
                    let index = bvh.order[position as usize] as usize;
                    assert!(!std::mem::replace(&mut seen[index], true), "triangle {index} twice");
                    let Triangle { p0, p1, p2, .. } = triangles[index];
                    assert!(inside(p0.min(p1).min(p2), p0.max(p1).max(p2)));
                }
            }
        }
        assert!(seen.iter().all(|s| *s) && visited.iter().all(|v| *v));
        assert_eq!(deepest, bvh.depth);
        assert!(deepest <= MAX_DEPTH);
    }

    fn checked(triangles: &[Triangle]) -> Bvh {
        let bvh = build(triangles);
        check(&bvh, triangles);
        bvh
    }

    #[test]
    fn small_and_large_soups() {
        for (seed, count) in [1, 2, 3, 4, 5, 8, 9, 100, 5000].into_iter().enumerate() {
            checked(&soup(count, seed as u64));
        }
    }

    fn boxes_of(triangles: &[Triangle]) -> Vec<Aabb> {
        triangles.iter().map(bounds_of).collect()
    }

    #[test]
    fn halves_hold_their_contents() {
        for count in [1, 4, 5, 100, 5000] {
            let triangles = soup(count, 7);
            check(&halve(&boxes_of(&triangles), MAX_LEAF), &triangles);
        }
    }

    #[test]
    fn a_clustered_soup_is_better_than_halves() {
        let triangles = soup(5000, 3);
        let (built, halves) = (cost(&build(&triangles).nodes), cost(&halve(&boxes_of(&triangles), MAX_LEAF).nodes));
        assert!(built < 0.9 * halves, "{built} {halves}");
    }

    /// At `at`, in a box of about `size`.
    pub(super) fn small(at: Vec3, size: f32) -> Triangle {
        triangle([at, at + size * Vec3::X, at + size * Vec3::new(0.3, 1.0, 0.2)])
    }

    /// Centred at the origin.
    pub(super) fn shell(size: f32) -> Triangle {
        triangle([Vec3::new(-size, -size, -size), Vec3::new(size, -size, size), Vec3::new(0.0, size, 0.0)])
    }

    /// What would take minutes to cluster is built in time.
    #[test]
    fn hostile_inputs_are_halved() {
        let count = 100_000;
        let each = |triangle: &dyn Fn(u32) -> Triangle| (0..count).map(triangle).collect::<Vec<_>>();
        let cases = [
            ("coincident", each(&|_| small(Vec3::ZERO, 1.0))),
            ("concentric", each(&|i| shell(1.0 + i as f32))),
            ("nested", each(&|i| small(Vec3::splat(-(i as f32)), 1.0 + 3.0 * i as f32))),
            ("ever larger and farther", each(&|i| small(1.0003f32.powi(i as i32) * Vec3::X, 1.0003f32.powi(i as i32)))),
            ("ever farther", each(&|i| small((i as f32).powi(2) * Vec3::X, 1.0))),
            ("a row of equal boxes", each(&|i| small(i as f32 * Vec3::X, 0.8))),
            // Pairs merge, then the pairs are in a row.
            ("pairs in a row", each(&|i| small((i / 2) as f32 * Vec3::X, 0.8))),
            ("half of them coincident", soup(count as usize / 2, 5).into_iter().chain(each(&|_| shell(0.1))).collect()),
        ];
        for (name, triangles) in cases {
            let start = Instant::now();
            assert!(!clusters_quickly(&boxes_of(&triangles)), "{name}");
            let bvh = checked(&triangles);
            assert!(start.elapsed() < Duration::from_secs(3), "{name}: {:?}", start.elapsed());
            assert!(bvh.depth <= 18, "{name}: {}", bvh.depth);
        }
    }

    #[test]
    fn regular_inputs_are_clustered() {
        let grid = |n: u32, spacing: f32| -> Vec<Triangle> {
            let at = |i: u32| spacing * Vec3::new((i % n) as f32, 0.0, (i / n) as f32);
            (0..n * n).map(|i| small(at(i), 0.8 * spacing)).collect()
        };
        let block = |n: u32| -> Vec<Triangle> {
            let at = |i: u32| UVec3::new(i % n, i / n % n, i / n / n).as_vec3();
            (0..n * n * n).map(|i| small(at(i), 0.5)).collect()
        };
        // Pole to pole, of two triangles each: they have the same box where the sides are along the axes.
        let quads = |n: u32, at: &dyn Fn(u32, u32) -> Vec3| -> Vec<Triangle> {
            let corners = |i, j| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            let halves = |[a, b, c, d]: [Vec3; 4]| [triangle([a, b, c]), triangle([a, c, d])];
            (0..n * n).flat_map(|k| halves(corners(k % n, k / n))).collect()
        };
        let sphere = |i: u32, j: u32| {
            let ((sin_theta, cos_theta), (sin_phi, cos_phi)) =
                ((i as f32 * PI / 200.0).sin_cos(), (j as f32 * TAU / 200.0).sin_cos());
            Vec3::new(sin_theta * cos_phi, cos_theta, sin_theta * sin_phi)
        };
        let cases = [
            ("a grid", grid(300, 1.0)),
            ("a grid with rounding", grid(300, 0.1)),
            ("a grid of a power of two", grid(256, 1.0)),
            ("a block", block(40)),
            ("a plane of squares", quads(300, &|i, j| Vec3::new(i as f32, 0.0, j as f32))),
            ("a sphere", quads(200, &sphere)),
            ("a soup", soup(100_000, 6)),
            ("8 copies of each", soup(2000, 8).iter().flat_map(|t| [*t; 8]).collect()),
        ];
        for (name, triangles) in cases {
            let start = Instant::now();
            assert!(clusters_quickly(&boxes_of(&triangles)), "{name}");
            let bvh = checked(&triangles);
            // Clustering that has become quadratic takes minutes; a busy machine must not look like that.
            assert!(start.elapsed() < Duration::from_secs(15), "{name}: {:?}", start.elapsed());
            let halves = cost(&halve(&boxes_of(&triangles), MAX_LEAF).nodes);
            assert!(cost(&bvh.nodes) < halves, "{name}: {} {halves}", cost(&bvh.nodes));
        }
    }

    #[test]
    fn large_triangles_everywhere() {
        let mut random = Random::new(4);
        let corner = |random: &mut Random| random.in_box(Vec3::NEG_ONE, Vec3::ONE);
        let triangles: Vec<Triangle> = (0..30_000).map(|_| triangle([0; 3].map(|_| corner(&mut random)))).collect();
        checked(&triangles);
    }

    /// Few triangles are always clustered. Where each encloses all before it, or lies ever farther out, that makes a chain.
    #[test]
    fn deep_trees_are_halved() {
        let apart = |i: i32| small(Vec3::X * 20f32.powi(i / 8), 1e-3 * 20f32.powi(i / 8));
        let cases = [
            ("nested", (0..200).map(|i| shell(1.1f32.powi(i))).collect::<Vec<_>>()),
            ("apart", (-230..48).map(apart).collect()),
        ];
        for (name, triangles) in cases {
            let boxes = boxes_of(&triangles);
            assert!(clusters_quickly(&boxes), "{name}");
            assert!(layout(&cluster(&boxes, Preset::Quick)).depth > MAX_DEPTH, "{name} is not hostile enough");
            assert!(checked(&triangles).depth < 10, "{name}");
        }
    }
}
