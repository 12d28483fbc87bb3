//! The values of one node: compressed as a whole, and with its inactive values left out.
//!
//! Source of the format: OpenVDB, io/Compression.h and io/Compression.cc.

use half::f16;

use super::blosc;
use super::cursor::Cursor;
use crate::volume::VolumeError;

const ZIP: u32 = 1;
const ACTIVE_MASK: u32 = 2;
const BLOSC: u32 = 4;

/// One bit a value, the lowest of the first word being that of value 0.
pub(super) type Mask = [u64];

pub(super) fn is_on(mask: &Mask, i: usize) -> bool {
    mask[i / 64] >> (i % 64) & 1 == 1
}

pub(super) fn count_on(mask: &Mask) -> usize {
    mask.iter().map(|word| word.count_ones() as usize).sum()
}

pub(super) fn read_mask(cursor: &mut Cursor, mask: &mut Mask, what: &'static str) -> Result<(), VolumeError> {
    mask.iter_mut().try_for_each(|word| {
        *word = cursor.u64(what)?;
        Ok(())
    })
}

/// How a grid stores the values of its nodes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Encoding {
    compression: u32,
    /// Whether values are 16-bit floats (inactive values left out, and those of the root, never are).
    pub half: bool,
    /// Whether each node says how its inactive values are stored (since file version 222).
    pub node_codes: bool,
    /// Numbers of a value: one, or the three of a vector.
    numbers: usize,
    /// Which of them is read.
    number: usize,
}

impl Encoding {
    /// Errors: [`VolumeError::Unsupported`] for flags of `compression` that are not known.
    pub fn new(compression: u32, half: bool, node_codes: bool, component: Option<usize>) -> Result<Self, VolumeError> {
        if compression & !(ZIP | ACTIVE_MASK | BLOSC) != 0 {
            return Err(VolumeError::Unsupported {
                found: format!("compression flags {compression:#x}"),
                accepted: "1 (zip), 2 (active values), 4 (Blosc) and their sums",
            });
        }
        let numbers = if component.is_some() { 3 } else { 1 };
        Ok(Self { compression, half, node_codes, numbers, number: component.unwrap_or(0) })
    }

    /// Reads a value that stands by itself.
    pub fn value(&self, cursor: &mut Cursor, what: &'static str) -> Result<f32, VolumeError> {
        let mut value = 0.0;
        for number in 0..self.numbers {
            let next = cursor.f32(what)?;
            if number == self.number {
                value = next;
            }
        }
        Ok(value)
    }
}

/// Reads the values of nodes, one after the other, from a cursor.
pub(super) struct ValueReader {
    encoding: Encoding,
    background: f32,
    /// Of the stored values, decompressed.
    bytes: Vec<u8>,
    selection: Vec<u64>,
}

impl ValueReader {
    pub fn new(encoding: Encoding, background: f32) -> Self {
        Self { encoding, background, bytes: Vec::new(), selection: Vec::new() }
    }

    /// Reads all values of a node. `active` has a bit for each; where `out` is shorter than that (a node that stores no
    /// value for its children, before file version 222), no inactive values are left out.
    ///
    /// Errors: [`VolumeError::Truncated`], [`VolumeError::Corrupt`], [`VolumeError::Unsupported`].
    pub fn read(&mut self, cursor: &mut Cursor, active: &Mask, out: &mut [f32]) -> Result<(), VolumeError> {
        // How inactive values are stored. 0: all are the background; 1: all are its negative; 2: all are one value.
        // 3, 4, 5: a mask selects between the background's negative and the background, a value and the background, or
        // two values. 6: like the active ones.
        let code = if self.encoding.node_codes { cursor.u8("a node's values")? } else { 6 };
        if code > 6 {
            return Err(VolumeError::corrupt(format!(
                "a node stores its inactive values by code {code}; known are 0 to 6"
            )));
        }
        let mut inactive = [if code == 0 { self.background } else { -self.background }, self.background];
        if matches!(code, 2 | 4 | 5) {
            inactive[0] = self.encoding.value(cursor, "an inactive value")?;
        }
        if code == 5 {
            inactive[1] = self.encoding.value(cursor, "an inactive value")?;
        }
        self.selection.clear();
        self.selection.resize(active.len(), 0);
        if matches!(code, 3..=5) {
            read_mask(cursor, &mut self.selection, "a node's selection of inactive values")?;
        }

        let all = self.encoding.compression & ACTIVE_MASK == 0 || code == 6;
        let stored = if all { out.len() } else { count_on(active) };
        self.read_stored(cursor, stored)?;
        let Encoding { half, numbers, number, .. } = self.encoding;
        let value = |i: usize| {
            let i = i * numbers + number;
            match half {
                true => f16::from_le_bytes([self.bytes[2 * i], self.bytes[2 * i + 1]]).to_f32(),
                false => {
                    let bytes = &self.bytes[4 * i..];
                    f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
                }
            }
        };
        let mut next = 0;
        for (i, out) in out.iter_mut().enumerate() {
            *out = if all || is_on(active, i) {
                next += 1;
                value(next - 1)
            } else {
                inactive[usize::from(is_on(&self.selection, i))]
            };
        }
        Ok(())
    }

    /// Decompresses `count` stored values into `self.bytes`.
    fn read_stored(&mut self, cursor: &mut Cursor, count: usize) -> Result<(), VolumeError> {
        const WHAT: &str = "a node's values";
        let width = if self.encoding.half { 2 } else { 4 };
        self.bytes.clear();
        // OpenVDB writes the length of no 32-bit values, but not that of no 16-bit values.
        if self.encoding.half && count == 0 {
            return Ok(());
        }
        let size = count * width * self.encoding.numbers;
        if self.encoding.compression & (ZIP | BLOSC) == 0 {
            self.bytes.extend_from_slice(cursor.take(size as u64, WHAT)?);
            return Ok(());
        }
        // A length that is not positive is that of bytes which did not compress.
        let length = cursor.i64(WHAT)?;
        let chunk = cursor.take(length.unsigned_abs(), WHAT)?;
        if length <= 0 {
            if chunk.len() != size {
                return Err(VolumeError::corrupt(format!(
                    "a node stores {} bytes of values; expected are {size}",
                    chunk.len()
                )));
            }
            self.bytes.extend_from_slice(chunk);
            return Ok(());
        }
        self.bytes.resize(size, 0);
        if self.encoding.compression & BLOSC != 0 {
            blosc::decompress(chunk, &mut self.bytes)
        } else if blosc::zlib(chunk, &mut self.bytes) {
            Ok(())
        } else {
            Err(VolumeError::corrupt(format!("a node's zip stream does not hold the {size} bytes of its values")))
        }
    }
}
