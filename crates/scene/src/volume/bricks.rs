//! Voxels in bricks: only where values differ are they kept.
//!
//! A brick spans 8 × 8 × 8 trilinear cells, the cubes between voxel centres, so it has 9³ voxels: those on a face between
//! two bricks are in both, and no interpolation needs a second brick. A brick whose voxels are all alike is one number.

use super::VolumeError;
use super::grid::{Budget, Filled, Sample};

/// Trilinear cells along an edge of a brick.
pub const BRICK_CELLS: u32 = 8;
/// Voxels along an edge of a brick.
pub const BRICK_EDGE: u32 = BRICK_CELLS + 1;
/// Voxels of a brick.
pub const BRICK_VOXELS: usize = (BRICK_EDGE * BRICK_EDGE * BRICK_EDGE) as usize;

const CELLS: usize = BRICK_CELLS as usize;
const EDGE: usize = BRICK_EDGE as usize;

/// The values within a brick, and where they are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Brick {
    /// The lowest value.
    pub low: f32,
    /// The highest value.
    pub high: f32,
    /// The number of its voxels among the stored bricks'; of no meaning where all values are alike.
    pub slot: u32,
}

impl Brick {
    /// A brick of one value.
    pub(super) fn uniform(value: f32) -> Self {
        Self { low: value, high: value, slot: 0 }
    }

    /// Whether all its values are alike, so that it has no voxels of its own.
    pub fn is_uniform(&self) -> bool {
        self.low == self.high
    }
}

/// Bricks along an axis of so many voxels.
pub(super) fn count(voxels: u64) -> u64 {
    voxels.saturating_sub(1).div_ceil(BRICK_CELLS.into()).max(1)
}

/// Bricks in the making.
pub(super) struct Bricks<T> {
    dims: [usize; 3],
    counts: [usize; 3],
    /// x fastest.
    pub index: Vec<Brick>,
    pub voxels: Vec<T>,
    budget: Budget,
}

impl<T: Sample> Bricks<T> {
    /// No bricks yet, of a grid of so many voxels.
    ///
    /// Errors: [`VolumeError::TooLarge`] and [`VolumeError::OutOfMemory`] where even their index finds no room.
    pub fn new(dims: [u64; 3], budget: Budget) -> Result<Self, VolumeError> {
        let counts = dims.map(count);
        let index = budget.reserve::<Brick>(dims, counts)?;
        let [dims, counts] = [dims, counts].map(|n| n.map(|n| n as usize));
        Ok(Self { dims, counts, index, voxels: Vec::new(), budget })
    }

    /// All bricks of one value.
    pub fn uniform(dims: [u64; 3], value: T, budget: Budget) -> Result<Self, VolumeError> {
        let mut bricks = Self::new(dims, budget)?;
        bricks.index.resize(bricks.counts.iter().product(), Brick::uniform(value.load()));
        Ok(bricks)
    }

    /// Adds the next layer of bricks in z, of a window of slices (each x fastest) from its lowest on: as many as there are
    /// left, 9 at most. Voxels beyond the grid repeat its last.
    pub fn push_layer(&mut self, window: &[T]) -> Result<(), VolumeError> {
        let [nx, ny, _] = self.dims;
        let slices = window.len() / (nx * ny);
        let mut values = [T::ZERO; BRICK_VOXELS];
        for by in 0..self.counts[1] {
            for bx in 0..self.counts[0] {
                for (row, line) in values.chunks_exact_mut(EDGE).enumerate() {
                    let z = (row / EDGE).min(slices - 1);
                    let y = (by * CELLS + row % EDGE).min(ny - 1);
                    let start = (z * ny + y) * nx;
                    let first = bx * CELLS;
                    let there = (nx - first).min(EDGE);
                    line[..there].copy_from_slice(&window[start + first..start + first + there]);
                    line[there..].fill(window[start + nx - 1]);
                }
                let brick = self.store(&values)?;
                self.index.push(brick);
            }
        }
        Ok(())
    }

    /// Sets the voxels of a box, its corners included, to a value.
    pub fn fill(&mut self, low: [usize; 3], high: [usize; 3], value: T) -> Result<(), VolumeError> {
        // A voxel on a face belongs to both bricks.
        let first = [0, 1, 2].map(|axis| low[axis].saturating_sub(1) / CELLS);
        let last = [0, 1, 2].map(|axis| (high[axis] / CELLS).min(self.counts[axis] - 1));
        for bz in first[2]..=last[2] {
            for by in first[1]..=last[1] {
                for bx in first[0]..=last[0] {
                    let brick = [bx, by, bz];
                    let from = [0, 1, 2].map(|axis| low[axis].saturating_sub(brick[axis] * CELLS));
                    // What lies beyond the grid repeats its last voxel.
                    let to = [0, 1, 2].map(|axis| {
                        let to = if high[axis] + 1 == self.dims[axis] { usize::MAX } else { high[axis] };
                        (to - brick[axis] * CELLS).min(CELLS)
                    });
                    self.fill_brick((bz * self.counts[1] + by) * self.counts[0] + bx, from, to, value)?;
                }
            }
        }
        Ok(())
    }

    fn fill_brick(&mut self, at: usize, from: [usize; 3], to: [usize; 3], value: T) -> Result<(), VolumeError> {
        let number = value.load();
        let brick = &mut self.index[at];
        if from == [0; 3] && to == [CELLS; 3] && brick.slot == 0 {
            *brick = Brick::uniform(number);
            return Ok(());
        }
        // Slots count from 1 while bricks are filled: 0 says that there are no voxels yet.
        if brick.slot == 0 {
            if brick.is_uniform() && brick.low == number {
                return Ok(());
            }
            let values = [T::store(brick.low).0; BRICK_VOXELS];
            let slot = self.append(&values)? + 1;
            self.index[at].slot = slot;
        }
        let start = (self.index[at].slot as usize - 1) * BRICK_VOXELS;
        for z in from[2]..=to[2] {
            for y in from[1]..=to[1] {
                let row = start + (z * EDGE + y) * EDGE;
                self.voxels[row + from[0]..=row + to[0]].fill(value);
            }
        }
        Ok(())
    }

    /// Ends the filling: every brick learns its range, and those of one value give up their voxels.
    pub fn settle(&mut self) {
        let mut kept = 0;
        // In the order of their slots, so that voxels only move towards the front.
        let mut filled: Vec<usize> = (0..self.index.len()).filter(|&at| self.index[at].slot > 0).collect();
        filled.sort_by_key(|&at| self.index[at].slot);
        for at in filled {
            let from = (self.index[at].slot as usize - 1) * BRICK_VOXELS;
            let [low, high] = range(&self.voxels[from..from + BRICK_VOXELS]);
            self.index[at] = Brick { low, high, slot: kept as u32 };
            if low < high {
                self.voxels.copy_within(from..from + BRICK_VOXELS, kept * BRICK_VOXELS);
                kept += 1;
            }
        }
        self.voxels.truncate(kept * BRICK_VOXELS);
        self.voxels.shrink_to_fit();
    }

    fn store(&mut self, values: &[T; BRICK_VOXELS]) -> Result<Brick, VolumeError> {
        let [low, high] = range(values);
        let slot = if low < high { self.append(values)? } else { 0 };
        Ok(Brick { low, high, slot })
    }

    /// Makes room for a brick, and gives its number.
    fn append(&mut self, values: &[T; BRICK_VOXELS]) -> Result<u32, VolumeError> {
        let bytes = size_of_val(self.index.as_slice()) + size_of_val(self.voxels.as_slice()) + size_of_val(values);
        if bytes as u64 > self.budget.0 {
            let dims = self.dims.map(|n| n as u64);
            return Err(VolumeError::TooLarge { dims, bytes: bytes as u64, budget: self.budget.0 });
        }
        if self.voxels.capacity() < self.voxels.len() + BRICK_VOXELS {
            // An eighth more at a time: twice as much might not fit beside what there is.
            let more = (self.voxels.len() / 8).next_multiple_of(BRICK_VOXELS).max(64 * BRICK_VOXELS);
            let failed = |_| VolumeError::OutOfMemory { bytes: bytes as u64 };
            self.voxels.try_reserve_exact(more).map_err(failed)?;
        }
        let slot = self.voxels.len() / BRICK_VOXELS;
        self.voxels.extend_from_slice(values);
        Ok(slot as u32)
    }
}

fn range<T: Sample>(values: &[T]) -> [f32; 2] {
    let ends = |[low, high]: [f32; 2], value: &T| [low.min(value.load()), high.max(value.load())];
    values.iter().fold([f32::INFINITY, f32::NEG_INFINITY], ends)
}

/// Voxels as they come, x fastest, made into bricks layer by layer.
pub(super) struct Slices<T> {
    filled: Filled<T>,
    window: Vec<T>,
    taken: u64,
}

impl<T: Sample> Slices<T> {
    /// Room for a layer of bricks.
    pub fn new(dims: [u64; 3], budget: Budget) -> Result<Self, VolumeError> {
        let filled = Filled { bricks: Bricks::new(dims, budget)?, exact: true };
        let window = budget.reserve(dims, [dims[0], dims[1], dims[2].min(BRICK_EDGE.into())])?;
        Ok(Self { filled, window, taken: 0 })
    }

    /// Takes the value of the next voxel. Once one is not exact, all others are ignored.
    ///
    /// Errors: [`VolumeError::NotFinite`], and a lack of memory.
    pub fn push_value(&mut self, value: f64) -> Result<(), VolumeError> {
        if !(value as f32).is_finite() {
            let [nx, ny, _] = self.filled.bricks.dims.map(|n| n as u64);
            let index = [self.taken % nx, self.taken / nx % ny, self.taken / (nx * ny)].map(|n| n as i64);
            return Err(VolumeError::NotFinite { index, value });
        }
        let (voxel, exact) = T::store(value as f32);
        self.filled.exact &= exact;
        if self.filled.exact { self.push(voxel) } else { Ok(()) }
    }

    /// Takes the next voxel.
    pub fn push(&mut self, voxel: T) -> Result<(), VolumeError> {
        self.window.push(voxel);
        self.taken += 1;
        let [nx, ny, nz] = self.filled.bricks.dims;
        let last = self.taken == (nx * ny * nz) as u64;
        // A grid of one slice, too, has a layer of bricks.
        if last || self.window.len() == nx * ny * EDGE {
            self.filled.bricks.push_layer(&self.window)?;
            // The slice between two layers is in both.
            let kept = self.window.len() - nx * ny;
            self.window.copy_within(kept.., 0);
            self.window.truncate(nx * ny);
        }
        Ok(())
    }

    /// Whether every value was exact so far.
    pub fn exact(&self) -> bool {
        self.filled.exact
    }

    /// The bricks, once all voxels were taken.
    pub fn finish(self) -> Filled<T> {
        self.filled
    }
}
