//! What flattening is at, for whoever waits for it.

use std::fmt;

/// A step of [`FlatScene::build`](super::FlatScene::build).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// What stands still is put into one mesh.
    Placing,
    /// A bottom level is built.
    Bvh,
    /// Images are made smaller and smaller.
    Mips,
    /// Lights are put into their table.
    Lights,
    /// Nothing is left.
    Done,
}

impl Step {
    /// The stage of a load that it belongs to, as www/stages.ts names it.
    pub fn stage(self) -> &'static str {
        match self {
            Step::Placing | Step::Bvh => "bvh",
            Step::Mips | Step::Lights | Step::Done => "textures",
        }
    }
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Step::Placing => "placing meshes",
            Step::Bvh => "building the BVH",
            Step::Mips => "making mip levels",
            Step::Lights => "weighing lights",
            Step::Done => "done",
        })
    }
}
