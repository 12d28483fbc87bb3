//! What comes out: linear images with their Monte Carlo statistics, and the pictures made of them for a screen.
//!
//! | module | idea |
//! |---|---|
//! | [`exr`] | linear images, losslessly, to and from OpenEXR bytes |
//! | [`hdr`] | linear images from Radiance bytes |
//! | [`png`] | display-referred images to and from PNG bytes |
//! | [`tonemap`] | linear radiance → what a screen shows |
//! | [`mod@file`] | whole files or none (not on wasm32) |

pub mod exr;
#[cfg(not(target_arch = "wasm32"))]
pub mod file;
pub mod hdr;
pub mod png;
pub mod tonemap;

use std::collections::BTreeMap;

#[cfg(not(target_arch = "wasm32"))]
pub use file::write_atomically;

/// The most pixels an image may have: 2²⁸, a square of 16384². A file that claims more is refused before any memory is
/// asked for.
pub const MAX_PIXELS: u64 = 1 << 28;

/// How many times larger than its file a decoded image may be. Deflate reaches 1032; a file beyond this is damaged or
/// meant to exhaust memory. Images under [`FREE_BYTES`] are exempt.
const MAX_EXPANSION: u64 = 4096;

/// Decoded images up to this many bytes are accepted whatever the size of their file.
const FREE_BYTES: u64 = 16 << 20;

/// A linear Rec. 709 RGB image, row 0 at the top.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Image {
    /// Columns [pixel].
    pub width: u32,
    /// Rows [pixel].
    pub height: u32,
    /// Radiance [W·sr⁻¹·m⁻²], `width * height` pixels, row by row from the top.
    pub pixels: Vec<[f32; 3]>,
    /// How sure the pixels are, if a Monte Carlo method made them.
    pub statistics: Option<Statistics>,
    /// Further channels by their names in an EXR, such as `depth.Z`: each a value a pixel, written and not read.
    pub channels: BTreeMap<String, Vec<f32>>,
    /// Free text that travels with the image (method, seed, scene hash, ...), by name.
    pub attributes: BTreeMap<String, String>,
}

/// Monte Carlo statistics of the pixels of an [`Image`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Statistics {
    /// Unbiased variance of *one* sample [(W·sr⁻¹·m⁻²)²], a value a channel. The pixel is a mean of independent
    /// samples, so its own variance is `variance / samples`.
    pub variance: Vec<[f32; 3]>,
    /// Samples taken in each pixel.
    pub samples: Vec<u32>,
}

/// A picture as a screen shows it, row 0 at the top.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DisplayImage {
    /// Columns [pixel].
    pub width: u32,
    /// Rows [pixel].
    pub height: u32,
    /// sRGB-encoded values (Rec. 709 primaries, IEC 61966-2-1 transfer) in 0..=1, row by row from the top.
    pub pixels: Vec<[f32; 3]>,
}

/// An image file's content: an EXR holds radiance, a PNG holds what a screen shows, and neither can stand for the
/// other.
#[derive(Debug, Clone, PartialEq)]
pub enum Picture {
    /// Radiance, from an EXR.
    Linear(Image),
    /// Display values, from a PNG.
    Display(DisplayImage),
}

/// Why an image could not be decoded, encoded, read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// An image without pixels.
    #[error("the image is empty ({width}×{height} pixels)")]
    Empty {
        /// Columns [pixel].
        width: u32,
        /// Rows [pixel].
        height: u32,
    },
    /// More than [`MAX_PIXELS`].
    #[error("an image of {width}×{height} pixels was found; at most {MAX_PIXELS} pixels (16384²) are accepted")]
    TooLarge {
        /// Columns [pixel].
        width: u64,
        /// Rows [pixel].
        height: u64,
    },
    /// A file that claims implausibly much more data than it holds.
    #[error("a file of {file} bytes claims to hold {decoded} bytes of pixels: it is damaged")]
    Expansion {
        /// Length of the file [byte].
        file: u64,
        /// Claimed length of the decoded pixels [byte].
        decoded: u64,
    },
    /// An image that needs more memory than it may take. Nothing was allocated.
    #[error("a picture of {width} x {height} pixels needs {bytes} bytes; the budget is {budget}")]
    Budget {
        /// Columns [pixel].
        width: u32,
        /// Rows [pixel].
        height: u32,
        /// Memory that decoding takes [byte].
        bytes: u64,
        /// Memory that it may take [byte].
        budget: u64,
    },
    /// A buffer whose length does not match the image's size.
    #[error("`{field}` holds {found} values where width × height = {expected} are needed")]
    Length {
        /// Field of [`Image`], [`Statistics`] or [`DisplayImage`].
        field: &'static str,
        /// Values found.
        found: usize,
        /// Values needed.
        expected: u64,
    },
    /// Neither an EXR nor a PNG signature at the start.
    #[error("the data are not an image that Tyndall reads; accepted are OpenEXR and PNG")]
    UnknownFormat,
    /// A path whose extension names no image format.
    #[error(
        "`{path}`: the extension `{found}` names no image format; accepted are `.exr` (linear) and `.png` (display)"
    )]
    UnknownExtension {
        /// The path as given.
        path: String,
        /// Its extension, with the dot; empty if it has none.
        found: String,
    },
    /// Damaged or unsupported EXR data, or an EXR that cannot be written.
    #[error("EXR: {0}")]
    Exr(String),
    /// Damaged or unsupported Radiance data.
    #[error("Radiance: {0}")]
    Hdr(String),
    /// Damaged or unsupported PNG data, or a PNG that cannot be written.
    #[error("PNG: {0}")]
    Png(String),
    /// Any of the above, in a file.
    #[error("`{path}`: {source}")]
    InFile {
        /// The path as given.
        path: String,
        /// What is wrong with the content.
        source: Box<ImageError>,
    },
    /// The operating system refused to read or write.
    #[error("`{path}`: {source}")]
    Io {
        /// The path as given.
        path: String,
        /// The system's error.
        source: std::io::Error,
    },
}

impl Image {
    /// Checks that the image has pixels, not too many, and that every buffer has one value a pixel.
    ///
    /// # Errors
    /// [`ImageError::Empty`], [`ImageError::TooLarge`], [`ImageError::Length`].
    pub fn check(&self) -> Result<(), ImageError> {
        let expected = pixel_count(self.width, self.height)?;
        check_length("pixels", self.pixels.len(), expected)?;
        if let Some(statistics) = &self.statistics {
            check_length("variance", statistics.variance.len(), expected)?;
            check_length("samples", statistics.samples.len(), expected)?;
        }
        self.channels.values().try_for_each(|values| check_length("channels", values.len(), expected))
    }
}

impl DisplayImage {
    /// Checks that the image has pixels, not too many, and as many values as pixels.
    ///
    /// # Errors
    /// [`ImageError::Empty`], [`ImageError::TooLarge`], [`ImageError::Length`].
    pub fn check(&self) -> Result<(), ImageError> {
        check_length("pixels", self.pixels.len(), pixel_count(self.width, self.height)?)
    }
}

impl Picture {
    /// Decodes the bytes of an EXR or PNG file; which of the two, its first bytes say.
    ///
    /// # Errors
    /// [`ImageError::UnknownFormat`], and what [`exr::decode`] and [`png::decode`] report.
    pub fn decode(bytes: &[u8]) -> Result<Self, ImageError> {
        if bytes.starts_with(&exr::SIGNATURE) {
            exr::decode(bytes).map(Self::Linear)
        } else if bytes.starts_with(&png::SIGNATURE) {
            png::decode(bytes).map(Self::Display)
        } else {
            Err(ImageError::UnknownFormat)
        }
    }

    /// Columns and rows [pixel].
    #[must_use]
    pub fn size(&self) -> (u32, u32) {
        match self {
            Self::Linear(image) => (image.width, image.height),
            Self::Display(image) => (image.width, image.height),
        }
    }
}

/// `width * height` of an image that is neither empty nor too large.
fn pixel_count(width: u32, height: u32) -> Result<u64, ImageError> {
    let count = u64::from(width) * u64::from(height);
    match count {
        0 => Err(ImageError::Empty { width, height }),
        1..=MAX_PIXELS => Ok(count),
        _ => Err(ImageError::TooLarge { width: width.into(), height: height.into() }),
    }
}

fn check_length(field: &'static str, found: usize, expected: u64) -> Result<(), ImageError> {
    if found as u64 == expected { Ok(()) } else { Err(ImageError::Length { field, found, expected }) }
}

/// Refuses a file that claims `decoded` bytes of pixels where its own length makes that implausible.
fn check_expansion(file: usize, decoded: u64) -> Result<(), ImageError> {
    let file = file as u64;
    if decoded <= FREE_BYTES || decoded <= file.saturating_mul(MAX_EXPANSION) {
        Ok(())
    } else {
        Err(ImageError::Expansion { file, decoded })
    }
}

#[cfg(test)]
mod test {
    use super::*;

    #[test]
    fn wrong_lengths_are_refused() {
        let image = Image { width: 2, height: 2, pixels: vec![[0.0; 3]; 3], ..Image::default() };
        assert!(matches!(image.check(), Err(ImageError::Length { field: "pixels", found: 3, expected: 4 })));
        let statistics = Statistics { variance: vec![[0.0; 3]; 4], samples: vec![1; 5] };
        let image = Image { pixels: vec![[0.0; 3]; 4], statistics: Some(statistics), ..image };
        assert!(matches!(image.check(), Err(ImageError::Length { field: "samples", .. })));
        assert!(matches!(Image::default().check(), Err(ImageError::Empty { .. })));
        let huge = DisplayImage { width: u32::MAX, height: u32::MAX, pixels: Vec::new() };
        assert!(matches!(huge.check(), Err(ImageError::TooLarge { .. })));
    }

    #[test]
    fn other_formats_are_refused() {
        for bytes in [&b""[..], b"v/1", b"GIF89a......", b"\xff\xd8\xff\xe0"] {
            assert!(matches!(Picture::decode(bytes), Err(ImageError::UnknownFormat)));
        }
    }
}
