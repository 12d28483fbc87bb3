//! Pictures without a window: a world in, an image out.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use tyndall_scene::World;
use tyndall_scene::image::Image;

use crate::frame::Frame;
use crate::{Gpu, RenderError};

/// A finished picture and what it took.
#[derive(Clone, Debug)]
pub struct Rendering {
    /// Linear radiance.
    pub image: Image,
    /// GPU time [s] a pass, summed over tiles; empty on a device without timestamps.
    pub passes: BTreeMap<String, f64>,
}

/// Renders a world. `progress` is told the finished fraction after each tile and may break off.
///
/// # Errors
/// What does not fit the device, a lost device, and [`RenderError::Interrupted`] where `progress` broke off.
pub async fn render(
    gpu: &Gpu,
    world: &World,
    progress: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> Result<Rendering, RenderError> {
    let mut frame = Frame::new(gpu, world).await?;
    let [width, height] = world.scene.film.size;
    let mut passes = BTreeMap::new();
    let total = frame.tiles().count();
    for (done, tile) in frame.tiles().enumerate() {
        frame.render_tile(tile);
        gpu.wait()?;
        for (label, seconds) in frame.timings() {
            *passes.entry(label).or_insert(0.0) += seconds;
        }
        if progress((done + 1) as f64 / total as f64).is_break() {
            return Err(RenderError::Interrupted);
        }
    }
    let pixels = read_film(gpu, frame.film()).await?;
    Ok(Rendering { image: Image { width, height, pixels, ..Default::default() }, passes })
}

/// Reads a `Rgba32Float` film back, without its opacity.
pub(crate) async fn read_film(gpu: &Gpu, film: &wgpu::Texture) -> Result<Vec<[f32; 3]>, RenderError> {
    let texels: Vec<[f32; 4]> = read_texels(gpu, film).await?;
    Ok(texels.iter().map(|[r, g, b, _]| [*r, *g, *b]).collect())
}

/// Reads a texture's texels back, in bands so that little memory is needed beside them.
pub(crate) async fn read_texels<T: bytemuck::Pod>(gpu: &Gpu, film: &wgpu::Texture) -> Result<Vec<T>, RenderError> {
    let (width, height) = (film.width(), film.height());
    let size = size_of::<T>() as u32;
    let row = (width * size).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let band = ((16 << 20) / row).clamp(1, height);
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("film band"),
        size: u64::from(row) * u64::from(band),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut pixels = Vec::with_capacity(width as usize * height as usize);
    for y in (0..height).step_by(band as usize) {
        let rows = band.min(height - y);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            wgpu::TexelCopyTextureInfo {
                texture: film,
                mip_level: 0,
                origin: wgpu::Origin3d { x: 0, y, z: 0 },
                aspect: wgpu::TextureAspect::All,
            },
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: Some(rows) },
            },
            wgpu::Extent3d { width, height: rows, depth_or_array_layers: 1 },
        );
        gpu.queue.submit([encoder.finish()]);
        let bytes = map(gpu, &buffer).await?;
        for line in bytes.chunks_exact(row as usize).take(rows as usize) {
            let texels = line[..(width * size) as usize].chunks_exact(size as usize);
            pixels.extend(texels.map(bytemuck::pod_read_unaligned::<T>));
        }
        drop(bytes);
        buffer.unmap();
    }
    Ok(pixels)
}

/// Maps a whole buffer for reading once the device has filled it.
pub(crate) async fn map(gpu: &Gpu, buffer: &wgpu::Buffer) -> Result<wgpu::BufferView, RenderError> {
    let lost = |reason: String| RenderError::DeviceLost { reason };
    let (sender, receiver) = futures_channel::oneshot::channel();
    buffer.map_async(wgpu::MapMode::Read, .., move |result| {
        // A receiver that is gone no longer waits for the result.
        let _ = sender.send(result);
    });
    gpu.wait()?;
    receiver.await.map_err(|error| lost(error.to_string()))?.map_err(|error| lost(error.to_string()))?;
    buffer.get_mapped_range(..).map_err(|error| lost(error.to_string()))
}
