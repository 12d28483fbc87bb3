//! Scalar volumes and their loaders: OpenVDB and NIfTI-1.
//!
//! A loader takes the bytes of a file and a [`Budget`], and gives a [`Grid`]. It opens no file, so that it also runs in
//! a browser. What a file says of its own size is checked against the budget and against the bytes at hand before
//! anything is allocated; a malformed file gives a [`VolumeError`], never a panic.

mod array;
mod bricks;
mod error;
mod grid;
mod nifti;
mod sampling;
#[cfg(test)]
mod tests;
mod vdb;

pub use bricks::{BRICK_CELLS, BRICK_EDGE, BRICK_VOXELS, Brick};
pub use error::VolumeError;
pub use grid::{Budget, Grid, Voxels};
pub use nifti::read_nifti;
pub use vdb::{read_vdb, vdb_grid_names};
