//! Reads a NIfTI-1 volume into a dense grid.
//!
//! Source of the format: nifti1.h, <https://nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h>. The crate `nifti`
//! parses the header; the voxels are streamed here, since the crate would allocate whatever the header says.

use glam::{DMat3, DMat4, DQuat, DVec3, DVec4, Mat4};
use nifti::{Endianness, NiftiHeader};

use super::VolumeError;
use super::array::{Array, Packed, Stored, Stream};
use super::grid::{Budget, Grid, invertible};

#[cfg(test)]
mod tests;

const HEADER: usize = 348;
/// Header and the four bytes that announce extensions: where voxels begin at the earliest.
const FIRST_VOXEL: u64 = 352;
/// The most bytes of extensions that are skipped.
const MAX_EXTENSIONS: u64 = 16 << 20;

/// Reads a NIfTI-1 file, `.nii` or `.nii.gz`, that holds one scalar volume.
///
/// Values are `scl_slope * stored + scl_inter` (as stored where the slope is 0), in the file's unit, rounded to 32
/// bits. The world is the file's (x to the right, y to the front, z up of a patient), in metres: by the sform where
/// there is one, else by the qform, else by the voxels' spacing alone. Lengths without a unit are taken as millimetres.
///
/// Errors: any [`VolumeError`] but those of other formats. Accepted are integers of 8, 16, 32, 64 bits and floats of 32,
/// 64 bits, in either byte order.
pub fn read_nifti(bytes: &[u8], budget: Budget) -> Result<Grid, VolumeError> {
    let packed = Packed::sniffed(bytes);
    let (array, world_from_index) = read_header(&mut packed.open())?;
    Ok(Grid::bricked(array.dims.map(|n| n as u32), array.read(packed, budget)?, world_from_index))
}

/// How the voxels are stored, each of `dims` being from 1 to 32767, and where they are.
fn read_header(stream: &mut Stream) -> Result<(Array, Mat4), VolumeError> {
    let mut bytes = [0; HEADER];
    stream.read(&mut bytes[..4], "the header")?;
    let size = [i32::from_le_bytes, i32::from_be_bytes].map(|parse| parse([bytes[0], bytes[1], bytes[2], bytes[3]]));
    if size.contains(&540) {
        return Err(VolumeError::Unsupported { found: "a NIfTI-2 file".into(), accepted: "NIfTI-1 (.nii, .nii.gz)" });
    }
    if !size.contains(&(HEADER as i32)) {
        return Err(VolumeError::NotNifti { found: format!("it begins with {:02x?}, the header's size", &bytes[..4]) });
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
    let array = Array {
        dims,
        stored: stored(header.datatype)?,
        big_endian: header.endianness == Endianness::Big,
        start: start(&header)?,
        slope,
        intercept,
    };
    Ok((array, world_from_index(&header, dims)?))
}

fn stored(datatype: i16) -> Result<Stored, VolumeError> {
    Ok(match datatype {
        2 => Stored::U8,
        4 => Stored::I16,
        8 => Stored::I32,
        16 => Stored::F32,
        64 => Stored::F64,
        256 => Stored::I8,
        512 => Stored::U16,
        768 => Stored::U32,
        1024 => Stored::I64,
        1280 => Stored::U64,
        _ => {
            return Err(VolumeError::Unsupported {
                found: format!("voxels of datatype {datatype}"),
                accepted: "2 (u8), 256 (i8), 512 (u16), 4 (i16), 768 (u32), 8 (i32), 1280 (u64), 1024 (i64), 16 (f32), \
                           64 (f64)",
            });
        }
    })
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
