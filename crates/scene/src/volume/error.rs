//! What can be wrong with a volume file.

use super::Stored;

/// Why a volume could not be loaded. Each message says what was found and what is accepted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum VolumeError {
    /// The bytes do not begin as an OpenVDB file does.
    #[error("not an OpenVDB file: it begins with {found}; a VDB file begins with 20 42 44 56 00 00 00 00")]
    NotVdb {
        /// The first bytes, at most eight, in hexadecimal.
        found: String,
    },
    /// The bytes do not hold a NIfTI-1 header.
    #[error("not a NIfTI file: {found}; accepted is NIfTI-1 in one file (.nii, .nii.gz)")]
    NotNifti {
        /// What stands where the header should be.
        found: String,
    },
    /// The bytes are not a VTK XML file.
    #[error("not a VTK XML file: {found}; accepted are .vtu and .vti as VTK writes them")]
    NotVtk {
        /// What stands where XML should be.
        found: String,
    },
    /// The bytes do not begin as a file of the format that its name promises.
    #[error("not {format} file: it begins with \"{found}\"; accepted: {accepted}")]
    NotFormat {
        /// The format, with its article.
        format: &'static str,
        /// The first bytes, with escapes.
        found: String,
        /// How such a file begins.
        accepted: &'static str,
    },
    /// A file that belongs to the volume cannot be read.
    #[error("cannot read {file:?}: {reason}")]
    Unreadable {
        /// The file.
        file: String,
        /// Why.
        reason: String,
    },
    /// A file that belongs to the volume is not what it should be.
    #[error("{file:?}: {source}")]
    Within {
        /// The file.
        file: String,
        /// What is wrong with it.
        source: Box<VolumeError>,
    },
    /// A file without header has another length than the scene says.
    #[error("found {found} bytes; accepted: {needed}, for {} x {} x {} voxels of {} after {offset} bytes",
        dims[0], dims[1], dims[2], format!("{stored:?}").to_lowercase())]
    WrongLength {
        /// Bytes there are.
        found: u64,
        /// Bytes there should be (saturated).
        needed: u64,
        /// Voxels along x, y, z.
        dims: [u64; 3],
        /// How they are stored.
        stored: Stored,
        /// Bytes before them.
        offset: u64,
    },
    /// The file ends too early.
    #[error("the file ends at byte {at}, within {what}")]
    Truncated {
        /// What was being read.
        what: &'static str,
        /// Where the bytes end (byte offset; for compressed voxels, in the decompressed stream).
        at: u64,
    },
    /// The file contradicts itself or its format.
    #[error("the file is corrupt: {what}")]
    Corrupt {
        /// What was found, and what is accepted.
        what: String,
    },
    /// The file is well formed, but uses something that is not supported.
    #[error("unsupported: {found}; accepted: {accepted}")]
    Unsupported {
        /// What the file has.
        found: String,
        /// What it may have.
        accepted: &'static str,
    },
    /// A VDB or NanoVDB file has no grid of that name.
    #[error("found no grid named {name:?}; accepted: {}", names(available))]
    NoSuchGrid {
        /// The name that was asked for.
        name: String,
        /// The names of the file's grids, in its order.
        available: Vec<String>,
    },
    /// A VDB or NanoVDB file has no grid, or several of which none was named.
    #[error("found {}; accepted: the name of one grid", names(available))]
    NoGridNamed {
        /// The names of the file's grids, in its order.
        available: Vec<String>,
    },
    /// A VTK file has no array of that name.
    #[error("found no array named {name:?} on points or cells; accepted: {}", arrays(available))]
    NoSuchArray {
        /// The name that was asked for.
        name: String,
        /// The names of the file's arrays on points, then on cells.
        available: Vec<String>,
    },
    /// A VTK file has no array, or several of which none was named and none is active.
    #[error("found {}; accepted: the name of one array", arrays(available))]
    NoArrayNamed {
        /// The names of the file's arrays on points, then on cells.
        available: Vec<String>,
    },
    /// A mesh contradicts itself.
    #[error("the mesh is malformed: {what}")]
    Mesh {
        /// What was found, and what is accepted.
        what: String,
    },
    /// The mesh would not fit into the budget.
    #[error(
        "a mesh of {vertices} vertices and {tetrahedra} tetrahedra needs {bytes} bytes while it is made; the budget is \
         {budget}"
    )]
    MeshTooLarge {
        /// How many vertices.
        vertices: usize,
        /// How many tetrahedra; 0 where they have not been counted.
        tetrahedra: usize,
        /// Bytes that it would need (saturated).
        bytes: u64,
        /// Bytes allowed.
        budget: u64,
    },
    /// A folder has several series of DICOM slices, of which none was named, or not the one that was.
    #[error("found the series {}; accepted: `name`, the SeriesInstanceUID of one",
        available.iter().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", "))]
    WhichSeries {
        /// The SeriesInstanceUIDs, in order.
        available: Vec<String>,
    },
    /// Slices are missing or not evenly spaced.
    #[error("the slices {:?} and {:?} are {gap:.3} mm apart along their normal, others {usual:.3} mm; accepted: slices \
             in a row, evenly spaced within 1 %", files[0], files[1])]
    UnevenSlices {
        /// The files of two neighbours.
        files: [String; 2],
        /// Their distance \[mm\].
        gap: f64,
        /// The distance of most \[mm\].
        usual: f64,
    },
    /// The dense grid would not fit into the budget. Nothing was allocated.
    #[error("a grid of {} x {} x {} voxels needs {bytes} bytes; the budget is {budget}", dims[0], dims[1], dims[2])]
    TooLarge {
        /// Voxels along x, y, z.
        dims: [u64; 3],
        /// Bytes that the result would need (saturated).
        bytes: u64,
        /// Bytes allowed.
        budget: u64,
    },
    /// The bodies would not fit into the budget, or into the numbers that count them. Nothing was allocated.
    #[error("{count} {what} need {bytes} bytes; the budget is {budget}")]
    TooMany {
        /// What there are too many of.
        what: &'static str,
        /// How many.
        count: u64,
        /// Bytes that they would need (saturated).
        bytes: u64,
        /// Bytes allowed.
        budget: u64,
    },
    /// The grid is within the budget, but the machine has no memory for it.
    #[error("no memory for {bytes} bytes")]
    OutOfMemory {
        /// Bytes asked for.
        bytes: u64,
    },
    /// A voxel is NaN, infinite, or too large for a 32-bit float.
    #[error("the voxel at index ({}, {}, {}) is {value}; every voxel must be a finite 32-bit float",
        index[0], index[1], index[2])]
    NotFinite {
        /// Index of the voxel in the file's own index space.
        index: [i64; 3],
        /// Its value.
        value: f64,
    },
}

/// Grids as a message lists them: their names are free text.
fn names(available: &[String]) -> String {
    list("grid", available)
}

/// As [`names`], arrays.
fn arrays(available: &[String]) -> String {
    list("array", available)
}

fn list(what: &str, available: &[String]) -> String {
    match available {
        [] => format!("a file without {what}s"),
        [only] => format!("the {what} {only:?}"),
        several => {
            format!("the {what}s {}", several.iter().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(", "))
        }
    }
}

impl VolumeError {
    /// `bytes` do not begin as a file of `format` does.
    pub(crate) fn not(format: &'static str, bytes: &[u8], accepted: &'static str) -> Self {
        Self::NotFormat { format, found: bytes[..bytes.len().min(8)].escape_ascii().to_string(), accepted }
    }

    pub(crate) fn corrupt(what: impl Into<String>) -> Self {
        Self::Corrupt { what: what.into() }
    }
}
