//! What rays walk: nodes and triangles, in storage buffers or in data textures.
//!
//! A GPU loads 16 bytes of a buffer at once. SwiftShader, the software adapter of Chromium, gathers them word by word and lane by
//! lane, each behind a test, after a division that finds the buffer's length; a texel it loads whole. lavapipe is a little
//! faster with textures, too (docs/performance.md).

use crate::error::Result;
use crate::gpu::Gpu;
use crate::gpu::data_texture::DataTexture;
use crate::gpu::memory::bytes_of;
use crate::gpu::recorder::Recorder;
use crate::pace::Pace;
use crate::scene::gpu_types::{Triangle, WideNode};
use bytemuck::Zeroable;

/// Triangles in the first of the two buffers: 128 MiB, what every WebGPU device can bind. As in `shaders/scene/data.wgsl`.
pub(super) const FIRST_TRIANGLES: usize = (128 << 20) / size_of::<Triangle>();

const NODE_TEXELS: u64 = size_of::<WideNode>() as u64 / 16;
const TRIANGLE_TEXELS: u64 = size_of::<Triangle>() as u64 / 16;

/// Nodes and triangles on the device. Of the place that is not used one record is there, for passes bind both.
#[derive(Debug)]
pub(super) struct Walked {
    nodes: wgpu::Buffer,
    /// The first [`FIRST_TRIANGLES`], and all others.
    triangles: [wgpu::Buffer; 2],
    node_texels: DataTexture,
    triangle_texels: DataTexture,
    in_textures: bool,
}

impl Walked {
    pub async fn upload(gpu: &Gpu, nodes: &[WideNode], triangles: &[Triangle], pace: &mut Pace) -> Result<Self> {
        let in_textures = gpu.runs_software_kernels();
        let (node, triangle) = ([WideNode::zeroed()], [Triangle::zeroed()]);
        let (buffered, textured) = match in_textures {
            true => ((&node[..], &triangle[..]), (nodes, triangles)),
            false => ((nodes, triangles), (&node[..], &triangle[..])),
        };
        let (first, rest) = buffered.1.split_at(buffered.1.len().min(FIRST_TRIANGLES));
        let rest = if rest.is_empty() { &triangle } else { rest };
        Ok(Walked {
            nodes: gpu.storage_in_slices("the nodes of the BVH", buffered.0, pace).await?,
            triangles: [
                gpu.storage_in_slices("triangles", first, pace).await?,
                gpu.storage_in_slices(&format!("the triangles after the first {FIRST_TRIANGLES}"), rest, pace).await?,
            ],
            node_texels: DataTexture::in_slices(gpu, "the nodes of the BVH", textured.0, pace).await?,
            triangle_texels: DataTexture::in_slices(gpu, "triangles", textured.1, pace).await?,
            in_textures,
        })
    }

    pub fn has_rows(&self) -> bool {
        self.node_texels.has_rows() || self.triangle_texels.has_rows()
    }

    /// Bytes on the device.
    pub fn memory(&self) -> u64 {
        let [first, rest] = &self.triangles;
        let texels = [&self.node_texels.view, &self.triangle_texels.view];
        bytes_of(&[&self.nodes, first, rest].map(Into::into)) + bytes_of(&texels.map(Into::into))
    }

    pub fn destroy(&self) {
        for buffer in self.triangles.iter().chain([&self.nodes]) {
            buffer.destroy();
        }
        for texels in [&self.node_texels, &self.triangle_texels] {
            texels.destroy();
        }
    }

    pub fn share<'a>(&'a self, recorder: &mut Recorder<'a>) {
        recorder.features.is_software = self.in_textures;
        recorder.share("nodes", &self.nodes);
        recorder.share("triangles", &self.triangles[0]);
        recorder.share("triangles_rest", &self.triangles[1]);
        recorder.share("node_texels", &self.node_texels.view);
        recorder.share("triangle_texels", &self.triangle_texels.view);
    }

    /// Overwrites nodes from index `first` on.
    pub fn write_nodes(&self, gpu: &Gpu, first: u32, nodes: &[WideNode]) {
        if self.in_textures {
            self.node_texels.write(gpu, u64::from(first) * NODE_TEXELS, nodes);
        } else {
            let offset = u64::from(first) * size_of::<WideNode>() as u64;
            gpu.queue.write_buffer(&self.nodes, offset, bytemuck::cast_slice(nodes));
        }
    }

    /// Overwrites triangles from index `first` on, in whichever place they lie.
    pub fn write_triangles(&self, gpu: &Gpu, first: u32, triangles: &[Triangle]) {
        if self.in_textures {
            self.triangle_texels.write(gpu, u64::from(first) * TRIANGLE_TEXELS, triangles);
            return;
        }
        let first = first as usize;
        let (low, high) = triangles.split_at(FIRST_TRIANGLES.saturating_sub(first).min(triangles.len()));
        let write = |buffer: &wgpu::Buffer, index: usize, part: &[Triangle]| {
            if !part.is_empty() {
                gpu.queue.write_buffer(buffer, (index * size_of::<Triangle>()) as u64, bytemuck::cast_slice(part));
            }
        };
        write(&self.triangles[0], first, low);
        write(&self.triangles[1], (first + low.len()).saturating_sub(FIRST_TRIANGLES), high);
    }
}
