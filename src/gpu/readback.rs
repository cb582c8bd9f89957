//! Bytes back from the device: the same future on the web, where the browser wakes it, and natively, where polling does.

use super::Gpu;
use crate::error::{Error, Result};
use std::future::Future;
use std::pin::Pin;
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll, Waker};

type MapResult = std::result::Result<(), wgpu::BufferAsyncError>;

#[derive(Default)]
struct Slot {
    value: Option<MapResult>,
    waker: Option<Waker>,
}

/// Resolves once the map callback has run.
struct Mapped(Arc<Mutex<Slot>>);

impl Future for Mapped {
    type Output = Result<()>;
    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        let Ok(mut slot) = self.0.lock() else {
            return Poll::Ready(Err(Error::Device("a map callback panicked".into())));
        };
        match slot.value.take() {
            Some(result) => Poll::Ready(result.map_err(|e| Error::Device(e.to_string()))),
            None => {
                slot.waker = Some(context.waker().clone());
                Poll::Pending
            }
        }
    }
}

impl Gpu {
    /// The contents of `source` (whole, or its first `size` bytes).
    ///
    /// # Errors
    /// `DEVICE` if the device was lost or the copy failed.
    pub async fn read_buffer(&self, source: &wgpu::Buffer, size: u64) -> Result<Vec<u8>> {
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(source, 0, &staging, 0, size);
        self.queue.submit([encoder.finish()]);
        self.map(&staging).await
    }

    /// The texels of a texture, rows tightly packed.
    ///
    /// # Errors
    /// As [`Gpu::read_buffer`].
    pub async fn read_texture(&self, texture: &wgpu::Texture, bytes_per_texel: u32) -> Result<Vec<u8>> {
        let (width, height) = (texture.width(), texture.height());
        let row = width * bytes_per_texel;
        let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size: u64::from(padded) * u64::from(height),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &staging,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(padded),
                    rows_per_image: Some(height),
                },
            },
            texture.size(),
        );
        self.queue.submit([encoder.finish()]);
        let bytes = self.map(&staging).await?;
        Ok(bytes.chunks(padded as usize).flat_map(|r| &r[..row as usize]).copied().collect())
    }

    /// Waits until everything submitted so far is done.
    ///
    /// # Errors
    /// `DEVICE` if the device reported an error meanwhile.
    pub async fn wait(&self) -> Result<()> {
        // A map of a scratch buffer resolves in queue order, on the web too.
        let scratch = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("wait"),
            size: 4,
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.clear_buffer(&scratch, 0, None);
        self.queue.submit([encoder.finish()]);
        self.map(&scratch).await.map(|_| ())
    }

    async fn map(&self, staging: &wgpu::Buffer) -> Result<Vec<u8>> {
        let slot = Arc::new(Mutex::new(Slot::default()));
        let done = slot.clone();
        staging.map_async(wgpu::MapMode::Read, .., move |result| {
            if let Ok(mut slot) = done.lock() {
                slot.value = Some(result);
                if let Some(waker) = slot.waker.take() {
                    waker.wake();
                }
            }
        });
        self.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| Error::Device(e.to_string()))?;
        // A map fails where the device is lost, maybe before the device says so: nobody shall take it for a good one meanwhile.
        Mapped(slot).await.inspect_err(|error| self.note_failure(error))?;
        self.check()?;
        let bytes = staging.get_mapped_range(..).map_err(|e| Error::Device(format!("{e:?}")))?.to_vec();
        // On the web it would otherwise lie about until a garbage collection.
        staging.destroy();
        Ok(bytes)
    }
}
