//! `ris`: resampled importance sampling of direct light, no reuse.

use super::{MAX_DEPTH, Technique, TechniqueInfo, candidates, views};
use crate::error::Result;
use crate::gpu::{Gpu, memory::bytes_of, recorder::Recorder, shader::table};
use crate::params::Params;
use glam::UVec2;

crate::params! {
    /// Parameters of `ris`.
    pub struct RisParams {
        /// Light samples that one is resampled from, M. Higher: less noise where lights differ, more time. Lower: towards plain light sampling at 1. Unbiased at any value.
        candidates: uint(32, 1..=1024, "samples"),
        /// Rays drawn for the BSDF that add what they run into to the candidates, weighed by the balance heuristic. Higher: sharp reflections of large lights get less noise; a ray each, and every light sample costs more. Unbiased at any value.
        bsdf_samples: uint(0, 0..=16, "rays"),
        /// How light samples choose a light. alias: by power, in constant time. cdf: by power, in a time that grows with the logarithm of the number of lights. uniform: all alike, which is noisier where they differ. Unbiased either way.
        light_choice: choice(0, candidates::LIGHT_CHOICES),
        /// Samples that are shaded, N, with a shadow ray each. Higher: less noise in shadow, more time. Unbiased at any value.
        samples: uint(1, 1..=4, "samples"),
        /// Whether each of N samples is selected from M candidates of its own (002, Eq. 5: less noise, N times the time) or all from the same (002, Eq. 13). Unbiased either way.
        stratified: flag(false),
    }
}

pub(super) static INFO: TechniqueInfo = TechniqueInfo {
    id: "ris",
    title: "RIS direct light",
    summary: "Direct light by resampled importance sampling: M candidates, one shadow ray, no reuse.",
    papers: &["Talbot et al. 2005", "Bitterli et al. 2020, Algorithm 3", "thesis 000, listing 3"],
    unbiased: true,
    bias: "Unbiased for direct light; draws no indirect light.",
    params: RisParams::SPECS,
    views: &[views::CONTRIBUTION_WEIGHT, views::TARGET_FUNCTION, views::LIGHT],
    layouts: &[RisParams::LAYOUT],
    check: |_| Ok(()),
    create: |gpu| {
        Box::new(Ris { params: Default::default(), uniform: gpu.uniform("ris.params", size_of::<RisParams>() as u64) })
    },
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
    fn obeys(&self, parameter: &str) -> bool {
        parameter != MAX_DEPTH
    }
    fn prepare(&mut self, gpu: &Gpu, _size: UVec2) -> Result<()> {
        gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&self.params));
        Ok(())
    }
    fn memory(&self) -> u64 {
        bytes_of(&[(&self.uniform).into()])
    }
    fn record(&mut self, recorder: &mut Recorder<'_>, size: UVec2) -> Result<()> {
        candidates::specialise(&mut recorder.features, self.params.light_choice, self.params.bsdf_samples);
        let pass = recorder.pass(&table::RIS_RIS).inspected_by(&table::RIS_INSPECT);
        pass.bind("params", &self.uniform).dispatch_over(size)
    }
}
