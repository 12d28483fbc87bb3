//! Which loader reads a file: its extension tells. A path without one that is known may be a folder of DICOM slices.

use std::io;

use super::array::{Array, Coding, Packed, centred};
use super::grid::invertible;
use super::{
    Budget, Grid, Mesh, VolumeError, nanovdb_grid_names, read_dicom, read_meta_image, read_nanovdb, read_nifti,
    read_npy, read_nrrd, read_vdb, read_vti, read_vtu, vdb_grid_names,
};
use crate::assets::Assets;
use crate::description::Raw;

#[cfg(test)]
mod tests;

/// What the extension of a grid's file says it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Format {
    Vdb,
    NanoVdb,
    Nifti,
    Nrrd,
    Npy,
    MetaImage,
    Vti,
    Raw,
}

const EXTENSIONS: [(&str, Format); 13] = [
    (".vdb", Format::Vdb),
    (".nvdb", Format::NanoVdb),
    (".nii", Format::Nifti),
    (".nii.gz", Format::Nifti),
    (".nrrd", Format::Nrrd),
    (".nhdr", Format::Nrrd),
    (".npy", Format::Npy),
    (".mhd", Format::MetaImage),
    (".mha", Format::MetaImage),
    (".vti", Format::Vti),
    (".raw", Format::Raw),
    (".bin", Format::Raw),
    (".dat", Format::Raw),
];
const ACCEPTED: &str = ".vdb, .nvdb, .nii, .nii.gz, .nrrd, .nhdr, .npy, .mhd, .mha, .vti, .raw, .bin, .dat or a folder of \
                        DICOM files";

impl Format {
    pub fn of(file: &str) -> Option<Self> {
        let lower = file.to_ascii_lowercase();
        EXTENSIONS.iter().find(|(extension, _)| lower.ends_with(extension)).map(|&(_, format)| format)
    }

    /// Its name, with an article.
    pub fn name(self) -> &'static str {
        match self {
            Self::Vdb => "an OpenVDB",
            Self::NanoVdb => "a NanoVDB",
            Self::Nifti => "a NIfTI",
            Self::Nrrd => "an NRRD",
            Self::Npy => "a NumPy",
            Self::MetaImage => "a MetaImage",
            Self::Vti => "a VTK",
            Self::Raw => "a raw",
        }
    }
}

/// Why a grid or a mesh could not be read.
#[derive(Debug, thiserror::Error)]
pub(crate) enum FileError {
    /// The file cannot be had.
    #[error(transparent)]
    Read(#[from] io::Error),
    /// It is not what it should be.
    #[error(transparent)]
    Volume(#[from] VolumeError),
}

/// Reads the grid of a file. Without a name the file must hold just one; `raw` is what a file without header needs.
pub(crate) fn read_grid(
    file: &str,
    name: Option<&str>,
    raw: Option<&Raw>,
    assets: &dyn Assets,
    budget: Budget,
) -> Result<Grid, FileError> {
    let Some(format) = Format::of(file) else {
        match assets.list(file) {
            Ok(files) => return Ok(read_dicom(&files, name, assets, budget)?),
            Err(error) if file.ends_with('/') => return Err(error.into()),
            Err(_) => {}
        }
        return Err(VolumeError::Unsupported { found: extension(file), accepted: ACCEPTED }.into());
    };
    let bytes = assets.read(file, budget.0)?;
    Ok(match (format, raw) {
        (Format::Vdb, _) => read_vdb(&bytes, &one(name, || vdb_grid_names(&bytes))?, budget)?,
        (Format::NanoVdb, _) => read_nanovdb(&bytes, &one(name, || nanovdb_grid_names(&bytes))?, budget)?,
        (Format::Nifti, _) => read_nifti(&bytes, budget)?,
        (Format::Nrrd, _) => read_nrrd(file, &bytes, assets, budget)?,
        (Format::Npy, _) => read_npy(&bytes, budget)?,
        (Format::MetaImage, _) => read_meta_image(file, &bytes, assets, budget)?,
        (Format::Vti, _) => read_vti(&bytes, name, budget)?,
        (Format::Raw, Some(raw)) => read_raw(&bytes, raw, budget)?,
        (Format::Raw, None) => {
            return Err(VolumeError::Unsupported { found: "no `raw`".into(), accepted: "a file with its `raw`" }.into());
        }
    })
}

/// Reads the mesh of a file. Without a name the file must hold just one array of scalars, or one that is active.
pub(crate) fn read_mesh(
    file: &str,
    name: Option<&str>,
    assets: &dyn Assets,
    budget: Budget,
) -> Result<Mesh, FileError> {
    if !file.to_ascii_lowercase().ends_with(".vtu") {
        return Err(VolumeError::Unsupported { found: extension(file), accepted: ".vtu" }.into());
    }
    Ok(read_vtu(&assets.read(file, budget.0)?, name, budget)?)
}

/// A file's extension, as a message has it.
fn extension(file: &str) -> String {
    let lower = file.to_ascii_lowercase();
    lower.rsplit_once('.').map_or("no file extension".into(), |(_, extension)| format!("extension .{extension}"))
}

/// The name that was given, or the only one there is.
fn one(name: Option<&str>, names: impl FnOnce() -> Result<Vec<String>, VolumeError>) -> Result<String, VolumeError> {
    match name {
        Some(name) => Ok(name.to_owned()),
        None => match <[String; 1]>::try_from(names()?) {
            Ok([only]) => Ok(only),
            Err(available) => Err(VolumeError::NoGridNamed { available }),
        },
    }
}

/// Reads voxels without a header.
fn read_raw(bytes: &[u8], raw: &Raw, budget: Budget) -> Result<Grid, VolumeError> {
    let &Raw { dims, sample: stored, spacing, big_endian, offset } = raw;
    let array = Array { dims: dims.map(u64::from), stored, big_endian, start: offset, slope: 1.0, intercept: 0.0 };
    let (found, needed) = (bytes.len() as u64, array.end());
    if found != needed {
        return Err(VolumeError::WrongLength { found, needed, dims: array.dims, stored, offset });
    }
    let voxels = array.read(Packed { bytes, coding: Coding::Plain }, budget)?;
    Ok(Grid::bricked(dims, voxels, invertible(centred(array.dims, spacing.as_dvec3()), "spacing")?))
}
