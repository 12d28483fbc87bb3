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
    let texels: Vec<[f32; 4]> = match map {
        Some(map) => map.pixels.iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect(),
        None => vec![[0.0; 4]],
    };
    gpu.table("sky", [width, height], wgpu::TextureFormat::Rgba32Float, bytemuck::cast_slice(&texels)).await
}
