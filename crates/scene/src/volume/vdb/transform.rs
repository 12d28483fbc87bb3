//! Where a VDB grid lies in the world.
//!
//! Source of the format: OpenVDB, math/Maps.h.

use glam::{DMat4, DVec3};

use super::cursor::Cursor;
use crate::volume::VolumeError;

const WHAT: &str = "a grid's transform";

/// Reads the matrix that maps index coordinates to the world.
///
/// Errors: [`VolumeError::Unsupported`] for a map that is not affine or not known, [`VolumeError::Truncated`].
pub(super) fn read(cursor: &mut Cursor) -> Result<DMat4, VolumeError> {
    let name = cursor.text(WHAT)?;
    Ok(match name.as_str() {
        "UniformScaleMap" | "ScaleMap" => {
            let scale = vector(cursor)?;
            skip_derived_scales(cursor)?;
            DMat4::from_scale(scale)
        }
        "UniformScaleTranslateMap" | "ScaleTranslateMap" => {
            let translation = vector(cursor)?;
            let scale = vector(cursor)?;
            skip_derived_scales(cursor)?;
            DMat4::from_translation(translation) * DMat4::from_scale(scale)
        }
        "TranslationMap" => DMat4::from_translation(vector(cursor)?),
        "AffineMap" | "UnitaryMap" => {
            // OpenVDB stores rows, and multiplies a row vector from the left: its rows are the columns here.
            let mut columns = [0.0; 16];
            for entry in &mut columns {
                *entry = cursor.f64(WHAT)?;
            }
            let matrix = DMat4::from_cols_array(&columns);
            if matrix.row(3) != glam::DVec4::W {
                return Err(VolumeError::corrupt(format!(
                    "the last column of a grid's affine map is {}; it must be (0, 0, 0, 1)",
                    matrix.row(3)
                )));
            }
            matrix
        }
        _ => {
            return Err(VolumeError::Unsupported {
                found: format!("the transform {name}"),
                accepted: "UniformScaleMap, UniformScaleTranslateMap, ScaleMap, ScaleTranslateMap, TranslationMap, \
                    AffineMap, UnitaryMap",
            });
        }
    })
}

fn vector(cursor: &mut Cursor) -> Result<DVec3, VolumeError> {
    Ok(DVec3::new(cursor.f64(WHAT)?, cursor.f64(WHAT)?, cursor.f64(WHAT)?))
}

/// The voxel size, and three vectors of reciprocals, all of which follow from the scale.
fn skip_derived_scales(cursor: &mut Cursor) -> Result<(), VolumeError> {
    (0..4).try_for_each(|_| vector(cursor).map(drop))
}
