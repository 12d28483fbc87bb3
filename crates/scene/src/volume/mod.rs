//! Dense scalar volumes and their loaders: OpenVDB, NanoVDB, NIfTI-1, NRRD, MetaImage, DICOM, NumPy and
//! files without header.
//!
//! A loader takes the bytes of a file and a [`Budget`], and gives a [`Grid`]. It opens no file, so that it also runs in
//! a browser; where a volume is in several files, [`Assets`](crate::Assets) has the others. What a file says of its own size is checked against the budget and against the bytes at hand before
//! anything is allocated; a malformed file gives a [`VolumeError`], never a panic.

mod array;
mod detached;
mod dicom;
mod error;
mod file;
mod grid;
mod meta_image;
mod nanovdb;
mod nifti;
mod npy;
mod nrrd;
mod patient;
mod sampling;
#[cfg(test)]
mod tests;
mod vdb;

pub use array::Stored;
pub use dicom::read_dicom;
pub use error::VolumeError;
pub(crate) use file::{FileError, Format, read_grid};
pub use grid::{Budget, Grid, Voxels};
pub use meta_image::read_meta_image;
pub use nanovdb::{nanovdb_grid_names, read_nanovdb};
pub use nifti::read_nifti;
pub use npy::read_npy;
pub use nrrd::read_nrrd;
pub use vdb::{read_vdb, vdb_grid_names};
