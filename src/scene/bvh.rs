//! The flattened BVH: built by obvhs, laid out for traversal.

use super::gpu_types::{BvhNode, Triangle};
use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, node::Bvh2Node, reinsertion::ReinsertionOptimizer};

/// No path from the root is longer than this, in nodes: the size of the traversal's stack (`shaders/scene/bvh.wgsl`).
pub const MAX_DEPTH: u32 = 60;
/// Most triangles in a leaf.
pub const MAX_LEAF: u32 = 4;

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
/// Top-down by binned SAH (Wald 2007), then improved by obvhs's reinsertion (Meister and Bittner 2018). obvhs's own
/// bottom-up builder is not used, for equal boxes make it take quadratic time: a hostile file could hang it.
pub fn build(triangles: &[Triangle]) -> Bvh {
    let boxes: Vec<Aabb> = triangles.iter().map(bounds_of).collect();
    let mut tree = split(&boxes);
    let plain = layout(&tree);
    optimize(&mut tree);
    let optimized = layout(&tree);
    if optimized.depth <= MAX_DEPTH { optimized } else { plain }
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
    (sum / root) as f32
}

fn bounds_of(triangle: &Triangle) -> Aabb {
    let Triangle { p0, p1, p2, .. } = *triangle;
    Aabb::new(p0.min(p1).min(p2).into(), p0.max(p1).max(p2).into())
}

/// The tree before it is improved, never deeper than [`MAX_DEPTH`].
fn split(boxes: &[Aabb]) -> Bvh2 {
    let centers: Vec<Vec3A> = boxes.iter().map(Aabb::center).collect();
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let mut nodes = vec![Bvh2Node::default()];
    let mut pending = vec![(0usize, 0..order.len(), 1u32)];
    while let Some((target, range, depth)) = pending.pop() {
        let part = &mut order[range.clone()];
        let mut bounds = Aabb::empty();
        let mut center_bounds = Aabb::empty();
        for &i in part.iter() {
            bounds = bounds.union(&boxes[i as usize]);
            center_bounds.extend(centers[i as usize]);
        }
        let cut = if depth < HALVES_FROM { best_cut(part, boxes, &centers, &center_bounds) } else { None };
        let cost = cut.as_ref().map_or(f32::INFINITY, |cut| bounds.half_area() + cut.cost);
        let fits = part.len() <= MAX_LEAF as usize;
        if part.len() == 1 || (fits && cost >= bounds.half_area() * part.len() as f32) {
            nodes[target] = Bvh2Node::new(bounds, part.len() as u32, range.start as u32);
            continue;
        }
        let middle = match cut {
            Some(cut) => partition(part, |i| cut.bins.of(centers[i as usize]) <= cut.bin),
            None => halve(part, &centers, &center_bounds),
        };
        let left = nodes.len();
        nodes[target] = Bvh2Node::new(bounds, 0, left as u32);
        nodes.resize(left + 2, Bvh2Node::default());
        pending.push((left + 1, range.start + middle..range.end, depth + 1));
        pending.push((left, range.start..range.start + middle, depth + 1));
    }
    Bvh2 { nodes, primitive_indices: order, max_depth: STACK_DEPTH, ..Bvh2::default() }
}

/// Below this depth nodes are split into halves by count, so that 2^28 triangles still fit in [`MAX_DEPTH`].
const HALVES_FROM: u32 = 30;
/// What reinsertion can make of the depth, generously: the size of its stacks.
const STACK_DEPTH: usize = 512;
const BINS: usize = 16;

/// Equal intervals of the centers along one axis.
struct Bins {
    axis: usize,
    start: f32,
    scale: f32,
}

impl Bins {
    fn of(&self, center: Vec3A) -> usize {
        (((center[self.axis] - self.start) * self.scale) as usize).min(BINS - 1)
    }
}

/// Bins 0 to `bin` go left. `cost` is the sum over both sides of half area x triangles.
struct Cut {
    bins: Bins,
    bin: usize,
    cost: f32,
}

/// The cheapest cut along any axis; none if the centers coincide.
fn best_cut(part: &[u32], boxes: &[Aabb], centers: &[Vec3A], center_bounds: &Aabb) -> Option<Cut> {
    let extent = center_bounds.diagonal();
    let mut best: Option<Cut> = None;
    for axis in 0..3 {
        let bins = Bins { axis, start: center_bounds.min[axis], scale: BINS as f32 / extent[axis] };
        if !bins.scale.is_finite() {
            continue;
        }
        let mut counts = [0usize; BINS];
        let mut bounds = [Aabb::empty(); BINS];
        for &i in part {
            let bin = bins.of(centers[i as usize]);
            counts[bin] += 1;
            bounds[bin] = bounds[bin].union(&boxes[i as usize]);
        }
        let side_cost = |bounds: &Aabb, count: usize| if count == 0 { 0.0 } else { bounds.half_area() * count as f32 };
        let mut right_costs = [0.0; BINS];
        let (mut side, mut count) = (Aabb::empty(), 0);
        for bin in (1..BINS).rev() {
            side = side.union(&bounds[bin]);
            count += counts[bin];
            right_costs[bin] = side_cost(&side, count);
        }
        (side, count) = (Aabb::empty(), 0);
        for bin in 0..BINS - 1 {
            side = side.union(&bounds[bin]);
            count += counts[bin];
            let cost = side_cost(&side, count) + right_costs[bin + 1];
            let proper = count > 0 && count < part.len();
            if proper && best.as_ref().is_none_or(|best| cost < best.cost) {
                best = Some(Cut { bins: Bins { ..bins }, bin, cost });
            }
        }
    }
    best
}

/// Moves what goes left to the front; how many do.
fn partition(part: &mut [u32], goes_left: impl Fn(u32) -> bool) -> usize {
    let mut middle = 0;
    for i in 0..part.len() {
        if goes_left(part[i]) {
            part.swap(i, middle);
            middle += 1;
        }
    }
    middle
}

/// Halves by count along the longest axis of the centers.
fn halve(part: &mut [u32], centers: &[Vec3A], center_bounds: &Aabb) -> usize {
    let axis = center_bounds.diagonal().max_position();
    let middle = part.len() / 2;
    part.select_nth_unstable_by(middle, |&a, &b| centers[a as usize][axis].total_cmp(&centers[b as usize][axis]));
    middle
}

/// Moves subtrees to where they cost less, the largest first.
fn optimize(tree: &mut Bvh2) {
    /// The fraction of the nodes that the first pass tries to move, and the most nodes it tries.
    const BATCH: f32 = 0.5;
    const MAX_BATCH: f32 = 100_000.0;
    let batch = BATCH.min(MAX_BATCH / tree.nodes.len() as f32);
    ReinsertionOptimizer::default().run(tree, batch, None);
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
    use glam::Vec3;

    fn triangle(corners: [Vec3; 3]) -> Triangle {
        let [p0, p1, p2] = corners;
        Triangle { p0, p1, p2, ..bytemuck::Zeroable::zeroed() }
    }

    fn soup(count: usize, seed: u64) -> Vec<Triangle> {
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

    #[test]
    fn reinsertion_improves_a_soup() {
        let triangles = soup(5000, 3);
        let boxes: Vec<Aabb> = triangles.iter().map(bounds_of).collect();
        let (plain, optimized) = (cost(&layout(&split(&boxes)).nodes), cost(&build(&triangles).nodes));
        assert!(optimized < 0.98 * plain, "{optimized} {plain}");
    }

    #[test]
    fn coincident_triangles() {
        checked(&vec![triangle([Vec3::ZERO, Vec3::X, Vec3::Y]); 100_000]);
    }

    #[test]
    fn large_triangles_everywhere() {
        let mut random = Random::new(4);
        let corner = |random: &mut Random| random.in_box(Vec3::NEG_ONE, Vec3::ONE);
        let triangles: Vec<Triangle> = (0..30_000).map(|_| triangle([0; 3].map(|_| corner(&mut random)))).collect();
        checked(&triangles);
    }

    /// Each triangle encloses all before it, or lies ever farther out: one falls off at every split.
    #[test]
    fn hostile_sizes_and_gaps_stay_within_the_stack() {
        let nested = |i: i32| {
            let size = 1.1f32.powi(i);
            triangle([Vec3::new(-size, -size, 0.0), Vec3::new(size, -size, 0.0), Vec3::new(0.0, size, size)])
        };
        checked(&(0..200).map(nested).collect::<Vec<_>>());
        let apart = |i: i32| {
            let at = Vec3::X * 20f32.powi(i / 8);
            triangle([at, at * 1.001, at + 0.001 * at.length() * Vec3::Y])
        };
        let triangles: Vec<Triangle> = (-230..48).map(apart).collect();
        checked(&triangles);
        let boxes: Vec<Aabb> = triangles.iter().map(bounds_of).collect();
        assert!(layout(&split(&boxes)).depth > HALVES_FROM, "not hostile enough to reach the halves");
    }
}
