//! Pictures on surfaces.

use std::io::Cursor;
use std::sync::Arc;

use glam::{Affine2, Vec2, Vec3, Vec4};
use image::{ImageDecoder as _, ImageFormat, ImageReader, Limits};

use crate::volume::Budget;

/// A picture on a surface, and how it lies there.
#[derive(Clone, Debug)]
pub struct Map {
    /// The picture.
    pub texture: Arc<Texture>,
    /// What is beyond its left and right edge, and beyond its top and bottom.
    pub wrap: [Wrap; 2],
    /// Maps texture coordinates to those of the picture.
    pub transform: Affine2,
    /// Whether it takes the second set of texture coordinates.
    pub second: bool,
    /// Whether mip levels of it are of use: not where neighbouring texels belong to places that lie apart, as in light maps.
    pub mips: bool,
}

/// What is beyond an edge of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The picture again.
    #[default]
    Repeat,
    /// Its image in a mirror, and then it again.
    Mirror,
    /// The texels of the edge.
    Clamp,
}

/// The first and the second texture coordinates of a point.
pub type Texcoords = [Vec2; 2];

impl PartialEq for Map {
    fn eq(&self, other: &Self) -> bool {
        let how = |map: &Self| (map.wrap, map.transform, map.second, map.mips);
        Arc::ptr_eq(&self.texture, &other.texture) && how(self) == how(other)
    }
}

impl Map {
    /// A picture that repeats, in the first set of texture coordinates.
    pub fn new(texture: Texture) -> Self {
        Self {
            texture: Arc::new(texture),
            wrap: Default::default(),
            transform: Affine2::IDENTITY,
            second: false,
            mips: true,
        }
    }

    /// Where in the picture a point is: (0, 0) is its top left corner, (1, 1) its bottom right.
    pub fn place(&self, uv: Texcoords) -> Vec2 {
        self.transform.transform_point2(uv[usize::from(self.second)])
    }

    /// Linear red, green, blue, alpha at texture coordinates: bilinear between texels' centres.
    pub fn at(&self, uv: Texcoords) -> Vec4 {
        let (place, texture) = (self.place(uv), &self.texture);
        let [(left, right, fx), (above, below, fy)] = [(place.x, texture.width, 0), (place.y, texture.height, 1)]
            .map(|(x, n, axis)| self.wrap[axis].texels(x, n));
        let row = |y| texture.texel(left, y).lerp(texture.texel(right, y), fx);
        row(above).lerp(row(below), fy)
    }
}

impl Wrap {
    /// The two texels, of `count`, that a coordinate lies between, and how far it is from the first to the second.
    fn texels(self, x: f32, count: u32) -> (u32, u32, f32) {
        let x = if x.abs() < 1e30 { x } else { 0.0 };
        let folded = match self {
            Self::Repeat => x.rem_euclid(1.0),
            // From 0 to 1 and back.
            Self::Mirror => 1.0 - (1.0 - x.rem_euclid(2.0)).abs(),
            Self::Clamp => x.clamp(0.0, 1.0),
        };
        let place = folded * count as f32 - 0.5;
        let low = place.floor();
        let [first, last] = [low, low + 1.0].map(|i| match self {
            Self::Repeat => (i as i64).rem_euclid(i64::from(count)) as u32,
            // Beside an edge a mirror shows its texels, too.
            Self::Mirror | Self::Clamp => (i.max(0.0) as u32).min(count - 1),
        });
        (first, last, place - low)
    }
}

/// A map of normals in tangent space: (2·rgb − 1)·(scale, scale, 1), then made a unit vector.
#[derive(Clone, Debug, PartialEq)]
pub struct NormalMap {
    /// The picture.
    pub map: Map,
    /// How strong it is.
    pub scale: f32,
}

/// A picture in memory, 8 bits a channel.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Texture {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Red, green, blue, alpha; row by row from the top.
    pub texels: Vec<[u8; 4]>,
    /// Whether red, green and blue are sRGB, and not linear.
    pub srgb: bool,
}

/// Why a file is no texture.
#[derive(Debug, thiserror::Error)]
pub enum TextureError {
    /// Another kind of file.
    #[error("found neither a PNG nor a JPEG file; accepted: these two")]
    Format,
    /// A picture that cannot be read.
    #[error("the picture is corrupt: {0}")]
    Corrupt(String),
    /// More texels than there is memory for. Nothing was allocated.
    #[error("a picture of {width} x {height} pixels needs {bytes} bytes; the budget is {budget}")]
    TooLarge {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// Bytes that it would need.
        bytes: u64,
        /// Bytes allowed.
        budget: u64,
    },
}

impl Texture {
    /// A texture of the bytes of a PNG or JPEG file, which are told by how they begin. Channels of 16 bits are rounded to 8.
    ///
    /// # Errors
    /// Other formats, damaged files, and those that need more memory than the budget.
    pub fn decode(bytes: &[u8], srgb: bool, budget: Budget) -> Result<Self, TextureError> {
        let format = image::guess_format(bytes).map_err(|_| TextureError::Format)?;
        if !matches!(format, ImageFormat::Png | ImageFormat::Jpeg) {
            return Err(TextureError::Format);
        }
        let corrupt = |error: image::ImageError| TextureError::Corrupt(error.to_string());
        let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
        let mut limits = Limits::no_limits();
        limits.max_alloc = Some(budget.0);
        reader.limits(limits);
        let decoder = reader.into_decoder().map_err(corrupt)?;
        let (width, height) = decoder.dimensions();
        // The decoder's own picture, and ours beside it.
        let needed = decoder.total_bytes().saturating_add(u64::from(width) * u64::from(height) * 4);
        if needed > budget.0 {
            return Err(TextureError::TooLarge { width, height, bytes: needed, budget: budget.0 });
        }
        let picture = image::DynamicImage::from_decoder(decoder).map_err(corrupt)?.into_rgba8();
        let texels = picture.pixels().map(|pixel| pixel.0).collect();
        Ok(Self { width, height, texels, srgb })
    }

    /// A texture of linear red, green and blue from 0 to 1, row by row from the top: in sRGB, rounded to 8 bits. Missing rows are black.
    pub fn of_light([width, height]: [u32; 2], values: impl Iterator<Item = Vec3>) -> Self {
        let byte = |x: f32| (srgb_from_linear(x.clamp(0.0, 1.0)) * 255.0).round() as u8;
        let mut texels: Vec<_> = values.map(|v| [byte(v.x), byte(v.y), byte(v.z), 255]).collect();
        texels.resize(width as usize * height as usize, [0, 0, 0, 255]);
        Self { width, height, texels, srgb: true }
    }

    /// Bytes of memory.
    pub fn bytes(&self) -> u64 {
        size_of_val(self.texels.as_slice()) as u64
    }

    /// Linear red, green, blue, alpha of a texel.
    fn texel(&self, column: u32, row: u32) -> Vec4 {
        let texel = self.texels[row as usize * self.width as usize + column as usize];
        let [r, g, b, a] = texel.map(|byte| f32::from(byte) / 255.0);
        if !self.srgb {
            return Vec4::new(r, g, b, a);
        }
        Vec4::new(linear_from_srgb(r), linear_from_srgb(g), linear_from_srgb(b), a)
    }
}

/// Linear light of an sRGB value, and the other way. [IEC 61966-2-1]
pub(super) fn linear_from_srgb(x: f32) -> f32 {
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

/// See [`linear_from_srgb`].
pub(super) fn srgb_from_linear(x: f32) -> f32 {
    if x <= 0.0031308 { x * 12.92 } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod test;
