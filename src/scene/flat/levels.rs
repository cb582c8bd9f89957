//! The two levels: which meshes are merged, which keep a bottom level of their own, and where those stand.

use super::triangles::{self, Soup};
use super::{FlatInstance, FlatMesh};
use crate::error::{Error, Result};
use crate::scene::bvh::{self, Bvh};
use crate::scene::gpu_types::{BvhNode, NONE, Triangle, TriangleAttributes};
use crate::scene::{MAX_TRIANGLES, Scene};
use glam::{Mat3, Mat4, Vec3, Vec4};

/// How often progress is told at most.
const MAX_REPORTS: usize = 100;
/// A mesh in several places keeps one bottom level for all of them if copies would cost at least this many triangles
/// (about 40 MB), for rays through merged triangles are faster.
const MIN_SAVED: u64 = 1 << 18;
/// Below this many triangles copies are cheaper than entering a bottom level.
const MIN_SHARED: u64 = 64;

/// The geometry of a flat scene.
pub(super) struct Levels {
    pub nodes: Vec<BvhNode>,
    pub triangles: Vec<Triangle>,
    pub attributes: Vec<TriangleAttributes>,
    pub meshes: Vec<FlatMesh>,
    pub instances: Vec<FlatInstance>,
    /// Triangles left out.
    pub dropped: u64,
    /// Longest path through both levels, in nodes.
    pub depth: u32,
}

/// What becomes one bottom level.
struct Group {
    /// Index into [`Scene::meshes`], or `NONE` for the merged one.
    mesh: u32,
    /// Indices into [`Scene::instances`]: where it stands, or what is merged.
    instances: Vec<u32>,
}

/// Merges what never moves and stands in one place, and gives every other mesh a bottom level of its own.
fn groups(scene: &Scene) -> Result<Vec<Group>> {
    let mut uses: Vec<Vec<u32>> = vec![Vec::new(); scene.meshes.len()];
    for (i, instance) in scene.instances.iter().enumerate() {
        let missing = || Error::bad_value(format!("instance {i}"), format!("there is no mesh {}", instance.mesh));
        uses.get_mut(instance.mesh as usize).ok_or_else(missing)?.push(i as u32);
    }
    let mut merged = Group { mesh: NONE, instances: Vec::new() };
    let mut own = Vec::new();
    let mut total = 0u64;
    for (mesh, uses) in uses.into_iter().enumerate() {
        let triangles = scene.meshes[mesh].indices.len() as u64 / 3;
        let is_shared = triangles >= MIN_SHARED && uses.len().saturating_sub(1) as u64 * triangles >= MIN_SAVED;
        let (mut stays, mut moves) = (uses, Vec::new());
        // What cannot be undone cannot have a space of its own.
        if is_shared {
            (moves, stays) = stays.into_iter().partition(|&i| is_invertible(scene.instances[i as usize].transform));
        }
        total += stays.len() as u64 * triangles + if moves.is_empty() { 0 } else { triangles };
        merged.instances.extend(stays);
        if !moves.is_empty() {
            own.push(Group { mesh: mesh as u32, instances: moves });
        }
    }
    if total > MAX_TRIANGLES {
        return Err(Error::Limit {
            what: "the scene after instancing".into(),
            wanted: total,
            had: MAX_TRIANGLES,
            unit: "triangles",
        });
    }
    // In the order of the scene, as a reader of the merged mesh expects.
    merged.instances.sort_unstable();
    let is_needed = !merged.instances.is_empty() || own.is_empty();
    Ok(is_needed.then_some(merged).into_iter().chain(own).collect())
}

/// Whether a transform can be undone in f32.
pub(crate) fn is_invertible(transform: Mat4) -> bool {
    let linear = Mat3::from_mat4(transform);
    let size = linear.x_axis.length() * linear.y_axis.length() * linear.z_axis.length();
    // A shear below a thousandth of a right angle's volume is taken for a flat thing.
    linear.determinant().abs() > 1e-3 * size && transform.inverse().is_finite() && size > 1e-30
}

/// Builds the bottom levels and the top level over them.
pub(super) fn build(scene: &Scene, progress: &mut dyn FnMut(f32, &str)) -> Result<Levels> {
    let groups = groups(scene)?;
    triangles::check_all(scene)?;
    let mut levels = Levels {
        nodes: Vec::new(),
        triangles: Vec::new(),
        attributes: Vec::new(),
        meshes: Vec::new(),
        instances: Vec::new(),
        dropped: 0,
        depth: 0,
    };
    let count = groups.len();
    for (i, group) in groups.iter().enumerate() {
        let mut report = |fraction: f32, what: &str| progress((i as f32 + fraction) / count as f32, what);
        let mut soup = Soup::default();
        if group.mesh == NONE {
            let parts = group.instances.len();
            for (k, &index) in group.instances.iter().enumerate() {
                // Each report may cross a thread.
                if k.is_multiple_of(parts.div_ceil(MAX_REPORTS)) {
                    report(0.3 * k as f32 / parts as f32, "placing meshes");
                }
                let instance = &scene.instances[index as usize];
                soup.add(scene, &scene.meshes[instance.mesh as usize], instance.transform);
            }
        } else {
            soup.add(scene, &scene.meshes[group.mesh as usize], Mat4::IDENTITY);
        }
        report(0.3, "building the BVH");
        levels.add(scene, group, soup);
    }
    let root_boxes: Vec<[Vec3; 2]> = levels.instances.iter().map(|i| levels.box_of(i)).collect();
    if levels.has_top() {
        let top = top_level(&root_boxes, levels.nodes.len() as u32);
        levels.depth += bvh::MAX_TOP_DEPTH;
        levels.nodes.extend(top);
    }
    Ok(levels)
}

impl Levels {
    /// Whether there is more than the merged mesh.
    fn has_top(&self) -> bool {
        !matches!(&self.meshes[..], [only] if only.source == NONE)
    }

    fn add(&mut self, scene: &Scene, group: &Group, mut soup: Soup) {
        self.dropped += soup.dropped;
        if soup.triangles.is_empty() {
            soup.triangles.push(POINT);
            soup.attributes.push(bytemuck::Zeroable::zeroed());
        }
        let Bvh { nodes, order, depth } = bvh::build(&soup.triangles);
        let (first_node, first_triangle) = (self.nodes.len() as u32, self.triangles.len() as u32);
        self.depth = self.depth.max(depth);
        self.nodes.extend(nodes.iter().map(|node| {
            let offset = if node.count == 0 { first_node } else { first_triangle };
            BvhNode { first: node.first + offset, ..*node }
        }));
        self.triangles.extend(order.iter().map(|&i| soup.triangles[i as usize]));
        self.attributes.extend(order.iter().map(|&i| soup.attributes[i as usize]));
        let mesh = self.meshes.len() as u32;
        self.meshes.push(FlatMesh {
            root: first_node,
            nodes: nodes.len() as u32,
            first_triangle,
            triangles: order.len() as u32,
            source: group.mesh,
        });
        if group.mesh == NONE {
            self.instances.push(instance(mesh, Mat4::IDENTITY, NONE));
        } else {
            let place = |&source: &u32| instance(mesh, scene.instances[source as usize].transform, source);
            self.instances.extend(group.instances.iter().map(place));
        }
    }

    fn box_of(&self, instance: &FlatInstance) -> [Vec3; 2] {
        let root = &self.nodes[self.meshes[instance.mesh as usize].root as usize];
        transformed_box(instance.transform, [root.min, root.max])
    }
}

fn instance(mesh: u32, transform: Mat4, source: u32) -> FlatInstance {
    FlatInstance { transform, mesh, first_light: 0, source, padding: 0 }
}

/// The box round a transformed box; a point out of everything's way for a transform that cannot be undone.
pub(crate) fn transformed_box(transform: Mat4, [min, max]: [Vec3; 2]) -> [Vec3; 2] {
    if !is_invertible(transform) {
        return [Vec3::splat(crate::scene::MAX_COORDINATE); 2];
    }
    let center = transform.transform_point3(0.5 * (min + max));
    let linear = Mat3::from_mat4(transform);
    let half = 0.5 * (max - min);
    let extent = linear.x_axis.abs() * half.x + linear.y_axis.abs() * half.y + linear.z_axis.abs() * half.z;
    // Rounding must not cut anything off.
    let margin = 1e-6 * (extent + center.abs());
    [center - extent - margin, center + extent + margin]
}

/// The nodes of a top level whose root stands at `first` of all nodes: always `2 n - 1` for n instances, so that it can be
/// rebuilt in place. The leaves' `first` is an instance.
pub(crate) fn top_level(boxes: &[[Vec3; 2]], first: u32) -> Vec<BvhNode> {
    let mut nodes = bvh::build_top(boxes);
    nodes.iter_mut().filter(|node| node.count == 0).for_each(|node| node.first += first);
    nodes
}

/// The three rows of an affine matrix.
pub(crate) fn rows(matrix: Mat4) -> [Vec4; 3] {
    let transposed = matrix.transpose();
    [transposed.x_axis, transposed.y_axis, transposed.z_axis]
}

/// Stands in for the triangles of an empty scene: a point, which no ray hits.
const POINT: Triangle = Triangle { p0: Vec3::ZERO, flags: 0, p1: Vec3::ZERO, material: 0, p2: Vec3::ZERO, light: NONE };
