//! Arrays of numbers in files: what the dense formats share. They differ in their headers only.

use std::io::{ErrorKind, Read};

use flate2::bufread::{MultiGzDecoder, ZlibDecoder};
use glam::{DMat4, DVec3};
use half::f16;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::VolumeError;
use super::bricks::Slices;
use super::grid::{Bricked, Budget, Filled, Sample, smallest};

/// DEFLATE makes no more bytes than this of one.
const MAX_DEFLATE_RATIO: u64 = 1032;

/// How a file stores its voxels, x fastest.
pub(super) struct Array {
    pub dims: [u64; 3],
    pub stored: Stored,
    pub big_endian: bool,
    /// Bytes before the first voxel, unpacked.
    pub start: u64,
    /// A voxel's value is `slope * stored + intercept`.
    pub slope: f64,
    pub intercept: f64,
}

impl Array {
    /// Reads all voxels of `packed`.
    ///
    /// Errors: [`VolumeError::Truncated`], [`VolumeError::TooLarge`], [`VolumeError::OutOfMemory`] before anything is
    /// allocated; then [`VolumeError::NotFinite`], and those of a malformed stream.
    pub fn read(&self, packed: Packed, budget: Budget) -> Result<Bricked, VolumeError> {
        let available = packed.most();
        if self.end() > available {
            return Err(VolumeError::Truncated { what: "the voxels", at: available });
        }
        smallest(|| self.fill(packed, budget), || self.fill(packed, budget))
    }

    /// Where the voxels end, in bytes, unpacked (saturated).
    pub fn end(&self) -> u64 {
        self.dims.iter().fold(self.stored.size() as u64, |size, &n| size.saturating_mul(n)).saturating_add(self.start)
    }

    fn fill<T: Sample>(&self, packed: Packed, budget: Budget) -> Result<Filled<T>, VolumeError> {
        let mut slices = Slices::new(self.dims, budget)?;
        let mut stream = packed.open();
        stream.skip(self.start, "what stands before the voxels")?;
        self.append(&mut stream, &mut slices)?;
        if slices.exact() {
            stream.finish()?;
        }
        Ok(slices.finish())
    }

    /// Reads all voxels of `text`: numbers in decimal, apart by white space or commas. Where they start, how they are
    /// stored and in which order of bytes does not matter then.
    ///
    /// Errors: as those of [`read`](Self::read); [`VolumeError::Corrupt`] for a word that is no number.
    pub fn read_text(&self, text: &[u8], budget: Budget) -> Result<Bricked, VolumeError> {
        let count = self.dims.iter().fold(1u64, |count, &n| count.saturating_mul(n));
        // A number and what parts it from the next take two bytes at least.
        if count > (text.len() as u64).div_ceil(2) {
            return Err(VolumeError::Truncated { what: "the voxels", at: text.len() as u64 });
        }
        smallest(|| self.fill_text(text, count, budget), || self.fill_text(text, count, budget))
    }

    fn fill_text<T: Sample>(&self, text: &[u8], count: u64, budget: Budget) -> Result<Filled<T>, VolumeError> {
        let mut slices = Slices::new(self.dims, budget)?;
        let mut words = text.split(|c| c.is_ascii_whitespace() || *c == b',').filter(|word| !word.is_empty());
        for _ in 0..count {
            let word = words.next().ok_or(VolumeError::Truncated { what: "the voxels", at: text.len() as u64 })?;
            let stored: Option<f64> = str::from_utf8(word).ok().and_then(|word| word.parse().ok());
            let stored = stored.ok_or_else(|| {
                let word = word[..word.len().min(20)].escape_ascii();
                VolumeError::corrupt(format!("a voxel is \"{word}\"; it must be a number"))
            })?;
            slices.push_value(self.slope * stored + self.intercept)?;
            if !slices.exact() {
                break;
            }
        }
        Ok(slices.finish())
    }

    /// Appends the voxels to `slices`, until one is not exact. `stream` is at the first.
    pub fn append<T: Sample>(&self, stream: &mut Stream, slices: &mut Slices<T>) -> Result<(), VolumeError> {
        let mut left = self.dims.iter().product::<u64>();
        let size = self.stored.size();
        let mut buffer = [0; 1 << 14];
        while left > 0 {
            let count = left.min((buffer.len() / size) as u64);
            let part = &mut buffer[..count as usize * size];
            stream.read(part, "the voxels")?;
            for stored in part.chunks_exact(size) {
                let value = self.slope * self.stored.decode(stored, self.big_endian) + self.intercept;
                slices.push_value(value)?;
                if !slices.exact() {
                    return Ok(());
                }
            }
            left -= count;
        }
        Ok(())
    }
}

/// The map from indices to a world whose origin is the middle of the grid: where a file does not say where it is.
pub(super) fn centred(dims: [u64; 3], spacing: DVec3) -> DMat4 {
    let middle = DVec3::from_array(dims.map(|n| (n as f64 - 1.0) / 2.0));
    DMat4::from_scale(spacing) * DMat4::from_translation(-middle)
}

/// How a file stores a number.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Stored {
    /// Unsigned integer of 8 bits.
    U8,
    /// Signed integer of 8 bits.
    I8,
    /// Unsigned integer of 16 bits.
    U16,
    /// Signed integer of 16 bits.
    I16,
    /// Unsigned integer of 32 bits.
    U32,
    /// Signed integer of 32 bits.
    I32,
    /// Unsigned integer of 64 bits.
    U64,
    /// Signed integer of 64 bits.
    I64,
    /// Float of 16 bits.
    F16,
    /// Float of 32 bits.
    F32,
    /// Float of 64 bits.
    F64,
}

impl Stored {
    /// Bytes a number.
    pub fn size(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 | Self::F16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }

    /// The value of `bytes`, of which there are [`size`](Self::size).
    pub(crate) fn decode(self, bytes: &[u8], big_endian: bool) -> f64 {
        let mut ordered = [0; 8];
        let ordered = &mut ordered[..bytes.len()];
        ordered.copy_from_slice(bytes);
        if big_endian {
            ordered.reverse();
        }
        match self {
            Self::U8 => f64::from(ordered[0]),
            Self::I8 => f64::from(ordered[0] as i8),
            Self::U16 => f64::from(u16::from_le_bytes(array(ordered))),
            Self::I16 => f64::from(i16::from_le_bytes(array(ordered))),
            Self::U32 => f64::from(u32::from_le_bytes(array(ordered))),
            Self::I32 => f64::from(i32::from_le_bytes(array(ordered))),
            Self::U64 => u64::from_le_bytes(array(ordered)) as f64,
            Self::I64 => i64::from_le_bytes(array(ordered)) as f64,
            Self::F16 => f64::from(f16::from_le_bytes(array(ordered))),
            Self::F32 => f64::from(f32::from_le_bytes(array(ordered))),
            Self::F64 => f64::from_le_bytes(array(ordered)),
        }
    }
}

fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
    let mut array = [0; N];
    array.copy_from_slice(bytes);
    array
}

/// Bytes as they stand in a file, and how they are packed.
#[derive(Clone, Copy)]
pub(super) struct Packed<'a> {
    pub bytes: &'a [u8],
    pub coding: Coding,
}

/// How bytes are packed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Coding {
    Plain,
    Gzip,
    Zlib,
}

impl<'a> Packed<'a> {
    /// A file that is a gzip stream where it begins as one.
    pub fn sniffed(bytes: &'a [u8]) -> Self {
        let coding = if bytes.starts_with(&[0x1f, 0x8b]) { Coding::Gzip } else { Coding::Plain };
        Self { bytes, coding }
    }

    /// The most bytes that this can hold.
    fn most(self) -> u64 {
        let ratio = if self.coding == Coding::Plain { 1 } else { MAX_DEFLATE_RATIO };
        (self.bytes.len() as u64).saturating_mul(ratio)
    }

    /// The bytes, unpacked as they are read.
    pub fn open(self) -> Stream<'a> {
        let bytes: Box<dyn Read + 'a> = match self.coding {
            Coding::Plain => Box::new(self.bytes),
            Coding::Gzip => Box::new(MultiGzDecoder::new(self.bytes)),
            Coding::Zlib => Box::new(ZlibDecoder::new(self.bytes)),
        };
        Stream { bytes, coding: self.coding, at: 0 }
    }
}

/// Unpacked bytes, of which is known how many were read.
pub(super) struct Stream<'a> {
    bytes: Box<dyn Read + 'a>,
    coding: Coding,
    at: u64,
}

impl Stream<'_> {
    /// Fills all of `out`.
    pub fn read(&mut self, out: &mut [u8], what: &'static str) -> Result<(), VolumeError> {
        let mut filled = 0;
        while filled < out.len() {
            match self.bytes.read(&mut out[filled..]) {
                Ok(0) => return Err(VolumeError::Truncated { what, at: self.at }),
                Ok(count) => {
                    filled += count;
                    self.at += count as u64;
                }
                Err(error) => return Err(self.failed(error, what)),
            }
        }
        Ok(())
    }

    pub fn skip(&mut self, count: u64, what: &'static str) -> Result<(), VolumeError> {
        let mut left = count;
        let mut buffer = [0; 1 << 12];
        while left > 0 {
            let part = left.min(buffer.len() as u64) as usize;
            self.read(&mut buffer[..part], what)?;
            left -= part as u64;
        }
        Ok(())
    }

    /// Reads on by a byte: where the voxels end the stream, that checks its checksum. What else may follow is ignored.
    fn finish(&mut self) -> Result<(), VolumeError> {
        let read = std::io::copy(&mut self.bytes.by_ref().take(1), &mut std::io::sink());
        read.map(drop).map_err(|error| self.failed(error, "the end of the compressed stream"))
    }

    fn failed(&self, error: std::io::Error, what: &'static str) -> VolumeError {
        match error.kind() {
            ErrorKind::UnexpectedEof => VolumeError::Truncated { what, at: self.at },
            _ => VolumeError::corrupt(format!("{:?}, {} bytes into its content: {error}", self.coding, self.at)),
        }
    }
}
