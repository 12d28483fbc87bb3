//! Reads a NIfTI-1 volume into a dense grid.
//!
//! Source of the format: nifti1.h, <https://nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h>. The crate `nifti`
//! parses the header; the voxels are streamed here, since the crate would allocate whatever the header says.

use std::io::{ErrorKind, Read};

use flate2::bufread::MultiGzDecoder;
use glam::{DMat3, DMat4, DQuat, DVec3, DVec4, Mat4};
use nifti::{Endianness, NiftiHeader};

use super::VolumeError;
use super::bricks::Slices;
use super::grid::{Budget, Filled, Grid, Sample, invertible, smallest};

#[cfg(test)]
mod tests;

const HEADER: usize = 348;
/// Header and the four bytes that announce extensions: where voxels begin at the earliest.
const FIRST_VOXEL: u64 = 352;
/// The most bytes of extensions that are skipped.
const MAX_EXTENSIONS: u64 = 16 << 20;
/// DEFLATE makes no more bytes than this of one.
const MAX_DEFLATE_RATIO: u64 = 1032;

/// Reads a NIfTI-1 file, `.nii` or `.nii.gz`, that holds one scalar volume.
///
/// Values are `scl_slope * stored + scl_inter` (as stored where the slope is 0), in the file's unit, rounded to 32
/// bits. The world is the file's (x to the right, y to the front, z up of a patient), in metres: by the sform where
/// there is one, else by the qform, else by the voxels' spacing alone. Lengths without a unit are taken as millimetres.
///
/// Errors: any [`VolumeError`] but those of VDB. Accepted are integers of 8, 16, 32 bits and floats of 32, 64 bits, in
/// either byte order.
pub fn read_nifti(bytes: &[u8], budget: Budget) -> Result<Grid, VolumeError> {
    let layout = Layout::read(&mut Stream::open(bytes))?;
    // Before anything is allocated: can the file hold so many voxels at all?
    let available = (bytes.len() as u64).saturating_mul(if is_gzip(bytes) { MAX_DEFLATE_RATIO } else { 1 });
    if layout.start + layout.dims.iter().product::<u64>() * layout.stored.size() as u64 > available {
        return Err(VolumeError::Truncated { what: "the voxels", at: available });
    }
    let voxels = smallest(|| layout.fill(bytes, budget), || layout.fill(bytes, budget))?;
    Ok(Grid::stored(layout.dims.map(|n| n as u32), voxels, layout.world_from_index))
}

/// What the header says of the voxels.
struct Layout {
    /// Each from 1 to 32767.
    dims: [u64; 3],
    stored: Stored,
    big_endian: bool,
    /// Byte offset of the first voxel.
    start: u64,
    slope: f64,
    intercept: f64,
    world_from_index: Mat4,
}

impl Layout {
    fn read(stream: &mut Stream) -> Result<Self, VolumeError> {
        let mut bytes = [0; HEADER];
        stream.read(&mut bytes[..4], "the header")?;
        let size =
            [i32::from_le_bytes, i32::from_be_bytes].map(|parse| parse([bytes[0], bytes[1], bytes[2], bytes[3]]));
        if size.contains(&540) {
            return Err(VolumeError::Unsupported {
                found: "a NIfTI-2 file".into(),
                accepted: "NIfTI-1 (.nii, .nii.gz)",
            });
        }
        if !size.contains(&(HEADER as i32)) {
            return Err(VolumeError::NotNifti {
                found: format!("it begins with {:02x?}, the header's size", &bytes[..4]),
            });
        }
        stream.read(&mut bytes[4..], "the header")?;
        match &bytes[344..] {
            b"n+1\0" => {}
            b"ni1\0" => {
                return Err(VolumeError::Unsupported {
                    found: "a NIfTI header whose voxels are in another file (.hdr and .img)".into(),
                    accepted: "both in one file (.nii, .nii.gz)",
                });
            }
            other => return Err(VolumeError::NotNifti { found: format!("its magic is \"{}\"", other.escape_ascii()) }),
        }
        let header = NiftiHeader::from_reader(&bytes[..])
            .map_err(|error| VolumeError::NotNifti { found: format!("its header: {error}") })?;
        if header.sizeof_hdr != HEADER as i32 {
            return Err(VolumeError::corrupt(format!("dim[0] is {}; it must be 1 to 7", header.dim[0].swap_bytes())));
        }

        let (slope, intercept) = match f64::from(header.scl_slope) {
            slope if slope == 0.0 || !slope.is_finite() => (1.0, 0.0),
            slope => (slope, f64::from(header.scl_inter)),
        };
        if !intercept.is_finite() {
            return Err(VolumeError::corrupt(format!("scl_inter is {intercept}; it must be finite")));
        }
        let dims = dims(&header)?;
        Ok(Self {
            dims,
            stored: Stored::new(header.datatype)?,
            big_endian: header.endianness == Endianness::Big,
            start: start(&header)?,
            slope,
            intercept,
            world_from_index: world_from_index(&header, dims)?,
        })
    }

    /// Errors: [`VolumeError::TooLarge`] before anything is allocated, [`VolumeError::NotFinite`], and those of a
    /// malformed stream.
    fn fill<T: Sample>(&self, bytes: &[u8], budget: Budget) -> Result<Filled<T>, VolumeError> {
        let mut slices = Slices::<T>::new(self.dims, budget)?;
        let mut stream = Stream::open(bytes);
        stream.skip(self.start, "the header's extensions")?;
        let count = self.dims.iter().product::<u64>();
        let size = self.stored.size();
        let mut buffer = [0; 1 << 14];
        while slices.taken < count {
            let part = (count - slices.taken).min((buffer.len() / size) as u64) as usize;
            let part = &mut buffer[..part * size];
            stream.read(part, "the voxels")?;
            for stored in part.chunks_exact(size) {
                let value = self.slope * self.stored.decode(stored, self.big_endian) + self.intercept;
                if !(value as f32).is_finite() {
                    let at = slices.taken;
                    let [nx, ny, _] = self.dims;
                    let index = [at % nx, at / nx % ny, at / (nx * ny)].map(|n| n as i64);
                    return Err(VolumeError::NotFinite { index, value });
                }
                let (voxel, exact) = T::store(value as f32);
                if !exact {
                    return Ok(Filled { bricks: slices.finish(), exact });
                }
                slices.push(voxel)?;
            }
        }
        stream.finish()?;
        Ok(Filled { bricks: slices.finish(), exact: true })
    }
}

/// How a voxel is stored.
#[derive(Clone, Copy)]
enum Stored {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    F32,
    F64,
}

impl Stored {
    fn new(datatype: i16) -> Result<Self, VolumeError> {
        Ok(match datatype {
            2 => Self::U8,
            4 => Self::I16,
            8 => Self::I32,
            16 => Self::F32,
            64 => Self::F64,
            256 => Self::I8,
            512 => Self::U16,
            768 => Self::U32,
            _ => {
                return Err(VolumeError::Unsupported {
                    found: format!("voxels of datatype {datatype}"),
                    accepted: "2 (u8), 256 (i8), 512 (u16), 4 (i16), 768 (u32), 8 (i32), 16 (f32), 64 (f64)",
                });
            }
        })
    }

    fn size(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The value of `bytes`, of which there are [`size`](Self::size).
    fn decode(self, bytes: &[u8], big_endian: bool) -> f64 {
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

fn dims(header: &NiftiHeader) -> Result<[u64; 3], VolumeError> {
    let [rank, sizes @ ..] = header.dim;
    if !(1..=7).contains(&rank) {
        return Err(VolumeError::corrupt(format!("dim[0] is {rank}; it must be 1 to 7")));
    }
    let sizes = &sizes[..usize::from(rank)];
    if let Some(i) = sizes.iter().position(|size| !(1..=i16::MAX as u16).contains(size)) {
        return Err(VolumeError::corrupt(format!("dim[{}] is {}; it must be 1 to 32767", i + 1, sizes[i] as i16)));
    }
    if sizes.iter().skip(3).any(|&size| size > 1) {
        return Err(VolumeError::Unsupported {
            found: format!("more than one volume, or more than one value a voxel (dim = {sizes:?})"),
            accepted: "one scalar volume; pick one and save it as a file of its own",
        });
    }
    Ok([0, 1, 2].map(|axis| sizes.get(axis).map_or(1, |&size| size.into())))
}

fn start(header: &NiftiHeader) -> Result<u64, VolumeError> {
    let offset = match f64::from(header.vox_offset) {
        // Some writers leave it at zero.
        0.0 => FIRST_VOXEL as f64,
        offset => offset,
    };
    let last = FIRST_VOXEL + MAX_EXTENSIONS;
    if offset.fract() == 0.0 && (FIRST_VOXEL as f64..=last as f64).contains(&offset) {
        Ok(offset as u64)
    } else {
        Err(VolumeError::corrupt(format!(
            "vox_offset is {offset}; it must be a whole number from {FIRST_VOXEL} to {last}"
        )))
    }
}

/// Errors: [`VolumeError::Unsupported`] for a unit that is none of length; [`VolumeError::Corrupt`] for a spacing that
/// is not positive, or a matrix that is not invertible.
fn world_from_index(header: &NiftiHeader, dims: [u64; 3]) -> Result<Mat4, VolumeError> {
    let metres = match header.xyzt_units & 7 {
        0 | 2 => 1e-3,
        1 => 1.0,
        3 => 1e-6,
        code => {
            return Err(VolumeError::Unsupported {
                found: format!("the unit of length {code} (xyzt_units)"),
                accepted: "0 (unknown, taken as mm), 1 (m), 2 (mm), 3 (um)",
            });
        }
    };
    let (matrix, source) = if header.sform_code > 0 {
        let [x, y, z] = [header.srow_x, header.srow_y, header.srow_z].map(|row| DVec4::from_array(row.map(f64::from)));
        (DMat4::from_cols(x, y, z, DVec4::W).transpose(), "sform")
    } else {
        // Of an axis of one voxel a file may leave the spacing at zero.
        let spacing = DVec3::from_array([0, 1, 2].map(|axis| match f64::from(header.pixdim[axis + 1]) {
            0.0 if dims[axis] == 1 => 1.0,
            spacing => spacing,
        }));
        if !(spacing.is_finite() && spacing.min_element() > 0.0) {
            return Err(VolumeError::corrupt(format!("pixdim[1..=3], the spacing, is {spacing}; it must be positive")));
        }
        if header.qform_code > 0 {
            let mirror = if header.pixdim[0] < 0.0 { -1.0 } else { 1.0 };
            let scale = DMat3::from_diagonal(spacing * DVec3::new(1.0, 1.0, mirror));
            let origin = DVec3::from_array([header.quatern_x, header.quatern_y, header.quatern_z].map(f64::from));
            (DMat4::from_mat3_translation(DMat3::from_quat(quaternion(header)) * scale, origin), "qform")
        } else {
            (DMat4::from_scale(spacing), "spacing")
        }
    };
    // The unit scales the world: rows, translation included.
    invertible(DMat4::from_scale(DVec3::splat(metres)) * matrix, source)
}

/// The qform's rotation. The file has its vector part; the rest follows from its unit length.
fn quaternion(header: &NiftiHeader) -> DQuat {
    let vector = DVec3::from_array([header.quatern_b, header.quatern_c, header.quatern_d].map(f64::from));
    let square = 1.0 - vector.length_squared();
    if square < 1e-7 {
        // A rotation by 180°, but for rounding. [nifti1_io.c, nifti_quatern_to_mat44]
        DQuat::from_vec4(vector.normalize().extend(0.0))
    } else {
        DQuat::from_vec4(vector.extend(square.sqrt()))
    }
}

/// The file's bytes, decompressed where they are a gzip stream.
struct Stream<'a> {
    bytes: Box<dyn Read + 'a>,
    at: u64,
}

impl<'a> Stream<'a> {
    fn open(bytes: &'a [u8]) -> Self {
        Self { bytes: if is_gzip(bytes) { Box::new(MultiGzDecoder::new(bytes)) } else { Box::new(bytes) }, at: 0 }
    }

    /// Fills all of `out`.
    fn read(&mut self, out: &mut [u8], what: &'static str) -> Result<(), VolumeError> {
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

    fn skip(&mut self, count: u64, what: &'static str) -> Result<(), VolumeError> {
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
        read.map(drop).map_err(|error| self.failed(error, "the end of the gzip stream"))
    }

    fn failed(&self, error: std::io::Error, what: &'static str) -> VolumeError {
        match error.kind() {
            ErrorKind::UnexpectedEof => VolumeError::Truncated { what, at: self.at },
            _ => VolumeError::corrupt(format!("gzip, {} bytes into its content: {error}", self.at)),
        }
    }
}

fn is_gzip(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x1f, 0x8b])
}
