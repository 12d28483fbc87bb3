//! The bricks of all grids as shaders see them.

use std::sync::Arc;

use tyndall_scene::volume::Grid;

use super::atlas::{Atlas, UNIFORM};
use crate::{Gpu, RenderError};

/// Texels in a row of the texture of bricks.
const BRICK_ROW: u32 = 2048;

/// The bricks of all grids: place in the atlas, majorant, lowest and highest value, as bits.
pub(super) struct Bricks<'a> {
    atlas: &'a Atlas,
    texels: Vec<[u32; 4]>,
}

impl<'a> Bricks<'a> {
    /// None yet, of grids in this atlas.
    pub fn new(atlas: &'a Atlas) -> Self {
        Self { atlas, texels: Vec::new() }
    }

    /// Appends a grid's bricks, and gives the number of the first. `majorant` is how much a metre with values between two
    /// can change a ray.
    pub fn append(&mut self, grid: &Arc<Grid>, majorant: impl Fn(f32, f32) -> f32) -> u32 {
        let first = self.texels.len() as u32;
        self.texels.extend(grid.bricks().iter().map(|brick| {
            let place = if brick.is_uniform() { UNIFORM } else { self.atlas.place(grid, brick.slot) };
            let majorant = majorant(brick.low, brick.high);
            [place, majorant.to_bits(), brick.low.to_bits(), brick.high.to_bits()]
        }));
        first
    }

    /// Whether something is seen of bricks whose values are all alike.
    pub fn flat(&self) -> bool {
        self.texels.iter().any(|&[place, majorant, ..]| place == UNIFORM && f32::from_bits(majorant) > 0.0)
    }

    /// The bricks as a texture, in rows of [`BRICK_ROW`].
    ///
    /// # Errors
    /// More bricks than a texture holds, and a lack of memory.
    pub async fn texture(self, gpu: &Gpu) -> Result<wgpu::Texture, RenderError> {
        let mut bricks = self.texels;
        bricks.resize(bricks.len().max(1).next_multiple_of(BRICK_ROW as usize), [UNIFORM, 0, 0, 0]);
        let height = (bricks.len() / BRICK_ROW as usize) as u32;
        let limit = gpu.device.limits().max_texture_dimension_2d;
        if height > limit {
            return Err(RenderError::Limit {
                what: "media: their grids".into(),
                found: format!("{} bricks of 8 x 8 x 8 voxels", bricks.len()),
                limit: format!("{} bricks", u64::from(limit) * u64::from(BRICK_ROW)),
                advice: "Resample the largest grid.".into(),
            });
        }
        let texels = bytemuck::cast_slice(&bricks);
        gpu.table("bricks", [BRICK_ROW, height], wgpu::TextureFormat::Rgba32Uint, texels).await
    }
}
