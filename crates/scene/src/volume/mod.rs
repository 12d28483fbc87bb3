//! Scalar volumes and their loaders: grids from OpenVDB, NIfTI-1 and VTK files, meshes from VTK files.
//!
//! A loader takes the bytes of a file and a [`Budget`], and gives a [`Grid`] or a [`Mesh`]. It opens no file, so that it also runs in
//! a browser. What a file says of its own size is checked against the budget and against the bytes at hand before
//! anything is allocated; a malformed file gives a [`VolumeError`], never a panic.

mod array;
mod bricks;
mod error;
mod grid;
mod mesh;
mod nifti;
mod sampling;
#[cfg(test)]
mod tests;
mod vdb;
mod vtk;

pub use bricks::{BRICK_CELLS, BRICK_EDGE, BRICK_VOXELS, Brick};
pub use error::VolumeError;
pub use grid::{Budget, Grid, Voxels};
pub use mesh::{Cell, Mesh, Values};
pub use nifti::read_nifti;
pub use vdb::{read_vdb, vdb_grid_names};
pub use vtk::{read_vti, read_vtu};
