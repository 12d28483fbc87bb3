//! One file of a DICOM series.
//!
//! Source of the format: DICOM PS3.3, C.7.6.2 (plane), C.7.6.3 (pixels), C.11.1 (rescale).

use glam::DVec3;

use super::elements::{is_dicom, visit};
use crate::volume::VolumeError;
use crate::volume::bricks::Slices;
use crate::volume::grid::Sample;

/// A slice of a series, as its file says it is.
#[derive(Clone, Debug, Default)]
pub struct Slice {
    pub file: String,
    /// SeriesInstanceUID.
    pub series: String,
    pub columns: u16,
    pub rows: u16,
    /// Centre of the first voxel, left-posterior-superior \[mm\].
    pub position: DVec3,
    /// From a voxel to the next of its row, and to the next of its column \[mm\].
    pub steps: [DVec3; 2],
    /// SliceThickness \[mm\].
    pub thickness: f64,
    bits: Bits,
    slope: f64,
    intercept: f64,
    /// Byte offset of the voxels.
    start: usize,
}

/// Where a value's bits are.
#[derive(Clone, Copy, Debug, Default)]
struct Bits {
    allocated: u16,
    stored: u16,
    high: u16,
    signed: bool,
}

impl Slice {
    /// Reads all but the voxels; `None` if the file is no DICOM image.
    pub fn read(file: &str, bytes: &[u8]) -> Result<Option<Self>, VolumeError> {
        if !is_dicom(bytes) {
            return Ok(None);
        }
        let mut slice = Slice { file: file.into(), thickness: 1.0, slope: 1.0, ..Self::default() };
        let mut pixels = None;
        let (mut position, mut orientation, mut spacing) = (None, None, None);
        visit(bytes, |tag, value, at| {
            match tag {
                0x0018_0050 => slice.thickness = numbers::<1>("SliceThickness", value)?[0],
                0x0020_000e => slice.series = text(value),
                0x0020_0032 => position = Some(numbers::<3>("ImagePositionPatient", value)?),
                0x0020_0037 => orientation = Some(numbers::<6>("ImageOrientationPatient", value)?),
                0x0028_0002 => only(integer(value) == Some(1), "more than one value a voxel (SamplesPerPixel)")?,
                0x0028_0004 => only(value.starts_with(b"MONOCHROME"), "colours (PhotometricInterpretation)")?,
                0x0028_0008 => only(numbers::<1>("NumberOfFrames", value)?[0] == 1.0, "several frames in a file")?,
                0x0028_0010 => slice.rows = integer(value).unwrap_or(0),
                0x0028_0011 => slice.columns = integer(value).unwrap_or(0),
                0x0028_0030 => spacing = Some(numbers::<2>("PixelSpacing", value)?),
                0x0028_0100 => slice.bits.allocated = integer(value).unwrap_or(0),
                0x0028_0101 => slice.bits.stored = integer(value).unwrap_or(0),
                0x0028_0102 => slice.bits.high = integer(value).unwrap_or(0),
                0x0028_0103 => slice.bits.signed = integer(value) == Some(1),
                0x0028_1052 => slice.intercept = numbers::<1>("RescaleIntercept", value)?[0],
                0x0028_1053 => slice.slope = numbers::<1>("RescaleSlope", value)?[0],
                0x0028_3000 => only(false, "a table of values (ModalityLUTSequence)")?,
                0x7fe0_0010 => pixels = Some((value.len() as u64, at)),
                _ => {}
            }
            Ok(())
        })?;
        let Some((length, start)) = pixels else { return Ok(None) };

        let missing = |name| VolumeError::corrupt(format!("it has no {name}"));
        let [x, y, z] = position.ok_or_else(|| missing("ImagePositionPatient"))?;
        let [a, b, c, d, e, f] = orientation.ok_or_else(|| missing("ImageOrientationPatient"))?;
        let [between_rows, between_columns] = spacing.ok_or_else(|| missing("PixelSpacing"))?;
        slice.position = DVec3::new(x, y, z);
        slice.steps = [DVec3::new(a, b, c) * between_columns, DVec3::new(d, e, f) * between_rows];
        slice.start = start;
        let Bits { allocated, stored, high, .. } = slice.bits;
        if ![8, 16, 32].contains(&allocated) || stored == 0 || high >= allocated || stored > high + 1 {
            return Err(VolumeError::Unsupported {
                found: format!("voxels of {allocated} bits, {stored} stored up to bit {high}"),
                accepted: "8, 16 or 32 bits, all those stored among them",
            });
        }
        let needed = u64::from(slice.rows) * u64::from(slice.columns) * u64::from(allocated / 8);
        if needed == 0 || length < needed {
            let (rows, columns) = (slice.rows, slice.columns);
            return Err(VolumeError::corrupt(format!(
                "its PixelData has {length} bytes; {rows} rows of {columns} voxels need {needed}, and at least 1"
            )));
        }
        Ok(Some(slice))
    }

    /// Appends the voxels, which `bytes` has, to `all`, until one is not exact.
    pub fn append<T: Sample>(&self, bytes: &[u8], all: &mut Slices<T>) -> Result<(), VolumeError> {
        let Bits { allocated, stored, high, signed } = self.bits;
        let size = usize::from(allocated / 8);
        let length = usize::from(self.columns) * usize::from(self.rows) * size;
        let voxels = bytes.get(self.start..).and_then(|rest| rest.get(..length));
        let voxels = voxels.ok_or(VolumeError::Truncated { what: "the voxels", at: bytes.len() as u64 })?;
        for voxel in voxels.chunks_exact(size) {
            let whole = voxel.iter().rev().fold(0u64, |value, &byte| value << 8 | u64::from(byte));
            let value = (whole >> (high + 1 - stored) & ((1 << stored) - 1)) as i64;
            let value = if signed && value >> (stored - 1) == 1 { value - (1 << stored) } else { value };
            all.push_value(self.slope * value as f64 + self.intercept)?;
            if !all.exact() {
                break;
            }
        }
        Ok(())
    }
}

fn only(holds: bool, found: &str) -> Result<(), VolumeError> {
    if holds {
        return Ok(());
    }
    let accepted = "slices of one value a voxel, each in a file of its own";
    Err(VolumeError::Unsupported { found: found.into(), accepted })
}

fn integer(value: &[u8]) -> Option<u16> {
    value.first_chunk().map(|bytes| u16::from_le_bytes(*bytes))
}

fn text(value: &[u8]) -> String {
    String::from_utf8_lossy(value).trim_end_matches(['\0', ' ']).to_owned()
}

/// Decimal numbers, apart by backslashes.
fn numbers<const N: usize>(name: &str, value: &[u8]) -> Result<[f64; N], VolumeError> {
    let text = text(value);
    let numbers: Option<Vec<f64>> =
        text.split('\\').map(|number| number.trim().parse().ok().filter(|number: &f64| number.is_finite())).collect();
    let numbers = numbers.and_then(|numbers| numbers.try_into().ok());
    numbers.ok_or_else(|| {
        let found: String = text.chars().take(80).collect();
        VolumeError::corrupt(format!("its {name} is {found:?}; it must have {N} finite numbers"))
    })
}
