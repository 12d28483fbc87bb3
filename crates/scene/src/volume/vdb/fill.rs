//! From the tree of a VDB grid to bricks: first its extent, then its values.

use super::cursor::Cursor;
use super::tree::{LeafMask, Tree, Visit};
use super::values::{ValueReader, is_on};
use crate::volume::VolumeError;
use crate::volume::bricks::Bricks;
use crate::volume::grid::{Budget, Filled, Sample};

/// The active voxels' extent, and where the values of leaves begin.
pub(super) struct Survey<'a> {
    /// Lowest and highest index; `None` without active voxels.
    active: Option<([i64; 3], [i64; 3])>,
    leaves: Cursor<'a>,
}

/// Walks the tree once, for its extent. Allocates no more than the table of a node.
pub(super) fn survey<'a>(tree: &Tree<'a>) -> Result<Survey<'a>, VolumeError> {
    let mut extent = Extent(None);
    let leaves = tree.walk(&mut extent)?;
    Ok(Survey { active: extent.0, leaves })
}

impl Survey<'_> {
    /// Index, in the file, of the first voxel of the result.
    pub fn origin(&self) -> [i64; 3] {
        self.active.map_or([0; 3], |(low, _)| low.map(|n| n - 1))
    }

    /// Voxels of the result, the border included.
    pub fn dims(&self) -> [u64; 3] {
        self.active.map_or([1; 3], |(low, high)| [0, 1, 2].map(|axis| (high[axis] - low[axis] + 3) as u64))
    }

    /// Walks the tree again, and stores every value.
    ///
    /// Errors: [`VolumeError::TooLarge`] before anything is allocated, [`VolumeError::NotFinite`], and those of a
    /// malformed file.
    pub fn fill<T: Sample>(&self, tree: &Tree, budget: Budget) -> Result<Filled<T>, VolumeError> {
        let (background, exact) = T::store(finite(tree.background, self.origin())?);
        let bricks = Bricks::uniform(self.dims(), background, budget)?;
        let mut fill = Fill {
            tree,
            filled: Filled { bricks, exact },
            origin: self.origin(),
            active: self.active.unwrap_or(([0; 3], [-1; 3])),
            leaves: self.leaves.clone(),
            reader: tree.values(),
        };
        tree.walk(&mut fill)?;
        fill.filled.bricks.settle();
        Ok(fill.filled)
    }
}

fn finite(value: f32, index: [i64; 3]) -> Result<f32, VolumeError> {
    if value.is_finite() { Ok(value) } else { Err(VolumeError::NotFinite { index, value: value.into() }) }
}

struct Extent(Option<([i64; 3], [i64; 3])>);

impl Extent {
    fn include(&mut self, low: [i64; 3], high: [i64; 3]) {
        let (a, b) = self.0.unwrap_or((low, high));
        self.0 = Some(([0, 1, 2].map(|axis| a[axis].min(low[axis])), [0, 1, 2].map(|axis| b[axis].max(high[axis]))));
    }
}

impl Visit for Extent {
    fn tile(&mut self, origin: [i64; 3], edge: i64, _: f32, active: bool) -> Result<(), VolumeError> {
        if active {
            self.include(origin, origin.map(|n| n + edge - 1));
        }
        Ok(())
    }

    fn leaf(&mut self, origin: [i64; 3], active: &LeafMask) -> Result<(), VolumeError> {
        for i in (0..512).filter(|&i| is_on(active, i)) {
            let voxel = leaf_voxel(origin, i);
            self.include(voxel, voxel);
        }
        Ok(())
    }
}

fn leaf_voxel(origin: [i64; 3], i: usize) -> [i64; 3] {
    let i = i as i64;
    [origin[0] + i / 64, origin[1] + i / 8 % 8, origin[2] + i % 8]
}

struct Fill<'t, 'a, T> {
    tree: &'t Tree<'a>,
    filled: Filled<T>,
    origin: [i64; 3],
    active: ([i64; 3], [i64; 3]),
    leaves: Cursor<'a>,
    reader: ValueReader,
}

impl<T: Sample> Fill<'_, '_, T> {
    /// A voxel's place in the result.
    fn place(&self, index: [i64; 3]) -> [usize; 3] {
        [0, 1, 2].map(|axis| (index[axis] - self.origin[axis]) as usize)
    }

    fn store(&mut self, value: f32) -> T {
        let (stored, exact) = T::store(value);
        self.filled.exact &= exact;
        stored
    }
}

impl<T: Sample> Visit for Fill<'_, '_, T> {
    fn tile(&mut self, origin: [i64; 3], edge: i64, value: f32, _: bool) -> Result<(), VolumeError> {
        let low = [0, 1, 2].map(|axis| origin[axis].max(self.active.0[axis]));
        let high = [0, 1, 2].map(|axis| (origin[axis] + edge - 1).min(self.active.1[axis]));
        let outside = (0..3).any(|axis| low[axis] > high[axis]);
        if outside || value == self.tree.background || !self.filled.exact {
            return Ok(());
        }
        let value = finite(value, low)?;
        let stored = self.store(value);
        let (low, high) = (self.place(low), self.place(high));
        self.filled.bricks.fill(low, high, stored)
    }

    fn leaf(&mut self, origin: [i64; 3], active: &LeafMask) -> Result<(), VolumeError> {
        if !self.filled.exact {
            return Ok(());
        }
        let mut values = [0.0; 512];
        self.tree.enter_leaf(&mut self.leaves, active)?;
        self.reader.read(&mut self.leaves, active, &mut values)?;
        for (i, &value) in values.iter().enumerate() {
            let voxel = leaf_voxel(origin, i);
            if (0..3).all(|axis| (self.active.0[axis]..=self.active.1[axis]).contains(&voxel[axis])) {
                let stored = self.store(finite(value, voxel)?);
                let place = self.place(voxel);
                self.filled.bricks.fill(place, place, stored)?;
            }
        }
        Ok(())
    }
}
