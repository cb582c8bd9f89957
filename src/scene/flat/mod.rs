//! A scene as plain arrays with a BVH: what is uploaded, sent from a Worker to the page, and kept to rebuild a lost device.

mod bytes;
pub mod cooked;
pub mod deformers;
mod emission;
pub(crate) mod environment;
mod extensions;
mod framing;
pub(crate) mod levels;
pub(super) mod lights;
mod materials;
mod mips;
mod packing;
mod step;
mod textures;
mod triangles;
mod validate;

pub use deformers::{Deformer, Deformers};
pub use environment::FlatEnvironment;
pub use step::Step;
pub(super) use triangles::face_normal;

use super::gpu_types::{BvhNode, Light, Material, MaterialExtensions, NONE, Triangle, TriangleAttributes};
use super::{Camera, MAX_COORDINATE, Projection, PunctualKind, Rig, Scene, bvh, rig};
use crate::error::{Error, Result};
use glam::{Mat4, Vec3};
use std::collections::{HashMap, HashSet};

/// Images of about one size, each with its mip chain, in layers of one size. Texels are as stored in the files (sRGB where
/// the file says so).
#[derive(Debug, Clone, PartialEq)]
pub struct TextureArray {
    /// Width of a layer in texels.
    pub width: u32,
    /// Height of a layer in texels.
    pub height: u32,
    /// Number of layers, at least 1.
    pub layers: u32,
    /// Number of levels, at least 1; level k has `max(1, side >> k)` texels along a side.
    pub levels: u32,
    /// RGBA8, level by level, layer by layer, row by row.
    pub texels: Vec<u8>,
}

impl TextureArray {
    /// Bytes of one layer of a level.
    pub fn layer_bytes(&self, level: u32) -> u64 {
        u64::from(mips::side(self.width, level)) * u64::from(mips::side(self.height, level)) * 4
    }

    /// Bytes of all levels, as the sizes say.
    fn expected_bytes(&self) -> u64 {
        (0..self.levels).map(|level| self.layer_bytes(level) * u64::from(self.layers)).sum()
    }

    /// Where in `texels` a texel begins.
    pub fn offset(&self, level: u32, layer: u32, x: u32, y: u32) -> usize {
        let before: u64 = (0..level).map(|level| self.layer_bytes(level) * u64::from(self.layers)).sum();
        let row = u64::from(y) * u64::from(mips::side(self.width, level)) + u64::from(x);
        (before + u64::from(layer) * self.layer_bytes(level) + 4 * row) as usize
    }
}

/// What one texture array holds, for reports.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct TextureStats {
    /// Width of a layer in texels.
    pub width: u32,
    /// Height of a layer in texels.
    pub height: u32,
    /// Layers.
    pub layers: u32,
    /// Mip levels.
    pub levels: u32,
    /// Images.
    pub images: u64,
    /// Bytes of all levels of all layers.
    pub bytes: u64,
    /// Those of them that are texels of images.
    pub used_bytes: u64,
}

/// What a scene holds, for reports.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SceneStats {
    /// Triangles that are held; those of a mesh that is shared by many instances once.
    pub triangles: u64,
    /// Triangles that can be seen, after instancing.
    pub placed_triangles: u64,
    /// Triangles dropped because they have no area or positions that are not finite.
    pub dropped_triangles: u64,
    /// Placements of meshes.
    pub instances: u64,
    /// Materials.
    pub materials: u64,
    /// Textures.
    pub textures: u64,
    /// The arrays that their images lie in.
    pub texture_arrays: Vec<TextureStats>,
    /// Lights: emissive triangles + punctual lights + sun + environment.
    pub lights: u64,
    /// Emissive triangles among them.
    pub emissive_triangles: u64,
    /// BVH nodes.
    pub bvh_nodes: u64,
    /// Longest path from the root, in nodes.
    pub bvh_depth: u32,
    /// Surface-area-heuristic cost of the BVH (node test 1, triangle test 1).
    pub bvh_cost: f32,
    /// Bytes the GPU holds for the scene.
    pub gpu_bytes: u64,
}

/// A mesh with a bottom level of its own.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct FlatMesh {
    /// Index of its root in `nodes`; its other nodes follow.
    pub root: u32,
    /// Number of nodes.
    pub nodes: u32,
    /// Its first triangle.
    pub first_triangle: u32,
    /// Number of triangles.
    pub triangles: u32,
    /// Index into [`Scene::meshes`], or `NONE` for what never moves and was merged in world space.
    pub source: u32,
}

/// A mesh placed in the world.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct FlatInstance {
    /// Object to world, at time 0 of the first animation.
    pub transform: Mat4,
    /// Index into [`FlatScene::meshes`].
    pub mesh: u32,
    /// Index in `lights` of the first of its emissive triangles.
    pub first_light: u32,
    /// Index into [`Scene::instances`], or `NONE` for the merged ones.
    pub source: u32,
    /// Unused.
    pub padding: u32,
}

/// Pod arrays + flattened BVH. Metres, linear Rec. 709.
#[derive(Debug, Clone, PartialEq)]
pub struct FlatScene {
    /// For titles and reports.
    pub name: String,
    /// The bottom levels one after another, then the top level, if there is one, at rest. A scene without triangles has
    /// one leaf with a single point in it.
    pub nodes: Vec<BvhNode>,
    /// In BVH leaf order, mesh after mesh, each in its mesh's space.
    pub triangles: Vec<Triangle>,
    /// Of each triangle.
    pub attributes: Vec<TriangleAttributes>,
    /// The bottom levels. The merged one, in world space, is the first if there is one.
    pub meshes: Vec<FlatMesh>,
    /// Where they stand.
    pub instances: Vec<FlatInstance>,
    /// At least one.
    pub materials: Vec<Material>,
    /// What glTF's extensions add to each material; empty where no material uses one.
    pub material_extensions: Vec<MaterialExtensions>,
    /// With alias table; the sun and the environment, if any, are the last. May be empty.
    pub lights: Vec<Light>,
    /// For each light the factor on its power, an index in [`Rig::powers`], or `NONE`; empty where no light changes its
    /// power. `lights` and their table are those of full power, all factors 1.
    pub light_powers: Vec<u32>,
    /// Index in `lights` of the first punctual light; they follow in the order of [`Scene::lights`].
    pub first_punctual: u32,
    /// What moves; its instances and cameras are those of this scene, its lights count from `first_punctual`.
    pub rig: Rig,
    /// The meshes that change their shape.
    pub deformers: Deformers,
    /// The images that materials read; at most four arrays, none in a scene without textures.
    pub textures: Vec<TextureArray>,
    /// Light from infinitely far away.
    pub environment: Option<FlatEnvironment>,
    /// The file's cameras, or one that frames the scene: at least one.
    pub cameras: Vec<Camera>,
    /// World bounds of the triangles (and point lights).
    pub bounds: [Vec3; 2],
    /// For reports.
    pub stats: SceneStats,
    /// Carried over from the scene, and what flattening itself found.
    pub warnings: Vec<String>,
}

impl FlatScene {
    /// Flattens `scene`; `progress` is told the fraction done and what is being done.
    ///
    /// # Errors
    /// [`Error::BadValue`] for indices out of range and numbers that are not usable; [`Error::Limit`] for more of something
    /// than a device can hold.
    pub fn build(scene: &Scene, progress: &mut dyn FnMut(f32, Step)) -> Result<Self> {
        let mut warnings = scene.warnings.clone();
        let geometry = levels::build(scene, &mut |fraction, step| progress(0.8 * fraction, step))?;
        let levels::Levels {
            nodes,
            mut triangles,
            attributes,
            meshes,
            mut instances,
            deformers,
            mut rig,
            merged,
            dropped,
            depth,
        } = geometry;
        if dropped > 0 {
            warnings.push(format!("{dropped} triangles without area or with unusable positions were left out"));
        }

        // Once to learn which images there are and what they mean, once to say where they went.
        let mut images = textures::Images::new(scene)?;
        let mut ask = |texture, texels| images.ask(texture, texels).map(|_| textures::Place::default());
        materials::flatten(scene, &mut ask)?;
        extensions::flatten(scene, &mut ask)?;
        let mut report = |fraction| progress(0.8 + 0.1 * fraction, Step::Mips);
        let (textures, places) = images.pack(&mut warnings, &mut report)?;
        let mut find = |texture, texels| images.ask(texture, texels).and_then(|image| places.get(image).copied());
        let materials = materials::flatten(scene, &mut find)?;
        let material_extensions = extensions::flatten(scene, &mut find)?;

        progress(0.9, Step::Lights);
        let environment = match &scene.environment {
            Some(environment) => FlatEnvironment::build(environment)?,
            None => None,
        };
        let emission = emission::Emission::new(scene);
        let mut emitters = lights::emitters(&mut triangles, &meshes, &mut instances, &attributes, &emission);
        let movers: HashSet<u32> = scene.rig.instances.iter().map(|placement| placement.instance).collect();
        lights::keep_movers(&mut emitters, |instance| movers.contains(&instances[instance as usize].source));
        let powers = light_powers(&mut rig, &emitters, &instances, &merged);
        let (lights, first_punctual) =
            lights::build(emitters, &scene.lights, scene.sun.as_ref(), environment.is_some())?;

        // Distant lights are never dimmed, and the last.
        let light_powers = if rig.powers.is_empty() {
            Vec::new()
        } else {
            powers.into_iter().chain(std::iter::repeat(NONE)).take(lights.len()).collect()
        };
        let bounds = bounds(&instances, &meshes, &nodes, scene);
        let mut flat = FlatScene {
            name: scene.name.clone(),
            cameras: Vec::new(),
            bounds,
            stats: SceneStats::default(),
            nodes,
            triangles,
            attributes,
            meshes,
            instances,
            materials,
            material_extensions,
            lights,
            light_powers,
            first_punctual,
            rig,
            deformers,
            textures,
            environment,
            warnings: Vec::new(),
        };
        flat.cameras = cameras(scene, &mut flat, &mut warnings);
        let counts =
            rig::Counts { instances: flat.instances.len(), lights: scene.lights.len(), cameras: flat.cameras.len() };
        flat.rig.check(counts).map_err(|(place, what)| Error::bad_value(place, what))?;
        flat.warnings = warnings;
        flat.stats = SceneStats {
            triangles: flat.triangle_count(),
            placed_triangles: flat.instances.iter().map(|i| u64::from(flat.meshes[i.mesh as usize].triangles)).sum(),
            dropped_triangles: dropped,
            instances: scene.instances.len() as u64,
            materials: flat.materials.len() as u64,
            textures: scene.textures.len() as u64,
            texture_arrays: textures::stats(&flat.textures, &places),
            lights: flat.lights.len() as u64,
            emissive_triangles: u64::from(first_punctual),
            bvh_nodes: flat.nodes.len() as u64,
            bvh_depth: depth,
            bvh_cost: bvh::cost(flat.nodes.get(flat.root() as usize..).unwrap_or_default()),
            gpu_bytes: flat.gpu_bytes(),
        };
        progress(1.0, Step::Done);
        Ok(flat)
    }

    /// The triangles that are not the point that stands in for none.
    fn triangle_count(&self) -> u64 {
        let has_area = |t: &&Triangle| (t.p1 - t.p0).cross(t.p2 - t.p0) != Vec3::ZERO;
        match &self.triangles[..] {
            [only] => [only].into_iter().filter(has_area).count() as u64,
            all => all.len() as u64,
        }
    }

    /// Whether there is a top level: more than one mesh that is in world space already.
    pub fn has_top_level(&self) -> bool {
        has_top(&self.meshes)
    }

    /// Index in `nodes` of the root of everything.
    pub fn root(&self) -> u32 {
        if self.has_top_level() { (self.nodes.len() + 1 - 2 * self.instances.len()) as u32 } else { 0 }
    }

    /// Bytes of all arrays as the GPU holds them.
    fn gpu_bytes(&self) -> u64 {
        let environment =
            self.environment.as_ref().map_or(0, |e| size_of_val(&e.radiance[..]) + size_of_val(&e.alias[..]));
        let arrays = size_of_val(&self.nodes[..])
            + size_of_val(&self.triangles[..])
            + size_of_val(&self.attributes[..])
            + size_of::<super::gpu_types::Instance>() * self.instances.len()
            + size_of_val(&self.materials[..])
            + size_of_val(&self.material_extensions[..])
            + size_of_val(&self.lights[..]);
        let textures: usize = self.textures.iter().map(|array| array.texels.len()).sum();
        (arrays + textures + environment) as u64
    }
}

/// The factor on the power of each emissive triangle, then of each punctual light, as the rig's dimmers say, which are taken
/// away. `merged` is that of [`levels::Levels`].
fn light_powers(
    rig: &mut Rig,
    emitters: &[lights::Emitter],
    instances: &[FlatInstance],
    merged: &[(u32, u32)],
) -> Vec<u32> {
    let by_target = |dimmers: Vec<rig::Dimmer>| -> HashMap<u32, u32> {
        dimmers.into_iter().map(|dimmer| (dimmer.target, dimmer.power)).collect()
    };
    let of_instance = by_target(std::mem::take(&mut rig.dimmed_instances));
    let of_light = by_target(std::mem::take(&mut rig.dimmed_lights));
    let source = |emitter: &lights::Emitter| match instances[emitter.light.instance as usize].source {
        NONE => {
            let after = merged.partition_point(|(first, _)| *first <= emitter.place);
            merged.get(after.wrapping_sub(1)).map_or(NONE, |(_, instance)| *instance)
        }
        source => source,
    };
    let power = |powers: &HashMap<u32, u32>, target: u32| powers.get(&target).copied().unwrap_or(NONE);
    let last = of_light.keys().max().map_or(0, |last| last + 1);
    emitters
        .iter()
        .map(|emitter| power(&of_instance, source(emitter)))
        .chain((0..last).map(|light| power(&of_light, light)))
        .collect()
}

fn has_top(meshes: &[FlatMesh]) -> bool {
    !matches!(meshes, [only] if only.source == NONE)
}

/// The box of the triangles, point and spot lights.
fn bounds(instances: &[FlatInstance], meshes: &[FlatMesh], nodes: &[BvhNode], scene: &Scene) -> [Vec3; 2] {
    // Not the root of the top level: what has no place is in its box.
    let boxes = instances.iter().filter_map(|instance| {
        let root = nodes.get(meshes.get(instance.mesh as usize)?.root as usize)?;
        if !has_top(meshes) {
            Some([root.min, root.max])
        } else {
            levels::transformed_box(instance.transform, [root.min, root.max])
        }
    });
    let all = boxes.reduce(|[a, b], [min, max]| [a.min(min), b.max(max)]).unwrap_or_default();
    let placed = scene.lights.iter().filter(|light| light.kind != PunctualKind::Directional);
    let reach = Vec3::splat(MAX_COORDINATE);
    placed
        .map(|light| light.position.clamp(-reach, reach))
        .fold(all, |[min, max], position| [min.min(position), max.max(position)])
}

/// The scene's usable cameras, or one that shows it from inside or outside.
fn cameras(scene: &Scene, flat: &mut FlatScene, warnings: &mut Vec<String>) -> Vec<Camera> {
    let usable = |camera: &&Camera| {
        let extent = match camera.projection {
            Projection::Perspective { vertical_fov } => vertical_fov,
            Projection::Orthographic { half_height } => half_height,
        };
        let right = camera.forward.cross(camera.up);
        camera.position.is_finite() && right.is_finite() && right.length() > 1e-6 && extent.is_finite() && extent > 0.0
    };
    let kept: Vec<bool> = scene.cameras.iter().map(|camera| usable(&camera)).collect();
    let mut cameras: Vec<Camera> = scene.cameras.iter().filter(usable).cloned().collect();
    // The rig follows those that are left.
    flat.rig.cameras.retain(|attached| kept.get(attached.target as usize).copied().unwrap_or(false));
    for attached in &mut flat.rig.cameras {
        attached.target = kept.iter().take(attached.target as usize).filter(|kept| **kept).count() as u32;
    }
    let unusable = scene.cameras.len() - cameras.len();
    if unusable > 0 {
        warnings.push(format!("{unusable} cameras that cannot project were left out"));
    }
    if cameras.is_empty() {
        cameras.push(framing::camera(flat));
    }
    cameras
}
