//! `restir-di`: spatiotemporal reservoir resampling of direct light, as Bitterli et al. 2020 with the switches of thesis
//! 001, section 5.1.

use super::{Bias, MAX_DEPTH, NO_INDIRECT, Technique, TechniqueInfo, biases_that_hold, candidates, reuse, views};
use crate::error::Result;
use crate::gpu::{Gpu, memory::bytes_of, recorder::Recorder, shader::table};
use crate::params::Params;
use crate::view::View;
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
        /// Rays drawn for the BSDF of a pixel that add what they run into to its candidates, weighed by the balance heuristic. Higher: sharp reflections of large lights get less noise; a ray each, and every light sample costs more. Unbiased at any value.
        bsdf_samples: uint(0, 0..=16, "rays"),
        /// How light samples choose a light. alias: by power, in constant time. cdf: by power, in a time that grows with the logarithm of the number of lights. uniform: all alike, which is noisier where they differ. Unbiased either way.
        light_choice: choice(0, crate::techniques::candidates::LIGHT_CHOICES),
        /// With a reservoir_size of 4: whether each reservoir has candidates of its own (four times the time, samples that differ more) or all four select from the same. Unbiased either way.
        stratified: flag(false),
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
        /// Take the history of another pixel in the same block of 4 x 4, a different one each frame. On: neighbours whose histories are alike come apart, which denoisers like; more noise at edges. Adds no bias to unbiased reuse_weights.
        temporal_permutation: flag(false),
        /// Throw away reservoirs whose estimate is far above the mean of their 8 x 8 pixels: above ten times it near 0, above the mean itself at 1; 0 throws nothing away. Higher: fewer bright specks that stay, and darker. Biased (darker) above 0.
        boiling_filter: float(0.0, 0.0..=1.0, ""),
        /// Join the reservoirs of neighbouring pixels. On: less noise, neighbours become correlated. Its bias is that of reuse_weights.
        spatial_reuse: flag(true),
        /// How often spatial reuse runs. Higher: samples travel further, more time. Adds no bias to unbiased reuse_weights.
        spatial_iterations: uint(1, 1..=4, "passes"),
        /// Neighbours that each iteration joins. Higher: less noise, more time. Adds no bias to unbiased reuse_weights.
        spatial_neighbors: uint(4, 1..=16, "pixels"),
        /// Neighbours that a pixel without history joins, if more than spatial_neighbors. Higher: less noise where something came into view, more time there. Adds no bias to unbiased reuse_weights.
        disocclusion_neighbors: uint(0, 0..=16, "pixels"),
        /// How many pixels are looked at for each neighbour that is wanted, until enough are found that are like the pixel. Higher: fewer pixels stay without neighbours, more time. Adds no bias, for only surfaces are looked at.
        spatial_retries: uint(1, 1..=8, "tries"),
        /// Where in their disk neighbours are looked for: each at random, or together at the points of a low-discrepancy sequence (R2) that is turned at random for every pixel, which spreads them evenly. Adds no bias.
        spatial_pattern: choice(0, ["random", "low-discrepancy"]),
        /// How far neighbours lie at most. Higher: more different samples, less alike surfaces. Adds no bias to unbiased reuse_weights.
        spatial_radius: float(30.0, 1.0..=256.0, "pixels"),
        /// Largest depth difference to a neighbour, relative. Higher: reuse across steps in depth. Adds no bias to unbiased reuse_weights.
        spatial_depth_threshold: float(0.1, 0.0..=10.0, "of depth"),
        /// Smallest cosine between the normals of a pixel and its neighbour. Lower: reuse round corners. Adds no bias to unbiased reuse_weights.
        spatial_normal_threshold: float(0.9, -1.0..=1.0, "cosine"),
        /// Largest difference to a neighbour in base colour, metalness or roughness squared; 1 allows all. Higher: reuse across the edges of materials. Adds no bias to unbiased reuse_weights.
        spatial_material_threshold: float(1.0, 0.0..=1.0, ""),
        /// Largest confidence weight of a neighbour. Higher: neighbours with a long history count for more. Lower: the pixel's own sample does. Unbiased at any value.
        spatial_cap: float(10000.0, 0.0..=10000.0, "frames"),
        /// Spatial reuse is for pixels whose own confidence weight is below this, as after a disocclusion: a neighbour's one sample, however sure, is noise beside a long history. Higher: more pixels reuse; above history_cap + 1 all do, as in Bitterli et al. 2020. Lower: less time. Adds no bias, for confidence does not depend on samples.
        spatial_confidence_limit: float(8.0, 0.0..=10000.0, "frames"),
        /// Make what spatial reuse found the next frame's history, as Bitterli et al. 2020. On: samples spread further; neighbours become correlated, and what noise they bring stays. Adds no bias to unbiased reuse_weights.
        spatial_feedback: flag(false),
        /// Samples that a pixel keeps. 4: less noise, four times the memory and shadow rays. Unbiased either way.
        reservoir_size: choice(0, ["1", "4"]),
        /// How a reservoir is kept: in f32 16 bytes, or packed in 12, where a contribution weight is rounded to 1/8192 and a confidence weight to 1/128 of itself. Packed: a quarter less memory; the same picture but for that rounding.
        reservoir_format: choice(0, ["f32", "packed"]),
        /// In which order pixels lie in memory: by rows, by columns, or in tiles of 2 to 40 pixels a side. The same picture; which is fastest depends on the device.
        pixel_order: choice(0, ["rows", "columns", "tiles-2", "tiles-4", "tiles-8", "tiles-16", "tiles-40"]),
        /// How joined reservoirs are weighted. constant (1/M, every neighbour) and heuristics (1/M, after rejection by depth, normal and material) are biased whatever else is set and trace no rays; 1/z divides by the confidence of pixels that could have made the sample, balance weighs them by how likely they were to, pairwise each neighbour against the pixel alone, defensive likewise with a share kept for the pixel's own sample (of neighbours; history is joined pairwise): unbiased with visibility_in_weights, or without visibility_reuse. Time goes with the square of neighbours for 1/z and balance, with their number for pairwise and defensive.
        reuse_weights: choice(5, crate::techniques::reuse::WEIGHTS),
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
           visibility_reuse but without visibility_in_weights, where visibility differs between pixels that share samples. \
           boiling_filter above 0 darkens what is bright.",
    params: RestirDiParams::SPECS,
    views: &[
        views::DIRECT,
        views::INDIRECT,
        views::CONTRIBUTION_WEIGHT,
        views::TARGET_FUNCTION,
        views::CONFIDENCE_WEIGHT,
        views::LIGHT,
        View::magnitude(
            "duplicates",
            "The share of pixels within 5 that hold the very same sample; black for none.",
            "of pixels",
            [1e-3, 1.0],
        ),
        views::REJECTED_NEIGHBORS,
    ],
    layouts: &[Reservoir::LAYOUT, RestirDiParams::LAYOUT],
    check: |_| Ok(()),
    create: |gpu| Box::new(RestirDi::new(gpu)),
};

/// Most spatial iterations; each has a uniform that says which it is.
const MAXIMUM_ITERATIONS: u32 = 4;

impl RestirDiParams {
    /// Reservoirs of a pixel.
    fn slots(&self) -> u32 {
        if self.reservoir_size == 1 { 4 } else { 1 }
    }

    fn is_packed(&self) -> bool {
        self.reservoir_format == 1
    }

    /// 32-bit words of a reservoir buffer; `shaders/techniques/restir-di/reservoirs.wgsl` addresses them.
    fn reservoir_words(&self, size: UVec2) -> u64 {
        let side = match self.pixel_order {
            0 | 1 => 1,
            6 => 40,
            order => 1 << (order - 1),
        };
        let pixels = u64::from(size.x.next_multiple_of(side)) * u64::from(size.y.next_multiple_of(side));
        // Shaders read words by four.
        (pixels * u64::from(self.slots()) * if self.is_packed() { 3 } else { 4 }).next_multiple_of(4)
    }
}

struct RestirDi {
    params: RestirDiParams,
    uniform: wgpu::Buffer,
    /// The same without indirect light, for pictures of reservoirs on their own.
    direct_only: wgpu::Buffer,
    pass_indices: Vec<wgpu::Buffer>,
    buffers: Option<Buffers>,
}

/// What depends on picture size and reservoir size.
struct Buffers {
    made_for: (UVec2, u64),
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
            direct_only: gpu.uniform("restir-di.params", std::mem::size_of::<RestirDiParams>() as u64),
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

    fn biases(&self) -> Vec<Bias> {
        let RestirDiParams { temporal_reuse, spatial_reuse, visibility_reuse, visibility_in_weights, .. } = self.params;
        let reuses = temporal_reuse == 1 || spatial_reuse == 1;
        let by_count = matches!(reuse::WEIGHTS[self.params.reuse_weights as usize], "constant" | "heuristics");
        let unseen = visibility_reuse == 1 && visibility_in_weights == 0;
        biases_that_hold(&[
            (
                reuses && by_count,
                "reuse_weights",
                "1/M: too dark where pixels that share samples differ, as at edges of shadows and in corners",
            ),
            (
                reuses && !by_count && unseen,
                "visibility_in_weights",
                "too dark at the edges of shadows, for shadowed samples are not passed on",
            ),
            (
                self.params.boiling_filter > 0.0,
                "boiling_filter",
                "what is far brighter than its surroundings is thrown away: darker",
            ),
            (self.params.indirect == 0, "indirect", NO_INDIRECT),
        ])
    }

    fn obeys(&self, parameter: &str) -> bool {
        parameter != MAX_DEPTH || self.params.indirect == 1
    }

    fn highest(&self, view: &str) -> Option<f32> {
        let RestirDiParams { spatial_reuse, spatial_iterations, spatial_neighbors, disocclusion_neighbors, .. } =
            self.params;
        let wanted = spatial_neighbors.max(disocclusion_neighbors);
        let neighbors = (spatial_reuse * spatial_iterations * wanted) as f32;
        match view {
            name if name == views::CONFIDENCE_WEIGHT.name => Some((self.params.history_cap + 1.0) * (1.0 + neighbors)),
            name if name == views::REJECTED_NEIGHBORS.name => {
                Some((neighbors * self.params.spatial_retries as f32).max(1.0))
            }
            _ => None,
        }
    }

    fn prepare(&mut self, gpu: &Gpu, size: UVec2) -> Result<()> {
        gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&self.params));
        let direct_only = RestirDiParams { indirect: 0, ..self.params };
        gpu.queue.write_buffer(&self.direct_only, 0, bytemuck::bytes_of(&direct_only));
        let (slots, words) = (self.params.slots(), self.params.reservoir_words(size));
        if let Some(buffers) = self.buffers.as_mut().filter(|b| b.made_for == (size, words)) {
            buffers.has_history = false;
            return Ok(());
        }
        let what = format!("restir-di reservoirs ({slots} a pixel at {}x{})", size.x, size.y);
        let make = || gpu.storage(&what, 4 * words);
        self.buffers = Some(Buffers {
            made_for: (size, words),
            reservoirs: [make()?, make()?, make()?],
            history: 2,
            has_history: false,
            indirect: gpu.texture("restir-di.indirect", size, wgpu::TextureFormat::Rgba32Float),
        });
        Ok(())
    }

    fn memory(&self) -> u64 {
        let own = [&self.uniform, &self.direct_only].into_iter().chain(&self.pass_indices);
        let reservoirs = self.buffers.iter().flat_map(|buffers| &buffers.reservoirs);
        let indirect = self.buffers.iter().map(|buffers| (&buffers.indirect).into());
        bytes_of(&own.chain(reservoirs).map(Into::into).chain(indirect).collect::<Vec<_>>())
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

        recorder.features.reservoirs_packed = self.params.is_packed();
        let features = recorder.features;
        candidates::specialise(&mut recorder.features, self.params.light_choice, self.params.bsdf_samples);
        recorder
            .pass(&table::RESTIR_DI_INITIAL)
            .inspected_by(&table::RESTIR_DI_INSPECT_INITIAL)
            .bind("params", &self.uniform)
            .bind("reservoirs_out", &reservoirs[current])
            .dispatch_over(size)?;
        // Indirect light draws its lights as the path tracer does.
        recorder.features = features;
        // What reservoirs stand for, where the frame is taken apart.
        let show = |recorder: &mut Recorder<'_>, reservoirs: &wgpu::Buffer| {
            let bound = [
                ("params", (&self.direct_only).into()),
                ("reservoirs", reservoirs.into()),
                ("indirect_radiance", (&buffers.indirect).into()),
            ];
            recorder.illustrate(&table::RESTIR_DI_SHADE, &bound, size)
        };
        show(recorder, &reservoirs[current])?;
        // Without a history the pass would only copy; and the first picture need not wait for its pipeline.
        if self.params.temporal_reuse == 1 && buffers.has_history {
            // Of two reservoirs pairwise weights are the balance heuristic; a share kept for the newer one would only make the
            // history shorter.
            let features = recorder.features;
            recorder.features.reuse_defensive = false;
            recorder
                .pass(&table::RESTIR_DI_TEMPORAL)
                .inspected_by(&table::RESTIR_DI_INSPECT_TEMPORAL)
                .bind("params", &self.uniform)
                .bind("reservoirs", &reservoirs[current])
                .bind("reservoirs_previous", &reservoirs[history])
                .bind("reservoirs_out", &reservoirs[spare])
                .dispatch_over(size)?;
            recorder.features = features;
            std::mem::swap(&mut current, &mut spare);
            show(recorder, &reservoirs[current])?;
        }
        if self.params.boiling_filter > 0.0 {
            recorder
                .pass(&table::RESTIR_DI_BOILING)
                .bind("params", &self.uniform)
                .bind("reservoirs", &reservoirs[current])
                .bind("reservoirs_out", &reservoirs[spare])
                .dispatch_over(size)?;
            std::mem::swap(&mut current, &mut spare);
            show(recorder, &reservoirs[current])?;
        }
        let found_in_time = current;
        if self.params.spatial_reuse == 1 {
            for pass_index in self.pass_indices.iter().take(self.params.spatial_iterations as usize) {
                recorder
                    .pass(&table::RESTIR_DI_SPATIAL)
                    .inspected_by(&table::RESTIR_DI_INSPECT_SPATIAL)
                    .bind("params", &self.uniform)
                    .bind("pass_index", pass_index)
                    .bind("reservoirs", &reservoirs[current])
                    .bind("reservoirs_previous", &reservoirs[found_in_time])
                    .bind("reservoirs_out", &reservoirs[spare])
                    .dispatch_over(size)?;
                // What this pass read is free now, but for what each iteration reads; the old history is no longer needed.
                let free = if current == found_in_time { history } else { current };
                current = spare;
                spare = free;
                show(recorder, &reservoirs[current])?;
            }
        }
        if self.params.indirect == 1 {
            recorder.pass(&table::COMMON_INDIRECT).bind("indirect_out", &buffers.indirect).dispatch_over(size)?;
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
