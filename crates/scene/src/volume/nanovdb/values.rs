//! How a NanoVDB grid stores its values, by its type.
//!
//! Source of the layouts: NanoVDB, NanoVDB.h and the table of constants in PNanoVDB.h (version 32).

use half::f16;

use super::tree::Bytes;
use crate::volume::VolumeError;

/// The type of grids of three 32-bit floats.
pub const VEC3F: u32 = 6;
/// Voxels of a leaf.
const VOXELS: usize = 512;

/// The layout of a grid's nodes, as far as it depends on the type of the values.
#[derive(Clone, Copy)]
pub struct Layout {
    /// Where the root has its background.
    background: usize,
    /// Bytes of the root, without its entries.
    pub root: usize,
    /// Where an entry of the root has its value.
    pub tile: usize,
    /// Bytes of an entry of a node's table.
    pub entry: usize,
    number: Number,
    /// Where a leaf has its values.
    values: usize,
    codes: Codes,
}

/// A value of the root, of a tile, and of a leaf that is not quantised.
#[derive(Clone, Copy)]
enum Number {
    F16,
    F32,
    F64,
    /// One of three 32-bit floats.
    Component(usize),
}

/// How leaves store values.
#[derive(Clone, Copy, PartialEq)]
enum Codes {
    /// As numbers.
    None,
    /// As that many bits between a least value and, in steps of one quantum, the greatest.
    Bits(usize),
    /// As as many bits as each leaf says.
    Variable,
}

const FLOAT: Layout =
    Layout { background: 28, root: 64, tile: 20, entry: 8, number: Number::F32, values: 96, codes: Codes::None };
const DOUBLE: Layout = Layout { background: 32, root: 96, tile: 24, number: Number::F64, values: 128, ..FLOAT };
const HALF: Layout = Layout { number: Number::F16, ..FLOAT };

impl Layout {
    /// The layout of grids of type `kind`; `component` says which of a vector's numbers is read.
    pub fn new(kind: u32, component: Option<usize>) -> Result<Self, VolumeError> {
        let quantised = |codes| Layout { codes, ..FLOAT };
        Ok(match (kind, component) {
            (1, None) => FLOAT,
            (2, None) => DOUBLE,
            (VEC3F, Some(component)) => {
                Layout { root: 96, entry: 16, number: Number::Component(component), values: 128, ..FLOAT }
            }
            (9, None) => HALF,
            (13, None) => quantised(Codes::Bits(4)),
            (14, None) => quantised(Codes::Bits(8)),
            (15, None) => quantised(Codes::Bits(16)),
            (16, None) => quantised(Codes::Variable),
            (VEC3F, None) | (_, Some(_)) => {
                return Err(VolumeError::corrupt(format!("a grid is of type {kind}, and its file says of another")));
            }
            (other, None) => {
                return Err(VolumeError::Unsupported {
                    found: format!("a NanoVDB grid of type {}", name(other)),
                    accepted: "Float, Double, Vec3f, Half, Fp4, Fp8, Fp16, FpN",
                });
            }
        })
    }

    pub fn background(&self, memory: Bytes, root: usize) -> Result<f64, VolumeError> {
        self.number.read(memory, root + self.background)
    }

    /// The value of the tile at `at`.
    pub fn value(&self, memory: Bytes, at: usize) -> Result<f64, VolumeError> {
        self.number.read(memory, at)
    }

    /// The leaf at `at`, with all its values.
    pub fn leaf<'a>(&self, memory: Bytes<'a>, at: usize) -> Result<Bytes<'a>, VolumeError> {
        let bits = match self.bits(Bytes(memory.slice(at, self.values)?))? {
            Some(bits) => bits,
            None => 8 * self.number.size(),
        };
        Ok(Bytes(memory.slice(at, self.values + VOXELS * bits / 8)?))
    }

    /// The value of a voxel of a leaf.
    pub fn voxel(&self, leaf: Bytes, voxel: usize) -> Result<f64, VolumeError> {
        const LEAST: usize = 80;
        const QUANTUM: usize = 84;
        let Some(bits) = self.bits(leaf)? else {
            return self.number.read(leaf, self.values + self.number.size() * voxel);
        };
        // Voxel after voxel, from the lowest bit on: no code goes beyond two bytes, nor lies across more than it needs.
        let at = bits * voxel;
        let code = match bits {
            16 => u16::from_le_bytes(leaf.array(self.values + at / 8)?),
            _ => u16::from(leaf.array::<1>(self.values + at / 8)?[0] >> (at % 8)) & ((1 << bits) - 1),
        };
        Ok((f32::from(code) * leaf.f32(QUANTUM)? + leaf.f32(LEAST)?).into())
    }

    /// Bits of a code of a leaf; `None` where values are numbers.
    fn bits(&self, leaf: Bytes) -> Result<Option<usize>, VolumeError> {
        const FLAGS: usize = 15;
        match self.codes {
            Codes::None => Ok(None),
            Codes::Bits(bits) => Ok(Some(bits)),
            Codes::Variable => match leaf.array::<1>(FLAGS)?[0] >> 5 {
                log2 @ 0..=4 => Ok(Some(1 << log2)),
                log2 => Err(VolumeError::corrupt(format!("a leaf has codes of 2^{log2} bits; they have up to 16"))),
            },
        }
    }
}

impl Number {
    /// Bytes from one to the next.
    fn size(self) -> usize {
        match self {
            Self::F16 => 2,
            Self::F32 => 4,
            Self::F64 => 8,
            Self::Component(_) => 12,
        }
    }

    fn read(self, memory: Bytes, at: usize) -> Result<f64, VolumeError> {
        Ok(match self {
            Self::F16 => f16::from_le_bytes(memory.array(at)?).to_f64(),
            Self::F32 => memory.f32(at)?.into(),
            Self::F64 => f64::from_le_bytes(memory.array(at)?),
            Self::Component(component) => memory.f32(at + 4 * component)?.into(),
        })
    }
}

/// A type as messages have it: its number and NanoVDB's name for it.
fn name(kind: u32) -> String {
    let name = match kind {
        3 => "Int16",
        4 => "Int32",
        5 => "Int64",
        7 => "Vec3d",
        8 => "Mask",
        10 => "UInt32",
        11 => "Boolean",
        12 => "RGBA8",
        17 => "Vec4f",
        18 => "Vec4d",
        19 => "Index",
        20 => "OnIndex",
        23 => "PointIndex",
        24 => "Vec3u8",
        25 => "Vec3u16",
        26 => "UInt8",
        _ => return kind.to_string(),
    };
    format!("{kind} ({name})")
}
