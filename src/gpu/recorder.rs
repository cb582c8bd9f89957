//! Recording a frame: a straight line of passes, each a compute pass of its own with a label and timestamps. What is recorded
//! is run afterwards, for then it is known which pipelines have to be made, and between two of them the page can draw.

use super::dissection::{Dissection, Easel};
use super::shader::{Resource, SceneFeatures, Shader};
use super::{Gpu, pipeline_key};
use crate::error::Result;
use glam::UVec2;
use std::collections::VecDeque;

/// Most passes that can be timed in one frame; later ones run untimed.
pub const MAXIMUM_TIMED_PASSES: u32 = 64;

/// GPU time of one pass.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct PassTime {
    /// The pass's shader id.
    pub name: &'static str,
    /// Milliseconds.
    pub ms: f64,
}

/// The timestamp queries of one frame.
#[derive(Debug, Clone)]
pub struct Timer {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    names: Vec<&'static str>,
}

impl Timer {
    /// A timer, or nothing where the device cannot time passes.
    pub fn new(gpu: &Gpu) -> Option<Self> {
        gpu.has_timestamps.then(|| Timer {
            queries: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("pass times"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * MAXIMUM_TIMED_PASSES,
            }),
            resolved: gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("pass times"),
                size: u64::from(2 * MAXIMUM_TIMED_PASSES) * 8,
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            names: Vec::new(),
        })
    }

    /// Forgets what was timed.
    pub fn clear(&mut self) {
        self.names.clear();
    }

    /// Bytes of the queries' results on the device.
    pub fn memory(&self) -> u64 {
        self.resolved.size()
    }

    /// Times of the last recorded frame.
    ///
    /// # Errors
    /// `DEVICE` if they cannot be read back.
    pub async fn read(&self, gpu: &Gpu) -> Result<Vec<PassTime>> {
        if self.names.is_empty() {
            return Ok(Vec::new());
        }
        let bytes = gpu.read_buffer(&self.resolved, self.names.len() as u64 * 16).await?;
        let period = f64::from(gpu.queue.get_timestamp_period());
        let tick = |i: usize| bytes.get(i * 8..i * 8 + 8).and_then(|b| b.try_into().ok()).map_or(0, u64::from_le_bytes);
        Ok(self
            .names
            .iter()
            .enumerate()
            .map(|(i, name)| PassTime { name, ms: tick(2 * i + 1).saturating_sub(tick(2 * i)) as f64 * period * 1e-6 })
            .collect())
    }
}

/// One step of a recorded frame.
#[derive(Debug)]
enum Command {
    /// A compute pass; its times become those of this index.
    Pass {
        shader: &'static Shader,
        features: SceneFeatures,
        groups: Vec<wgpu::BindGroup>,
        workgroups: [u32; 3],
        timed: Option<u32>,
    },
    /// Zeroes so many bytes from an offset on, all without a number.
    Clear { buffer: wgpu::Buffer, offset: u64, size: Option<u64> },
    /// Copies the first bytes of a buffer.
    Copy { from: wgpu::Buffer, to: wgpu::Buffer, size: u64 },
}

/// A frame that is recorded and not yet run to its end. It borrows nothing.
#[derive(Debug)]
pub struct Recording {
    commands: VecDeque<Command>,
    encoder: wgpu::CommandEncoder,
    timer: Option<Timer>,
}

impl Recording {
    /// Pipelines that are not made yet.
    pub fn unmade(&self, gpu: &Gpu) -> usize {
        let mut unmade = Vec::new();
        for command in &self.commands {
            if let &Command::Pass { shader, features, .. } = command
                && !gpu.has_pipeline(shader, features)
                && !unmade.contains(&pipeline_key(shader, features))
            {
                unmade.push(pipeline_key(shader, features));
            }
        }
        unmade.len()
    }

    /// Runs what comes before the next pipeline that is not made, and makes that; false where there is none and all is encoded.
    /// Compiling may take a second: the device runs the passes before meanwhile.
    pub fn make_pipeline(&mut self, gpu: &Gpu) -> bool {
        while let Some(command) = self.commands.pop_front() {
            if let &Command::Pass { shader, features, .. } = &command
                && !gpu.has_pipeline(shader, features)
            {
                self.flush(gpu);
                gpu.pipeline(shader, features);
                self.commands.push_front(command);
                return true;
            }
            self.encode(gpu, command);
        }
        false
    }

    fn encode(&mut self, gpu: &Gpu, command: Command) {
        match command {
            Command::Pass { shader, features, groups, workgroups: [x, y, z], timed } => {
                let pipeline = gpu.pipeline(shader, features);
                let timestamp_writes =
                    timed.zip(self.timer.as_ref()).map(|(index, timer)| wgpu::ComputePassTimestampWrites {
                        query_set: &timer.queries,
                        beginning_of_pass_write_index: Some(2 * index),
                        end_of_pass_write_index: Some(2 * index + 1),
                    });
                let descriptor = wgpu::ComputePassDescriptor { label: Some(shader.id), timestamp_writes };
                let mut pass = self.encoder.begin_compute_pass(&descriptor);
                pass.set_pipeline(&pipeline);
                for (index, group) in groups.iter().enumerate() {
                    pass.set_bind_group(index as u32, group, &[]);
                }
                pass.dispatch_workgroups(x, y, z);
            }
            Command::Clear { buffer, offset, size } => self.encoder.clear_buffer(&buffer, offset, size),
            Command::Copy { from, to, size } => self.encoder.copy_buffer_to_buffer(&from, 0, &to, 0, size),
        }
    }

    /// Submits what is encoded so far; the device runs it while this thread goes on.
    fn flush(&mut self, gpu: &Gpu) {
        let encoded = std::mem::replace(&mut self.encoder, frame_encoder(gpu));
        gpu.queue.submit([encoded.finish()]);
    }

    /// Runs all that is left.
    pub fn submit(mut self, gpu: &Gpu) {
        while self.make_pipeline(gpu) {}
        if let Some(timer) = &self.timer
            && !timer.names.is_empty()
        {
            self.encoder.resolve_query_set(&timer.queries, 0..2 * timer.names.len() as u32, &timer.resolved, 0);
        }
        gpu.queue.submit([self.encoder.finish()]);
    }
}

/// Records passes. Resources shared by many passes are bound once, by name.
pub struct Recorder<'a> {
    gpu: &'a Gpu,
    commands: VecDeque<Command>,
    timer: Option<&'a mut Timer>,
    shared: Vec<(&'a str, Resource<'a>)>,
    /// What the scene of this frame has.
    pub features: SceneFeatures,
    /// Whether a pixel is inspected.
    pub observes: bool,
    /// What keeps the pictures of passes, and what passes that only illustrate write to.
    dissection: Option<(&'a mut Dissection, &'a Easel)>,
    /// While the dissection's own passes are recorded: they are neither timed nor kept.
    aside: bool,
}

impl<'a> Recorder<'a> {
    /// Starts a frame.
    pub fn new(gpu: &'a Gpu, mut timer: Option<&'a mut Timer>) -> Self {
        if let Some(timer) = timer.as_mut() {
            timer.clear();
        }
        let shared = vec![("albedo_table", Resource::Texture(&gpu.albedo_table))];
        Recorder {
            gpu,
            commands: VecDeque::new(),
            timer,
            shared,
            features: SceneFeatures::ALL,
            observes: false,
            dissection: None,
            aside: false,
        }
    }

    /// Binds a resource for every later pass that asks for it by name.
    pub fn share(&mut self, name: &'a str, resource: impl Into<Resource<'a>>) {
        self.shared.push((name, resource.into()));
    }

    /// Zeroes `size` bytes of a buffer from `offset` on; without a size all that follow.
    pub fn clear(&mut self, buffer: &wgpu::Buffer, offset: u64, size: Option<u64>) {
        self.commands.push_back(Command::Clear { buffer: buffer.clone(), offset, size });
    }

    /// Copies the first `size` bytes of a buffer to the beginning of another.
    pub fn copy(&mut self, from: &wgpu::Buffer, to: &wgpu::Buffer, size: u64) {
        self.commands.push_back(Command::Copy { from: from.clone(), to: to.clone(), size });
    }

    /// Keeps in `dissection` what the passes from now on write.
    pub(crate) fn dissect(&mut self, dissection: &'a mut Dissection, easel: &'a Easel) {
        self.dissection = Some((dissection, easel));
    }

    pub(super) fn gpu(&self) -> &'a Gpu {
        self.gpu
    }

    /// Starts describing a pass.
    pub fn pass<'r>(&'r mut self, shader: &'static Shader) -> Pass<'r, 'a> {
        let bound = self.shared.clone();
        Pass { recorder: self, shader, bound, illustrates: false, inspection: None }
    }

    /// While a frame is dissected: a pass whose `radiance_out` shows what the last pass has written, where that is no picture itself.
    fn illustration<'r>(&'r mut self, shader: &'static Shader) -> Option<Pass<'r, 'a>> {
        let (_, easel) = self.dissection.as_ref()?;
        let easel: &'a Easel = easel;
        let mut bound: Vec<(&'r str, Resource<'r>)> = self.shared.clone();
        bound.push(("radiance_out", (&easel.radiance).into()));
        bound.push(("counters", (&easel.counters).into()));
        Some(Pass { recorder: self, shader, bound, illustrates: true, inspection: None })
    }

    /// While a frame is dissected: has `shader` show, over `size` pixels, what the last pass has written, with this bound to it.
    ///
    /// # Errors
    /// `SHADER` if something the shader needs was not bound.
    pub fn illustrate(&mut self, shader: &'static Shader, bound: &[(&str, Resource<'_>)], size: UVec2) -> Result<()> {
        let Some(pass) = self.illustration(shader) else { return Ok(()) };
        bound.iter().fold(pass, |pass, &(name, resource)| pass.bind(name, resource)).dispatch_over(size)
    }

    fn run(&mut self, shader: &'static Shader, bound: &[(&str, Resource<'_>)], workgroups: [u32; 3]) -> Result<()> {
        let groups = shader.bind_groups(self.gpu, &self.gpu.layouts(shader), bound)?;
        let timer = self.timer.as_mut().filter(|_| !self.aside);
        let timed = timer.and_then(|timer| {
            let index = timer.names.len() as u32;
            (index < MAXIMUM_TIMED_PASSES).then(|| {
                timer.names.push(shader.id);
                index
            })
        });
        self.commands.push_back(Command::Pass { shader, features: self.features, groups, workgroups, timed });
        Ok(())
    }

    /// Ends the frame: what was recorded, to be run.
    pub fn finish(self) -> Recording {
        let Recorder { gpu, commands, timer, .. } = self;
        Recording { commands, encoder: frame_encoder(gpu), timer: timer.map(|timer| timer.clone()) }
    }

    /// Ends the frame and runs it.
    pub fn submit(self) {
        let gpu = self.gpu;
        self.finish().submit(gpu);
    }
}

fn frame_encoder(gpu: &Gpu) -> wgpu::CommandEncoder {
    gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("frame") })
}

/// One pass being described.
pub struct Pass<'r, 'a> {
    recorder: &'r mut Recorder<'a>,
    shader: &'static Shader,
    bound: Vec<(&'r str, Resource<'r>)>,
    illustrates: bool,
    inspection: Option<&'static Shader>,
}

impl<'r> Pass<'r, '_> {
    /// Binds a resource by the name the shader gives it.
    #[must_use]
    pub fn bind(mut self, name: &'r str, resource: impl Into<Resource<'r>>) -> Self {
        self.bound.push((name, resource.into()));
        self
    }

    /// Where a pixel is inspected, runs `inspection` after the pass, once, with what is bound to it.
    #[must_use]
    pub fn inspected_by(mut self, inspection: &'static Shader) -> Self {
        self.inspection = Some(inspection);
        self
    }

    /// Runs one invocation a pixel.
    ///
    /// # Errors
    /// `SHADER` if something the shader needs was not bound.
    pub fn dispatch_over(self, size: UVec2) -> Result<()> {
        let [x, y, _] = self.shader.workgroup_size;
        self.dispatch([size.x.div_ceil(x), size.y.div_ceil(y), 1])
    }

    /// Runs that many workgroups.
    ///
    /// # Errors
    /// `SHADER` if something the shader needs was not bound.
    pub fn dispatch(self, workgroups: [u32; 3]) -> Result<()> {
        let Pass { recorder, shader, bound, illustrates, inspection } = self;
        let was_aside = recorder.aside;
        recorder.aside |= illustrates;
        recorder.run(shader, &bound, workgroups)?;
        recorder.aside = true;
        if let Some(inspection) = inspection.filter(|_| recorder.observes) {
            recorder.run(inspection, &bound, [1; 3])?;
        }
        if !was_aside && let Some((dissection, easel)) = recorder.dissection.take() {
            if illustrates {
                dissection.illustrate(recorder, &easel.radiance)?;
            } else {
                dissection.keep(recorder, shader, &bound)?;
            }
            recorder.dissection = Some((dissection, easel));
        }
        recorder.aside = was_aside;
        Ok(())
    }
}
