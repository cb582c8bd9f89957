//! `ris`: resampled importance sampling of direct light, no reuse.

use super::{Technique, TechniqueInfo};
use crate::error::Result;
use crate::gpu::{Gpu, recorder::Recorder, shader::table};
use crate::params::Params;
use glam::UVec2;

crate::params! {
    /// Parameters of `ris`.
    pub struct RisParams {
        /// Light samples that one is resampled from, M. Higher: less noise where lights differ, more time. Lower: towards plain light sampling at 1. Unbiased at any value.
        candidates: uint(32, 1..=1024, "samples"),
    }
}

pub(super) static INFO: TechniqueInfo = TechniqueInfo {
    id: "ris",
    title: "RIS direct light",
    summary: "Direct light by resampled importance sampling: M light samples, one shadow ray, no reuse.",
    papers: &["Talbot et al. 2005", "Bitterli et al. 2020, Algorithm 3"],
    unbiased: true,
    bias: "Unbiased for direct light; draws no indirect light.",
    params: RisParams::SPECS,
    views: &[],
    layouts: &[RisParams::LAYOUT],
    create: |gpu| Box::new(Ris { params: Default::default(), uniform: gpu.uniform("ris.params", 4) }),
};

struct Ris {
    params: RisParams,
    uniform: wgpu::Buffer,
}

impl Technique for Ris {
    fn info(&self) -> &'static TechniqueInfo {
        &INFO
    }
    fn set(&mut self, name: &str, value: &str) -> Result<bool> {
        self.params.set(name, value)
    }
    fn values(&self) -> serde_json::Value {
        self.params.values()
    }
    fn prepare(&mut self, gpu: &Gpu, _size: UVec2) -> Result<()> {
        gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&self.params));
        Ok(())
    }
    fn record(&mut self, recorder: &mut Recorder<'_>, size: UVec2) -> Result<()> {
        recorder.pass(&table::RIS_RIS).bind("params", &self.uniform).dispatch_over(size)
    }
}
