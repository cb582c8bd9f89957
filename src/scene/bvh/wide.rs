//! The BVH as shaders walk it: a binary tree collapsed to four children a node, their boxes on a grid of 8 bits a plane.
//!
//! After Ylitie, Karras and Laine 2017 ("Efficient incoherent ray traversal on GPUs through compressed wide BVHs"), with
//! four children instead of eight: 64 bytes hold what two levels of the binary tree hold in 128. Boxes only grow.

use crate::scene::gpu_types::{BvhNode, WideNode};
use glam::Vec3;

/// Marks a child that is a leaf.
pub const LEAF: u32 = 1 << 31;
/// Where a leaf's number of items less one begins.
const COUNT_SHIFT: u32 = 28;
/// Most items in a leaf, which names them in 28 bits.
pub const MAX_ITEMS: u32 = 8;
/// Most entries that the traversal's stack needs for a bottom level and for a top level. With an entry between the two they
/// fit `BVH_STACK` in `shaders/scene/bvh.wgsl`.
pub const MAX_STACK: u32 = 64;
/// As [`MAX_STACK`], for a top level.
pub const MAX_TOP_STACK: u32 = 31;

/// A tree of wide nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Wide {
    /// The first is the root; children come after their parent.
    pub nodes: Vec<WideNode>,
    /// Entries of the traversal's stack that a ray can need.
    pub stack: u32,
}

/// Most nodes that [`collapse`] makes of a binary tree of so many.
pub const fn capacity(binary_nodes: usize) -> usize {
    if binary_nodes < 3 { 1 } else { binary_nodes / 2 }
}

/// Collapses the binary tree below `nodes[root]`. The result will lie at index `first_node` of all wide nodes; `first_item`
/// is added to what leaves name.
pub fn collapse(nodes: &[BvhNode], root: usize, first_node: u32, first_item: u32) -> Wide {
    Collapse::new(nodes, root, first_node, first_item).finish()
}

/// As [`collapse`], of a tree that was built within the limits and has been refitted since: other boxes are opened, and another
/// stack is needed. Where that is more than [`MAX_STACK`], nodes keep the two children they had, which take as many entries as
/// the tree is deep.
pub fn collapse_refitted(nodes: &[BvhNode], root: usize, first_node: u32, first_item: u32) -> Wide {
    let wide = collapse(nodes, root, first_node, first_item);
    if wide.stack <= MAX_STACK {
        return wide;
    }
    Collapse { most_children: 2, ..Collapse::new(nodes, root, first_node, first_item) }.finish()
}

/// A collapse that can be done in parts.
pub struct Collapse<'a> {
    nodes: &'a [BvhNode],
    first_node: u32,
    first_item: u32,
    most_children: usize,
    /// (binary node, its wide one, stack entries below it)
    pending: Vec<(usize, usize, u32)>,
    /// What is done so far.
    pub wide: Wide,
}

impl<'a> Collapse<'a> {
    /// Starts what [`collapse`] does.
    pub fn new(nodes: &'a [BvhNode], root: usize, first_node: u32, first_item: u32) -> Self {
        let wide = Wide { nodes: vec![bytemuck::Zeroable::zeroed()], stack: 0 };
        Collapse { nodes, first_node, first_item, most_children: 4, pending: vec![(root, 0, 0)], wide }
    }

    fn finish(mut self) -> Wide {
        while !self.go_on(usize::MAX) {}
        self.wide
    }

    /// Makes at most `count` more nodes; whether that was all.
    pub fn go_on(&mut self, count: usize) -> bool {
        let Collapse { nodes, wide, pending, most_children, .. } = self;
        for _ in 0..count {
            let Some((source, target, below)) = pending.pop() else { return true };
            let children = open(nodes, source, *most_children);
            let mut references = [0; 4];
            let mut boxes = [None; 4];
            let entries = below + children.count as u32 - 1;
            wide.stack = wide.stack.max(entries);
            let first_inner = wide.nodes.len();
            let mut inner = 0;
            for (k, node) in children.list().filter_map(|i| nodes.get(i)).enumerate() {
                boxes[k] = Some([node.min, node.max]);
                references[k] = if node.count == 0 {
                    inner += 1;
                    self.first_node + (first_inner + inner - 1) as u32
                } else {
                    LEAF | ((node.count.min(MAX_ITEMS) - 1) << COUNT_SHIFT) | (node.first + self.first_item)
                };
            }
            wide.nodes.resize(first_inner + inner, bytemuck::Zeroable::zeroed());
            wide.nodes[target] = encode(boxes, references);
            // The first child last: it is walked, and so laid out, first.
            let mut place = first_inner + inner;
            for i in children.list().rev().filter(|&i| nodes.get(i).is_some_and(|node| node.count == 0)) {
                place -= 1;
                pending.push((i, place, entries));
            }
        }
        pending.is_empty()
    }
}

/// Up to four binary nodes that become the children of one wide node.
struct Children {
    nodes: [usize; 4],
    count: usize,
}

impl Children {
    fn list(&self) -> impl DoubleEndedIterator<Item = usize> + '_ {
        self.nodes[..self.count].iter().copied()
    }
}

/// The children of a binary node, the largest inner ones of them replaced by theirs until there are `most` (two to four). A
/// leaf is its own only child.
fn open(nodes: &[BvhNode], source: usize, most: usize) -> Children {
    let mut children = Children { nodes: [source, 0, 0, 0], count: 1 };
    while children.count < most {
        let area = |k: &usize| half_area(&nodes[children.nodes[*k]]);
        let inner = (0..children.count).filter(|&k| nodes[children.nodes[k]].count == 0);
        let Some(largest) = inner.max_by(|a, b| area(a).total_cmp(&area(b))) else { break };
        let first = nodes[children.nodes[largest]].first as usize;
        children.nodes[largest] = first;
        children.nodes[children.count] = first + 1;
        children.count += 1;
    }
    children
}

fn half_area(node: &BvhNode) -> f32 {
    let d = node.max - node.min;
    d.x * d.y + d.y * d.z + d.z * d.x
}

/// Puts the boxes on the node's grid. A missing child has planes that no ray is between; should rounding say otherwise, it
/// is the first child over again, which does no harm.
fn encode(boxes: [Option<[Vec3; 2]>; 4], mut children: [u32; 4]) -> WideNode {
    let present = || boxes.iter().flatten();
    let (min, max) =
        present().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), b| (min.min(b[0]), max.max(b[1])));
    let mut grid = [min.x.to_bits(), min.y.to_bits(), min.z.to_bits(), 0];
    let mut planes = [[0u32; 3]; 2];
    for axis in 0..3 {
        let exponent = exponent(f64::from(max[axis]) - f64::from(min[axis]));
        grid[3] |= exponent << (8 * axis);
        let step = f64::from(f32::from_bits(exponent << 23));
        for (k, corners) in boxes.iter().enumerate() {
            let at = |corner: Vec3| (f64::from(corner[axis]) - f64::from(min[axis])) / step;
            let [low, high] = match corners {
                Some([low, high]) => {
                    [at(*low).floor().clamp(0.0, 255.0) as u32, at(*high).ceil().clamp(0.0, 255.0) as u32]
                }
                None => [255, 0],
            };
            planes[0][axis] |= low << (8 * k);
            planes[1][axis] |= high << (8 * k);
        }
    }
    for (child, corners) in (0..4).zip(&boxes) {
        if corners.is_none() {
            children[child] = children[0];
        }
    }
    let [low, high] = planes;
    WideNode { grid, planes_0: [low[0], low[1], low[2], high[0]], planes_1: [high[1], high[2], 0, 0], children }
}

/// The biased exponent of the smallest power of two of which 255 steps cover `extent`.
fn exponent(extent: f64) -> u32 {
    let mut exponent = ((extent.max(1e-37) / 255.0).log2().ceil() as i32 + 127).clamp(1, 254) as u32;
    // The logarithm may be rounded down.
    while exponent < 254 && 255.0 * f64::from(f32::from_bits(exponent << 23)) < extent {
        exponent += 1;
    }
    exponent
}

#[cfg(test)]
mod tests {
    use super::super::tests::{shell, small, soup};
    use super::super::{MAX_DEPTH, build, build_top};
    use super::*;

    /// The box of a child as a shader sees it; none where there is no child.
    fn child_box(node: &WideNode, child: usize) -> Option<[Vec3; 2]> {
        let byte = |word: u32| (word >> (8 * child)) & 255;
        let [low_x, low_y, low_z, high_x] = node.planes_0.map(byte);
        let [high_y, high_z, ..] = node.planes_1.map(byte);
        let at = |axis: usize, steps: u32| {
            f32::from_bits(node.grid[axis]) + f32::from_bits(((node.grid[3] >> (8 * axis)) & 255) << 23) * steps as f32
        };
        let corner = |steps: [u32; 3]| Vec3::from_array([0, 1, 2].map(|axis| at(axis, steps[axis])));
        (low_x <= high_x).then(|| [corner([low_x, low_y, low_z]), corner([high_x, high_y, high_z])])
    }

    /// Everything is in exactly one leaf, within the boxes of all nodes above it, and the stack is as deep as stated.
    fn check(binary: &[BvhNode], items: &[[Vec3; 2]]) -> Wide {
        let wide = collapse(binary, 0, 100, 1000);
        assert!(wide.nodes.len() <= capacity(binary.len()), "{} of {}", wide.nodes.len(), binary.len());
        let mut seen = vec![false; items.len()];
        let mut deepest = 0;
        let everything = [Vec3::splat(f32::MIN), Vec3::splat(f32::MAX)];
        let mut pending = vec![(0usize, everything, 0)];
        while let Some((index, bounds, below)) = pending.pop() {
            let node = &wide.nodes[index];
            let boxes: Vec<_> = (0..4).filter_map(|k| child_box(node, k).map(|b| (node.children[k], b))).collect();
            let entries = below + boxes.len() as u32 - 1;
            deepest = deepest.max(entries);
            for (child, [min, max]) in boxes {
                let inside = [min.max(bounds[0]), max.min(bounds[1])];
                if child & LEAF == 0 {
                    let child = (child - 100) as usize;
                    assert!(child > index);
                    pending.push((child, inside, entries));
                    continue;
                }
                let first = (child & 0x0fff_ffff) - 1000;
                for item in first..=first + ((child >> COUNT_SHIFT) & 7) {
                    assert!(!std::mem::replace(&mut seen[item as usize], true), "{item} twice");
                    let [low, high] = items[item as usize];
                    assert!(low.cmpge(inside[0]).all() && high.cmple(inside[1]).all(), "{item} sticks out");
                }
            }
        }
        assert!(seen.iter().all(|s| *s));
        assert_eq!(deepest, wide.stack);
        wide
    }

    #[test]
    fn holds_what_the_binary_tree_holds() {
        for (seed, count) in [1, 2, 5, 9, 100, 5000].into_iter().enumerate() {
            for scale in [1.0, 1e-6, 1e6] {
                let mut triangles = soup(count, seed as u64);
                for t in &mut triangles {
                    let offset = Vec3::new(3.0, -700.0, 0.1);
                    (t.p0, t.p1, t.p2) = ((t.p0 + offset) * scale, (t.p1 + offset) * scale, (t.p2 + offset) * scale);
                }
                let bvh = build(&triangles);
                let boxes: Vec<[Vec3; 2]> = bvh
                    .order
                    .iter()
                    .map(|&i| &triangles[i as usize])
                    .map(|t| [t.p0.min(t.p1).min(t.p2), t.p0.max(t.p1).max(t.p2)])
                    .collect();
                let wide = check(&bvh.nodes, &boxes);
                assert!(wide.stack <= MAX_STACK);
            }
        }
    }

    #[test]
    fn nodes_have_about_three_children() {
        let bvh = build(&soup(20_000, 9));
        let wide = collapse(&bvh.nodes, 0, 0, 0);
        let children: usize = wide.nodes.iter().map(|n| (0..4).filter(|&k| child_box(n, k).is_some()).count()).sum();
        assert!(children as f32 > 2.9 * wide.nodes.len() as f32, "{children} of {}", wide.nodes.len());
    }

    #[test]
    fn top_levels_hold_their_instances() {
        for count in [1usize, 2, 7, 500] {
            let boxes: Vec<[Vec3; 2]> = soup(count, 3).iter().map(|t| [t.p0.min(t.p1), t.p0.max(t.p1)]).collect();
            let wide = check(&build_top(&boxes), &boxes);
            assert!(wide.stack <= MAX_TOP_STACK);
        }
    }

    /// Trees that need a deep stack are built another way.
    #[test]
    fn the_stack_is_never_too_small() {
        let nested: Vec<_> = (0..60).map(|i| shell(1.5f32.powi(i))).collect();
        let apart: Vec<_> = (0..50).map(|i| small(3f32.powi(i / 2) * Vec3::X, 1e-3 * 3f32.powi(i / 2))).collect();
        for triangles in [nested, apart] {
            assert!(collapse(&build(&triangles).nodes, 0, 0, 0).stack <= MAX_STACK);
        }
    }

    /// A refitted tree may have grown wide bushes beside a long, small stem.
    #[test]
    fn refitted_trees_need_no_larger_stack() {
        let inner =
            |size: f32, first: u32| BvhNode { min: -Vec3::splat(size), first, max: Vec3::splat(size), count: 0 };
        let leaf = || BvhNode { count: 1, ..inner(0.1, 0) };
        let mut nodes = vec![inner(9.0, 1)];
        for _ in 1..MAX_DEPTH - 3 {
            let first = nodes.len() as u32;
            // The stem goes on after the six nodes of a bush.
            nodes.extend([inner(1.0, first + 8), inner(3.0, first + 2), inner(2.0, first + 4), inner(2.0, first + 6)]);
            nodes.extend([leaf(), leaf(), leaf(), leaf()]);
        }
        nodes.extend([leaf(), leaf()]);
        assert!(collapse(&nodes, 0, 0, 0).stack > MAX_STACK);
        let wide = collapse_refitted(&nodes, 0, 0, 0);
        assert!(wide.stack <= MAX_STACK && wide.nodes.len() <= capacity(nodes.len()), "{}", wide.stack);
        let is_leaf = |node: &WideNode, k: usize| child_box(node, k).is_some() && node.children[k] & LEAF != 0;
        let leaves: usize = wide.nodes.iter().map(|node| (0..4).filter(|&k| is_leaf(node, k)).count()).sum();
        assert_eq!(leaves, nodes.iter().filter(|node| node.count != 0).count());
    }
}
