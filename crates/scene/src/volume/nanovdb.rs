//! Reads one grid of a NanoVDB file.
//!
//! Source of the format: NanoVDB, NanoVDB.h and io/IO.h (version 32). A file has segments: a header, what there is to
//! know of each grid, and the grids, each as NanoVDB has it in memory; [`tree`] reads that.

#[cfg(test)]
mod tests;
mod tree;
mod values;

use glam::{DMat3, DMat4, DVec3};
use tree::{Bytes, Extent, Tree};
use values::VEC3F;

use super::VolumeError;
use super::bricks::Bricks;
use super::grid::{Budget, Filled, Grid, Sample, invertible, smallest};
use super::vdb::blosc;

/// The version whose layout is known here, in the upper 11 bits.
const MAJOR: u32 = 32;
const HEADER: usize = 16;
const DESCRIPTOR: usize = 176;
/// Blosc compresses in parts of this size.
const BLOSC_PART: usize = 1 << 30;
/// Neither DEFLATE nor LZ4 makes more bytes than this of one.
const MAX_RATIO: u64 = 1032;

/// Reads the grid named `grid` of a NanoVDB file, the first of that name. A grid of vectors is three, `.x`, `.y` and `.z`
/// after its name: those of a grid `Cd` of colours are `Cd.x`, `Cd.y` and `Cd.z`.
///
/// As with [`read_vdb`](super::read_vdb), the result spans the bounding box of the active voxels and active tiles, and
/// one voxel more on each side, which holds the background; a world unit is taken as a metre. A compressed grid is
/// decompressed as a whole: it and the result must fit into the budget together.
///
/// # Errors
/// Any [`VolumeError`] but those of other formats. Accepted are grids of 16, 32 and 64-bit floats, of three 32-bit
/// floats, and of types Fp4, Fp8, Fp16 and FpN, not compressed or by zip or Blosc; 64-bit floats are rounded to 32 bits.
pub fn read_nanovdb(bytes: &[u8], grid: &str, budget: Budget) -> Result<Grid, VolumeError> {
    let descriptors = descriptors(bytes)?;
    let descriptor = descriptors.iter().find(|descriptor| descriptor.name == grid).ok_or_else(|| {
        let available = descriptors.iter().map(|descriptor| descriptor.name.clone()).collect();
        VolumeError::NoSuchGrid { name: grid.into(), available }
    })?;
    let unpacked;
    let (memory, left) = match descriptor.codec {
        0 => (descriptor.packed, budget),
        _ => {
            unpacked = descriptor.unpack(budget)?;
            (unpacked.as_slice(), Budget(budget.0 - unpacked.len() as u64))
        }
    };
    in_memory(Bytes(memory), descriptor.component, left)
}

/// Reads the grid at `memory`; of vectors, the component that is given.
fn in_memory(memory: Bytes, component: Option<usize>, budget: Budget) -> Result<Grid, VolumeError> {
    let tree = Tree::new(memory, component)?;
    let extent = Extent::of(&tree)?;
    let voxels = smallest(|| fill(&tree, &extent, budget), || fill(&tree, &extent, budget))?;
    let origin = DMat4::from_translation(DVec3::from_array(extent.origin().map(|n| n as f64)));
    let world_from_index = invertible(world_from_file(memory)? * origin, "map")?;
    Ok(Grid::bricked(extent.dims().map(|n| n as u32), voxels, world_from_index))
}

/// Names of all grids of a NanoVDB file, in its order, those of vectors by component, also of those that [`read_nanovdb`] does not accept.
///
/// # Errors
/// [`VolumeError`]s of a malformed file; grids themselves are not looked at.
pub fn nanovdb_grid_names(bytes: &[u8]) -> Result<Vec<String>, VolumeError> {
    Ok(descriptors(bytes)?.into_iter().map(|descriptor| descriptor.name).collect())
}

fn fill<T: Sample>(tree: &Tree, extent: &Extent, budget: Budget) -> Result<Filled<T>, VolumeError> {
    let (background, exact) = T::store(finite(tree.background()?, extent.origin())?);
    let mut filled = Filled { bricks: Bricks::uniform(extent.dims(), background, budget)?, exact };
    let mut store = |low, high, value| {
        let (voxel, exact) = T::store(finite(value, low)?);
        filled.exact &= exact;
        if !filled.exact {
            return Ok(());
        }
        filled.bricks.fill(extent.place(low), extent.place(high), voxel)
    };
    tree.walk(&mut |cell| {
        let Some((low, high)) = extent.within(cell) else { return Ok(()) };
        if let Some(value) = cell.tile() {
            return store(low, high, value);
        }
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    store([x, y, z], [x, y, z], cell.value([x, y, z])?)?;
                }
            }
        }
        Ok(())
    })?;
    filled.bricks.settle();
    Ok(filled)
}

fn finite(value: f64, index: [i64; 3]) -> Result<f32, VolumeError> {
    let single = value as f32;
    if single.is_finite() { Ok(single) } else { Err(VolumeError::NotFinite { index, value }) }
}

/// The matrix is the file's by rows, in double precision.
fn world_from_file(memory: Bytes) -> Result<DMat4, VolumeError> {
    const MATRIX: usize = 384;
    const VECTOR: usize = 528;
    let number = |at| Ok(f64::from_le_bytes(memory.array(at)?));
    let mut rows = [0.0; 9];
    for (i, entry) in rows.iter_mut().enumerate() {
        *entry = number(MATRIX + 8 * i)?;
    }
    let vector = DVec3::new(number(VECTOR)?, number(VECTOR + 8)?, number(VECTOR + 16)?);
    Ok(DMat4::from_mat3_translation(DMat3::from_cols_array(&rows).transpose(), vector))
}

/// A grid, as its file describes it.
struct Descriptor<'a> {
    name: String,
    /// Of vectors, the one that is meant.
    component: Option<usize>,
    /// Bytes in memory.
    size: u64,
    /// 0 for none, 1 for zip, 2 for Blosc.
    codec: u16,
    packed: &'a [u8],
}

fn descriptors(bytes: &[u8]) -> Result<Vec<Descriptor<'_>>, VolumeError> {
    let file = Bytes(bytes);
    let mut descriptors = Vec::new();
    let mut at = 0;
    while at < bytes.len() || at == 0 {
        let magic: &[u8] = bytes.get(at..).unwrap_or(&[]);
        if !magic.starts_with(b"NanoVDB0") && !magic.starts_with(b"NanoVDB2") {
            return Err(VolumeError::not(
                "a NanoVDB",
                magic,
                "NanoVDB0 or NanoVDB2, as nanovdb::io::writeGrid makes it",
            ));
        }
        let version = file.u32(at + 8)?;
        if version >> 21 != MAJOR {
            let found = format!("a NanoVDB file of version {}.{}", version >> 21, version >> 10 & 0x7ff);
            return Err(VolumeError::Unsupported { found, accepted: "versions 32.x" });
        }
        let count = u16::from_le_bytes(file.array(at + 12)?);
        at += HEADER;
        let mut grids = Vec::new();
        for _ in 0..count {
            let [size, packed] = [u64::from_le_bytes(file.array(at)?), u64::from_le_bytes(file.array(at + 8)?)];
            let kind = file.u32(at + 32)?;
            let length = file.u32(at + 136)? as usize;
            let codec = u16::from_le_bytes(file.array(at + 168)?);
            let name = file.slice(at + DESCRIPTOR, length)?;
            let name = String::from_utf8_lossy(name).trim_end_matches('\0').to_owned();
            at += DESCRIPTOR + length;
            grids.push((Descriptor { name, component: None, size, codec, packed: &[] }, kind, packed));
        }
        for (mut descriptor, kind, packed) in grids {
            let packed = usize::try_from(packed).unwrap_or(usize::MAX);
            descriptor.packed = file.slice(at, packed)?;
            at += packed;
            if kind != VEC3F {
                descriptors.push(descriptor);
                continue;
            }
            for (component, letter) in ["x", "y", "z"].into_iter().enumerate() {
                let name = format!("{}.{letter}", descriptor.name);
                descriptors.push(Descriptor { name, component: Some(component), ..descriptor });
            }
        }
    }
    Ok(descriptors)
}

impl Descriptor<'_> {
    /// The grid's bytes, within the budget.
    fn unpack(&self, budget: Budget) -> Result<Vec<u8>, VolumeError> {
        if self.size > budget.0 {
            let found = format!("a grid of {} bytes, with a budget of {}", self.size, budget.0);
            return Err(VolumeError::Unsupported { found, accepted: "one that fits" });
        }
        if self.size > MAX_RATIO.saturating_mul(self.packed.len() as u64) {
            return Err(VolumeError::Truncated { what: "a compressed grid", at: self.packed.len() as u64 });
        }
        let size = usize::try_from(self.size).unwrap_or(usize::MAX);
        let mut unpacked = Vec::new();
        unpacked.try_reserve_exact(size).map_err(|_| VolumeError::OutOfMemory { bytes: self.size })?;
        unpacked.resize(size, 0);
        let mut packed = Bytes(self.packed);
        let mut next = || {
            let size = u64::from_le_bytes(packed.array(0)?);
            let part = packed.slice(8, usize::try_from(size).unwrap_or(usize::MAX))?;
            packed = Bytes(&packed.0[8 + part.len()..]);
            Ok(part)
        };
        match self.codec {
            1 if blosc::zlib(next()?, &mut unpacked) => {}
            1 => return Err(VolumeError::corrupt("a grid's zip stream is malformed")),
            2 => {
                for part in unpacked.chunks_mut(BLOSC_PART) {
                    blosc::decompress(next()?, part)?;
                }
            }
            codec => {
                let found = format!("a grid compressed by codec {codec}");
                return Err(VolumeError::Unsupported { found, accepted: "0 (none), 1 (zip), 2 (Blosc)" });
            }
        }
        Ok(unpacked)
    }
}
