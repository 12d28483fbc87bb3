//! Light from all around, as a picture of latitude and longitude.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3, Vec3};

use crate::image::{Image, ImageError, exr, hdr};
use crate::volume::Budget;

/// A latitude–longitude map of radiance.
///
/// A direction (x, y, z) has the place u = ½ + (atan2(x, −z) + `rotation`)/2π, v = acos(y)/π in the picture's unit
/// square, u modulo 1, v from the top. So with no rotation the middle column is −z, the column a quarter to its right +x,
/// the upper edge the zenith +y. Texel (i, j) of w × h has its centre at ((i + ½)/w, (j + ½)/h). Between centres the
/// radiance is bilinear in u and v; it wraps round in u, and beyond the first and last row's centres it is constant in v.
///
/// A positive `rotation` turns the sky about +y, counterclockwise as seen from above.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentMap {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Radiance [W·sr⁻¹·m⁻²], `width * height` texels, row by row from the zenith; finite and not negative.
    pub pixels: Vec<[f32; 3]>,
    /// Rotation about the y axis [rad].
    pub rotation: f32,
}

/// Why a file is no environment map.
#[derive(Debug, thiserror::Error)]
pub enum EnvironmentError {
    /// Another kind of file.
    #[error("found neither an OpenEXR nor a Radiance file; accepted: these two")]
    Format,
    /// A picture that cannot be read, or has no pixels.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A texel that is no radiance.
    #[error(
        "the pixel in column {column}, row {row}, scaled, is {value:?}; accepted: three finite numbers >= 0 (from 0 at \
         the top left)"
    )]
    Radiance {
        /// Its column, from 0.
        column: u32,
        /// Its row, from 0 at the top.
        row: u32,
        /// Its value.
        value: [f32; 3],
    },
}

impl EnvironmentMap {
    /// A map of a picture, turned by `rotation` [rad].
    ///
    /// # Errors
    /// A picture that [`Image::check`] refuses, and pixels that are negative or not finite.
    pub fn new(image: Image, rotation: f32) -> Result<Self, EnvironmentError> {
        image.check()?;
        let Image { width, height, pixels, .. } = image;
        let accepted = |value: &f32| value.is_finite() && *value >= 0.0;
        if let Some(at) = pixels.iter().position(|pixel| !pixel.iter().all(accepted)) {
            let (column, row) = (at as u32 % width, at as u32 / width);
            return Err(EnvironmentError::Radiance { column, row, value: pixels[at] });
        }
        Ok(Self { width, height, pixels, rotation })
    }

    /// A map from the bytes of an OpenEXR or Radiance file, turned by an angle [degrees] and scaled.
    ///
    /// # Errors
    /// As [`EnvironmentMap::new`], other formats, damaged files, and those that need more memory than the budget.
    pub fn decode(bytes: &[u8], degrees: f32, scale: Vec3, budget: Budget) -> Result<Self, EnvironmentError> {
        let mut image = if bytes.starts_with(&exr::SIGNATURE) {
            exr::decode_within(bytes, budget)?
        } else if hdr::SIGNATURES.iter().any(|signature| bytes.starts_with(signature)) {
            hdr::decode(bytes, budget)?
        } else {
            return Err(EnvironmentError::Format);
        };
        for pixel in &mut image.pixels {
            *pixel = (Vec3::from(*pixel) * scale).to_array();
        }
        Self::new(image, degrees.rem_euclid(360.0).to_radians())
    }

    /// The radiance that arrives from a direction [W·sr⁻¹·m⁻²]; the direction need not be a unit vector.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let (width, height) = (self.width as usize, self.height as usize);
        let at = self.uv(direction.as_dvec3()) * DVec2::new(width as f64, height as f64) - 0.5;
        let (left, y) = (at.x.floor(), at.y.clamp(0.0, height as f64 - 1.0));
        let (s, t) = ((at.x - left) as f32, y.fract() as f32);
        // `left` is −1 at least, and rounding may give u = 1.
        let left = (left as isize).rem_euclid(width as isize) as usize;
        let right = (left + 1) % width;
        let upper = y as usize;
        let lower = (upper + 1).min(height - 1);
        let texel = |row: usize, column: usize| Vec3::from(self.pixels[row * width + column]);
        let along = |row: usize| texel(row, left).lerp(texel(row, right), s);
        along(upper).lerp(along(lower), t)
    }

    /// The place (u, v) of a direction in the picture's unit square.
    pub fn uv(&self, direction: DVec3) -> DVec2 {
        let longitude = direction.x.atan2(-direction.z) + f64::from(self.rotation);
        // The angle to the zenith as an arctangent: an arccosine is not accurate near the poles.
        let angle = direction.x.hypot(direction.z).atan2(direction.y);
        DVec2::new((0.5 + longitude / TAU).rem_euclid(1.0), angle / PI)
    }

    /// The unit direction at a place (u, v): the inverse of [`EnvironmentMap::uv`].
    pub fn direction(&self, uv: DVec2) -> DVec3 {
        let (sin, cos) = (TAU * (uv.x - 0.5) - f64::from(self.rotation)).sin_cos();
        let (radius, height) = (PI * uv.y).sin_cos();
        DVec3::new(sin * radius, height, -cos * radius)
    }
}

#[cfg(test)]
mod test;
