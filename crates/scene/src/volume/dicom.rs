//! Reads a series of DICOM slices into a dense grid.
//!
//! Own code, as the crate `dicom-object` reserves and clears what the length of an element claims, up to 4 GiB each,
//! without a budget.

mod elements;
mod slice;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;

use glam::{DMat4, DVec3};
use slice::Slice;

use super::VolumeError;
use super::bricks::Slices;
use super::grid::{Budget, Filled, Grid, Sample, invertible, smallest};
use super::patient::{MILLIMETRE, RAS_FROM_LPS};
use crate::assets::Assets;

/// How far a slice may be from where an even spacing puts it, in parts of that spacing.
const UNEVEN: f64 = 0.01;

/// Reads a series of slices, each in a file of its own, from those of `files` that are DICOM images. `series` is its
/// SeriesInstanceUID; it may be left out where there is only one. One file after the other is in memory, beside the grid.
///
/// Values are `RescaleSlope * stored + RescaleIntercept` of each slice. The world is right-anterior-superior in metres,
/// by ImagePositionPatient, ImageOrientationPatient and PixelSpacing; slices are in the order of their positions, and
/// i runs along a row. A single slice is as thick as SliceThickness says, or a millimetre.
///
/// # Errors
/// [`VolumeError::Within`], with the file, for what is wrong with a slice, and [`VolumeError`]s of the series: several
/// without a name, unlike slices, slices that are missing or not evenly spaced. Accepted are slices that are not
/// compressed, of one integer a voxel.
pub fn read_dicom(
    files: &[String],
    series: Option<&str>,
    assets: &dyn Assets,
    budget: Budget,
) -> Result<Grid, VolumeError> {
    let mut slices = Vec::new();
    for file in files {
        slices.extend(with_file(file, assets, budget, |bytes| Slice::read(file, bytes))?);
    }
    let slices = chosen(slices, series, files.len())?;
    let (slices, steps) = stacked(slices)?;
    let first = &slices[0];
    let [x, y, z] = steps.map(|step| step.extend(0.0));
    let matrix = DMat4::from_cols(x, y, z, first.position.extend(1.0));
    let world_from_index = invertible(DMat4::from_scale(RAS_FROM_LPS * MILLIMETRE) * matrix, "positions")?;
    let dims = [u64::from(first.columns), u64::from(first.rows), slices.len() as u64];
    let voxels = smallest(|| fill(&slices, dims, assets, budget), || fill(&slices, dims, assets, budget))?;
    Ok(Grid::bricked(dims.map(|n| n as u32), voxels, world_from_index))
}

/// Gives `read` the bytes of a file.
fn with_file<T>(
    file: &str,
    assets: &dyn Assets,
    budget: Budget,
    read: impl FnOnce(&[u8]) -> Result<T, VolumeError>,
) -> Result<T, VolumeError> {
    let bytes = assets
        .read(file, budget.0)
        .map_err(|error| VolumeError::Unreadable { file: file.into(), reason: error.to_string() })?;
    read(&bytes).map_err(|source| VolumeError::Within { file: file.into(), source: Box::new(source) })
}

/// The slices of one series, at least one.
fn chosen(mut slices: Vec<Slice>, series: Option<&str>, files: usize) -> Result<Vec<Slice>, VolumeError> {
    let available: BTreeSet<_> = slices.iter().map(|slice| slice.series.clone()).collect();
    if available.is_empty() {
        return Err(VolumeError::Unsupported {
            found: format!("a folder of {files} files, none of which is a DICOM image"),
            accepted: "the slices of a series",
        });
    }
    match series {
        None if available.len() == 1 => {}
        Some(name) if available.contains(name) => slices.retain(|slice| slice.series == name),
        _ => return Err(VolumeError::WhichSeries { available: available.into_iter().collect() }),
    }
    Ok(slices)
}

/// The slices in the order of their positions along their normal, and the steps from a voxel to the next of its row,
/// its column and to the next slice \[mm\].
fn stacked(mut slices: Vec<Slice>) -> Result<(Vec<Slice>, [DVec3; 3]), VolumeError> {
    let first = slices[0].clone();
    let [x, y] = first.steps;
    for slice in &slices {
        let turned = slice.steps.iter().zip(first.steps).any(|(a, b)| a.distance(b) > 1e-3 * b.length());
        if turned || (slice.columns, slice.rows) != (first.columns, first.rows) {
            let found =
                format!("slices of different size, spacing or orientation ({:?} and {:?})", first.file, slice.file);
            return Err(VolumeError::Unsupported { found, accepted: "a series of parallel slices of one size" });
        }
    }
    let normal = x.cross(y).normalize_or_zero();
    slices.sort_by(|a, b| a.position.dot(normal).total_cmp(&b.position.dot(normal)));
    let mut gaps: Vec<_> = slices.windows(2).map(|pair| pair[1].position - pair[0].position).collect();
    if gaps.is_empty() {
        return Ok((slices, [x, y, normal * first.thickness]));
    }
    gaps.sort_by(|a, b| a.dot(normal).total_cmp(&b.dot(normal)));
    let usual = gaps[gaps.len() / 2];
    for pair in slices.windows(2) {
        let gap = pair[1].position - pair[0].position;
        // Neither a spacing of 0 is even, nor one that overflows.
        let even = gap.distance(usual) < UNEVEN * usual.length();
        if !even {
            return Err(VolumeError::UnevenSlices {
                files: [pair[0].file.clone(), pair[1].file.clone()],
                gap: gap.dot(normal),
                usual: usual.dot(normal),
            });
        }
    }
    let step = (slices[slices.len() - 1].position - slices[0].position) / gaps.len() as f64;
    Ok((slices, [x, y, step]))
}

fn fill<T: Sample>(
    slices: &[Slice],
    dims: [u64; 3],
    assets: &dyn Assets,
    budget: Budget,
) -> Result<Filled<T>, VolumeError> {
    let mut voxels = Slices::new(dims, budget)?;
    for slice in slices {
        with_file(&slice.file, assets, budget, |bytes| slice.append(bytes, &mut voxels))?;
        if !voxels.exact() {
            break;
        }
    }
    Ok(voxels.finish())
}
