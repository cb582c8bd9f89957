//! The flattened BVH: built by obvhs, laid out for traversal.

use super::gpu_types::{BvhNode, Triangle};
use glam::Vec3;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, leaf_collapser::collapse, reinsertion::ReinsertionOptimizer};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

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
/// Clustering bottom-up (PLOC, Meister and Bittner 2018), improved by reinsertion (2018), leaves merged by SAH. Where that
/// comes out deeper than [`MAX_DEPTH`], halves by count are used instead, whose depth is logarithmic.
pub fn build(triangles: &[Triangle]) -> Bvh {
    let boxes: Vec<Aabb> = triangles.iter().map(bounds_of).collect();
    let clustered = layout(&cluster(&boxes));
    if clustered.depth <= MAX_DEPTH { clustered } else { build_balanced(&boxes) }
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

/// obvhs's own one-call builders ask for the time, which panics on wasm; this is what they do.
fn cluster(boxes: &[Aabb]) -> Bvh2 {
    const REINSERTION_BATCH: f32 = 0.05;
    const SINGLE_NEIGHBOR_PASSES: usize = 3;
    let indices = (0..boxes.len() as u32).collect();
    let mut bvh = PlocBuilder::with_capacity(boxes.len()).build(
        PlocSearchDistance::Medium,
        boxes,
        indices,
        SortPrecision::U64,
        SINGLE_NEIGHBOR_PASSES,
    );
    let mut optimizer = ReinsertionOptimizer::default();
    optimizer.run(&mut bvh, REINSERTION_BATCH, None);
    collapse(&mut bvh, MAX_LEAF, 1.0);
    optimizer.run(&mut bvh, 2.0 * REINSERTION_BATCH, None);
    bvh
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

/// Splits at the median along the longest axis of the centroids until a leaf is full: depth log2(n), whatever the shape.
fn build_balanced(boxes: &[Aabb]) -> Bvh {
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let mut nodes: Vec<BvhNode> = vec![bytemuck::Zeroable::zeroed()];
    let mut deepest = 0;
    let centroid = |i: u32| boxes[i as usize].center();
    let mut pending = vec![(0usize, 0..order.len(), 1u32)];
    while let Some((target, range, depth)) = pending.pop() {
        deepest = deepest.max(depth);
        let part = &mut order[range.clone()];
        let mut bounds = Aabb::empty();
        let mut centers = Aabb::empty();
        for &i in part.iter() {
            bounds = bounds.union(&boxes[i as usize]);
            centers.extend(centroid(i));
        }
        let (min, max): (Vec3, Vec3) = (bounds.min.into(), bounds.max.into());
        nodes[target] = if part.len() <= MAX_LEAF as usize {
            BvhNode { min, first: range.start as u32, max, count: part.len() as u32 }
        } else {
            let axis = centers.diagonal().max_position();
            let half = part.len() / 2;
            part.select_nth_unstable_by(half, |&a, &b| centroid(a)[axis].total_cmp(&centroid(b)[axis]));
            let left = nodes.len();
            nodes.resize(left + 2, bytemuck::Zeroable::zeroed());
            pending.push((left + 1, range.start + half..range.end, depth + 1));
            pending.push((left, range.start..range.start + half, depth + 1));
            BvhNode { min, first: left as u32, max, count: 0 }
        };
    }
    Bvh { nodes, order, depth: deepest }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::random::Random;

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

    #[test]
    fn small_and_large_soups() {
        for (seed, count) in [1, 2, 3, 4, 5, 8, 9, 100, 5000].into_iter().enumerate() {
            let triangles = soup(count, seed as u64);
            check(&build(&triangles), &triangles);
            let boxes: Vec<Aabb> = triangles.iter().map(bounds_of).collect();
            check(&build_balanced(&boxes), &triangles);
        }
    }

    #[test]
    fn a_tree_of_a_soup_is_better_than_halves() {
        let triangles = soup(5000, 3);
        let boxes: Vec<Aabb> = triangles.iter().map(bounds_of).collect();
        let (built, halves) = (cost(&build(&triangles).nodes), cost(&build_balanced(&boxes).nodes));
        assert!(built < 0.9 * halves, "{built} {halves}");
    }

    #[test]
    fn coincident_triangles() {
        let triangles = vec![triangle([Vec3::ZERO, Vec3::X, Vec3::Y]); 2_000];
        check(&build(&triangles), &triangles);
    }

    #[test]
    fn hostile_sizes_stay_within_the_stack() {
        // Each triangle encloses all before it: clustering makes a chain of them.
        let triangles: Vec<Triangle> = (0..400)
            .map(|i| {
                let size = 1.1f32.powi(i);
                triangle([Vec3::new(-size, -size, 0.0), Vec3::new(size, -size, 0.0), Vec3::new(0.0, size, size)])
            })
            .collect();
        let boxes: Vec<Aabb> = triangles.iter().map(bounds_of).collect();
        assert!(layout(&cluster(&boxes)).depth > MAX_DEPTH, "not hostile enough to test the fallback");
        check(&build(&triangles), &triangles);
    }
}
