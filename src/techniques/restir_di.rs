//! `restir-di`: spatiotemporal reservoir resampling of direct light, as Bitterli et al. 2020 with the switches of thesis
//! 001, section 5.1.

use super::{Technique, TechniqueInfo, reuse};
use crate::error::Result;
use crate::gpu::{Gpu, recorder::Recorder, shader::table};
use crate::params::Params;
use glam::UVec2;

crate::gpu_struct! {
/// One reservoir, in the convention of dissertation 004, chapter 6.
pub struct Reservoir {
    /// Which light the sample lies on, or `NONE`.
    pub light: u32,
    /// Where on it, two 16-bit numbers.
    pub point: u32,
    /// W.
    pub unbiased_contribution_weight: f32,
    /// c.
    pub confidence_weight: f32,
}
}

crate::params! {
    /// Parameters of `restir-di`.
    pub struct RestirDiParams {
        /// Light samples that a pixel's initial reservoir is resampled from, M. Higher: less noise from many lights, more time. Unbiased at any value.
        light_samples: uint(32, 1..=1024, "samples"),
        /// Trace a shadow ray for the initial sample and pass it on only if it is lit. On: less noise in shadow; biased (darker) unless visibility_in_weights is on.
        visibility_reuse: flag(true),
        /// Join the reservoir of the same point in the previous frame. On: far less noise, frames become correlated. Its bias is that of reuse_weights.
        temporal_reuse: flag(true),
        /// Largest confidence weight of the history, in frames. Higher: less noise, slower to follow change. Unbiased at any value.
        history_cap: float(20.0, 0.0..=1000.0, "frames"),
        /// Largest distance between a point and its history, as a fraction of the distance to the camera. Higher: history is kept on thin and moving things, more smearing. Adds no bias to unbiased reuse_weights.
        temporal_position_threshold: float(0.05, 0.0..=10.0, "of distance"),
        /// Smallest cosine between the normals of a point and its history. Lower: more history on curved things. Adds no bias to unbiased reuse_weights.
        temporal_normal_threshold: float(0.9, -1.0..=1.0, "cosine"),
        /// Largest difference between the albedos of a point and its history. Higher: history crosses texture edges. Adds no bias to unbiased reuse_weights.
        temporal_albedo_threshold: float(0.25, 0.0..=1.0, ""),
        /// Join the reservoirs of neighbouring pixels. On: less noise, neighbours become correlated. Its bias is that of reuse_weights.
        spatial_reuse: flag(true),
        /// How often spatial reuse runs. Higher: samples travel further, more time. Adds no bias to unbiased reuse_weights.
        spatial_iterations: uint(1, 1..=4, "passes"),
        /// Neighbours that each iteration joins. Higher: less noise, more time. Adds no bias to unbiased reuse_weights.
        spatial_neighbors: uint(4, 1..=16, "pixels"),
        /// How far neighbours lie at most. Higher: more different samples, less alike surfaces. Adds no bias to unbiased reuse_weights.
        spatial_radius: float(30.0, 1.0..=256.0, "pixels"),
        /// Largest depth difference to a neighbour, relative. Higher: reuse across steps in depth. Adds no bias to unbiased reuse_weights.
        spatial_depth_threshold: float(0.1, 0.0..=10.0, "of depth"),
        /// Smallest cosine between the normals of a pixel and its neighbour. Lower: reuse round corners. Adds no bias to unbiased reuse_weights.
        spatial_normal_threshold: float(0.9, -1.0..=1.0, "cosine"),
        /// Spatial reuse is for pixels whose own confidence weight is below this, as after a disocclusion: a neighbour's one sample, however sure, is noise beside a long history. Higher: more pixels reuse; above history_cap + 1 all do, as in Bitterli et al. 2020. Lower: less time. Adds no bias, for confidence does not depend on samples.
        spatial_confidence_limit: float(8.0, 0.0..=10000.0, "frames"),
        /// Make what spatial reuse found the next frame's history, as Bitterli et al. 2020. On: samples spread further; neighbours become correlated, and what noise they bring stays. Adds no bias to unbiased reuse_weights.
        spatial_feedback: flag(false),
        /// Samples that a pixel keeps. 4: less noise, four times the memory and shadow rays. Unbiased either way.
        reservoir_size: choice(0, ["1", "4"]),
        /// How joined reservoirs are weighted. constant (1/M, every neighbour) and heuristics (1/M, after rejection by depth, normal and material) are biased whatever else is set and trace no rays; 1/z divides by the confidence of pixels that could have made the sample, balance weighs them by how likely they were to, pairwise each neighbour against the pixel alone, defensive likewise with a share kept for the pixel's own sample: unbiased with visibility_in_weights, or without visibility_reuse. Time goes with the square of neighbours for 1/z and balance, with their number for pairwise and defensive.
        reuse_weights: choice(3, crate::techniques::reuse::WEIGHTS),
        /// Trace shadow rays for reuse weights, in vain for constant and heuristics. Of k joined reservoirs, at most k(k - 1) rays for 1/z and balance and 2(k - 1) for pairwise and defensive; without visibility_reuse k more. On: unbiased. Off: faster, and too dark at the edges of shadows while visibility_reuse is on.
        visibility_in_weights: flag(true),
        /// Add indirect light from the path tracer's later bounces. Off: direct light only, faster, and darker than the truth.
        indirect: flag(true),
    }
}

pub(super) static INFO: TechniqueInfo = TechniqueInfo {
    id: "restir-di",
    title: "ReSTIR DI",
    summary: "Direct light by spatiotemporal reservoir resampling, indirect light by path tracing.",
    papers: &["Bitterli et al. 2020", "thesis 001, section 5", "Lin 2022 (dissertation), chapter 6 for conventions"],
    unbiased: true,
    bias: "Unbiased by default. reuse_weights = constant and heuristics are biased towards dark; the others are with \
           visibility_reuse but without visibility_in_weights, where visibility differs between pixels that share samples.",
    params: RestirDiParams::SPECS,
    views: &["direct", "indirect", "contribution weight", "confidence weight", "light"],
    layouts: &[Reservoir::LAYOUT, RestirDiParams::LAYOUT],
    create: |gpu| Box::new(RestirDi::new(gpu)),
};

/// Most spatial iterations; each has a uniform that says which it is.
const MAXIMUM_ITERATIONS: u32 = 4;

struct RestirDi {
    params: RestirDiParams,
    uniform: wgpu::Buffer,
    pass_indices: Vec<wgpu::Buffer>,
    buffers: Option<Buffers>,
}

/// What depends on picture size and reservoir size.
struct Buffers {
    made_for: (UVec2, u32),
    /// Two to write to and fro within a frame, and the history: rotated, never copied.
    reservoirs: [wgpu::Buffer; 3],
    /// Which of them holds the previous frame's final reservoirs.
    history: usize,
    /// Whether there was a previous frame since the last start.
    has_history: bool,
    indirect: wgpu::TextureView,
}

impl RestirDi {
    fn new(gpu: &Gpu) -> Self {
        let pass_indices = (0..MAXIMUM_ITERATIONS)
            .map(|index| {
                let buffer = gpu.uniform("restir-di.pass_index", 4);
                gpu.queue.write_buffer(&buffer, 0, &index.to_le_bytes());
                buffer
            })
            .collect();
        RestirDi {
            params: RestirDiParams::default(),
            uniform: gpu.uniform("restir-di.params", std::mem::size_of::<RestirDiParams>() as u64),
            pass_indices,
            buffers: None,
        }
    }
}

impl Technique for RestirDi {
    fn info(&self) -> &'static TechniqueInfo {
        &INFO
    }

    fn set(&mut self, name: &str, value: &str) -> Result<bool> {
        if name == reuse::OLD_NAME {
            for (name, value) in reuse::from_old(value)? {
                self.params.set(name, value)?;
            }
            return Ok(true);
        }
        self.params.set(name, value)
    }

    fn values(&self) -> serde_json::Value {
        self.params.values()
    }

    fn prepare(&mut self, gpu: &Gpu, size: UVec2) -> Result<()> {
        gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&self.params));
        let slots = if self.params.reservoir_size == 1 { 4 } else { 1 };
        if let Some(buffers) = self.buffers.as_mut().filter(|b| b.made_for == (size, slots)) {
            buffers.has_history = false;
            return Ok(());
        }
        let bytes = u64::from(size.x) * u64::from(size.y) * u64::from(slots) * std::mem::size_of::<Reservoir>() as u64;
        let make = || gpu.storage(&format!("restir-di reservoirs ({slots} a pixel at {}x{})", size.x, size.y), bytes);
        self.buffers = Some(Buffers {
            made_for: (size, slots),
            reservoirs: [make()?, make()?, make()?],
            history: 2,
            has_history: false,
            indirect: gpu.texture("restir-di.indirect", size, wgpu::TextureFormat::Rgba32Float),
        });
        Ok(())
    }

    fn record(&mut self, recorder: &mut Recorder<'_>, size: UVec2) -> Result<()> {
        let Some(buffers) = &mut self.buffers else { return Ok(()) };
        reuse::specialise(
            &mut recorder.features,
            self.params.reuse_weights,
            self.params.visibility_in_weights == 1,
            self.params.visibility_reuse == 1,
        );
        let reservoirs = &buffers.reservoirs;
        let history = buffers.history;
        let mut current = (history + 1) % 3;
        let mut spare = (history + 2) % 3;

        recorder
            .pass(&table::RESTIR_DI_INITIAL)
            .bind("params", &self.uniform)
            .bind("reservoirs_out", &reservoirs[current])
            .dispatch_over(size)?;
        // Without a history the pass would only copy; and the first picture need not wait for its pipeline.
        if self.params.temporal_reuse == 1 && buffers.has_history {
            recorder
                .pass(&table::RESTIR_DI_TEMPORAL)
                .bind("params", &self.uniform)
                .bind("reservoirs", &reservoirs[current])
                .bind("reservoirs_previous", &reservoirs[history])
                .bind("reservoirs_out", &reservoirs[spare])
                .dispatch_over(size)?;
            std::mem::swap(&mut current, &mut spare);
        }
        let found_in_time = current;
        if self.params.spatial_reuse == 1 {
            for pass_index in self.pass_indices.iter().take(self.params.spatial_iterations as usize) {
                recorder
                    .pass(&table::RESTIR_DI_SPATIAL)
                    .bind("params", &self.uniform)
                    .bind("pass_index", pass_index)
                    .bind("reservoirs", &reservoirs[current])
                    .bind("reservoirs_out", &reservoirs[spare])
                    .dispatch_over(size)?;
                // What this pass read is free now, unless it is the next frame's history.
                let free =
                    if self.params.spatial_feedback == 0 && current == found_in_time { history } else { current };
                current = spare;
                spare = free;
            }
        }
        if self.params.indirect == 1 {
            recorder.pass(&table::RESTIR_DI_INDIRECT).bind("indirect_out", &buffers.indirect).dispatch_over(size)?;
        }
        recorder
            .pass(&table::RESTIR_DI_SHADE)
            .bind("params", &self.uniform)
            .bind("reservoirs", &reservoirs[current])
            .bind("indirect_radiance", &buffers.indirect)
            .dispatch_over(size)?;
        buffers.has_history = true;
        buffers.history = if self.params.spatial_feedback == 1 { current } else { found_in_time };
        Ok(())
    }
}
