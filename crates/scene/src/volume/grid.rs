//! A dense grid of scalars, and the memory it may take.

use glam::Mat4;
use half::f16;

use super::VolumeError;

/// A dense scalar grid. The centre of voxel (i, j, k) lies at index coordinates (i, j, k); x is fastest in memory.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Voxels along x, y, z; each at least 1.
    pub dims: [u32; 3],
    /// `dims[0] * dims[1] * dims[2]` finite values, in the file's unit.
    pub voxels: Voxels,
    /// Maps index coordinates to the file's world \[m\]; affine and invertible.
    pub world_from_index: Mat4,
}

/// The values of a [`Grid`], voxel (i, j, k) at `i + dims[0] * (j + dims[1] * k)`.
#[derive(Debug, Clone, PartialEq)]
pub enum Voxels {
    /// 16-bit floats; a loader chooses these where every voxel, as a 32-bit float, is exactly representable.
    F16(Vec<f16>),
    /// 32-bit floats.
    F32(Vec<f32>),
}

impl Grid {
    /// A grid of `dims[0] * dims[1] * dims[2]` voxels, x fastest.
    pub fn dense(dims: [u32; 3], voxels: Voxels, world_from_index: Mat4) -> Self {
        Self { dims, voxels, world_from_index }
    }

    /// Value of voxel (i, j, k), in the file's unit.
    ///
    /// # Panics
    /// If the index is outside [`dims`](Self::dims), as indexing a slice does.
    pub fn value(&self, i: u32, j: u32, k: u32) -> f32 {
        let [nx, ny, nz] = self.dims.map(|n| n as usize);
        let [i, j, k] = [i, j, k].map(|n| n as usize);
        assert!(i < nx && j < ny && k < nz, "voxel ({i}, {j}, {k}) of a grid of {nx} x {ny} x {nz}");
        let at = i + nx * (j + ny * k);
        match &self.voxels {
            Voxels::F16(values) => values[at].to_f32(),
            Voxels::F32(values) => values[at],
        }
    }
}

/// The most memory, in bytes, that a loader may allocate for its result. Beside it a loader needs buffers of well under
/// a megabyte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget(pub u64);

impl Budget {
    /// An empty vector with room for `dims[0] * dims[1] * dims[2]` values of type `T`; all dims then fit 32 bits.
    ///
    /// Errors: [`VolumeError::TooLarge`] beyond the budget, [`VolumeError::OutOfMemory`] where the machine has less.
    pub(super) fn reserve<T>(self, dims: [u64; 3]) -> Result<Vec<T>, VolumeError> {
        // Saturation suffices: a product that saturates is beyond every budget, which has 64 bits.
        let count = dims.iter().fold(1u128, |count, &n| count.saturating_mul(u128::from(n)));
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
    /// The nearest value, and whether it is exact.
    fn store(value: f32) -> (Self, bool);
}

impl Sample for f16 {
    fn store(value: f32) -> (Self, bool) {
        let stored = f16::from_f32(value);
        (stored, stored.to_f32() == value)
    }
}

impl Sample for f32 {
    fn store(value: f32) -> (Self, bool) {
        (value, true)
    }
}

/// Voxels as a loader leaves them.
pub(super) struct Filled<T> {
    pub voxels: Vec<T>,
    /// False once a value was met that `T` does not hold; the voxels are then of no use, and may be too few.
    pub exact: bool,
}

/// Loads as [`Voxels::F16`] where that loses nothing, else as [`Voxels::F32`]. What the first attempt had is freed
/// before the second begins, so that the two never need memory together.
pub(super) fn smallest(
    f16s: impl FnOnce() -> Result<Filled<f16>, VolumeError>,
    f32s: impl FnOnce() -> Result<Filled<f32>, VolumeError>,
) -> Result<Voxels, VolumeError> {
    let attempt = f16s()?;
    if attempt.exact {
        return Ok(Voxels::F16(attempt.voxels));
    }
    drop(attempt);
    Ok(Voxels::F32(f32s()?.voxels))
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
