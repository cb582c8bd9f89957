//! The two levels: which meshes are merged, which keep a bottom level of their own, and where those stand.

use super::triangles::{self, Soup};
use super::{Deformer, Deformers, FlatInstance, FlatMesh, Step};
use crate::error::{Error, Result};
use crate::scene::bvh::{self, Bvh};
use crate::scene::gpu_types::{BvhNode, NONE, Triangle, TriangleAttributes};
use crate::scene::rig::{self, Motion, Pose};
use crate::scene::{MAX_COORDINATE, MAX_TRIANGLES, Rig, Scene};
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
    /// The meshes that change their shape.
    pub deformers: Deformers,
    /// The scene's rig, with instances of this scene.
    pub rig: Rig,
    /// Of the merged mesh: the number of the first triangle, in the order of the scene, of each instance merged, and that
    /// instance; empty where nobody asks (no light changes its power).
    pub merged: Vec<(u32, u32)>,
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
    /// Index in the rig's instances of the one whose shape this is, if it changes.
    deforming: Option<u32>,
}

/// Merges what never moves and stands in one place, and gives every other mesh a bottom level of its own; each instance
/// whose mesh changes its shape has one for itself.
fn groups(scene: &Scene) -> Result<Vec<Group>> {
    let moving = scene.rig.moving_nodes();
    let mut motions = vec![(Motion::Still, 0); scene.instances.len()];
    for (i, placement) in scene.rig.instances.iter().enumerate() {
        if let Some(motion) = motions.get_mut(placement.instance as usize) {
            *motion = (scene.rig.motion(placement, &moving), i as u32);
        }
    }
    let mut uses: Vec<Vec<u32>> = vec![Vec::new(); scene.meshes.len()];
    for (i, instance) in scene.instances.iter().enumerate() {
        let missing = || Error::bad_value(format!("instance {i}"), format!("there is no mesh {}", instance.mesh));
        uses.get_mut(instance.mesh as usize).ok_or_else(missing)?.push(i as u32);
    }
    let mut merged = Group { mesh: NONE, instances: Vec::new(), deforming: None };
    let mut own = Vec::new();
    let mut total = 0u64;
    for (mesh, mut uses) in uses.into_iter().enumerate() {
        let triangles = scene.meshes[mesh].indices.len() as u64 / 3;
        for instance in uses.extract_if(.., |&mut i| motions[i as usize].0 == Motion::Deforming) {
            let deforming = Some(motions[instance as usize].1);
            own.push(Group { mesh: mesh as u32, instances: vec![instance], deforming });
            total += triangles;
        }
        let rigid: Vec<u32> = uses.extract_if(.., |&mut i| motions[i as usize].0 == Motion::Rigid).collect();
        let is_shared = triangles >= MIN_SHARED && uses.len().saturating_sub(1) as u64 * triangles >= MIN_SAVED;
        let (mut stays, mut moves) = (uses, Vec::new());
        // What cannot be undone cannot have a space of its own.
        if is_shared {
            (moves, stays) = stays.into_iter().partition(|&i| is_invertible(scene.instances[i as usize].transform));
        }
        moves.extend(rigid);
        total += stays.len() as u64 * triangles + if moves.is_empty() { 0 } else { triangles };
        merged.instances.extend(stays);
        if !moves.is_empty() {
            own.push(Group { mesh: mesh as u32, instances: moves, deforming: None });
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
pub(super) fn build(scene: &Scene, progress: &mut dyn FnMut(f32, Step)) -> Result<Levels> {
    let counts =
        rig::Counts { instances: scene.instances.len(), lights: scene.lights.len(), cameras: scene.cameras.len() };
    scene.rig.check(counts).map_err(|(place, what)| Error::bad_value(place, what))?;
    let groups = groups(scene)?;
    triangles::check_all(scene)?;
    let pose = scene.rig.pose(0, 0.0);
    let mut levels = Levels {
        nodes: Vec::new(),
        triangles: Vec::new(),
        attributes: Vec::new(),
        meshes: Vec::new(),
        instances: Vec::new(),
        deformers: Deformers::default(),
        rig: scene.rig.clone(),
        merged: Vec::new(),
        dropped: 0,
        depth: 0,
    };
    let count = groups.len();
    for (i, group) in groups.iter().enumerate() {
        let mut report = |fraction: f32, step: Step| progress((i as f32 + fraction) / count as f32, step);
        let mut soup = Soup::default();
        if group.mesh == NONE {
            let parts = group.instances.len();
            for (k, &index) in group.instances.iter().enumerate() {
                // Each report may cross a thread.
                if k.is_multiple_of(parts.div_ceil(MAX_REPORTS)) {
                    report(0.3 * k as f32 / parts as f32, Step::Placing);
                }
                if !scene.rig.powers.is_empty() {
                    levels.merged.push((soup.triangles.len() as u32, index));
                }
                let instance = &scene.instances[index as usize];
                soup.add(scene, &scene.meshes[instance.mesh as usize], instance.transform);
            }
        } else if let Some(placement) = group.deforming {
            soup = levels.deforming(scene, group, placement, &pose);
        } else {
            soup.add(scene, &scene.meshes[group.mesh as usize], Mat4::IDENTITY);
        }
        report(0.3, Step::Bvh);
        levels.add(scene, group, soup);
    }
    levels.follow(&pose);
    let triangles: Vec<u32> = levels.meshes.iter().map(|mesh| mesh.triangles).collect();
    levels.deformers.check(&triangles, &levels.rig.instances).map_err(|(place, what)| Error::bad_value(place, what))?;
    let root_boxes: Vec<[Vec3; 2]> = levels.instances.iter().map(|i| levels.box_of(i)).collect();
    if levels.has_top() {
        let first = levels.nodes.len();
        let top = top_level(&root_boxes, first as u32);
        levels.depth += depth(&top, first);
        levels.nodes.extend(top);
    }
    Ok(levels)
}

impl Levels {
    /// Whether there is more than the merged mesh.
    fn has_top(&self) -> bool {
        !matches!(&self.meshes[..], [only] if only.source == NONE)
    }

    /// The triangles of an instance whose mesh changes its shape, as it is in `pose`; its vertices and displacements are kept.
    fn deforming(&mut self, scene: &Scene, group: &Group, index: u32, pose: &Pose) -> Soup {
        let mesh = &scene.meshes[group.mesh as usize];
        let placement = &scene.rig.instances[index as usize];
        let joints = pose.joint_matrices(&scene.rig, placement.skin);
        let shaped = mesh.shaped(pose.morph_weights(placement), &joints);
        let deformers = &mut self.deformers;
        deformers.list.push(Deformer {
            placement: index,
            mesh: self.meshes.len() as u32,
            first_vertex: deformers.vertices.len() as u32,
            vertex_count: mesh.positions.len() as u32,
            first_displacement: deformers.displacements.len() as u32,
            first_corners: deformers.corners.len() as u32,
            flat: mesh.deformation.flat.into(),
        });
        deformers.vertices.extend(mesh.vertices());
        // A mesh may have fewer targets than its node has weights.
        for target in 0..placement.weight_count as usize {
            let target = mesh.deformation.targets.get(target).map_or(&[][..], |target| target);
            let missing = mesh.positions.len() - target.len().min(mesh.positions.len());
            deformers.displacements.extend(target.iter().take(mesh.positions.len()));
            deformers.displacements.extend(std::iter::repeat_n(rig::deform::Displacement::default(), missing));
        }
        Soup::of_deforming(scene, &shaped)
    }

    /// Puts the rig's instances where `pose` has them, and has the rig name instances of this scene.
    fn follow(&mut self, pose: &Pose) {
        let mut of_source = std::collections::HashMap::new();
        for (i, instance) in self.instances.iter().enumerate() {
            of_source.insert(instance.source, i as u32);
        }
        // Everything that moves has an instance of its own; what was merged is the rig's no longer.
        let mut kept = Vec::new();
        let mut numbers = vec![NONE; self.rig.instances.len()];
        for (placement, number) in self.rig.instances.iter().zip(&mut numbers) {
            if let Some(&instance) = of_source.get(&placement.instance) {
                self.instances[instance as usize].transform = pose.instance(placement);
                *number = kept.len() as u32;
                kept.push(rig::Placement { instance, ..*placement });
            }
        }
        self.rig.instances = kept;
        for deformer in &mut self.deformers.list {
            deformer.placement = numbers[deformer.placement as usize];
        }
    }

    fn add(&mut self, scene: &Scene, group: &Group, mut soup: Soup) {
        self.dropped += soup.dropped;
        if soup.triangles.is_empty() {
            soup.triangles.push(POINT);
            soup.attributes.push(bytemuck::Zeroable::zeroed());
        }
        // Until lights are numbered, their place in the scene: the light table must not depend on how a tree orders them.
        soup.triangles.iter_mut().zip(0..).for_each(|(triangle, place)| triangle.light = place);
        let Bvh { nodes, order, depth } = bvh::build(&soup.triangles);
        self.deformers.corners.extend(order.iter().filter_map(|&i| soup.corners.get(i as usize)));
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
        transformed_box(instance.transform, [root.min, root.max]).unwrap_or(NOWHERE)
    }
}

fn instance(mesh: u32, transform: Mat4, source: u32) -> FlatInstance {
    FlatInstance { transform, mesh, first_light: 0, source, padding: 0 }
}

/// Stands in the top level for the box of what has no place: a point out of everything's way.
pub(crate) const NOWHERE: [Vec3; 2] = [Vec3::splat(MAX_COORDINATE); 2];

/// The box round a transformed box; none for a transform that cannot be undone, or that leads out of the world.
pub(crate) fn transformed_box(transform: Mat4, [min, max]: [Vec3; 2]) -> Option<[Vec3; 2]> {
    if !is_invertible(transform) {
        return None;
    }
    let center = transform.transform_point3(0.5 * (min + max));
    let linear = Mat3::from_mat4(transform);
    let half = 0.5 * (max - min);
    let extent = linear.x_axis.abs() * half.x + linear.y_axis.abs() * half.y + linear.z_axis.abs() * half.z;
    // False for what is not a number, too.
    let is_within = (center.abs() + extent).max_element() <= MAX_COORDINATE;
    if !is_within {
        return None;
    }
    // Rounding must not cut anything off.
    let margin = 1e-6 * (extent + center.abs());
    Some([center - extent - margin, center + extent + margin])
}

/// The nodes of a top level whose root stands at `first` of all nodes: always `2 n - 1` for n instances, so that it can be
/// rebuilt in place. The leaves' `first` is an instance.
pub(crate) fn top_level(boxes: &[[Vec3; 2]], first: u32) -> Vec<BvhNode> {
    let mut nodes = bvh::build_top(boxes);
    nodes.iter_mut().filter(|node| node.count == 0).for_each(|node| node.first += first);
    nodes
}

/// Nodes on the longest path from the root of a top level whose root stands at `first` of all nodes.
fn depth(top: &[BvhNode], first: usize) -> u32 {
    let mut depths = vec![1; top.len()];
    for (i, node) in top.iter().enumerate().filter(|(_, node)| node.count == 0) {
        let child = node.first as usize - first;
        let below = depths[i] + 1;
        depths[child..child + 2].fill(below);
    }
    depths.into_iter().max().unwrap_or(0)
}

/// The three rows of an affine matrix.
pub(crate) fn rows(matrix: Mat4) -> [Vec4; 3] {
    let transposed = matrix.transpose();
    [transposed.x_axis, transposed.y_axis, transposed.z_axis]
}

/// Stands in for the triangles of an empty scene: a point, which no ray hits.
const POINT: Triangle = Triangle { p0: Vec3::ZERO, flags: 0, p1: Vec3::ZERO, material: 0, p2: Vec3::ZERO, light: NONE };
