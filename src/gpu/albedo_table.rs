//! The table of directional albedos on the device.

/// Entries along each axis: square root of the cosine along x, roughness along y (`build/albedo.rs`).
pub const SIZE: u32 = 32;
/// RGBA8 texels, row by row: red E of a GGX reflection with F = 1, green the share of F90 in it, blue E of the sheen up to
/// 1, alpha a quarter of what it has beyond 1.
pub const TEXELS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/albedo.bin"));

/// Uploads it.
pub(super) fn upload(device: &wgpu::Device, queue: &wgpu::Queue) -> wgpu::TextureView {
    let size = wgpu::Extent3d { width: SIZE, height: SIZE, depth_or_array_layers: 1 };
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("albedo table"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * SIZE), rows_per_image: Some(SIZE) };
    queue.write_texture(texture.as_image_copy(), TEXELS, layout, size);
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}
