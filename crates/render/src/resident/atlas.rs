//! The bricks of all grids in one 3D texture.

use std::sync::{Arc, Weak};

use bytemuck::Pod;
use half::f16;
use tyndall_scene::volume::{BRICK_EDGE, BRICK_VOXELS, Grid, Voxels};
use tyndall_scene::{Field, FieldError, Volume};

use crate::{Gpu, RenderError};

/// The place of a brick that has no voxels, as all its values are alike.
pub const UNIFORM: u32 = u32::MAX;

/// Bricks along an axis of the atlas at most: a place has 8 bits an axis.
const MOST_BRICKS: u32 = 255;

/// Where the bricks of every grid lie.
#[derive(Clone, Debug)]
pub struct Atlas {
    /// `R16Float` or `R32Float`.
    pub texture: wgpu::Texture,
    /// Every grid once, with the number of its first brick. They tell grids apart, and keep no voxels.
    grids: Vec<(Weak<Grid>, u32)>,
    /// Bricks along x, y, z.
    sides: [u32; 3],
}

impl Atlas {
    /// Uploads the bricks of all volumes' grids.
    ///
    /// # Errors
    /// More bricks than a texture holds, and memory that runs out.
    pub async fn new(gpu: &Gpu, volumes: &[Volume]) -> Result<Self, RenderError> {
        let mut grids: Vec<(Arc<Grid>, u32)> = Vec::new();
        let mut total = 0u64;
        for grid in volumes.iter().flat_map(grids_of) {
            if !grids.iter().any(|(other, _)| Arc::ptr_eq(other, grid)) {
                grids.push((grid.clone(), total as u32));
                total += stored_bricks(grid);
            }
        }
        let most = (gpu.device.limits().max_texture_dimension_3d / BRICK_EDGE).min(MOST_BRICKS);
        let limit = u64::from(most).pow(3);
        if total > limit {
            return Err(RenderError::Limit {
                what: "media: the voxels of their grids".into(),
                found: format!("{total} bricks of 8 x 8 x 8 voxels with more than one value"),
                limit: format!("{limit} bricks"),
                advice: "Resample the largest grid.".into(),
            });
        }
        let sides = sides(total, most);
        let wide = grids.iter().any(|(grid, _)| matches!(grid.voxels(), Voxels::F32(_)));
        let filterable = gpu.device.features().contains(wgpu::Features::FLOAT32_FILTERABLE);
        if wide && !filterable {
            tracing::warn!("this device does not interpolate 32-bit floats: voxels are rounded to 16 bits");
        }
        let wide = wide && filterable;
        let [width, height, depth] = sides.map(|n| n * BRICK_EDGE);
        let texture = gpu
            .texture(&wgpu::TextureDescriptor {
                label: Some("atlas"),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: depth },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D3,
                format: if wide { wgpu::TextureFormat::R32Float } else { wgpu::TextureFormat::R16Float },
                usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            })
            .await?;
        let known = grids.iter().map(|(grid, first)| (Arc::downgrade(grid), *first)).collect();
        let atlas = Self { texture, grids: known, sides };
        if wide {
            atlas.upload(gpu, &grids, |voxels, range| match voxels {
                Voxels::F16(values) => values[range].iter().map(|value| value.to_f32()).collect(),
                Voxels::F32(values) => values[range].to_vec(),
            })?;
        } else {
            atlas.upload(gpu, &grids, |voxels, range| match voxels {
                Voxels::F16(values) => values[range].to_vec(),
                Voxels::F32(values) => values[range].iter().map(|&value| f16::from_f32(value)).collect(),
            })?;
        }
        Ok(atlas)
    }

    /// Writes all bricks, a layer of the atlas at a time, so that staging memory stays small beside it.
    fn upload<T: Pod>(
        &self,
        gpu: &Gpu,
        grids: &[(Arc<Grid>, u32)],
        read: impl Fn(&Voxels, std::ops::Range<usize>) -> Vec<T>,
    ) -> Result<(), RenderError> {
        let [nx, ny, nz] = self.sides;
        let edge = BRICK_EDGE as usize;
        let (row, slice) = ((nx * BRICK_EDGE) as usize, (nx * BRICK_EDGE * ny * BRICK_EDGE) as usize);
        let mut bricks = grids.iter().flat_map(|(grid, _)| (0..stored_bricks(grid) as usize).map(move |i| (grid, i)));
        for layer in 0..nz {
            let mut texels = vec![T::zeroed(); slice * edge];
            for (place, (grid, brick)) in bricks.by_ref().take((nx * ny) as usize).enumerate() {
                let values = read(grid.voxels(), brick * BRICK_VOXELS..(brick + 1) * BRICK_VOXELS);
                let corner = place / nx as usize * edge * row + place % nx as usize * edge;
                for (line, values) in values.chunks_exact(edge).enumerate() {
                    let at = corner + line / edge * slice + line % edge * row;
                    texels[at..at + edge].copy_from_slice(values);
                }
            }
            gpu.queue.write_texture(
                wgpu::TexelCopyTextureInfo {
                    texture: &self.texture,
                    mip_level: 0,
                    origin: wgpu::Origin3d { x: 0, y: 0, z: layer * BRICK_EDGE },
                    aspect: wgpu::TextureAspect::All,
                },
                bytemuck::cast_slice(&texels),
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some((row * size_of::<T>()) as u32),
                    rows_per_image: Some(ny * BRICK_EDGE),
                },
                wgpu::Extent3d { width: nx * BRICK_EDGE, height: ny * BRICK_EDGE, depth_or_array_layers: BRICK_EDGE },
            );
            // Frees the staging memory of this layer before the next.
            gpu.queue.submit([]);
            gpu.wait()?;
        }
        Ok(())
    }

    /// The number of a grid's first brick; `None` where it is not here.
    fn first(&self, grid: &Arc<Grid>) -> Option<u32> {
        self.grids.iter().find(|(known, _)| known.as_ptr() == Arc::as_ptr(grid)).map(|(_, first)| *first)
    }

    /// Refuses volumes of whose grids one is not here.
    pub fn check(&self, volumes: &[Volume]) -> Result<(), FieldError> {
        match volumes.iter().find(|volume| grids_of(volume).any(|grid| self.first(grid).is_none())) {
            None => Ok(()),
            Some(volume) => Err(FieldError {
                path: format!("media.{}", volume.name),
                found: "a grid that the frame was not made with".into(),
                accepted: "the grids of the world that it was made of; for others, a new frame".into(),
            }),
        }
    }

    /// The place of a grid's brick, 8 bits an axis.
    pub fn place(&self, grid: &Arc<Grid>, slot: u32) -> u32 {
        let at = self.first(grid).unwrap_or(0) + slot;
        let [nx, ny, _] = self.sides;
        (at % nx) | ((at / nx % ny) << 8) | ((at / (nx * ny)) << 16)
    }
}

/// A medium's voxels, and those of its temperature and colour.
fn grids_of(volume: &Volume) -> impl Iterator<Item = &Arc<Grid>> {
    let own = match &volume.field {
        Field::Grid(grid) => Some(grid),
        _ => None,
    };
    let temperature = volume.temperature.iter().map(|temperature| &temperature.grid.grid);
    let colors = volume.color.iter().flat_map(|color| color.grids.iter().map(|placed| &placed.grid));
    own.into_iter().chain(temperature).chain(colors)
}

fn stored_bricks(grid: &Grid) -> u64 {
    let voxels = match grid.voxels() {
        Voxels::F16(values) => values.len(),
        Voxels::F32(values) => values.len(),
    };
    (voxels / BRICK_VOXELS) as u64
}

/// A box that is nearly a cube and has room for so many bricks, but at least for one.
fn sides(bricks: u64, most: u32) -> [u32; 3] {
    let side = ((bricks as f64).cbrt().ceil() as u32).clamp(1, most);
    let layer = u64::from(side) * u64::from(side);
    [side, side, bricks.div_ceil(layer).max(1) as u32]
}

#[cfg(test)]
mod test {
    use super::*;

    #[test]
    fn there_is_room_for_every_brick() {
        for bricks in [0, 1, 2, 7, 8, 9, 1000, 1001, 227 * 227 * 227 - 1, 227 * 227 * 227] {
            let sides = sides(bricks, 227);
            let room: u64 = sides.iter().map(|&n| u64::from(n)).product();
            assert!(room >= bricks.max(1) && sides.iter().all(|&n| n <= 227), "{sides:?} for {bricks}");
        }
    }
}
