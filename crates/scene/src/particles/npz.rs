//! Particles from arrays of NumPy: a `.npz` file with the arrays `position` (n, 3), `radius` (n), `opacity` (n) and `color` (n, 3),
//! or a `.npy` file of one array (n, 3 to 8) with the columns x, y, z, radius, opacity, red, green, blue.
//!
//! A `.npz` file is a ZIP archive. Source of that format: <https://pkware.cachefly.net/webdocs/casestudies/APPNOTE.TXT>.

use std::borrow::Cow;
use std::io::Read as _;

use flate2::bufread::DeflateDecoder;

use super::Particles;
use super::columns::{COLUMNS, Rows};
use crate::description::BodyFile;
use crate::volume::{Budget, NpyTable, Stored, VolumeError};

/// Arrays of an archive, and where their columns are in a row.
const ARRAYS: [(&str, usize, u64); 4] = [("position", 0, 3), ("radius", 3, 1), ("opacity", 4, 1), ("color", 5, 3)];

/// The most entries of an archive that are looked at.
const MAX_ENTRIES: u16 = 1024;

/// Reads an array (n, 3 to 8).
pub(super) fn read_npy(bytes: &[u8], given: &BodyFile, budget: Budget) -> Result<Particles, VolumeError> {
    let table = NpyTable::new(bytes)?;
    let (count, width) = match table.shape[..] {
        [count, width @ 3..=8] => (count, width as usize),
        _ => return Err(shape("its array", &table, "(n, 3) to (n, 8)")),
    };
    let present = std::array::from_fn(|column| column < width);
    let mut rows = Rows::new(given, present, count, budget)?;
    let scale = color_scale(table.stored);
    for i in 0..count {
        let mut row = [0.0; COLUMNS];
        for (column, value) in row[..width].iter_mut().enumerate() {
            *value = table.value(i * width as u64 + column as u64, [count, width as u64]);
        }
        row[5..].iter_mut().for_each(|value| *value *= scale);
        rows.push(row, present[5])?;
    }
    Ok(rows.finish())
}

/// Reads an archive.
pub(super) fn read_npz(bytes: &[u8], given: &BodyFile, budget: Budget) -> Result<Particles, VolumeError> {
    let entries = entries(bytes)?;
    let mut unpacked = [const { None }; ARRAYS.len()];
    let mut left = budget.0;
    for (slot, (name, ..)) in unpacked.iter_mut().zip(ARRAYS) {
        if let Some(entry) = entries.iter().find(|entry| entry.name == format!("{name}.npy").as_bytes()) {
            let array = entry.unpack(bytes, left)?;
            if let Cow::Owned(array) = &array {
                left -= array.len() as u64;
            }
            *slot = Some(array);
        }
    }
    let mut tables = [const { None }; ARRAYS.len()];
    let mut present = [false; COLUMNS];
    let mut count = 0;
    for ((slot, array), (name, first, width)) in tables.iter_mut().zip(&unpacked).zip(ARRAYS) {
        let Some(array) = array else { continue };
        let table = NpyTable::new(array)?;
        let rows = match table.shape[..] {
            [n] if width == 1 => n,
            [n, w] if w == width => n,
            _ => return Err(shape(name, &table, if width == 1 { "(n)" } else { "(n, 3)" })),
        };
        if first == 0 {
            count = rows;
        }
        if rows != count {
            return Err(shape(name, &table, "as many rows as `position` has"));
        }
        present[first..first + width as usize].fill(true);
        *slot = Some(table);
    }
    let mut rows = Rows::new(given, present, count, Budget(left))?;
    for i in 0..count {
        let mut row = [0.0; COLUMNS];
        for (table, (_, first, width)) in tables.iter().zip(ARRAYS) {
            let Some(table) = table else { continue };
            let scale = if first == 5 { color_scale(table.stored) } else { 1.0 };
            for column in 0..width {
                row[first + column as usize] = scale * table.value(i * width + column, [count, width]);
            }
        }
        rows.push(row, present[5])?;
    }
    Ok(rows.finish())
}

/// What a stored colour is multiplied by.
fn color_scale(stored: Stored) -> f64 {
    match stored {
        Stored::U8 => 1.0 / 255.0,
        Stored::U16 => 1.0 / 65535.0,
        _ => 1.0,
    }
}

fn shape(name: &str, table: &NpyTable, accepted: &'static str) -> VolumeError {
    VolumeError::Unsupported { found: format!("{name} of shape {:?}", table.shape), accepted }
}

/// A file in an archive, as the central directory has it.
struct Entry<'a> {
    name: &'a [u8],
    method: u16,
    packed: u64,
    unpacked: u64,
    /// Where its local header begins.
    at: u64,
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes(bytes.get(at..at.checked_add(2)?)?.try_into().ok()?))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(bytes.get(at..at.checked_add(4)?)?.try_into().ok()?))
}

/// The central directory, which is found from the end of the file.
fn entries(bytes: &[u8]) -> Result<Vec<Entry<'_>>, VolumeError> {
    const END: &[u8] = b"PK\x05\x06";
    const END_SIZE: usize = 22;
    if !bytes.starts_with(&b"PK"[..bytes.len().min(2)]) || bytes.is_empty() {
        return Err(VolumeError::not("an NPZ", bytes, "PK"));
    }
    let truncated = || VolumeError::Truncated { what: "the archive's directory", at: bytes.len() as u64 };
    // A comment of up to 64 KiB may follow.
    let last = bytes.len().checked_sub(END_SIZE).ok_or_else(truncated)?;
    let first = last.saturating_sub(usize::from(u16::MAX));
    let end = (first..=last).rev().find(|&at| bytes[at..].starts_with(END)).ok_or_else(truncated)?;
    let count = u16_at(bytes, end + 10).ok_or_else(truncated)?;
    let mut at = u32_at(bytes, end + 16).ok_or_else(truncated)? as usize;
    if count > MAX_ENTRIES || at == u32::MAX as usize {
        let found = format!("an archive of {count} files or beyond 4 GiB");
        return Err(VolumeError::Unsupported { found, accepted: "at most 1024 files in 4 GiB" });
    }
    let mut entries = Vec::new();
    for _ in 0..count {
        let corrupt = || VolumeError::corrupt(format!("no entry of its directory is at byte {at}"));
        if u32_at(bytes, at) != Some(0x0201_4b50) {
            return Err(corrupt());
        }
        let short = |offset: usize| u16_at(bytes, at + offset).ok_or_else(corrupt);
        let long = |offset: usize| u32_at(bytes, at + offset).map(u64::from).ok_or_else(corrupt);
        let lengths = [short(28)?, short(30)?, short(32)?].map(usize::from);
        let name = bytes.get(at + 46..at + 46 + lengths[0]).ok_or_else(corrupt)?;
        if short(8)? & 1 == 1 {
            let found = format!("{} encrypted", name.escape_ascii());
            return Err(VolumeError::Unsupported { found, accepted: "arrays as NumPy writes them" });
        }
        entries.push(Entry { name, method: short(10)?, packed: long(20)?, unpacked: long(24)?, at: long(42)? });
        at += 46 + lengths.iter().sum::<usize>();
    }
    Ok(entries)
}

impl Entry<'_> {
    /// The file's bytes, at most `limit` of them.
    fn unpack<'a>(&self, bytes: &'a [u8], limit: u64) -> Result<Cow<'a, [u8]>, VolumeError> {
        let name = self.name.escape_ascii();
        let corrupt = || VolumeError::corrupt(format!("{name} is not where its directory says"));
        let at = self.at as usize;
        if u32_at(bytes, at) != Some(0x0403_4b50) {
            return Err(corrupt());
        }
        let [names, extra] = [26, 28].map(|offset| u16_at(bytes, at + offset).map(usize::from));
        let start = at + 30 + names.ok_or_else(corrupt)? + extra.ok_or_else(corrupt)?;
        let packed = bytes.get(start..).and_then(|rest| rest.get(..self.packed as usize)).ok_or_else(corrupt)?;
        if self.unpacked > limit {
            let (what, count) = ("bytes in an array of particles", self.unpacked);
            return Err(VolumeError::TooMany { what, count, bytes: self.unpacked, budget: limit });
        }
        match self.method {
            0 => Ok(Cow::Borrowed(packed)),
            8 => {
                let mut array = Vec::new();
                // A byte more than there should be shows that there are too many.
                let read = DeflateDecoder::new(packed).take(self.unpacked + 1).read_to_end(&mut array);
                match read {
                    Ok(length) if length as u64 == self.unpacked => Ok(Cow::Owned(array)),
                    _ => Err(VolumeError::corrupt(format!("{name} does not unpack to {} bytes", self.unpacked))),
                }
            }
            method => Err(VolumeError::Unsupported {
                found: format!("{name} packed by method {method}"),
                accepted: "stored or deflated arrays",
            }),
        }
    }
}
