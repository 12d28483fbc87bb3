//! Reads a NumPy array into a dense grid.
//!
//! Source of the format: <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>.

use glam::{DMat4, DVec3};

use super::array::{Array, Coding, Packed, centred};
use super::grid::{Budget, Grid, invertible};
use super::{Stored, VolumeError};

#[cfg(test)]
mod tests;

const MAGIC: &[u8] = b"\x93NUMPY";
/// The longest header that is looked at; those of plain arrays take 128 bytes.
const MAX_HEADER: u64 = 1 << 16;

/// Reads an array `a[z][y][x]` of a `.npy` file of version 1, 2 or 3.
///
/// The file does not say how large its voxels are: the grid is centred at the origin, and its longest edge, from voxel
/// face to voxel face, is a metre. An array in Fortran order is the same grid as its copy in C order.
///
/// # Errors
/// Any [`VolumeError`] but those of other formats. Accepted are arrays of three axes, of booleans, integers of 8 to 64
/// bits and floats of 16, 32, 64 bits, in either byte order.
pub fn read_npy(bytes: &[u8], budget: Budget) -> Result<Grid, VolumeError> {
    let (header, start) = header(bytes)?;
    let Header { stored, big_endian, fortran, shape } = Header::parse(header)?;
    let Some([nz, ny, nx]) = <[u64; 3]>::try_from(shape.as_slice()).ok().filter(|shape| shape.iter().all(|&n| n > 0))
    else {
        return Err(VolumeError::Unsupported {
            found: format!("an array of shape {}", tuple(&shape)),
            accepted: "three axes [z][y][x] of at least one voxel",
        });
    };
    let spacing = DVec3::splat(1.0 / nx.max(ny).max(nz) as f64);
    let (dims, turn) = match fortran {
        false => ([nx, ny, nz], DMat4::IDENTITY),
        // z is fastest: what runs along the grid's first axis runs along the world's last.
        true => (
            [nz, ny, nx],
            DMat4::from_cols_array_2d(&[
                [0.0, 0.0, 1.0, 0.0],
                [0.0, 1.0, 0.0, 0.0],
                [1.0, 0.0, 0.0, 0.0],
                [0.0, 0.0, 0.0, 1.0],
            ]),
        ),
    };
    let array = Array { dims, stored, big_endian, start, slope: 1.0, intercept: 0.0 };
    let voxels = array.read(Packed { bytes, coding: Coding::Plain }, budget)?;
    let world_from_index = invertible(turn * centred(dims, spacing), "shape")?;
    Ok(Grid::bricked(dims.map(|n| n as u32), voxels, world_from_index))
}

/// An array of any shape, whose numbers are read one by one.
pub(crate) struct NpyTable<'a> {
    /// How a number is stored.
    pub stored: Stored,
    /// Numbers along each axis.
    pub shape: Vec<u64>,
    big_endian: bool,
    fortran: bool,
    numbers: &'a [u8],
}

impl<'a> NpyTable<'a> {
    /// The array of a `.npy` file, all of which is there.
    pub fn new(bytes: &'a [u8]) -> Result<Self, VolumeError> {
        let (header, start) = header(bytes)?;
        let Header { stored, big_endian, fortran, shape } = Header::parse(header)?;
        let numbers = &bytes[start as usize..];
        let needed = shape.iter().fold(stored.size() as u64, |size, &n| size.saturating_mul(n));
        if needed > numbers.len() as u64 {
            return Err(VolumeError::Truncated { what: "the numbers of an array", at: bytes.len() as u64 });
        }
        Ok(Self { stored, shape, big_endian, fortran, numbers })
    }

    /// The number at a place in C order of an array of rows and columns.
    pub fn value(&self, place: u64, [rows, columns]: [u64; 2]) -> f64 {
        let place = if self.fortran { place % columns * rows + place / columns } else { place };
        let (at, size) = (place as usize * self.stored.size(), self.stored.size());
        self.stored.decode(&self.numbers[at..at + size], self.big_endian)
    }
}

/// A shape as Python writes it.
fn tuple(shape: &[u64]) -> String {
    let sizes = shape.iter().map(u64::to_string).collect::<Vec<_>>().join(", ");
    if shape.len() == 1 { format!("({sizes},)") } else { format!("({sizes})") }
}

/// The header's text, and where the voxels begin.
fn header(bytes: &[u8]) -> Result<(&str, u64), VolumeError> {
    const WHAT: &str = "the header";
    let truncated = || VolumeError::Truncated { what: WHAT, at: bytes.len() as u64 };
    if !bytes.starts_with(&MAGIC[..bytes.len().min(MAGIC.len())]) {
        return Err(VolumeError::not("a NumPy", bytes, "\\x93NUMPY"));
    }
    let (major, length, start) = match *bytes.get(6..).unwrap_or(&[]) {
        [1, _, a, b, ..] => (1, u64::from(u16::from_le_bytes([a, b])), 10),
        [major @ 2..=3, _, a, b, c, d, ..] => (major, u64::from(u32::from_le_bytes([a, b, c, d])), 12),
        [] | [1..=3, ..] => return Err(truncated()),
        [major, ..] => {
            return Err(VolumeError::Unsupported {
                found: format!("a NumPy file of version {major}"),
                accepted: "versions 1, 2, 3",
            });
        }
    };
    if length > MAX_HEADER {
        return Err(VolumeError::corrupt(format!("its header has {length} bytes; at most {MAX_HEADER} are read")));
    }
    let text = bytes[start..].get(..length as usize).ok_or_else(truncated)?;
    let text = str::from_utf8(text).ok().filter(|text| major == 3 || text.is_ascii());
    Ok((text.ok_or_else(|| VolumeError::corrupt("its header is no text"))?, start as u64 + length))
}

/// What a header says of the array.
struct Header {
    stored: Stored,
    big_endian: bool,
    /// Whether the first axis is the fastest.
    fortran: bool,
    shape: Vec<u64>,
}

impl Header {
    /// Reads a Python dictionary, `{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3, 4), }`.
    fn parse(text: &str) -> Result<Self, VolumeError> {
        let corrupt = || {
            let text: String = text.trim_end().chars().take(80).collect();
            VolumeError::corrupt(format!(
                "its header is {text:?}; it must be {{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3, 4), }}"
            ))
        };
        let (mut descr, mut fortran, mut shape) = (None, None, None);
        let inner = text.trim().strip_prefix('{').and_then(|text| text.strip_suffix('}'));
        let mut rest = inner.ok_or_else(corrupt)?.trim();
        while !rest.is_empty() {
            let (key, value) = rest.split_once(':').ok_or_else(corrupt)?;
            let end = match value.trim_start().chars().next() {
                Some('(') => value.find(')').map(|end| end + 1),
                Some('[') => value.rfind(']').map(|end| end + 1),
                _ => value.find(',').or(Some(value.len())),
            };
            let (value, after) = value.split_at(end.ok_or_else(corrupt)?);
            let slot = match key.trim().trim_matches(['\'', '"']) {
                "descr" => &mut descr,
                "fortran_order" => &mut fortran,
                "shape" => &mut shape,
                _ => return Err(corrupt()),
            };
            *slot = Some(value.trim());
            rest = after.trim_start().trim_start_matches(',').trim();
        }
        let (Some(descr), Some(fortran), Some(shape)) = (descr, fortran, shape) else { return Err(corrupt()) };

        let fortran = match fortran {
            "True" => true,
            "False" => false,
            _ => return Err(corrupt()),
        };
        let sizes = shape.strip_prefix('(').and_then(|shape| shape.strip_suffix(')')).ok_or_else(corrupt)?;
        let sizes = sizes.trim_end().trim_end_matches(',').split(',').map(str::trim).filter(|size| !size.is_empty());
        let shape = sizes.map(|size| size.parse().map_err(|_| corrupt())).collect::<Result<Vec<u64>, _>>()?;
        let (stored, big_endian) = stored(descr.trim_matches(['\'', '"']))?;
        Ok(Self { stored, big_endian, fortran, shape })
    }
}

/// The type and whether it is big-endian.
fn stored(descr: &str) -> Result<(Stored, bool), VolumeError> {
    let unsupported = || VolumeError::Unsupported {
        found: format!("voxels of dtype {descr}"),
        accepted: "bool, int8 to int64, uint8 to uint64, float16, float32, float64",
    };
    let order = descr.chars().next().filter(|order| "<>|=".contains(*order)).ok_or_else(unsupported)?;
    let stored = match &descr[1..] {
        "b1" | "u1" => Stored::U8,
        "i1" => Stored::I8,
        "u2" => Stored::U16,
        "i2" => Stored::I16,
        "u4" => Stored::U32,
        "i4" => Stored::I32,
        "u8" => Stored::U64,
        "i8" => Stored::I64,
        "f2" => Stored::F16,
        "f4" => Stored::F32,
        "f8" => Stored::F64,
        _ => return Err(unsupported()),
    };
    Ok((stored, order == '>'))
}
