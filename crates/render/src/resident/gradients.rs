//! The gradients of grids' values, voxel by voxel, for shading: one read instead of six.
//!
//! A texture of half floats in the atlas' shape, four times the memory of 16-bit voxels, made on the device where a transfer
//! function shades or isosurfaces are shown. Where it would be larger than [`MOST_BYTES`], or there is no room, the six neighbours are read.

use super::Resident;
use crate::graph::{Graph, Shader, shader};
use crate::{Gpu, RenderError};

static GRADIENTS: Shader = shader!("resident/gradients");

/// The texture's size at most.
const MOST_BYTES: u64 = 1 << 30;

/// Bricks in a row of workgroups: `BRICK_ROW` in `volume.wesl`.
const BRICK_ROW: u32 = 2048;

/// What stands for gradients where there are none.
pub(super) async fn none(gpu: &Gpu) -> Result<wgpu::Texture, RenderError> {
    texture(gpu, wgpu::Extent3d::default()).await
}

/// The gradients of a world's grids, where they are looked at and there is room for them.
pub(super) async fn make(gpu: &Gpu, resident: &Resident) -> Result<Option<wgpu::Texture>, RenderError> {
    let (size, traits) = (resident.atlas.size(), &resident.traits);
    let bytes = 8 * u64::from(size.width) * u64::from(size.height) * u64::from(size.depth_or_array_layers);
    if !traits.grids || !(traits.shaded || traits.surfaces) || bytes > MOST_BYTES {
        return Ok(None);
    }
    let slopes = match texture(gpu, size).await {
        Err(RenderError::OutOfMemory { .. }) => {
            tracing::warn!("no memory for gradients: shading reads six neighbours instead, which takes longer");
            return Ok(None);
        }
        made => made?,
    };
    let mut graph = Graph::new(gpu);
    let workgroups = [BRICK_ROW, resident.bricks.height(), 1];
    graph.compute("gradients", &GRADIENTS).world(resident).write("slopes", &slopes).dispatch(workgroups, 1).await?;
    graph.run_once()?;
    Ok(Some(slopes))
}

async fn texture(gpu: &Gpu, size: wgpu::Extent3d) -> Result<wgpu::Texture, RenderError> {
    gpu.texture(&wgpu::TextureDescriptor {
        label: Some("gradients"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D3,
        format: wgpu::TextureFormat::Rgba16Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::STORAGE_BINDING,
        view_formats: &[],
    })
    .await
}
