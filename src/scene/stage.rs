//! A flat scene in motion: what of it changes, as it is now and as it was in the frame before.
//!
//! The frame before is a whole scene of its own, with transforms, shapes, lights and both levels of its BVH, so that
//! temporal reuse can rebuild and trace it exactly.

use super::area_light::keeps_spheres;
use super::flat::FlatScene;
use super::flat::deformers::{Deformer, write_shape};
use super::flat::lights;
use super::gpu_types::{BvhNode, LIGHT_DIRECTIONAL, LIGHT_POINT, Light, NONE, Triangle, TriangleAttributes};
use super::rig::Pose;
use super::rig::deform::Deformed;
use super::{Camera, Shape as Primitive, bvh};
use glam::{Mat4, Vec3};
use std::ops::Range;

/// A bottom level is built again once rays through it are expected to cost this many times what they did when it was
/// built (by the surface-area heuristic), for refitting keeps its tree and only moves the boxes.
pub const REBUILD_RATIO: f32 = 1.6;

/// The parts of a scene that change from frame to frame.
#[derive(Debug, Clone)]
pub struct Stage {
    clip: usize,
    time: f64,
    pose: Pose,
    /// Object to world of each instance of the flat scene.
    pub transforms: Vec<Mat4>,
    /// The same in the frame before.
    pub previous_transforms: Vec<Mat4>,
    /// Lights of the flat scene, with the table that their powers make: all where any changes its power, else the punctual
    /// ones.
    lights: Vec<Light>,
    /// The punctual lights in the frame before.
    pub previous_lights: Vec<Light>,
    /// The punctual ones among `lights`.
    punctual: Range<usize>,
    /// Another number whenever a power or the table has changed.
    light_version: u64,
    /// Whether any power is another than in the frame before.
    dimmed: bool,
    /// Meshes that change their shape, in the order of the scene's deformers.
    pub bodies: Vec<Body>,
    /// Whether anything is not where it was in the frame before.
    moved: bool,
    version: u64,
}

/// A mesh that changes its shape.
#[derive(Debug, Clone)]
pub struct Body {
    /// Index in the scene's meshes.
    pub mesh: u32,
    /// Its triangles now, in the order of its leaves.
    pub triangles: Vec<Triangle>,
    /// Their attributes.
    pub attributes: Vec<TriangleAttributes>,
    /// Its bottom level; children and triangles count from its own first.
    pub nodes: Vec<BvhNode>,
    /// Where the order of its triangles is another than in the frame before: its shape in that frame, in the new order.
    pub renumbered: Option<Shape>,
    corners: Vec<[u32; 3]>,
    /// Expected cost of a ray when the bottom level was built.
    built_cost: f32,
    /// Whether the bottom level is to be built again before the next shape.
    is_degraded: bool,
    emits: bool,
    capacity: usize,
}

/// The triangles of a mesh, their attributes and its bottom level.
#[derive(Debug, Clone)]
pub struct Shape {
    /// In the order of the leaves.
    pub triangles: Vec<Triangle>,
    /// Of each triangle.
    pub attributes: Vec<TriangleAttributes>,
    /// Children and triangles count from the mesh's own first.
    pub nodes: Vec<BvhNode>,
}

impl Stage {
    /// Everything of `scene` as it is at `time` of animation `clip`; the frame before is the same.
    pub fn new(scene: &FlatScene, clip: usize, time: f64) -> Self {
        let punctual = Stage::punctual(scene);
        let previous_lights = scene.lights.get(punctual.clone()).unwrap_or_default().to_vec();
        let (lights, punctual) = match scene.light_powers.is_empty() {
            true => (previous_lights.clone(), 0..punctual.len()),
            false => (scene.lights.clone(), punctual),
        };
        let transforms: Vec<Mat4> = scene.instances.iter().map(|instance| instance.transform).collect();
        let bodies = scene.deformers.list.iter().map(|deformer| Body::new(scene, deformer)).collect();
        let mut stage = Stage {
            clip,
            time,
            pose: Pose::default(),
            previous_transforms: transforms.clone(),
            transforms,
            previous_lights,
            lights,
            punctual,
            light_version: 0,
            dimmed: false,
            bodies,
            moved: false,
            version: 0,
        };
        stage.take(scene, clip, time);
        stage.rest();
        stage
    }

    /// Goes to `time` of animation `clip` as if nothing had been before.
    pub fn start(&mut self, scene: &FlatScene, clip: usize, time: f64) {
        if (clip, time) != (self.clip, self.time) {
            self.take(scene, clip, time);
        }
        self.rest();
    }

    /// Goes on to `time` of animation `clip`; where everything was becomes the frame before.
    pub fn step(&mut self, scene: &FlatScene, clip: usize, time: f64) {
        self.rest();
        if (clip, time) != (self.clip, self.time) {
            self.take(scene, clip, time);
            self.moved = !scene.rig.is_still();
        }
    }

    /// The punctual lights among those of a scene.
    pub fn punctual(scene: &FlatScene) -> Range<usize> {
        let first = (scene.first_punctual as usize).min(scene.lights.len());
        let is_punctual = |light: &&Light| (LIGHT_POINT..=LIGHT_DIRECTIONAL).contains(&light.kind);
        first..first + scene.lights[first..].iter().take_while(is_punctual).count()
    }

    /// The punctual lights as they are now.
    pub fn punctual_lights(&self) -> &[Light] {
        self.lights.get(self.punctual.clone()).unwrap_or_default()
    }

    /// All lights with their table, and a number that changes with them; none where no light changes its power.
    pub fn light_table(&self, scene: &FlatScene) -> Option<(&[Light], u64)> {
        (!scene.light_powers.is_empty()).then_some((&self.lights, self.light_version))
    }

    /// Light `index` of the scene, an emissive triangle, as it is now.
    pub fn emitter(&self, scene: &FlatScene, index: usize) -> Option<Light> {
        let lights = self.light_table(scene).map_or(&scene.lights[..], |(lights, _)| lights);
        lights.get(index).copied()
    }

    /// The moment, in seconds.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Another number whenever anything has been moved.
    pub fn version(&self) -> u64 {
        self.version
    }

    /// Whether anything is not where it was in the frame before, or not as bright.
    pub fn has_moved(&self) -> bool {
        self.moved
    }

    /// Whether triangles of the frame before can no longer be told by their numbers.
    pub fn is_renumbered(&self) -> bool {
        self.bodies.iter().any(|body| body.renumbered.is_some())
    }

    /// Makes the frame before the same as this one.
    fn rest(&mut self) {
        self.previous_transforms.clone_from(&self.transforms);
        self.previous_lights.clear();
        self.previous_lights.extend_from_slice(self.lights.get(self.punctual.clone()).unwrap_or_default());
        if std::mem::take(&mut self.dimmed) {
            let emitters = self.lights.get_mut(..self.punctual.start).unwrap_or_default();
            emitters.iter_mut().for_each(|light| light.intensity.y = light.intensity.x);
            self.light_version += 1;
        }
        self.bodies.iter_mut().for_each(|body| body.renumbered = None);
        self.moved = false;
    }

    fn take(&mut self, scene: &FlatScene, clip: usize, time: f64) {
        (self.clip, self.time) = (clip, time);
        if scene.rig.is_still() {
            return;
        }
        self.version += 1;
        let pose = scene.rig.pose(clip, time);
        let powers = std::mem::replace(&mut self.pose, pose).powers;
        if powers != self.pose.powers {
            self.dim(scene);
        }
        for placement in &scene.rig.instances {
            let moved = self.pose.instance(placement);
            if let Some(transform) = self.transforms.get_mut(placement.instance as usize) {
                // A light that would be no sphere any more stays where it was.
                if keeps_spheres(moved) || !is_sphere(scene, placement.instance) {
                    *transform = moved;
                }
            }
        }
        for attached in &scene.rig.lights {
            let punctual = self.lights.get_mut(self.punctual.clone()).unwrap_or_default();
            if let Some(light) = punctual.get_mut(attached.target as usize) {
                let node = self.pose.node(attached.node);
                // A light that leads out of all numbers stays where it was.
                if !node.is_finite() {
                    continue;
                }
                light.position = node.w_axis.truncate();
                light.direction = node.transform_vector3(Vec3::NEG_Z).try_normalize().unwrap_or(light.direction);
            }
        }
        let mut vertices = Vec::new();
        for (body, deformer) in self.bodies.iter_mut().zip(&scene.deformers.list) {
            scene.deformers.deform(scene, deformer, &self.pose, &mut vertices);
            body.shape(deformer, &vertices);
        }
    }

    /// Gives every light the power that it has in the pose, and rebuilds the table.
    fn dim(&mut self, scene: &FlatScene) {
        if scene.light_powers.is_empty() {
            return;
        }
        // Distant lights are neither dimmed nor weighed.
        let count = self.punctual.end;
        let mut weights = Vec::with_capacity(count);
        let lights = self.lights.iter_mut().take(count).enumerate();
        for ((i, light), (full, power)) in lights.zip(scene.lights.iter().zip(&scene.light_powers)) {
            let factor = self.pose.powers.get(*power as usize).copied().unwrap_or(1.0);
            if i < self.punctual.start {
                light.intensity.x = factor;
            } else {
                light.intensity = (full.intensity * factor).min(Vec3::splat(f32::MAX));
            }
            // Probabilities at full power are the weights, but for a factor that all share.
            weights.push(f64::from(full.pmf) * f64::from(factor));
        }
        lights::weigh(&mut self.lights, weights);
        self.light_version += 1;
        self.dimmed = true;
    }

    /// Camera `index` of the scene where it is now.
    pub fn camera(&self, scene: &FlatScene, index: usize) -> Option<Camera> {
        let camera = scene.cameras.get(index)?;
        let attached = scene.rig.cameras.iter().find(|attached| attached.target as usize == index);
        attached.map_or_else(
            || Some(camera.clone()),
            |attached| camera.at(&self.pose.node(attached.node)).filter(|camera| camera.position.is_finite()),
        )
    }
}

/// Whether an instance is a spherical light.
fn is_sphere(scene: &FlatScene, instance: u32) -> bool {
    let mesh = scene.instances.get(instance as usize).and_then(|instance| scene.meshes.get(instance.mesh as usize));
    let triangle = mesh.and_then(|mesh| scene.triangles.get(mesh.first_triangle as usize));
    triangle.is_some_and(|triangle| triangle.shape() == Primitive::Sphere)
}

impl Body {
    fn new(scene: &FlatScene, deformer: &Deformer) -> Self {
        let mesh = &scene.meshes[deformer.mesh as usize];
        let triangles = mesh.first_triangle as usize..(mesh.first_triangle + mesh.triangles) as usize;
        let nodes = mesh.root as usize..(mesh.root + mesh.nodes) as usize;
        let local = |node: &BvhNode| {
            let base = if node.count == 0 { mesh.root } else { mesh.first_triangle };
            BvhNode { first: node.first - base, ..*node }
        };
        let nodes: Vec<BvhNode> = scene.nodes[nodes].iter().map(local).collect();
        Body {
            mesh: deformer.mesh,
            triangles: scene.triangles[triangles.clone()].to_vec(),
            attributes: scene.attributes[triangles.clone()].to_vec(),
            corners: scene.deformers.corners_of(deformer, mesh.triangles).to_vec(),
            built_cost: bvh::cost(&nodes),
            capacity: Body::node_capacity(nodes.len()),
            nodes,
            renumbered: None,
            is_degraded: false,
            emits: scene.triangles[triangles].iter().any(|triangle| triangle.light != NONE),
        }
    }

    /// Most nodes that a bottom level may have when it is built again, if it had `nodes` at first.
    pub fn node_capacity(nodes: usize) -> usize {
        nodes + nodes / 4 + 2
    }

    /// Whether any of its triangles is a light.
    pub fn emits(&self) -> bool {
        self.emits
    }

    /// The box of everything.
    pub fn bounds(&self) -> [Vec3; 2] {
        self.nodes.first().map_or([Vec3::ZERO; 2], |root| [root.min, root.max])
    }

    /// Takes a shape and refits the bottom level, which is built anew first if it has degraded too far.
    fn shape(&mut self, deformer: &Deformer, vertices: &[Deformed]) {
        if std::mem::take(&mut self.is_degraded) {
            self.renumbered = self.rebuild();
        }
        write_shape(vertices, &self.corners, deformer.flat == 1, &mut self.triangles, &mut self.attributes);
        bvh::refit(&mut self.nodes, &self.triangles);
        // Lights name their triangles by number: those of a mesh that shines keep their order.
        self.is_degraded = !self.emits && bvh::cost(&self.nodes) > REBUILD_RATIO * self.built_cost;
    }

    /// Builds the bottom level for the shape that it has, and gives that; none where there is no room for so many nodes.
    fn rebuild(&mut self) -> Option<Shape> {
        let rebuilt = bvh::build_with(&self.triangles, bvh::Preset::Quick);
        if rebuilt.nodes.len() > self.capacity {
            // What was refitted is as good as it gets for a while.
            self.built_cost = bvh::cost(&self.nodes);
            return None;
        }
        self.built_cost = bvh::cost(&rebuilt.nodes);
        self.nodes = rebuilt.nodes;
        self.triangles = permuted(&self.triangles, &rebuilt.order);
        self.attributes = permuted(&self.attributes, &rebuilt.order);
        self.corners = permuted(&self.corners, &rebuilt.order);
        let (triangles, attributes) = (self.triangles.clone(), self.attributes.clone());
        Some(Shape { triangles, attributes, nodes: self.nodes.clone() })
    }
}

fn permuted<T: Copy>(list: &[T], order: &[u32]) -> Vec<T> {
    order.iter().filter_map(|&i| list.get(i as usize)).copied().collect()
}
