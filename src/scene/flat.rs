//! A scene as plain arrays with a BVH: what is uploaded, sent from a Worker to the page, and kept to rebuild a lost device.

use super::gpu_types::{BvhNode, EnvironmentTexel, Light, Material, Triangle};
use super::{Camera, LightMotion, Scene};
use crate::error::{Error, Result};
use glam::Vec3;

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
    /// Node 0 is the root; a scene without triangles has one empty leaf.
    pub nodes: Vec<BvhNode>,
    /// In BVH leaf order.
    pub triangles: Vec<Triangle>,
    /// At least one.
    pub materials: Vec<Material>,
    /// With alias table; the environment, if any, is the last. May be empty.
    pub lights: Vec<Light>,
    /// Index in `lights` of the first punctual light; they follow in the order of [`Scene::lights`].
    pub first_punctual: u32,
    /// How punctual lights move; `light` counts from `first_punctual`.
    pub motions: Vec<LightMotion>,
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
    /// Indices out of range, or more of something than an index can count.
    pub fn build(scene: &Scene, progress: &mut dyn FnMut(f32, &str)) -> Result<Self> {
        let _ = (scene, progress);
        Err(Error::Device("not written yet".into()))
    }
}
