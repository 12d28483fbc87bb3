//! Scalar volumes and their loaders: grids from OpenVDB, NanoVDB, NIfTI-1, NRRD, MetaImage, DICOM, VTK and NumPy files and
//! files without header, meshes from VTK files.
//!
//! A loader takes the bytes of a file and a [`Budget`], and gives a [`Grid`] or a [`Mesh`]. It opens no file, so that it
//! also runs in a browser; where a volume is in several files, [`Assets`](crate::assets::Assets) has the others. What a
//! file says of its own size is checked against the budget and against the bytes at hand before anything is allocated; a
//! malformed file gives a [`VolumeError`], never a panic.

mod array;
mod bricks;
mod detached;
mod dicom;
mod error;
mod file;
mod grid;
mod mesh;
mod meta_image;
mod nanovdb;
mod nifti;
mod npy;
mod nrrd;
mod patient;
mod sampling;
#[cfg(test)]
pub(crate) mod tests;
mod vdb;
mod vtk;

pub use array::Stored;
pub use bricks::{BRICK_CELLS, BRICK_EDGE, BRICK_VOXELS, Brick};
pub use dicom::read_dicom;
pub use error::VolumeError;
pub(crate) use file::{FileError, Format, read_grid, read_mesh};
pub use grid::{Budget, Grid, Voxels};
pub use mesh::{Cell, Mesh, Values};
pub use meta_image::read_meta_image;
pub use nanovdb::{nanovdb_grid_names, read_nanovdb};
pub use nifti::read_nifti;
pub(crate) use npy::NpyTable;
pub use npy::read_npy;
pub use nrrd::read_nrrd;
pub use vdb::{read_vdb, vdb_grid_names};
pub use vtk::{read_vti, read_vtu};
