//! `normals`: shading normals as colours. The living template of a technique: copy it to begin a new one.

use super::{Technique, TechniqueInfo};
use crate::error::Result;
use crate::gpu::{Gpu, memory::bytes_of, recorder::Recorder, shader::table};
use crate::params::Params;
use glam::UVec2;

crate::params! {
    /// Parameters of `normals`.
    pub struct NormalsParams {
        /// Show the flat normal of each triangle instead of the interpolated, mapped one.
        geometric: flag(false),
    }
}

pub(super) static INFO: TechniqueInfo = TechniqueInfo {
    id: "normals",
    title: "Normals",
    summary: "Shading normals as colours: the template for a new technique.",
    papers: &[],
    unbiased: true,
    bias: "Not an estimate of light.",
    params: NormalsParams::SPECS,
    views: &[],
    layouts: &[NormalsParams::LAYOUT],
    check: |_| Ok(()),
    create: |gpu| Box::new(Normals { params: Default::default(), uniform: gpu.uniform("normals.params", 4) }),
};

struct Normals {
    params: NormalsParams,
    uniform: wgpu::Buffer,
}

impl Technique for Normals {
    fn info(&self) -> &'static TechniqueInfo {
        &INFO
    }
    fn set(&mut self, name: &str, value: &str) -> Result<bool> {
        self.params.set(name, value)
    }
    fn values(&self) -> serde_json::Value {
        self.params.values()
    }
    fn obeys(&self, _parameter: &str) -> bool {
        false
    }
    fn prepare(&mut self, gpu: &Gpu, _size: UVec2) -> Result<()> {
        gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&self.params));
        Ok(())
    }
    fn memory(&self) -> u64 {
        bytes_of(&[(&self.uniform).into()])
    }
    fn record(&mut self, recorder: &mut Recorder<'_>, size: UVec2) -> Result<()> {
        recorder.pass(&table::NORMALS_NORMALS).bind("params", &self.uniform).dispatch_over(size)
    }
}
