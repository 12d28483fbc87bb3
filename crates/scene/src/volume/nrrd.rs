//! Reads an NRRD volume into a dense grid.
//!
//! Source of the format: <https://teem.sourceforge.net/nrrd/format.html>.

use std::borrow::Cow;
use std::collections::BTreeMap;

use glam::{DMat4, DVec3};

use super::array::{Array, Coding, Packed};
use super::detached::read_detached;
use super::grid::{Bricked, Budget, Grid, invertible};
use super::patient::{MILLIMETRE, RAS_FROM_LPS};
use super::{Stored, VolumeError};
use crate::assets::Assets;

#[cfg(test)]
mod tests;

const TYPES: &str = "int8, uint8, int16, uint16, int32, uint32, int64, uint64, float, double";

/// Reads an NRRD file that holds one scalar volume: `.nrrd`, or `.nhdr`, whose voxels are in a file of its own that is
/// read from `assets`, relative to the header's folder. `file` is the header's path there, `bytes` its content.
///
/// The world is that of the file's `space`, turned to right-anterior-superior where it is a patient's, in metres: by
/// `space directions` and `space origin`, else by `spacings` alone. Lengths without a unit are taken as millimetres.
/// `axis mins`, `centers` and `old min` say nothing.
///
/// # Errors
/// Any [`VolumeError`] but those of other formats. Accepted are integers of 8, 16, 32, 64 bits and floats of 32, 64 bits
/// in the encodings raw, gzip and ascii.
pub fn read_nrrd(file: &str, bytes: &[u8], assets: &dyn Assets, budget: Budget) -> Result<Grid, VolumeError> {
    let (header, rest) = Header::read(bytes)?;
    let array = Array {
        dims: header.dims()?,
        stored: header.stored()?,
        big_endian: false,
        start: 0,
        slope: 1.0,
        intercept: 0.0,
    };
    let world_from_index = header.world_from_index()?;
    let dims = array.dims.map(|n| n as u32);
    let voxels = match header.get("datafile") {
        None => header.read_voxels(array, rest, budget)?,
        Some(name) => read_detached(file, name, assets, budget, |data| header.read_voxels(array, data, budget))?,
    };
    Ok(Grid::bricked(dims, voxels, world_from_index))
}

/// The fields of a header, by their names without spaces, in lower case.
struct Header<'a>(BTreeMap<String, Cow<'a, str>>);

impl<'a> Header<'a> {
    /// Reads a header, and gives what follows it.
    fn read(bytes: &'a [u8]) -> Result<(Self, &'a [u8]), VolumeError> {
        let (magic, mut rest) = line(bytes);
        if !matches!(magic, [b'N', b'R', b'R', b'D', b'0', b'0', b'0', b'1'..=b'5']) {
            return Err(VolumeError::not("an NRRD", bytes, "NRRD0001 to NRRD0005"));
        }
        let mut fields = BTreeMap::new();
        while !rest.is_empty() {
            let (text, next) = line(rest);
            rest = next;
            if text.is_empty() {
                break;
            }
            let text = match String::from_utf8_lossy(text) {
                // A comment, and a key of the writer's own.
                text if text.starts_with('#') || text.contains(":=") => continue,
                text => text,
            };
            let Some(colon) = text.find(": ") else {
                let text: String = text.chars().take(40).collect();
                return Err(VolumeError::corrupt(format!(
                    "its header has the line {text:?}; it must be `field: value`"
                )));
            };
            let name = compact(&text[..colon]);
            let value = match text {
                Cow::Borrowed(text) => Cow::Borrowed(text[colon + 2..].trim()),
                Cow::Owned(text) => Cow::Owned(text[colon + 2..].trim().to_owned()),
            };
            if fields.contains_key(&name) {
                return Err(VolumeError::corrupt(format!("its header has `{name}` twice")));
            }
            fields.insert(name, value);
        }
        Ok((Self(fields), rest))
    }

    fn get(&self, name: &str) -> Option<&str> {
        self.0.get(name).map(|value| &**value)
    }

    fn required(&self, name: &str) -> Result<&str, VolumeError> {
        self.get(name).ok_or_else(|| VolumeError::corrupt(format!("its header has no `{name}`")))
    }

    fn dims(&self) -> Result<[u64; 3], VolumeError> {
        const ACCEPTED: &str = "one scalar volume: 3 axes, all in space";
        let dimension = self.required("dimension")?;
        if dimension != "3" {
            return Err(VolumeError::Unsupported { found: format!("{dimension} axes"), accepted: ACCEPTED });
        }
        for kind in self.get("kinds").unwrap_or("").split_whitespace() {
            if !["domain", "space", "none", "???"].contains(&kind.to_ascii_lowercase().as_str()) {
                return Err(VolumeError::Unsupported { found: format!("an axis of kind {kind}"), accepted: ACCEPTED });
            }
        }
        let sizes = self.required("sizes")?;
        let dims: Vec<_> = sizes.split_whitespace().map(|size| count("sizes", size)).collect::<Result<_, _>>()?;
        let dims = <[u64; 3]>::try_from(dims).ok().filter(|dims| dims.iter().all(|&n| n > 0));
        dims.ok_or_else(|| VolumeError::corrupt(format!("its `sizes` are {sizes}; they must be three, of at least 1")))
    }

    fn stored(&self) -> Result<Stored, VolumeError> {
        let name = self.required("type")?;
        Ok(match compact(name).as_str() {
            "signedchar" | "int8" | "int8_t" => Stored::I8,
            "uchar" | "unsignedchar" | "uint8" | "uint8_t" => Stored::U8,
            "short" | "shortint" | "signedshort" | "signedshortint" | "int16" | "int16_t" => Stored::I16,
            "ushort" | "unsignedshort" | "unsignedshortint" | "uint16" | "uint16_t" => Stored::U16,
            "int" | "signedint" | "int32" | "int32_t" => Stored::I32,
            "uint" | "unsignedint" | "uint32" | "uint32_t" => Stored::U32,
            "longlong" | "longlongint" | "signedlonglong" | "signedlonglongint" | "int64" | "int64_t" => Stored::I64,
            "ulonglong" | "unsignedlonglong" | "unsignedlonglongint" | "uint64" | "uint64_t" => Stored::U64,
            "float" => Stored::F32,
            "double" => Stored::F64,
            _ => return Err(VolumeError::Unsupported { found: format!("voxels of type {name}"), accepted: TYPES }),
        })
    }

    fn big_endian(&self) -> Result<bool, VolumeError> {
        match self.required("endian")?.to_ascii_lowercase().as_str() {
            "little" => Ok(false),
            "big" => Ok(true),
            other => Err(VolumeError::corrupt(format!("its `endian` is {other}; it must be little or big"))),
        }
    }

    /// Reads the voxels from `data`, which may begin with what is to be skipped.
    fn read_voxels(&self, mut array: Array, mut data: &[u8], budget: Budget) -> Result<Bricked, VolumeError> {
        for _ in 0..count("line skip", self.get("lineskip").unwrap_or("0"))? {
            if data.is_empty() {
                return Err(VolumeError::Truncated { what: "the lines to skip", at: 0 });
            }
            data = line(data).1;
        }
        let coding = match self.required("encoding")?.to_ascii_lowercase().as_str() {
            "raw" => Coding::Plain,
            "gzip" | "gz" => Coding::Gzip,
            "ascii" | "text" | "txt" => return array.read_text(data, budget),
            encoding => {
                let found = format!("the encoding {encoding}");
                return Err(VolumeError::Unsupported { found, accepted: "raw, gzip, ascii" });
            }
        };
        array.big_endian = array.stored.size() > 1 && self.big_endian()?;
        array.start = match self.get("byteskip").unwrap_or("0") {
            // The voxels are what the file ends with.
            "-1" if coding == Coding::Plain => (data.len() as u64).saturating_sub(array.end()),
            bytes => count("byte skip", bytes)?,
        };
        array.read(Packed { bytes: data, coding }, budget)
    }

    fn world_from_index(&self) -> Result<glam::Mat4, VolumeError> {
        let sign = match self.get("space").map(compact).as_deref() {
            None | Some("right-anterior-superior" | "ras" | "scanner-xyz" | "3d-right-handed") => DVec3::ONE,
            Some("left-anterior-superior" | "las") => DVec3::new(-1.0, 1.0, 1.0),
            Some("left-posterior-superior" | "lps") => RAS_FROM_LPS,
            Some(space) => {
                return Err(VolumeError::Unsupported {
                    found: format!("the space {space}"),
                    accepted: "right-anterior-superior, left-anterior-superior, left-posterior-superior, scanner-xyz, \
                               3D-right-handed",
                });
            }
        };
        let Some(directions) = self.get("spacedirections") else {
            let spacings = match self.get("spacings") {
                // An axis of unknown spacing.
                Some(text) => triple("spacings", text)?.map(|spacing| if spacing.is_nan() { 1.0 } else { spacing }),
                None => [1.0; 3],
            };
            let spacing = DVec3::from_array(spacings) * self.metres("units")?;
            return invertible(DMat4::from_scale(spacing), "spacings");
        };
        if directions.contains("none") {
            return Err(VolumeError::Unsupported {
                found: format!("an axis without direction (space directions: {directions})"),
                accepted: "one scalar volume: 3 axes, all in space",
            });
        }
        let columns: Vec<_> = directions.split_inclusive(')').map(vector).collect::<Result<_, _>>()?;
        let [x, y, z] = columns[..] else {
            return Err(VolumeError::corrupt(format!("its `space directions` are {directions}; they must be three")));
        };
        let origin = self.get("spaceorigin").map_or(Ok(DVec3::ZERO), vector)?;
        let matrix = DMat4::from_cols(x.extend(0.0), y.extend(0.0), z.extend(0.0), origin.extend(1.0));
        invertible(DMat4::from_scale(sign * self.metres("spaceunits")?) * matrix, "space directions")
    }

    /// How long the units of a field are \[m\].
    fn metres(&self, field: &str) -> Result<DVec3, VolumeError> {
        let mut metres = [MILLIMETRE; 3];
        let units = self.get(field).unwrap_or("").split('"').skip(1).step_by(2);
        for (metres, unit) in metres.iter_mut().zip(units) {
            *metres = match unit {
                "" | "mm" | "millimeter" | "millimeters" => MILLIMETRE,
                "m" | "meter" | "meters" => 1.0,
                "cm" | "centimeter" | "centimeters" => 1e-2,
                "um" | "µm" | "μm" | "micron" | "microns" | "micrometer" | "micrometers" => 1e-6,
                "nm" | "nanometer" | "nanometers" => 1e-9,
                _ => {
                    return Err(VolumeError::Unsupported {
                        found: format!("the unit {unit:?}"),
                        accepted: "m, cm, mm, um, nm",
                    });
                }
            };
        }
        Ok(DVec3::from_array(metres))
    }
}

/// The first line, without its end, and what follows it.
fn line(bytes: &[u8]) -> (&[u8], &[u8]) {
    let (line, rest) = match bytes.iter().position(|&byte| byte == b'\n') {
        Some(end) => (&bytes[..end], &bytes[end + 1..]),
        None => (bytes, &[][..]),
    };
    (line.strip_suffix(b"\r").unwrap_or(line), rest)
}

/// Names as they are compared.
fn compact(name: &str) -> String {
    name.chars().filter(|c| !c.is_whitespace()).map(|c| c.to_ascii_lowercase()).collect()
}

fn count(field: &str, text: &str) -> Result<u64, VolumeError> {
    text.parse().map_err(|_| VolumeError::corrupt(format!("its `{field}` is {text:?}; it must be a whole number")))
}

/// `(1,0,0)`
fn vector(text: &str) -> Result<DVec3, VolumeError> {
    let inner = text.trim().strip_prefix('(').and_then(|text| text.strip_suffix(')'));
    let inner = inner.ok_or_else(|| VolumeError::corrupt(format!("a vector is {text:?}; it must be (x,y,z)")))?;
    triple("vector", &inner.replace(',', " ")).map(DVec3::from_array)
}

fn triple(field: &str, text: &str) -> Result<[f64; 3], VolumeError> {
    let numbers: Option<Vec<f64>> = text.split_whitespace().map(|number| number.parse().ok()).collect();
    let triple = numbers.and_then(|numbers| numbers.try_into().ok());
    triple.ok_or_else(|| VolumeError::corrupt(format!("a `{field}` is {text:?}; it must be three numbers")))
}
