//! A scene as plain arrays with a BVH: what is uploaded, sent from a Worker to the page, and kept to rebuild a lost device.

mod atlas;
mod bytes;
mod framing;
mod lights;
mod materials;
mod triangles;
mod validate;

pub(super) use triangles::face_normal;

use super::gpu_types::{BvhNode, EnvironmentTexel, Light, Material, NONE, Triangle};
use super::{Camera, MAX_COORDINATE, Projection, PunctualKind, Rig, Scene, bvh, rig};
use crate::error::{Error, Result};
use glam::{Vec3, Vec4};

/// All textures of a scene in layers of one size. Texels are as stored in the files (sRGB where the file says so).
#[derive(Debug, Clone, PartialEq)]
pub struct Atlas {
    /// Width and height of a layer in texels.
    pub size: u32,
    /// Number of layers, at least 1.
    pub layers: u32,
    /// RGBA8, layer by layer, row by row: `size * size * layers * 4` bytes.
    pub texels: Vec<u8>,
}

/// The environment with its alias table.
#[derive(Debug, Clone, PartialEq)]
pub struct FlatEnvironment {
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// Linear radiance, RGB and an unused 1.
    pub radiance: Vec<[f32; 4]>,
    /// One entry a texel.
    pub alias: Vec<EnvironmentTexel>,
}

/// What a scene holds, for reports.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SceneStats {
    /// Triangles after instancing.
    pub triangles: u64,
    /// Triangles dropped because they have no area or positions that are not finite.
    pub dropped_triangles: u64,
    /// Placements of meshes.
    pub instances: u64,
    /// Materials.
    pub materials: u64,
    /// Textures.
    pub textures: u64,
    /// Lights: emissive triangles + punctual lights + environment.
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

/// Pod arrays + flattened BVH. World space, metres, linear Rec. 709.
#[derive(Debug, Clone, PartialEq)]
pub struct FlatScene {
    /// For titles and reports.
    pub name: String,
    /// Node 0 is the root; a scene without triangles has one leaf with a single point in it.
    pub nodes: Vec<BvhNode>,
    /// In BVH leaf order.
    pub triangles: Vec<Triangle>,
    /// At least one.
    pub materials: Vec<Material>,
    /// With alias table; the environment, if any, is the last. May be empty.
    pub lights: Vec<Light>,
    /// Index in `lights` of the first punctual light; they follow in the order of [`Scene::lights`].
    pub first_punctual: u32,
    /// What moves; its lights count from `first_punctual`, its cameras are indices in `cameras`.
    pub rig: Rig,
    /// Textures.
    pub atlas: Atlas,
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
    pub fn build(scene: &Scene, progress: &mut dyn FnMut(f32, &str)) -> Result<Self> {
        let mut warnings = scene.warnings.clone();
        let baked = triangles::bake(scene, &mut |fraction, what| progress(0.3 * fraction, what))?;
        if baked.dropped > 0 {
            warnings.push(format!("{} triangles without area or with unusable positions were left out", baked.dropped));
        }

        progress(0.3, "building the BVH");
        let mut unordered = baked.triangles;
        let triangle_count = unordered.len() as u64;
        if unordered.is_empty() {
            unordered.push(POINT);
        }
        let bvh::Bvh { nodes, order, depth } = bvh::build(&unordered);
        let mut triangles: Vec<Triangle> = order.iter().map(|&i| unordered[i as usize]).collect();
        drop(unordered);

        progress(0.8, "packing textures");
        let (atlas, rectangles) = atlas::pack(scene, &mut warnings)?;
        let materials = materials::flatten(scene, &rectangles)?;

        progress(0.9, "weighing lights");
        let environment = match &scene.environment {
            Some(environment) => lights::environment(environment)?,
            None => None,
        };
        let (lights, first_punctual) = lights::build(&mut triangles, &materials, &scene.lights, environment.is_some())?;
        let bounds = bounds(&nodes, scene);
        let mut flat = FlatScene {
            name: scene.name.clone(),
            cameras: Vec::new(),
            bounds,
            stats: SceneStats::default(),
            nodes,
            triangles,
            materials,
            lights,
            first_punctual,
            rig: scene.rig.clone(),
            atlas,
            environment,
            warnings: Vec::new(),
        };
        flat.cameras = cameras(scene, &mut flat, &mut warnings);
        let counts =
            rig::Counts { instances: scene.instances.len(), lights: scene.lights.len(), cameras: flat.cameras.len() };
        flat.rig.check(counts).map_err(|(place, what)| Error::bad_value(place, what))?;
        flat.warnings = warnings;
        flat.stats = SceneStats {
            triangles: triangle_count,
            dropped_triangles: baked.dropped,
            instances: scene.instances.len() as u64,
            materials: flat.materials.len() as u64,
            textures: scene.textures.len() as u64,
            lights: flat.lights.len() as u64,
            emissive_triangles: u64::from(first_punctual),
            bvh_nodes: flat.nodes.len() as u64,
            bvh_depth: depth,
            bvh_cost: bvh::cost(&flat.nodes),
            gpu_bytes: flat.gpu_bytes(),
        };
        progress(1.0, "done");
        Ok(flat)
    }

    /// Bytes of all arrays as the GPU holds them.
    fn gpu_bytes(&self) -> u64 {
        let environment =
            self.environment.as_ref().map_or(0, |e| size_of_val(&e.radiance[..]) + size_of_val(&e.alias[..]));
        let arrays = size_of_val(&self.nodes[..])
            + size_of_val(&self.triangles[..])
            + size_of_val(&self.materials[..])
            + size_of_val(&self.lights[..]);
        (arrays + self.atlas.texels.len() + environment) as u64
    }
}

/// Stands in for the triangles of an empty scene: a point, which no ray hits.
const POINT: Triangle = Triangle {
    p0: Vec3::ZERO,
    material: 0,
    p1: Vec3::ZERO,
    light: NONE,
    p2: Vec3::ZERO,
    instance: 0,
    uv_a: Vec4::ZERO,
    uv_b: Vec4::ZERO,
    uv_c: Vec4::ZERO,
    normal_0: 0,
    normal_1: 0,
    normal_2: 0,
    tangents: 0,
    color_0: u32::MAX,
    color_1: u32::MAX,
    color_2: u32::MAX,
    flags: 0,
};

/// The box of the triangles, point and spot lights.
fn bounds(nodes: &[BvhNode], scene: &Scene) -> [Vec3; 2] {
    let root = nodes.first().map_or([Vec3::ZERO; 2], |root| [root.min, root.max]);
    let placed = scene.lights.iter().filter(|light| light.kind != PunctualKind::Directional);
    let reach = Vec3::splat(MAX_COORDINATE);
    placed
        .map(|light| light.position.clamp(-reach, reach))
        .fold(root, |[min, max], position| [min.min(position), max.max(position)])
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
