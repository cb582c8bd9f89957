//! The trees of a scene as shaders walk them.

use crate::error::{Error, Result};
use crate::pace::Pace;
use crate::scene::FlatScene;
use crate::scene::bvh::wide::{self, Collapse};
use crate::scene::gpu_types::WideNode;

/// The trees of a scene as shaders walk them, one after another; last the top level, with room to be rebuilt in.
pub(super) struct Forest {
    pub nodes: Vec<WideNode>,
    /// Index of the root of each mesh's bottom level.
    pub roots: Vec<u32>,
    /// Index of the root of everything.
    pub top_level: u32,
}

impl Forest {
    pub async fn new(scene: &FlatScene, pace: &mut Pace) -> Result<Self> {
        /// Nodes made between two questions: a few milliseconds' worth.
        const SLICE: usize = 1 << 13;
        let limit = |what: &str, wanted: u32, had: u32| {
            let what = format!("the stack for {what}");
            if wanted > had {
                return Err(Error::Limit { what, wanted: wanted.into(), had: had.into(), unit: "entries" });
            }
            Ok(())
        };
        let mut forest = Forest { nodes: Vec::new(), roots: Vec::new(), top_level: 0 };
        for mesh in &scene.meshes {
            let root = forest.nodes.len() as u32;
            forest.roots.push(root);
            let mut collapse = Collapse::new(&scene.nodes, mesh.root as usize, root, 0);
            while !collapse.go_on(SLICE) {
                pace.breathe().await;
            }
            let tree = collapse.wide;
            limit("the BVH of a mesh", tree.stack, wide::MAX_STACK)?;
            // Most scenes have one large mesh, first: its nodes are not copied.
            if forest.nodes.is_empty() {
                forest.nodes = tree.nodes;
            } else {
                forest.nodes.extend(tree.nodes);
            }
            pace.breathe().await;
        }
        if scene.has_top_level() {
            forest.top_level = forest.nodes.len() as u32;
            let top = wide::collapse(&scene.nodes, scene.root() as usize, forest.top_level, 0);
            limit("the BVH of the instances", top.stack, wide::MAX_TOP_STACK)?;
            let room = wide::capacity(scene.nodes.len() - scene.root() as usize);
            forest.nodes.extend(top.nodes);
            forest.nodes.resize(forest.top_level as usize + room, bytemuck::Zeroable::zeroed());
        }
        Ok(forest)
    }
}
