//! Where the moving parts of a scene lie on the device. The frame before has its own top level, its own instances and its
//! own punctual lights, which come after this frame's; a mesh that changes its shape has two places, used in turn.

use super::GpuScene;
use super::forest::Forest;
use crate::gpu::Gpu;
use crate::scene::FlatScene;
use crate::scene::bvh::wide;
use crate::scene::flat::{FlatInstance, levels};
use crate::scene::gpu_types::{BvhNode, Instance, Light, NONE, Triangle, TriangleAttributes};
use crate::scene::stage::{Body, Stage};
use glam::{Mat4, Vec3, Vec4};
use std::borrow::Cow;

/// Texels of one triangle in the data texture `attributes`.
const ATTRIBUTE_TEXELS: u64 = size_of::<TriangleAttributes>() as u64 / 16;

/// What is uploaded at first.
pub(super) struct Arrays<'a> {
    pub triangles: Cow<'a, [Triangle]>,
    pub attributes: Cow<'a, [TriangleAttributes]>,
    pub instances: Vec<Instance>,
    pub lights: Cow<'a, [Light]>,
}

/// The two places of a mesh that changes its shape: index in `nodes` and index of the first triangle.
type Places = [(u32, u32); 2];

/// What is where.
#[derive(Debug)]
pub(super) struct Motion {
    pub previous_top_level: u32,
    /// Index in `nodes` of the root of each mesh's bottom level, where it does not deform.
    roots: Vec<u32>,
    /// Of each body.
    places: Vec<Places>,
    /// Which of the places of every body holds this frame's shape, and which that of the frame before.
    now: usize,
    before: Vec<usize>,
    /// The binary top level of this frame, numbered from 0.
    top_level: Vec<BvhNode>,
    /// What of the stage is uploaded.
    pub version: Option<u64>,
    /// Which table of lights is uploaded.
    light_version: Option<u64>,
    /// Whether the frame before is the same as this one on the device.
    pub at_rest: bool,
}

/// Triangles on the device.
pub(super) fn triangle_count(scene: &FlatScene) -> usize {
    let deforming = scene.deformers.list.iter().filter_map(|deformer| scene.meshes.get(deformer.mesh as usize));
    scene.triangles.len() + deforming.map(|mesh| mesh.triangles as usize).sum::<usize>()
}

impl Motion {
    /// Finds a place for everything, in `forest` too. Without motion the arrays are the scene's own.
    pub fn lay_out<'a>(scene: &'a FlatScene, forest: &mut Forest) -> (Option<Motion>, Arrays<'a>) {
        let transforms: Vec<Mat4> = scene.instances.iter().map(|instance| instance.transform).collect();
        let roots: Vec<u32> = scene.instances.iter().map(|i| forest.roots[i.mesh as usize]).collect();
        let records = records(scene, &transforms, &roots, &vec![0; roots.len()]);
        let mut arrays = Arrays {
            triangles: Cow::Borrowed(&scene.triangles),
            attributes: Cow::Borrowed(&scene.attributes),
            instances: records,
            lights: Cow::Borrowed(&scene.lights),
        };
        if scene.rig.is_still() {
            return (None, arrays);
        }
        // The top level of this frame is the last of the forest, with its room; that of the frame before needs as much.
        let nodes = &mut forest.nodes;
        let previous_top_level = nodes.len() as u32;
        let room = if scene.has_top_level() { nodes.len() - forest.top_level as usize } else { 0 };
        nodes.resize(nodes.len() + room, bytemuck::Zeroable::zeroed());
        let mut places = Vec::new();
        for deformer in &scene.deformers.list {
            let mesh = &scene.meshes[deformer.mesh as usize];
            let capacity = wide::capacity(Body::node_capacity(mesh.nodes as usize));
            let (triangles, attributes) = (arrays.triangles.to_mut(), arrays.attributes.to_mut());
            let own = mesh.first_triangle as usize..(mesh.first_triangle + mesh.triangles) as usize;
            places.push([
                (nodes.len() as u32, mesh.first_triangle),
                ((nodes.len() + capacity) as u32, triangles.len() as u32),
            ]);
            nodes.resize(nodes.len() + 2 * capacity, bytemuck::Zeroable::zeroed());
            triangles.extend_from_within(own.clone());
            attributes.extend_from_within(own);
        }
        arrays.instances.extend_from_within(..);
        let lights = arrays.lights.to_mut();
        lights.extend_from_within(Stage::punctual(scene));
        let before = vec![0; places.len()];
        let motion = Motion {
            previous_top_level,
            roots: forest.roots.clone(),
            places,
            now: 0,
            before,
            top_level: Vec::new(),
            version: None,
            light_version: None,
            at_rest: false,
        };
        (Some(motion), arrays)
    }

    /// Uploads the shapes of a new moment to the places that hold none of this frame's, which becomes the one before.
    pub fn take_shapes(&mut self, gpu: &Gpu, device: &GpuScene, stage: &Stage) {
        let before = self.now;
        self.now = 1 - self.now;
        for (i, (body, places)) in stage.bodies.iter().zip(&self.places).enumerate() {
            let upload = |(root, first): (u32, u32), nodes: &[BvhNode], triangles: &[Triangle], attributes: &[_]| {
                device.walked.write_nodes(gpu, root, &wide::collapse_refitted(nodes, 0, root, first).nodes);
                device.walked.write_triangles(gpu, first, triangles);
                device.attributes.write(gpu, u64::from(first) * ATTRIBUTE_TEXELS, attributes);
            };
            upload(places[self.now], &body.nodes, &body.triangles, &body.attributes);
            // What is there has other numbers than this frame's.
            if let Some(shape) = &body.renumbered {
                upload(places[before], &shape.nodes, &shape.triangles, &shape.attributes);
            }
            self.before[i] = if stage.has_moved() { before } else { self.now };
        }
    }

    /// The frame before becomes this one.
    pub fn stand_still(&mut self) {
        self.before.fill(self.now);
    }

    /// Uploads instances, both top levels and the lights: the punctual ones and, where any light has changed its power, all
    /// with their table.
    pub fn place(&mut self, gpu: &Gpu, device: &GpuScene, scene: &FlatScene, stage: &Stage) {
        let mut bodies = vec![None; scene.meshes.len()];
        for (i, body) in stage.bodies.iter().enumerate() {
            bodies[body.mesh as usize] = Some(i);
        }
        let body_of = |mesh: u32| bodies.get(mesh as usize).copied().flatten();
        let roots = |now: bool| -> Vec<u32> {
            let root = |mesh: u32| match body_of(mesh) {
                Some(i) => self.places[i][if now { self.now } else { self.before[i] }].0,
                None => self.roots[mesh as usize],
            };
            scene.instances.iter().map(|instance| root(instance.mesh)).collect()
        };
        let offset = |mesh: u32| {
            body_of(mesh).map_or(0, |i| self.places[i][self.before[i]].1.wrapping_sub(self.places[i][self.now].1))
        };
        let offsets: Vec<u32> = scene.instances.iter().map(|instance| offset(instance.mesh)).collect();
        let mut instances = records(scene, &stage.transforms, &roots(true), &offsets);
        instances.extend(records(scene, &stage.previous_transforms, &roots(false), &vec![0; offsets.len()]));
        device.instances.write(gpu, 0, &instances[..]);

        if scene.has_top_level() {
            let bounds = |mesh: u32| {
                let node = scene.nodes.get(scene.meshes[mesh as usize].root as usize);
                let still = node.map_or([Vec3::ZERO; 2], |root| [root.min, root.max]);
                body_of(mesh).and_then(|i| stage.bodies.get(i)).map_or(still, Body::bounds)
            };
            let each = scene.instances.iter().zip(&stage.transforms);
            let boxes: Vec<[Vec3; 2]> = each
                .map(|(instance, &to_world)| {
                    levels::transformed_box(to_world, bounds(instance.mesh)).unwrap_or(levels::NOWHERE)
                })
                .collect();
            let now = levels::top_level(&boxes, 0);
            let before = if stage.has_moved() && !self.top_level.is_empty() { &self.top_level } else { &now };
            device.walked.write_nodes(gpu, device.top_level, &wide::collapse(&now, 0, device.top_level, 0).nodes);
            let (root, twins) = (self.previous_top_level, device.instance_count);
            device.walked.write_nodes(gpu, root, &wide::collapse(before, 0, root, twins).nodes);
            self.top_level = now;
        }

        if let Some((lights, version)) = stage.light_table(scene)
            && self.light_version != Some(version)
        {
            write_lights(gpu, device, 0, lights);
            self.light_version = Some(version);
        }
        for (body, places) in stage.bodies.iter().zip(&self.places) {
            name_lights(gpu, device, scene, stage, body, places[self.now].1);
        }
        let first_twin = scene.lights.len() as u32;
        let first = Stage::punctual(scene).start as u32;
        let twin = |i: usize| first_twin + i as u32;
        let lights: Vec<Light> = stage
            .punctual_lights()
            .iter()
            .enumerate()
            .map(|(i, light)| Light { previous: twin(i), ..*light })
            .collect();
        let twins: Vec<Light> =
            stage.previous_lights.iter().enumerate().map(|(i, light)| Light { previous: twin(i), ..*light }).collect();
        write_lights(gpu, device, first, &lights);
        write_lights(gpu, device, first_twin, &twins);
    }
}

/// Emissive triangles of a body know where it lies now.
fn name_lights(gpu: &Gpu, device: &GpuScene, scene: &FlatScene, stage: &Stage, body: &Body, first_triangle: u32) {
    if !body.emits() {
        return;
    }
    let Some(instance) = scene.instances.iter().find(|instance| instance.mesh == body.mesh) else { return };
    let mut lights = Vec::new();
    for (i, triangle) in body.triangles.iter().enumerate().filter(|(_, triangle)| triangle.light != NONE) {
        if let Some(light) = stage.emitter(scene, (instance.first_light + triangle.light) as usize) {
            lights.push((triangle.light, Light { triangle: first_triangle + i as u32, ..light }));
        }
    }
    lights.sort_unstable_by_key(|&(number, _)| number);
    let lights: Vec<Light> = lights.into_iter().map(|(_, light)| light).collect();
    write_lights(gpu, device, instance.first_light, &lights);
}

fn write_lights(gpu: &Gpu, device: &GpuScene, first: u32, lights: &[Light]) {
    if !lights.is_empty() {
        let offset = u64::from(first) * size_of::<Light>() as u64;
        gpu.queue.write_buffer(&device.lights, offset, bytemuck::cast_slice(lights));
    }
}

fn records(scene: &FlatScene, transforms: &[Mat4], roots: &[u32], previous_triangles: &[u32]) -> Vec<Instance> {
    let places = transforms.iter().zip(roots).zip(previous_triangles);
    let record =
        |(instance, ((&transform, &root), &previous_triangles)): (&FlatInstance, ((&Mat4, &u32), &u32))| Instance {
            to_object: if levels::is_invertible(transform) {
                levels::rows(transform.inverse())
            } else {
                [Vec4::ZERO; 3]
            },
            to_world: levels::rows(transform),
            root,
            first_light: instance.first_light,
            previous_triangles,
            padding: 0,
        };
    scene.instances.iter().zip(places).map(record).collect()
}
