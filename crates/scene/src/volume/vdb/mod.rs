//! Reads one grid of an OpenVDB file.
//!
//! Source of the format: OpenVDB, io/Archive.cc, io/GridDescriptor.cc, MetaMap.cc (file versions 220 to 225).

pub(super) mod blosc;
mod cursor;
mod fill;
#[cfg(test)]
mod tests;
mod transform;
mod tree;
mod values;

use cursor::Cursor;
use glam::{DMat4, DVec3};
use tree::Tree;
use values::Encoding;

use super::VolumeError;
use super::grid::{Budget, Grid, invertible, smallest};

/// "VDB " as the upper half of a 64-bit number.
const MAGIC: [u8; 8] = *b" BDV\0\0\0\0";
/// Files before have another layout of transforms; files after may have one that is not known here.
const VERSIONS: std::ops::RangeInclusive<u32> = 220..=225;
/// From here on each grid has its own compression, and each node says how its inactive values are stored.
const NODE_CODES: u32 = 222;
const HALF_SUFFIX: &str = "_HalfFloat";
const TREE: &str = "Tree_float_5_4_3";
const VECTORS: &str = "Tree_vec3s_5_4_3";

/// Reads the grid named `grid` of a VDB file.
///
/// The result spans the bounding box of the active voxels (and active tiles), and one voxel more on each side, which
/// holds the background, so that interpolation falls off to it. Inactive voxels in the box have the value that the tree
/// gives them. A grid without active voxels gives one voxel of background, at index (0, 0, 0). A world unit is taken as
/// a metre; VDB files do not say. Where several grids have the name, the first is read; `name[1]` names the second.
/// A grid of vectors is three, `.x`, `.y` and `.z` after its name: those of a grid `Cd` of colours are `Cd.x`, `Cd.y` and `Cd.z`.
///
/// Errors: any [`VolumeError`] but [`VolumeError::NotNifti`]. Accepted are grids of 32-bit floats and of vectors of three
/// of them, also those stored with 16 bits, under an affine transform, uncompressed or by zip or Blosc (blosclz, lz4, zlib).
pub fn read_vdb(bytes: &[u8], grid: &str, budget: Budget) -> Result<Grid, VolumeError> {
    let archive = Archive::read(bytes)?;
    let descriptor = archive.find(grid)?;
    if !descriptor.instance_of.is_empty() {
        return Err(VolumeError::Unsupported {
            found: format!("the grid \"{grid}\" is an instance of \"{}\"", descriptor.instance_of),
            accepted: "a grid with a tree of its own",
        });
    }
    if descriptor.component.is_none() && descriptor.tree_type != TREE {
        return Err(VolumeError::Unsupported {
            found: format!("the grid type {}", descriptor.tree_type),
            accepted: "Tree_float_5_4_3, Tree_vec3s_5_4_3",
        });
    }

    let mut cursor = Cursor::new(bytes);
    cursor.seek(descriptor.start, "the grid")?;
    let compression = match archive.version {
        NODE_CODES.. => cursor.u32("the grid's compression")?,
        _ => archive.compression,
    };
    let half = read_metadata(&mut cursor)?;
    let world_from_file = transform::read(&mut cursor)?;
    let tree =
        Tree::new(cursor, Encoding::new(compression, half, archive.version >= NODE_CODES, descriptor.component)?)?;
    let survey = fill::survey(&tree)?;
    let bricked = smallest(|| survey.fill(&tree, budget), || survey.fill(&tree, budget))?;
    let origin = DMat4::from_translation(DVec3::from_array(survey.origin().map(|n| n as f64)));
    let world_from_index = invertible(world_from_file * origin, "transform")?;
    Ok(Grid::bricked(survey.dims().map(|n| n as u32), bricked, world_from_index))
}

/// Names of all grids of a VDB file, in its order, those of vectors by component, also of those that [`read_vdb`] does not accept; where several share
/// one, `[0]`, `[1]`, ... follows it.
///
/// Errors: [`VolumeError`]s of a malformed file; grids themselves are not looked at.
pub fn vdb_grid_names(bytes: &[u8]) -> Result<Vec<String>, VolumeError> {
    Ok(Archive::read(bytes)?.grids.into_iter().map(|grid| grid.name).collect())
}

struct Archive {
    version: u32,
    /// Of all grids, before file version 222.
    compression: u32,
    grids: Vec<Descriptor>,
}

struct Descriptor {
    name: String,
    /// Without what says that values are stored with 16 bits.
    tree_type: String,
    /// Of vectors, the one that is meant.
    component: Option<usize>,
    instance_of: String,
    /// Byte offset in the file.
    start: u64,
}

impl Archive {
    fn read(bytes: &[u8]) -> Result<Self, VolumeError> {
        if !bytes.starts_with(&MAGIC) {
            let found: Vec<_> = bytes.iter().take(8).map(|byte| format!("{byte:02x}")).collect();
            let found = if found.is_empty() { "nothing".into() } else { found.join(" ") };
            return Err(VolumeError::NotVdb { found });
        }
        let mut cursor = Cursor::new(bytes);
        cursor.take(8, "the header")?;
        let version = cursor.u32("the header")?;
        if !VERSIONS.contains(&version) {
            return Err(VolumeError::Unsupported {
                found: format!("a VDB file of version {version}"),
                accepted: "versions 220 to 225",
            });
        }
        cursor.take(8, "the header")?;
        if cursor.u8("the header")? == 0 {
            return Err(VolumeError::Unsupported {
                found: "a VDB stream without the offsets of its grids".into(),
                accepted: "a VDB file with offsets, as openvdb::io::File and vdb.write make it",
            });
        }
        let compression = if version < NODE_CODES { u32::from(cursor.u8("the header")? != 0) } else { 0 };
        cursor.take(36, "the file's identifier")?;
        read_metadata(&mut cursor)?;
        let count = cursor.u32("the number of grids")?;
        let mut grids = Vec::new();
        for _ in 0..count {
            grids.extend(Descriptor::read(&mut cursor)?);
        }
        Ok(Self { version, compression, grids })
    }

    fn find(&self, name: &str) -> Result<&Descriptor, VolumeError> {
        let exact = self.grids.iter().find(|grid| grid.name == name);
        let first = || self.grids.iter().find(|grid| grid.name.strip_suffix("[0]") == Some(name));
        exact.or_else(first).ok_or_else(|| VolumeError::NoSuchGrid {
            name: name.into(),
            available: self.grids.iter().map(|grid| grid.name.clone()).collect(),
        })
    }
}

impl Descriptor {
    /// Reads a descriptor, one for each component of vectors, and moves on to the next one.
    fn read(cursor: &mut Cursor) -> Result<Vec<Self>, VolumeError> {
        const WHAT: &str = "a grid's descriptor";
        // A number follows a name that is not unique.
        let name = cursor.text(WHAT)?;
        let (name, number) = match name.split_once('\x1e') {
            Some((name, number)) => (name, format!("[{number}]")),
            None => (name.as_str(), String::new()),
        };
        let mut tree_type = cursor.text(WHAT)?;
        tree_type.truncate(tree_type.strip_suffix(HALF_SUFFIX).unwrap_or(&tree_type).len());
        let instance_of = cursor.text(WHAT)?;
        let start = cursor.u64(WHAT)?;
        cursor.u64(WHAT)?;
        let end = cursor.u64(WHAT)?;
        let here = cursor.position() as u64;
        if start < here || end < start {
            return Err(VolumeError::corrupt(format!(
                "the grid \"{name}\", whose descriptor ends at byte {here}, lies from byte {start} to {end}"
            )));
        }
        cursor.seek(end, WHAT)?;
        let one = |component: Option<usize>| {
            let letter = component.map_or("", |component| [".x", ".y", ".z"][component]);
            let name = format!("{name}{letter}{number}");
            Self { name, tree_type: tree_type.clone(), component, instance_of: instance_of.clone(), start }
        };
        Ok(if tree_type == VECTORS { (0..3).map(|component| one(Some(component))).collect() } else { vec![one(None)] })
    }
}

/// Skips metadata; gives whether it says that the grid is stored as 16-bit floats. (A descriptor says so too, by the
/// suffix of the type, but it is the metadata that OpenVDB goes by.)
fn read_metadata(cursor: &mut Cursor) -> Result<bool, VolumeError> {
    const WHAT: &str = "metadata";
    let mut half = false;
    for _ in 0..cursor.u32(WHAT)? {
        let name = cursor.text(WHAT)?;
        cursor.text(WHAT)?;
        let size = cursor.u32(WHAT)?;
        let value = cursor.take(size.into(), WHAT)?;
        if name == "is_saved_as_half_float" {
            half = value.iter().any(|&byte| byte != 0);
        }
    }
    Ok(half)
}
