//! Reads a MetaImage into a dense grid.
//!
//! Source of the format: <https://itk.org/Wiki/ITK/MetaIO/Documentation>, and ITK's metaImage.cxx.

use std::collections::BTreeMap;

use glam::{DMat4, DVec3, Mat4};

use super::array::{Array, Coding, Packed};
use super::detached::read_detached;
use super::grid::{Bricked, Budget, Grid, invertible};
use super::patient::{MILLIMETRE, RAS_FROM_LPS};
use super::{Stored, VolumeError};
use crate::assets::Assets;

#[cfg(test)]
mod tests;

/// Reads a MetaImage that holds one scalar volume: `.mha`, or `.mhd`, whose voxels are in a file of its own that is read
/// from `assets`, relative to the header's folder. `file` is the header's path there, `bytes` its content.
///
/// The world is right-anterior-superior in metres: the file's, by `TransformMatrix`, `Offset` and `ElementSpacing`, is
/// left-posterior-superior in millimetres, as ITK takes it.
///
/// # Errors
/// Any [`VolumeError`] but those of other formats. Accepted are integers of 8, 16, 32, 64 bits and floats of 32, 64 bits,
/// as they are, compressed by zlib, or as text.
pub fn read_meta_image(file: &str, bytes: &[u8], assets: &dyn Assets, budget: Budget) -> Result<Grid, VolumeError> {
    let (header, rest) = Header::read(bytes)?;
    let big_endian = match header.switch("BinaryDataByteOrderMSB")? {
        Some(big_endian) => big_endian,
        None => header.switch("ElementByteOrderMSB")?.unwrap_or(false),
    };
    let array =
        Array { dims: header.dims()?, stored: header.stored()?, big_endian, start: 0, slope: 1.0, intercept: 0.0 };
    let world_from_index = header.world_from_index()?;
    let dims = array.dims.map(|n| n as u32);
    let voxels = match header.required("ElementDataFile")? {
        "LOCAL" => header.read_voxels(array, rest, budget)?,
        name => read_detached(file, name, assets, budget, |data| header.read_voxels(array, data, budget))?,
    };
    Ok(Grid::bricked(dims, voxels, world_from_index))
}

/// The fields of a header.
struct Header(BTreeMap<String, String>);

impl Header {
    /// Reads a header, and gives what follows it.
    fn read(bytes: &[u8]) -> Result<(Self, &[u8]), VolumeError> {
        let mut fields = BTreeMap::new();
        let mut rest = bytes;
        while !rest.is_empty() {
            let end = rest.iter().position(|&byte| byte == b'\n').unwrap_or(rest.len());
            let line = &rest[..end];
            rest = rest.get(end + 1..).unwrap_or(&[]);
            let Some((name, value)) = str::from_utf8(line).ok().and_then(|line| line.split_once('=')) else {
                if line.trim_ascii().is_empty() {
                    continue;
                }
                return Err(VolumeError::not("a MetaImage", line, "lines `Name = value`, ElementDataFile last"));
            };
            let (name, value) = (name.trim().to_owned(), value.trim().to_owned());
            let last = name == "ElementDataFile";
            fields.insert(name, value);
            if last {
                break;
            }
        }
        Ok((Self(fields), rest))
    }

    fn get(&self, name: &str) -> Option<&str> {
        self.0.get(name).map(String::as_str)
    }

    fn required(&self, name: &str) -> Result<&str, VolumeError> {
        self.get(name).ok_or_else(|| VolumeError::corrupt(format!("its header has no {name}")))
    }

    fn wrong(&self, name: &str, accepted: &str) -> VolumeError {
        VolumeError::corrupt(format!("its {name} is {:?}; it must be {accepted}", self.get(name).unwrap_or("")))
    }

    fn switch(&self, name: &str) -> Result<Option<bool>, VolumeError> {
        match self.get(name).map(str::to_ascii_lowercase).as_deref() {
            None => Ok(None),
            Some("true" | "1") => Ok(Some(true)),
            Some("false" | "0") => Ok(Some(false)),
            Some(_) => Err(self.wrong(name, "True or False")),
        }
    }

    /// `N` numbers of the first of these fields that is there.
    fn numbers<const N: usize>(&self, names: &[&str]) -> Result<Option<[f64; N]>, VolumeError> {
        let Some(name) = names.iter().find(|name| self.0.contains_key(**name)) else { return Ok(None) };
        let numbers: Option<Vec<f64>> =
            self.get(name).unwrap_or("").split_whitespace().map(|number| number.parse().ok()).collect();
        let numbers = numbers.and_then(|numbers| numbers.try_into().ok());
        numbers.map(Some).ok_or_else(|| self.wrong(name, &format!("{N} numbers")))
    }

    fn dims(&self) -> Result<[u64; 3], VolumeError> {
        const ACCEPTED: &str = "one scalar volume: NDims = 3, ElementNumberOfChannels = 1";
        for (name, accepted) in [("NDims", "3"), ("ElementNumberOfChannels", "1")] {
            if let Some(found) = self.get(name).filter(|found| *found != accepted) {
                return Err(VolumeError::Unsupported { found: format!("{name} = {found}"), accepted: ACCEPTED });
            }
        }
        let sizes: Option<Vec<u64>> =
            self.required("DimSize")?.split_whitespace().map(|size| size.parse().ok().filter(|&n| n > 0)).collect();
        sizes.and_then(|sizes| sizes.try_into().ok()).ok_or_else(|| self.wrong("DimSize", "three sizes of at least 1"))
    }

    fn stored(&self) -> Result<Stored, VolumeError> {
        Ok(match self.required("ElementType")? {
            "MET_CHAR" => Stored::I8,
            "MET_UCHAR" => Stored::U8,
            "MET_SHORT" => Stored::I16,
            "MET_USHORT" => Stored::U16,
            "MET_INT" | "MET_LONG" => Stored::I32,
            "MET_UINT" | "MET_ULONG" => Stored::U32,
            "MET_LONG_LONG" => Stored::I64,
            "MET_ULONG_LONG" => Stored::U64,
            "MET_FLOAT" => Stored::F32,
            "MET_DOUBLE" => Stored::F64,
            other => {
                return Err(VolumeError::Unsupported {
                    found: format!("ElementType = {other}"),
                    accepted: "MET_CHAR, MET_UCHAR, MET_SHORT, MET_USHORT, MET_INT, MET_UINT, MET_LONG, MET_ULONG, \
                               MET_LONG_LONG, MET_ULONG_LONG, MET_FLOAT, MET_DOUBLE",
                });
            }
        })
    }

    /// Reads the voxels from `data`, which may begin with another header.
    fn read_voxels(&self, mut array: Array, data: &[u8], budget: Budget) -> Result<Bricked, VolumeError> {
        if self.switch("BinaryData")? == Some(false) {
            return array.read_text(data, budget);
        }
        let coding = if self.switch("CompressedData")? == Some(true) { Coding::Zlib } else { Coding::Plain };
        array.start = match self.get("HeaderSize").unwrap_or("0") {
            // The voxels are what the file ends with.
            "-1" if coding == Coding::Plain => (data.len() as u64).saturating_sub(array.end()),
            bytes => {
                bytes.parse().map_err(|_| self.wrong("HeaderSize", "-1 (not compressed), or a number of bytes"))?
            }
        };
        array.read(Packed { bytes: data, coding }, budget)
    }

    fn world_from_index(&self) -> Result<Mat4, VolumeError> {
        let spacing = DVec3::from_array(self.numbers(&["ElementSpacing", "ElementSize"])?.unwrap_or([1.0; 3]));
        let origin = DVec3::from_array(self.numbers(&["Offset", "Position", "Origin"])?.unwrap_or([0.0; 3]));
        // Three by three, the direction of each axis after the other.
        let axes = self.numbers::<9>(&["TransformMatrix", "Orientation", "Rotation"])?;
        let [x, y, z] = match axes {
            Some([a, b, c, d, e, f, g, h, i]) => [DVec3::new(a, b, c), DVec3::new(d, e, f), DVec3::new(g, h, i)],
            None => [DVec3::X, DVec3::Y, DVec3::Z],
        };
        let matrix = DMat4::from_cols(x.extend(0.0), y.extend(0.0), z.extend(0.0), origin.extend(1.0));
        let world = DMat4::from_scale(RAS_FROM_LPS * MILLIMETRE);
        invertible(world * matrix * DMat4::from_scale(spacing), "TransformMatrix and ElementSpacing")
    }
}
