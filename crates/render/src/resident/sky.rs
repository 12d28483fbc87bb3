//! The environment map on the device.

use tyndall_scene::EnvironmentMap;

use crate::{Gpu, RenderError};

/// A map as a texture; one black texel where there is none.
///
/// # Errors
/// A map that is larger than the device's textures, and a lack of memory.
pub(super) async fn texture(gpu: &Gpu, map: Option<&EnvironmentMap>) -> Result<wgpu::Texture, RenderError> {
    let (width, height) = map.map_or((1, 1), |map| (map.width, map.height));
    let limit = gpu.device.limits().max_texture_dimension_2d;
    if width.max(height) > limit {
        return Err(RenderError::Limit {
            what: "lights: the environment map".into(),
            found: format!("{width} x {height} texels"),
            limit: format!("{limit} texels a side"),
            advice: "Resample it.".into(),
        });
    }
    let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
    let texture = gpu
        .texture(&wgpu::TextureDescriptor {
            label: Some("sky"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        })
        .await?;
    if let Some(map) = map {
        let texels: Vec<[f32; 4]> = map.pixels.iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect();
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(width * 16), rows_per_image: None };
        gpu.queue.write_texture(texture.as_image_copy(), bytemuck::cast_slice(&texels), layout, size);
    }
    Ok(texture)
}
