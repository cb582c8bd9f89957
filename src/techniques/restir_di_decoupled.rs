//! `restir-di-decoupled`: the production pipeline of Wyman and Panteleev 2021, light tiles and decoupled shading.

use super::{Bias, MAX_DEPTH, NO_INDIRECT, Technique, TechniqueInfo, biases_that_hold, views};
use crate::error::{Error, Result};
use crate::gpu::{Gpu, memory::bytes_of, recorder::Recorder, shader::table};
use crate::params::Params;
use crate::view::View;
use glam::UVec2;

crate::gpu_struct! {
/// A presampled light (Wyman and Panteleev 2021, section 5.2), resolved so that nothing of the scene is needed to weigh it.
pub struct TileLight {
    /// The point on the light, in metres, or the direction to a distant one.
    pub place: [f32; 3],
    /// Which light; its kind in the highest three bits.
    pub light: u32,
    /// Luminance over density, times the normal of a surface; else with what its kind needs.
    pub weight: [f32; 3],
    /// Where on the light, two 16-bit numbers.
    pub point: u32,
}
}

crate::gpu_struct! {
/// What a pixel hands to the next frame, in the convention of dissertation 004, chapter 6.
pub struct DecoupledReservoir {
    /// Which light the sample lies on, or `NONE`.
    pub light: u32,
    /// Where on it, two 16-bit numbers.
    pub point: u32,
    /// W.
    pub unbiased_contribution_weight: f32,
    /// c in 32nds of a frame, 16 bits; whether the sample was lit, and how many frames ago that was found out.
    pub state: u32,
}
}

crate::gpu_struct! {
/// What a pixel's first kernel hands to the other two.
pub struct Selection {
    /// The candidate's light, or `NONE`.
    pub light: u32,
    /// Where on it.
    pub point: u32,
    /// Its W.
    pub unbiased_contribution_weight: f32,
    /// The previous frame's pixel of the same point, two 16-bit numbers, or `NONE`.
    pub temporal: u32,
    /// A pixel near that one, or `NONE`.
    pub spatiotemporal: u32,
    /// Which samples are lit, seen from which pixels; a bit each.
    pub visibility: u32,
}
}

crate::gpu_struct! {
/// The surface that a pixel saw, as far as the target function of the next frame needs it.
pub struct DomainRecord {
    /// World space, metres, in the frame that saw it.
    pub position: [f32; 3],
    /// Of shading; octahedral, two 16-bit numbers.
    pub normal: u32,
    /// Of the triangle, likewise.
    pub geometric_normal: u32,
    /// Metalness and GGX's alpha, 16 bits each.
    pub metallic_alpha: u32,
    /// Luminance of F0, and F90; likewise.
    pub f0_f90: u32,
    /// Luminance of the base colour; below 0 where the pixel saw no surface.
    pub albedo: f32,
}
}

crate::params! {
    /// Parameters of `restir-di-decoupled`.
    pub struct RestirDiDecoupledParams {
        /// Lights of its tile's subset that a pixel's candidate is resampled from, M. Higher: less noise, more time. Unbiased at any value.
        candidates: uint(32, 1..=1024, "lights"),
        /// Subsets of lights that are drawn each frame. Higher: tiles have less in common, more time and memory. Unbiased at any value.
        tile_subsets: uint(128, 1..=4096, "subsets"),
        /// Lights in each subset. Higher: pixels of a tile have less in common, worse use of caches. Unbiased at any value.
        tile_lights: uint(1024, 1..=32768, "lights"),
        /// Width of the tiles of pixels that share a subset. Larger: pixels have more in common, better use of caches. Unbiased at any value.
        tile_size: choice(3, ["1", "2", "4", "8", "16", "32"]),
        /// What is traced, and what becomes of it; the letters are those of Fig. 15. none (a): nothing. shading (b): all three samples, for shading alone; unbiased. candidate (c): the candidate, for shading and reuse. discard (d) and keep (e): all three, for shading and reuse; a history whose sample is shadowed is thrown away, confidence and all, or counted as dark (both biased). decoupled (f): the candidate for shading and reuse, the others for shading, by old rays where that will do; one to two rays, too dark at the edges of shadows. mis: each sample from each pixel, up to seven rays; unbiased.
        visibility: choice(5, ["none", "shading", "candidate", "discard", "keep", "decoupled", "mis"]),
        /// With visibility at decoupled: how near a spatiotemporal sample's pixel must be for what it knew of the sample's visibility to be taken for true. Higher: fewer rays, down to one a pixel; softer contact shadows (biased). 0: always traced.
        visibility_reuse_radius: float(0.0, 0.0..=256.0, "pixels"),
        /// With visibility at decoupled: for how many frames a ray's answer may be reused. Higher: fewer rays, shadows lag behind what moves (biased). 255: for ever. 0: always traced, as far as two rays a pixel go.
        visibility_lifetime: uint(4, 0..=255, "frames"),
        /// How the three samples are weighted. heuristics divides by all confidence of like pixels (1/M) and is biased; 1/z divides by that of pixels that could have made the sample, balance weights by the balance heuristic. Both are unbiased where visibility is shading or mis.
        reuse_weights: choice(2, ["heuristics", "1/z", "balance"]),
        /// Join the sample of the same point in the previous frame. On: far less noise, frames become correlated. Adds no bias of its own.
        temporal_reuse: flag(true),
        /// Join the sample of a pixel near that point in the previous frame. On: samples spread, also to where there is no history; neighbours become correlated. Adds no bias of its own.
        spatiotemporal_reuse: flag(true),
        /// How far that pixel lies at most. Higher: more different samples, less alike surfaces. Unbiased at any value with mis.
        spatiotemporal_radius: float(30.0, 1.0..=256.0, "pixels"),
        /// Pixels that are tried for one that is like enough. Higher: fewer pixels stay without, more time. Unbiased at any value with mis.
        spatiotemporal_tries: uint(2, 1..=8, "pixels"),
        /// Where the point was not seen in the previous frame, join a second pixel near it. On: less noise behind what has moved. Adds no bias of its own.
        fill_disocclusions: flag(true),
        /// Largest confidence weight of either history, in frames. Higher: less noise, slower to follow change. Unbiased at any value with mis.
        history_cap: float(20.0, 0.0..=1000.0, "frames"),
        /// Largest depth difference to a pixel of the previous frame, relative. Higher: reuse across steps in depth. Adds no bias with mis.
        depth_threshold: float(0.1, 0.0..=10.0, "of depth"),
        /// Smallest cosine between the normals. Lower: reuse round corners. Adds no bias with mis.
        normal_threshold: float(0.9, -1.0..=1.0, "cosine"),
        /// Find candidates and trace rays for every other pixel only, in turn; the others show the sample they had. On: half the time, shadows lag (biased).
        checkerboard: flag(false),
        /// Add indirect light from the path tracer's later bounces. Off: direct light only, faster, and darker than the truth.
        indirect: flag(true),
    }
}

pub(super) static INFO: TechniqueInfo = TechniqueInfo {
    id: "restir-di-decoupled",
    title: "ReSTIR DI, decoupled",
    summary: "Direct light by the production pipeline of 2021: light tiles, three kernels, three samples shaded with one or two rays.",
    papers: &["Wyman and Panteleev 2021", "Lin 2022 (dissertation), chapter 6 for conventions"],
    unbiased: false,
    bias: "Unbiased with visibility = mis or shading, while reuse_weights is balance or 1/z and checkerboard is off. The default, \
           decoupled, is too dark at the edges of shadows.",
    params: RestirDiDecoupledParams::SPECS,
    views: &[
        views::DIRECT,
        views::INDIRECT,
        View::radiance("candidate", "The share that this frame's candidate has in direct light."),
        View::radiance("temporal", "The share that the history has in direct light."),
        View::radiance("spatiotemporal", "The share that the history of a pixel nearby has in direct light."),
        views::CONFIDENCE_WEIGHT,
        views::LIGHT,
        View::colors("subset", "A colour for each subset of lights that a tile draws from."),
        views::CONTRIBUTION_WEIGHT,
        View::number(
            "age",
            "Frames since a ray last told whether the reservoir's sample is lit.",
            "frames",
            [0.0, 16.0],
        ),
        views::REJECTED_NEIGHBORS,
    ],
    layouts: &[
        TileLight::LAYOUT,
        DecoupledReservoir::LAYOUT,
        Selection::LAYOUT,
        DomainRecord::LAYOUT,
        RestirDiDecoupledParams::LAYOUT,
    ],
    check: |settings| {
        let mut params = RestirDiDecoupledParams::default();
        settings.iter().try_for_each(|(name, value)| {
            params.set(name, value)?;
            params.check()
        })
    },
    create: |gpu| Box::new(RestirDiDecoupled::new(gpu)),
};

/// `visibility = none`.
const VISIBILITY_NONE: u32 = 0;
/// `visibility = mis`.
const VISIBILITY_MIS: u32 = 6;
/// `reuse_weights = heuristics`.
const REUSE_WEIGHTS_HEURISTICS: u32 = 0;

impl RestirDiDecoupledParams {
    /// Refuses settings that contradict each other: the mode that traces every ray for the sake of unbiasedness, and what
    /// would spoil it.
    fn check(&self) -> Result<()> {
        if self.visibility != VISIBILITY_MIS {
            return Ok(());
        }
        let contradiction = [
            (self.reuse_weights == REUSE_WEIGHTS_HEURISTICS, "reuse_weights = heuristics, whose weights take no rays"),
            (self.checkerboard == 1, "checkerboard = true, which saves rays"),
        ];
        match contradiction.into_iter().find(|(holds, _)| *holds) {
            Some((_, what)) => Err(Error::bad_value("visibility", format!("mis contradicts {what}"))),
            None => Ok(()),
        }
    }
}

struct RestirDiDecoupled {
    params: RestirDiDecoupledParams,
    uniform: wgpu::Buffer,
    buffers: Option<Buffers>,
}

/// What depends on picture size and light tiles.
struct Buffers {
    size: UVec2,
    tile_light_count: u64,
    tile_lights: wgpu::Buffer,
    tile_inverse_pdfs: wgpu::Buffer,
    selections: wgpu::Buffer,
    /// This frame's and the previous one's, in turn.
    reservoirs: [wgpu::Buffer; 2],
    /// Likewise.
    domains: [wgpu::Buffer; 2],
    /// Which of each holds the previous frame's.
    history: usize,
    indirect: wgpu::TextureView,
}

impl RestirDiDecoupled {
    fn new(gpu: &Gpu) -> Self {
        RestirDiDecoupled {
            params: RestirDiDecoupledParams::default(),
            uniform: gpu.uniform("restir-di-decoupled.params", size_of::<RestirDiDecoupledParams>() as u64),
            buffers: None,
        }
    }
}

impl Technique for RestirDiDecoupled {
    fn info(&self) -> &'static TechniqueInfo {
        &INFO
    }

    fn set(&mut self, name: &str, value: &str) -> Result<bool> {
        let mut params = self.params;
        let known = params.set(name, value)?;
        params.check()?;
        self.params = params;
        Ok(known)
    }

    fn values(&self) -> serde_json::Value {
        self.params.values()
    }

    fn biases(&self) -> Vec<Bias> {
        let RestirDiDecoupledParams { temporal_reuse, spatiotemporal_reuse, visibility, .. } = self.params;
        let reuses = temporal_reuse == 1 || spatiotemporal_reuse == 1;
        let visibility_bias = match visibility {
            0 => Some("no shadows: far too bright"),
            2 if reuses => Some("too bright in contact shadows, for reused samples are shaded as lit"),
            3 if reuses => Some("weights depend on the samples: too dark at the edges of shadows, or too bright"),
            4 | 5 if reuses => Some("too dark at the edges of shadows"),
            _ => None,
        };
        biases_that_hold(&[
            (visibility_bias.is_some(), "visibility", visibility_bias.unwrap_or_default()),
            (
                reuses && self.params.reuse_weights == REUSE_WEIGHTS_HEURISTICS,
                "reuse_weights",
                "1/M: too dark where pixels that share samples differ",
            ),
            (self.params.checkerboard == 1, "checkerboard", "shadows lag by a frame in every other pixel"),
            (self.params.indirect == 0, "indirect", NO_INDIRECT),
        ])
    }

    fn obeys(&self, parameter: &str) -> bool {
        parameter != MAX_DEPTH || self.params.indirect == 1
    }

    fn highest(&self, view: &str) -> Option<f32> {
        match view {
            // Its own, and two histories.
            name if name == views::CONFIDENCE_WEIGHT.name => Some(1.0 + 2.0 * self.params.history_cap),
            name if name == views::REJECTED_NEIGHBORS.name => Some((1 + 2 * self.params.spatiotemporal_tries) as f32),
            "age" => Some((self.params.visibility_lifetime as f32).max(1.0)),
            _ => None,
        }
    }

    fn prepare(&mut self, gpu: &Gpu, size: UVec2) -> Result<()> {
        gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&self.params));
        let tile_light_count = u64::from(self.params.tile_subsets) * u64::from(self.params.tile_lights);
        if self.buffers.as_ref().is_some_and(|b| (b.size, b.tile_light_count) == (size, tile_light_count)) {
            return Ok(());
        }
        let pixels = u64::from(size.x) * u64::from(size.y);
        let of_pixels = |what: &str, bytes: usize| {
            gpu.storage(&format!("restir-di-decoupled {what} at {}x{}", size.x, size.y), pixels * bytes as u64)
        };
        let of_tiles = |what: &str, bytes: usize| {
            gpu.storage(
                &format!("restir-di-decoupled {what} (tile_subsets x tile_lights)"),
                tile_light_count * bytes as u64,
            )
        };
        self.buffers = Some(Buffers {
            size,
            tile_light_count,
            tile_lights: of_tiles("tile lights", size_of::<TileLight>())?,
            tile_inverse_pdfs: of_tiles("tile densities", size_of::<f32>())?,
            selections: of_pixels("selections", size_of::<Selection>())?,
            reservoirs: [
                of_pixels("reservoirs", size_of::<DecoupledReservoir>())?,
                of_pixels("reservoirs", size_of::<DecoupledReservoir>())?,
            ],
            domains: [
                of_pixels("domains", size_of::<DomainRecord>())?,
                of_pixels("domains", size_of::<DomainRecord>())?,
            ],
            history: 0,
            indirect: gpu.texture("restir-di-decoupled.indirect", size, wgpu::TextureFormat::Rgba32Float),
        });
        Ok(())
    }

    fn memory(&self) -> u64 {
        let of = |buffers: &Buffers| {
            let Buffers { tile_lights, tile_inverse_pdfs, selections, reservoirs, domains, indirect, .. } = buffers;
            let once = [tile_lights, tile_inverse_pdfs, selections];
            let all = once.into_iter().chain(reservoirs).chain(domains).map(Into::into);
            bytes_of(&all.chain([indirect.into()]).collect::<Vec<_>>())
        };
        bytes_of(&[(&self.uniform).into()]) + self.buffers.as_ref().map_or(0, of)
    }

    fn record(&mut self, recorder: &mut Recorder<'_>, size: UVec2) -> Result<()> {
        let Some(buffers) = &mut self.buffers else { return Ok(()) };
        let (previous, next) = (buffers.history, 1 - buffers.history);
        // Every other pixel of each row.
        let traced = UVec2::new(size.x.div_ceil(1 + self.params.checkerboard), size.y);

        let presample = &table::RESTIR_DI_DECOUPLED_PRESAMPLE;
        recorder
            .pass(presample)
            .bind("params", &self.uniform)
            .bind("tile_lights_out", &buffers.tile_lights)
            .bind("tile_inverse_pdfs_out", &buffers.tile_inverse_pdfs)
            .dispatch([self.params.tile_lights.div_ceil(presample.workgroup_size[0]), self.params.tile_subsets, 1])?;
        recorder
            .pass(&table::RESTIR_DI_DECOUPLED_SELECT)
            .inspected_by(&table::RESTIR_DI_DECOUPLED_INSPECT_SELECT)
            .bind("params", &self.uniform)
            .bind("tile_lights", &buffers.tile_lights)
            .bind("tile_inverse_pdfs", &buffers.tile_inverse_pdfs)
            .bind("selections", &buffers.selections)
            .bind("domains_previous", &buffers.domains[previous])
            .dispatch_over(traced)?;
        if self.params.visibility != VISIBILITY_NONE {
            recorder
                .pass(&table::RESTIR_DI_DECOUPLED_TRACE)
                .bind("params", &self.uniform)
                .bind("selections", &buffers.selections)
                .bind("reservoirs_previous", &buffers.reservoirs[previous])
                .dispatch_over(traced)?;
        }
        if self.params.indirect == 1 {
            recorder.pass(&table::COMMON_INDIRECT).bind("indirect_out", &buffers.indirect).dispatch_over(size)?;
        }
        recorder
            .pass(&table::RESTIR_DI_DECOUPLED_SHADE)
            .inspected_by(&table::RESTIR_DI_DECOUPLED_INSPECT_SHADE)
            .bind("params", &self.uniform)
            .bind("selections", &buffers.selections)
            .bind("reservoirs_previous", &buffers.reservoirs[previous])
            .bind("reservoirs_out", &buffers.reservoirs[next])
            .bind("domains_previous", &buffers.domains[previous])
            .bind("domains_out", &buffers.domains[next])
            .bind("indirect_radiance", &buffers.indirect)
            .dispatch_over(size)?;
        buffers.history = next;
        Ok(())
    }
}
