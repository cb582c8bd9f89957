//! `restir-report`: the system of report 003, with its faults as switches beside the corrected form.

use super::{Bias, MAX_DEPTH, NO_INDIRECT, Technique, TechniqueInfo, biases_that_hold, views};
use crate::error::Result;
use crate::gpu::{Gpu, memory::bytes_of, recorder::Recorder, shader::table};
use crate::params::Params;
use crate::view::View;
use glam::UVec2;

crate::gpu_struct! {
/// The report's reservoir (section 4.1), one for each strategy of a pixel.
pub struct ReportReservoir {
    /// Which light the sample lies on, or `NONE`.
    pub light: u32,
    /// Where on it, two 16-bit numbers.
    pub point: u32,
    /// Target function of the sample at the pixel that holds it.
    pub desired_pdf: f32,
    /// W.
    pub unbiased_contribution_weight: f32,
    /// c, counted in proposals.
    pub samples_count: f32,
}
}

crate::params! {
    /// Parameters of `restir-report`.
    pub struct RestirReportParams {
        /// The report's configurations A to E: one sample a strategy; resampling; resampling with temporal reuse, with spatial reuse, with both. Each is unbiased without faults.
        configuration: choice(4, ["a-naive", "b-ris", "c-temporal", "d-spatial", "e-both"]),
        /// Proposals of each strategy that a pixel's reservoir is resampled from, RESAMPLE_COUNT; a-naive takes one. Higher: less noise, more time. Unbiased at any value.
        resample_count: uint(8, 1..=256, "samples"),
        /// How many frames' worth of samples the history may count for at most; the report names no such cap. Higher: less noise, slower to follow change. Unbiased at any value.
        history_cap: float(20.0, 0.0..=1000.0, "frames"),
        /// How far away the one neighbour lies at most. Higher: more different samples, less alike surfaces. Unbiased at any value.
        spatial_radius: float(0.03, 0.0..=1.0, "of height"),
        /// Fault: SamplesCount grows by one for a merged reservoir, whose weight stands for all that it has seen. Biased: the whole picture is too bright, and with temporal reuse brighter every frame.
        fault_sample_count: flag(false),
        /// Fault: a merged reservoir's weight is that of its own pixel, while the final weight divides by the desired pdf at this one. Biased: too bright on the whole, and light leaks across edges and corners; least where neighbours must be similar.
        fault_target_not_reevaluated: flag(false),
        /// Fault: merged reservoirs are weighted by their counts alone, also where the other could not have made the sample. Biased: too dark at edges and corners, with the two faults that follow, for their checks hide it.
        fault_count_weights: flag(false),
        /// Fault: the history is that of the same pixel, whatever it saw. Alone it adds noise when the camera moves, and no bias; with fault_count_weights it is biased.
        fault_no_reprojection: flag(false),
        /// Fault: the neighbour may see any surface, whatever its depth, normal or material. Alone it adds noise, and no bias; with fault_count_weights it is biased.
        fault_no_similarity: flag(false),
        /// Fault: the final weight divides by the desired pdf without asking whether it is 0. Makes NaNs, on purpose, which merging spreads; the film leaves them out, counts them, and is biased by what is missing.
        fault_unguarded_pdf: flag(false),
        /// Add indirect light from the path tracer's later bounces. Off: direct light only, faster, and darker than the truth.
        indirect: flag(true),
    }
}

pub(super) static INFO: TechniqueInfo = TechniqueInfo {
    id: "restir-report",
    title: "ReSTIR as reported",
    summary: "A student's ReSTIR, corrected: one reservoir for area lights and one for point lights, with the faults that its \
              report describes as switches.",
    papers: &["Report 003, a Direct3D 12 path tracer", "Bitterli et al. 2020", "Lin 2022 (dissertation), chapter 6"],
    unbiased: true,
    bias: "Unbiased in all five configurations without faults. Each fault_ setting is one of the report's mistakes: sample \
           counts make it too bright, count weights too dark, the target that is not re-evaluated leaks light, the unguarded \
           pdf makes NaNs; missing checks are biased together with count weights.",
    params: RestirReportParams::SPECS,
    views: &[
        View::radiance("area lights", "Direct light by the reservoir of area lights."),
        View::radiance("point lights", "Direct light by the reservoir of point lights."),
        views::INDIRECT,
        View::colors(
            "samples count",
            "Samples that the reservoirs count: red of area lights, green of point lights; full at twice what history may hold.",
        ),
        View::colors(
            "broken weights",
            "Weights that are no numbers: red of area lights, green of point lights; dark where all is well.",
        ),
        views::REJECTED_NEIGHBORS,
    ],
    layouts: &[ReportReservoir::LAYOUT, RestirReportParams::LAYOUT],
    check: |_| Ok(()),
    create: |gpu| Box::new(RestirReport::new(gpu)),
};

/// Reservoirs of a pixel: area lights and point lights. The report's third, for an indirect direction, is not there yet.
const STRATEGIES: u64 = 2;

struct RestirReport {
    params: RestirReportParams,
    uniform: wgpu::Buffer,
    /// The same without indirect light, for pictures of reservoirs on their own.
    direct_only: wgpu::Buffer,
    buffers: Option<Buffers>,
}

/// What depends on the picture's size.
struct Buffers {
    size: UVec2,
    /// Two to write to and fro within a frame, and the history: rotated, never copied.
    reservoirs: [wgpu::Buffer; 3],
    /// Which of them holds the previous frame's final reservoirs.
    history: usize,
    /// Whether there was a previous frame since the last start.
    has_history: bool,
    indirect: wgpu::TextureView,
}

impl RestirReport {
    fn new(gpu: &Gpu) -> Self {
        RestirReport {
            params: RestirReportParams::default(),
            uniform: gpu.uniform("restir-report.params", std::mem::size_of::<RestirReportParams>() as u64),
            direct_only: gpu.uniform("restir-report.params", std::mem::size_of::<RestirReportParams>() as u64),
            buffers: None,
        }
    }

    /// Whether the configuration has temporal and spatial reuse.
    fn reuse(&self) -> (bool, bool) {
        let RestirReportParams { configuration, .. } = self.params;
        (matches!(configuration, 2 | 4), matches!(configuration, 3 | 4))
    }
}

impl Technique for RestirReport {
    fn info(&self) -> &'static TechniqueInfo {
        &INFO
    }

    fn set(&mut self, name: &str, value: &str) -> Result<bool> {
        self.params.set(name, value)
    }

    fn values(&self) -> serde_json::Value {
        self.params.values()
    }

    fn biases(&self) -> Vec<Bias> {
        let RestirReportParams { fault_count_weights, .. } = self.params;
        let (temporal, spatial) = self.reuse();
        let reuses = temporal || spatial;
        biases_that_hold(&[
            (
                reuses && self.params.fault_sample_count == 1,
                "fault_sample_count",
                "too bright, and with temporal reuse brighter every frame",
            ),
            (
                reuses && self.params.fault_target_not_reevaluated == 1,
                "fault_target_not_reevaluated",
                "too bright on the whole, and light leaks across edges and corners",
            ),
            (reuses && fault_count_weights == 1, "fault_count_weights", "too dark at edges and corners"),
            (
                temporal && fault_count_weights == 1 && self.params.fault_no_reprojection == 1,
                "fault_no_reprojection",
                "with fault_count_weights: too dark where the camera has moved",
            ),
            (
                spatial && fault_count_weights == 1 && self.params.fault_no_similarity == 1,
                "fault_no_similarity",
                "with fault_count_weights: too dark at edges and corners",
            ),
            (
                self.params.fault_unguarded_pdf == 1,
                "fault_unguarded_pdf",
                "what is no number is left out of the picture",
            ),
            (self.params.indirect == 0, "indirect", NO_INDIRECT),
        ])
    }

    fn obeys(&self, parameter: &str) -> bool {
        parameter != MAX_DEPTH || self.params.indirect == 1
    }

    fn prepare(&mut self, gpu: &Gpu, size: UVec2) -> Result<()> {
        gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&self.params));
        let direct_only = RestirReportParams { indirect: 0, ..self.params };
        gpu.queue.write_buffer(&self.direct_only, 0, bytemuck::bytes_of(&direct_only));
        if let Some(buffers) = self.buffers.as_mut().filter(|buffers| buffers.size == size) {
            buffers.has_history = false;
            return Ok(());
        }
        let bytes = u64::from(size.x) * u64::from(size.y) * STRATEGIES * std::mem::size_of::<ReportReservoir>() as u64;
        let make = || gpu.storage(&format!("restir-report reservoirs at {}x{}", size.x, size.y), bytes);
        self.buffers = Some(Buffers {
            size,
            reservoirs: [make()?, make()?, make()?],
            history: 2,
            has_history: false,
            indirect: gpu.texture("restir-report.indirect", size, wgpu::TextureFormat::Rgba32Float),
        });
        Ok(())
    }

    fn memory(&self) -> u64 {
        let reservoirs = self.buffers.iter().flat_map(|buffers| &buffers.reservoirs);
        let indirect = self.buffers.iter().map(|buffers| (&buffers.indirect).into());
        let buffers = [&self.uniform, &self.direct_only].into_iter().chain(reservoirs);
        bytes_of(&buffers.map(Into::into).chain(indirect).collect::<Vec<_>>())
    }

    fn record(&mut self, recorder: &mut Recorder<'_>, size: UVec2) -> Result<()> {
        let (temporal_reuse, spatial_reuse) = self.reuse();
        let Some(buffers) = &mut self.buffers else { return Ok(()) };
        let reservoirs = &buffers.reservoirs;
        let history = buffers.history;
        let mut current = (history + 1) % 3;
        let mut spare = (history + 2) % 3;
        // What reservoirs stand for, where the frame is taken apart.
        let show = |recorder: &mut Recorder<'_>, reservoirs: &wgpu::Buffer| {
            let bound = [
                ("params", (&self.direct_only).into()),
                ("reservoirs", reservoirs.into()),
                ("indirect_radiance", (&buffers.indirect).into()),
            ];
            recorder.illustrate(&table::RESTIR_REPORT_SHADE, &bound, size)
        };

        recorder
            .pass(&table::RESTIR_REPORT_INITIAL)
            .inspected_by(&table::RESTIR_REPORT_INSPECT_INITIAL)
            .bind("params", &self.uniform)
            .bind("reservoirs_out", &reservoirs[current])
            .dispatch_over(size)?;
        show(recorder, &reservoirs[current])?;
        if temporal_reuse && buffers.has_history {
            recorder
                .pass(&table::RESTIR_REPORT_TEMPORAL)
                .inspected_by(&table::RESTIR_REPORT_INSPECT_TEMPORAL)
                .bind("params", &self.uniform)
                .bind("reservoirs", &reservoirs[current])
                .bind("reservoirs_previous", &reservoirs[history])
                .bind("reservoirs_out", &reservoirs[spare])
                .dispatch_over(size)?;
            std::mem::swap(&mut current, &mut spare);
            show(recorder, &reservoirs[current])?;
        }
        if spatial_reuse {
            recorder
                .pass(&table::RESTIR_REPORT_SPATIAL)
                .inspected_by(&table::RESTIR_REPORT_INSPECT_SPATIAL)
                .bind("params", &self.uniform)
                .bind("reservoirs", &reservoirs[current])
                .bind("reservoirs_out", &reservoirs[spare])
                .dispatch_over(size)?;
            current = spare;
            show(recorder, &reservoirs[current])?;
        }
        if self.params.indirect == 1 {
            recorder.pass(&table::COMMON_INDIRECT).bind("indirect_out", &buffers.indirect).dispatch_over(size)?;
        }
        recorder
            .pass(&table::RESTIR_REPORT_SHADE)
            .bind("params", &self.uniform)
            .bind("reservoirs", &reservoirs[current])
            .bind("indirect_radiance", &buffers.indirect)
            .dispatch_over(size)?;
        buffers.has_history = true;
        buffers.history = current;
        Ok(())
    }
}
