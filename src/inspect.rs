//! The pixel inspector: what one pixel's passes saw in the last frame. Passes are run once more for that pixel alone, with the same
//! random numbers, and write notes (`shaders/techniques/common/observed.wgsl`); nothing of the picture changes.

use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::gpu::memory::bytes_of;
use crate::gpu::recorder::Recorder;
use crate::gpu_struct;
use crate::scene::gpu_types::{
    LIGHT_DIRECTIONAL, LIGHT_ENVIRONMENT, LIGHT_POINT, LIGHT_SPOT, LIGHT_SUN, LIGHT_TRIANGLE, NONE,
};
use glam::{UVec2, Vec3, Vec4};
use serde::Serialize;

/// Notes that are kept of a frame; four reservoirs of a thousand candidates each make more.
pub const CAPACITY: u32 = 2048;

gpu_struct! {
/// Which pixel is inspected.
pub struct Inspected {
    /// From the top left.
    pub pixel: UVec2,
    /// Notes that there is room for.
    pub capacity: u32,
    /// Unused.
    pub padding_0: u32,
}
}

gpu_struct! {
/// One note, as `shaders/scene/trace.wgsl` declares it.
pub struct Observation {
    /// From the pixel's surface to the sample, world space.
    pub direction: Vec3,
    /// To the sample, in metres.
    pub distance: f32,
    /// Candidate, domain, rejected neighbour, result.
    pub kind: u32,
    /// 0 initial, 1 temporal, 2 and on spatial.
    pub stage: u32,
    /// Which of the pixel's reservoirs.
    pub slot: u32,
    /// Of a result: why it is what it was.
    pub reason: u32,
    /// The sample's light, or `NONE`.
    pub light: u32,
    /// Where on the light, two 16-bit numbers.
    pub point: u32,
    /// Where a domain is, or `NONE`.
    pub pixel: UVec2,
    /// W.
    pub unbiased_contribution_weight: f32,
    /// c.
    pub confidence_weight: f32,
    /// p-hat of the inspected pixel.
    pub target_value: f32,
    /// m.
    pub mis_weight: f32,
    /// w.
    pub resampling_weight: f32,
    /// Of a result: 1 if its sample is lit here.
    pub is_visible: u32,
    /// Unused.
    pub padding_0: u32,
    /// Unused.
    pub padding_1: u32,
}
}

gpu_struct! {
/// What the pixel shows, as `shaders/scene/trace.wgsl` declares it.
pub struct TraceHead {
    /// Notes.
    pub count: u32,
    /// `NONE` where there is no surface.
    pub instance: u32,
    /// Of the mesh.
    pub triangle: u32,
    /// Notes that there was no room for.
    pub dropped: u32,
    /// World space.
    pub position: Vec3,
    /// Metres along the view axis.
    pub depth: f32,
    /// Shading normal, world space.
    pub normal: Vec3,
    /// 0 to 1.
    pub metallic: f32,
    /// Linear Rec. 709.
    pub base_color: Vec3,
    /// Roughness squared.
    pub alpha: f32,
    /// Towards the camera, linear Rec. 709 radiance.
    pub emission: Vec3,
    /// In the film's pixel.
    pub samples: f32,
    /// Of the last frame, linear Rec. 709.
    pub radiance: Vec4,
    /// Of the film, linear Rec. 709.
    pub mean: Vec4,
}
}

gpu_struct! {
/// The buffer that is written to.
pub struct Trace {
    /// What the pixel shows.
    pub head: TraceHead,
    /// The first of the notes; the others follow.
    pub observations: [Observation; 1],
}
}

/// By `Observation::kind`.
const KINDS: [&str; 4] = ["candidate", "domain", "rejected", "result"];

/// By `Observation::reason`, `REASON_*` of `shaders/techniques/common/observations.wgsl`.
const REASONS: [&str; 8] = [
    "",
    "there is no previous frame to reuse",
    "what the pixel shows was outside the previous picture",
    "there was no surface in the previous frame, or there is none now",
    "the previous frame showed another surface there",
    "its own confidence weight is at least spatial_confidence_limit",
    "the place that was drawn is the pixel itself, or outside the picture",
    "the neighbour that was drawn is too different",
];

/// One pixel of the last frame.
#[derive(Debug, Clone, Serialize)]
pub struct Inspection {
    /// From the top left.
    pub pixel: [u32; 2],
    /// What is seen; nothing where there is no surface.
    pub surface: Option<InspectedSurface>,
    /// Of the last frame, linear Rec. 709.
    pub radiance: [f32; 3],
    /// Of the film, linear Rec. 709.
    pub mean: [f32; 3],
    /// In the film's pixel: those that were not finite are left out.
    pub samples: f32,
    /// In the order in which passes made them.
    pub notes: Vec<Note>,
    /// Notes that there was no room for.
    pub dropped: u32,
}

/// The surface that an inspected pixel shows.
#[derive(Debug, Clone, Serialize)]
pub struct InspectedSurface {
    /// Index in the scene.
    pub instance: u32,
    /// Index in the mesh.
    pub triangle: u32,
    /// World space.
    pub position: [f32; 3],
    /// Shading normal, world space.
    pub normal: [f32; 3],
    /// Metres along the view axis.
    pub depth: f32,
    /// Linear Rec. 709.
    pub base_color: [f32; 3],
    /// 0 to 1.
    pub metallic: f32,
    /// glTF's: the root of alpha.
    pub roughness: f32,
    /// Towards the camera.
    pub emission: [f32; 3],
}

/// What a pass saw: a candidate, a domain whose reservoir it joined, a neighbour that it rejected, or the reservoir that came out.
#[derive(Debug, Clone, Serialize)]
pub struct Note {
    /// `candidate`, `domain`, `rejected` or `result`.
    pub kind: &'static str,
    /// `initial`, `temporal`, `spatial 1`, ...
    pub stage: String,
    /// Which of the pixel's reservoirs.
    pub slot: u32,
    /// The sample; none where the reservoir is empty.
    pub sample: Option<NotedSample>,
    /// Of a domain: the pixel that its reservoir is from, of the previous frame in `temporal` but for the first.
    pub pixel: Option<[u32; 2]>,
    /// W.
    pub unbiased_contribution_weight: f32,
    /// c.
    pub confidence_weight: f32,
    /// m.
    pub mis_weight: f32,
    /// w: the chance of being selected, up to their sum.
    pub resampling_weight: f32,
    /// Of a result: whether its sample is lit at the pixel.
    pub is_visible: bool,
    /// Of a result that is what it was: why.
    pub reason: &'static str,
}

/// A light sample, as the inspected pixel sees it.
#[derive(Debug, Clone, Serialize)]
pub struct NotedSample {
    /// Index among the lights.
    pub light: u32,
    /// Where on it: the same number, the same point.
    pub point: u32,
    /// `triangle`, `point`, `spot`, `directional`, `environment`, `sun`.
    pub light_kind: &'static str,
    /// From the surface, world space, of length 1.
    pub direction: [f32; 3],
    /// Metres; beyond every scene for what is infinitely far away.
    pub distance: f32,
    /// p-hat: luminance of f L G, without visibility.
    pub target_value: f32,
}

fn light_kind(kind: u32) -> &'static str {
    match kind {
        LIGHT_TRIANGLE => "triangle",
        LIGHT_POINT => "point",
        LIGHT_SPOT => "spot",
        LIGHT_DIRECTIONAL => "directional",
        LIGHT_ENVIRONMENT => "environment",
        LIGHT_SUN => "sun",
        _ => "unknown",
    }
}

fn stage_name(stage: u32) -> String {
    match stage {
        0 => "initial".into(),
        1 => "temporal".into(),
        _ => format!("spatial {}", stage - 1),
    }
}

impl Note {
    fn new(seen: &Observation, light_kinds: &[u32]) -> Self {
        let name = |names: &[&'static str], index: u32| names.get(index as usize).copied().unwrap_or_default();
        let sample = (seen.light != NONE).then(|| NotedSample {
            light: seen.light,
            point: seen.point,
            light_kind: light_kind(light_kinds.get(seen.light as usize).copied().unwrap_or(NONE)),
            direction: seen.direction.to_array(),
            distance: seen.distance,
            target_value: seen.target_value,
        });
        Note {
            kind: name(&KINDS, seen.kind),
            stage: stage_name(seen.stage),
            slot: seen.slot,
            sample,
            pixel: (seen.pixel.x != NONE).then(|| seen.pixel.to_array()),
            unbiased_contribution_weight: seen.unbiased_contribution_weight,
            confidence_weight: seen.confidence_weight,
            mis_weight: seen.mis_weight,
            resampling_weight: seen.resampling_weight,
            is_visible: seen.is_visible == 1,
            reason: name(&REASONS, seen.reason),
        }
    }
}

/// The buffers of an inspection.
#[derive(Debug)]
pub struct Inspector {
    pixel: UVec2,
    /// Whether a frame has been observed.
    observed: bool,
    uniform: wgpu::Buffer,
    trace: wgpu::Buffer,
}

impl Inspector {
    /// Bytes on the device.
    pub fn memory(&self) -> u64 {
        bytes_of(&[(&self.uniform).into(), (&self.trace).into()])
    }

    /// An inspector of `pixel`.
    ///
    /// # Errors
    /// `LIMIT` if the device has no room.
    pub fn new(gpu: &Gpu, pixel: UVec2) -> Result<Self> {
        let uniform = gpu.uniform("inspected", size_of::<Inspected>() as u64);
        let inspected = Inspected { pixel, capacity: CAPACITY, padding_0: 0 };
        gpu.queue.write_buffer(&uniform, 0, bytemuck::bytes_of(&inspected));
        let bytes = size_of::<Trace>() + (CAPACITY as usize - 1) * size_of::<Observation>();
        Ok(Inspector { pixel, observed: false, uniform, trace: gpu.storage("trace", bytes as u64)? })
    }

    /// Notes that the frame that was shared with it has been recorded.
    pub fn set_observed(&mut self) {
        self.observed = true;
    }

    /// Has passes of this frame observed.
    pub fn share<'a>(&'a self, recorder: &mut Recorder<'a>) {
        recorder.observes = true;
        recorder.share("inspected", &self.uniform);
        recorder.share("trace", &self.trace);
    }

    /// What was seen in the last frame; `light_kinds` are those of the scene's lights.
    ///
    /// # Errors
    /// `BAD_VALUE` where no frame has been observed yet, `DEVICE` if it cannot be read back.
    pub fn read(&self, gpu: &Gpu, light_kinds: Vec<u32>) -> impl Future<Output = Result<Inspection>> + use<> {
        let (gpu, trace, pixel, observed) = (gpu.clone(), self.trace.clone(), self.pixel, self.observed);
        async move {
            if !observed {
                return Err(Error::bad_value("pixel", "no frame has been rendered since it was chosen"));
            }
            let bytes = gpu.read_buffer(&trace, trace.size()).await?;
            let (head, notes) = bytes.split_at(size_of::<TraceHead>());
            let head: TraceHead = bytemuck::pod_read_unaligned(head);
            let notes = notes.chunks_exact(size_of::<Observation>()).take(head.count as usize);
            let surface = (head.instance != NONE).then(|| InspectedSurface {
                instance: head.instance,
                triangle: head.triangle,
                position: head.position.to_array(),
                normal: head.normal.to_array(),
                depth: head.depth,
                base_color: head.base_color.to_array(),
                metallic: head.metallic,
                roughness: head.alpha.sqrt(),
                emission: head.emission.to_array(),
            });
            Ok(Inspection {
                pixel: pixel.to_array(),
                surface,
                radiance: head.radiance.truncate().to_array(),
                mean: head.mean.truncate().to_array(),
                samples: head.samples,
                notes: notes.map(|note| Note::new(&bytemuck::pod_read_unaligned(note), &light_kinds)).collect(),
                dropped: head.dropped,
            })
        }
    }
}
