//! A grid of scalars, and the memory it may take.

use glam::Mat4;
use half::f16;

use super::VolumeError;
use super::bricks::{self, BRICK_CELLS, BRICK_EDGE, BRICK_VOXELS, Brick, Bricks, Slices};

/// A scalar grid, kept in bricks. The centre of voxel (i, j, k) lies at index coordinates (i, j, k).
#[derive(Clone, PartialEq)]
pub struct Grid {
    /// Voxels along x, y, z; each at least 1.
    pub dims: [u32; 3],
    /// Maps index coordinates to the file's world \[m\]; affine and invertible.
    pub world_from_index: Mat4,
    bricks: Vec<Brick>,
    voxels: Voxels,
}

/// Finite values in the file's unit.
#[derive(Debug, Clone, PartialEq)]
pub enum Voxels {
    /// 16-bit floats; a loader chooses these where every voxel, as a 32-bit float, is exactly representable.
    F16(Vec<f16>),
    /// 32-bit floats.
    F32(Vec<f32>),
}

impl Grid {
    /// A grid of `dims[0] * dims[1] * dims[2]` finite voxels, voxel (i, j, k) at `i + dims[0] * (j + dims[1] * k)`.
    ///
    /// # Panics
    /// If there are not as many voxels as `dims` says.
    pub fn dense(dims: [u32; 3], voxels: Voxels, world_from_index: Mat4) -> Self {
        fn split<T: Sample>(dims: [u32; 3], voxels: &[T]) -> Bricks<T> {
            let no_limit = Budget(u64::MAX);
            let mut slices = Slices::new(dims.map(u64::from), no_limit).expect("the machine has as much memory again");
            for &voxel in voxels {
                slices.push(voxel).expect("the machine has as much memory again");
            }
            slices.finish().bricks
        }
        let count = dims.iter().map(|&n| n as usize).product::<usize>();
        let bricked = match &voxels {
            Voxels::F16(values) if values.len() == count => Bricked::f16(split(dims, values)),
            Voxels::F32(values) if values.len() == count => Bricked::f32(split(dims, values)),
            _ => panic!("a grid of {dims:?} has {count} voxels"),
        };
        Self::bricked(dims, bricked, world_from_index)
    }

    /// A grid of a loader's bricks.
    pub(super) fn bricked(dims: [u32; 3], Bricked { bricks, voxels }: Bricked, world_from_index: Mat4) -> Self {
        Self { dims, world_from_index, bricks, voxels }
    }

    /// Bricks along x, y, z.
    pub fn brick_counts(&self) -> [u32; 3] {
        self.dims.map(|n| bricks::count(n.into()) as u32)
    }

    /// The bricks, x fastest; brick (i, j, k) spans index coordinates from (i, j, k) times [`BRICK_CELLS`] on.
    pub fn bricks(&self) -> &[Brick] {
        &self.bricks
    }

    /// The voxels of the bricks that have some, [`BRICK_VOXELS`] each in the order of their slots, x fastest.
    pub fn voxels(&self) -> &Voxels {
        &self.voxels
    }

    /// Size in memory [bytes].
    pub fn bytes(&self) -> u64 {
        let voxels = match &self.voxels {
            Voxels::F16(values) => size_of_val(values.as_slice()),
            Voxels::F32(values) => size_of_val(values.as_slice()),
        };
        (voxels + size_of_val(self.bricks.as_slice())) as u64
    }

    /// Value of voxel (i, j, k), in the file's unit.
    ///
    /// # Panics
    /// If the index is outside [`dims`](Self::dims), as indexing a slice does.
    pub fn value(&self, i: u32, j: u32, k: u32) -> f32 {
        let voxel = [i, j, k];
        assert!((0..3).all(|axis| voxel[axis] < self.dims[axis]), "voxel {voxel:?} of a grid of {:?}", self.dims);
        let counts = self.brick_counts();
        let brick = [0, 1, 2].map(|axis| (voxel[axis] / BRICK_CELLS).min(counts[axis] - 1));
        let local = [0, 1, 2].map(|axis| (voxel[axis] - brick[axis] * BRICK_CELLS) as usize);
        let found = self.bricks[((brick[2] * counts[1] + brick[1]) * counts[0] + brick[0]) as usize];
        if found.is_uniform() {
            return found.low;
        }
        let edge = BRICK_EDGE as usize;
        let at = found.slot as usize * BRICK_VOXELS + (local[2] * edge + local[1]) * edge + local[0];
        match &self.voxels {
            Voxels::F16(values) => values[at].to_f32(),
            Voxels::F32(values) => values[at],
        }
    }
}

impl std::fmt::Debug for Grid {
    /// Without voxels: there may be millions.
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.debug_struct("Grid").field("dims", &self.dims).field("bytes", &self.bytes()).finish_non_exhaustive()
    }
}

/// The most memory, in bytes, that a loader may allocate for its result. Beside it a loader needs buffers of well under
/// a megabyte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget(pub u64);

impl Budget {
    /// An empty vector with room for `sides[0] * sides[1] * sides[2]` values of type `T`, for a grid of `dims`; all dims
    /// then fit 32 bits.
    ///
    /// Errors: [`VolumeError::TooLarge`] beyond the budget, [`VolumeError::OutOfMemory`] where the machine has less.
    pub(super) fn reserve<T>(self, dims: [u64; 3], sides: [u64; 3]) -> Result<Vec<T>, VolumeError> {
        // Saturation suffices: a product that saturates is beyond every budget, which has 64 bits.
        let count = sides.iter().fold(1u128, |count, &n| count.saturating_mul(u128::from(n)));
        let bytes = u64::try_from(count.saturating_mul(size_of::<T>() as u128)).unwrap_or(u64::MAX);
        if bytes > self.0 || bytes == u64::MAX || dims.iter().any(|&n| u32::try_from(n).is_err()) {
            return Err(VolumeError::TooLarge { dims, bytes, budget: self.0 });
        }
        let mut voxels = Vec::new();
        usize::try_from(count)
            .ok()
            .and_then(|count| voxels.try_reserve_exact(count).ok())
            .ok_or(VolumeError::OutOfMemory { bytes })?;
        Ok(voxels)
    }
}

/// How a voxel is stored.
pub(super) trait Sample: Copy {
    /// 0.
    const ZERO: Self;
    /// The nearest value, and whether it is exact.
    fn store(value: f32) -> (Self, bool);
    /// The value.
    fn load(self) -> f32;
}

impl Sample for f16 {
    const ZERO: Self = f16::ZERO;
    fn store(value: f32) -> (Self, bool) {
        let stored = f16::from_f32(value);
        (stored, stored.to_f32() == value)
    }
    fn load(self) -> f32 {
        self.to_f32()
    }
}

impl Sample for f32 {
    const ZERO: Self = 0.0;
    fn store(value: f32) -> (Self, bool) {
        (value, true)
    }
    fn load(self) -> f32 {
        self
    }
}

/// Bricks as a loader leaves them.
pub(super) struct Filled<T> {
    pub bricks: Bricks<T>,
    /// False once a value was met that `T` does not hold; the bricks are then of no use, and may be too few.
    pub exact: bool,
}

/// Bricks with their voxels, of whatever type.
pub(super) struct Bricked {
    bricks: Vec<Brick>,
    voxels: Voxels,
}

impl Bricked {
    pub fn f16(bricks: Bricks<f16>) -> Self {
        Self { bricks: bricks.index, voxels: Voxels::F16(bricks.voxels) }
    }

    fn f32(bricks: Bricks<f32>) -> Self {
        Self { bricks: bricks.index, voxels: Voxels::F32(bricks.voxels) }
    }
}

/// Loads 16-bit voxels where that loses nothing, else 32-bit ones. What the first attempt had is freed before the second
/// begins, so that the two never need memory together.
pub(super) fn smallest(
    f16s: impl FnOnce() -> Result<Filled<f16>, VolumeError>,
    f32s: impl FnOnce() -> Result<Filled<f32>, VolumeError>,
) -> Result<Bricked, VolumeError> {
    let attempt = f16s()?;
    if attempt.exact {
        return Ok(Bricked::f16(attempt.bricks));
    }
    drop(attempt);
    Ok(Bricked::f32(f32s()?.bricks))
}

/// `matrix` in single precision.
///
/// Errors: [`VolumeError::Corrupt`], naming `source`, if it is not finite or not invertible.
pub(super) fn invertible(matrix: glam::DMat4, source: &str) -> Result<Mat4, VolumeError> {
    let single = matrix.as_mat4();
    // A determinant that is tiny beside the lengths of its columns is a flat grid, whatever its unit.
    let lengths = [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|axis| axis.truncate().length());
    let volume = lengths.iter().product::<f64>();
    if single.is_finite() && matrix.determinant().abs() > 1e-6 * volume && single.inverse().is_finite() {
        return Ok(single);
    }
    Err(VolumeError::corrupt(format!(
        "the matrix of its {source} is {:?}; it must be finite and invertible",
        matrix.transpose().to_cols_array_2d()
    )))
}
