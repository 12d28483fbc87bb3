//! How wrong a picture is: one comparison of an image with a reference gives a [`Report`] of several measures.
//!
//! | module | measure | on |
//! |---|---|---|
//! | [`linear`] | RMSE, and how much of it is noise and how much bias | radiance |
//! | [`structure`] | PSNR and SSIM | display values |
//! | [`flip`] | FLIP, what an observer notices when flipping between the two | display values |
//! | [`ztest`] | whether the difference is more than the noise explains | radiance and its variance |
//! | [`map`] | the FLIP error map as a picture | |
//!
//! Display values are sRGB-encoded; a linear image gets there by [`tonemap::display`] with the same exposure for both.

mod filter;
pub mod flip;
pub mod linear;
pub mod map;
pub mod structure;
pub mod ztest;

use crate::image::{Image, ImageError, Picture, tonemap};

pub use map::error_map;

/// What a comparison may be told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Exposure of both images before the tone map [EV]; linear images only. Default 0.
    pub exposure: f32,
    /// Pixels in one degree of the observer's view, for FLIP, in 5..=1000. Default [`flip::PIXELS_PER_DEGREE`].
    pub pixels_per_degree: f32,
    /// Side of the blocks that are averaged before the z-test [pixel], at least 1. Default [`ztest::BLOCK`].
    pub z_block: u32,
}

impl Default for Options {
    fn default() -> Self {
        Self { exposure: 0.0, pixels_per_degree: flip::PIXELS_PER_DEGREE, z_block: ztest::BLOCK }
    }
}

/// All measures of one comparison. Infinite numbers become `null` in JSON.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Report {
    /// Columns of both images [pixel].
    pub width: u32,
    /// Rows of both images [pixel].
    pub height: u32,
    /// Errors in radiance; absent if either picture is display-referred.
    pub linear: Option<linear::LinearErrors>,
    /// Peak signal-to-noise ratio of the display values [dB]; infinite for equal pictures.
    pub psnr_db: f64,
    /// Structural similarity of the display values' luma, at most 1, which is equality.
    pub ssim: f64,
    /// Mean of the FLIP error over all pixels, 0 (no visible difference) to 1.
    pub flip_mean: f64,
    /// 99th percentile of the FLIP error: 1 % of the pixels are worse.
    pub flip_p99: f64,
    /// Whether noise explains the difference; present if both images carry statistics.
    pub z_test: Option<ztest::ZTest>,
    /// FLIP error of every pixel, row by row from the top; see [`error_map`].
    #[serde(skip)]
    pub flip_map: Vec<f32>,
}

/// Which of the two pictures an error speaks of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The picture under test, the first argument.
    Image,
    /// What it is measured against, the second argument.
    Reference,
}

impl std::fmt::Display for Side {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Image => "image",
            Self::Reference => "reference",
        })
    }
}

/// Why two pictures could not be compared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MetricError {
    /// The pictures differ in size.
    #[error("the image has {}×{} pixels, the reference {}×{}; they must be equal", image.0, image.1, reference.0, reference.1)]
    Size {
        /// Columns and rows of the image [pixel].
        image: (u32, u32),
        /// Columns and rows of the reference [pixel].
        reference: (u32, u32),
    },
    /// An empty picture, or one whose buffers do not match its size.
    #[error("the {side} cannot be compared: {source}")]
    Malformed {
        /// Which picture.
        side: Side,
        /// What is wrong with it.
        source: ImageError,
    },
    /// A NaN or infinite pixel.
    #[error("the {side} has the value {value} in pixel x = {x}, y = {y}, channel {channel}; finite values are needed")]
    NotFinite {
        /// Which picture.
        side: Side,
        /// Column, from the left, from 0.
        x: u32,
        /// Row, from the top, from 0.
        y: u32,
        /// `R`, `G` or `B`.
        channel: char,
        /// The value found.
        value: f32,
    },
    /// A variance that is negative or not finite, or a pixel without samples.
    #[error(
        "the {side} has variance {variance:?} of {samples} samples in pixel x = {x}, y = {y}; finite variances ≥ 0 and at \
         least one sample are needed"
    )]
    Statistics {
        /// Which picture.
        side: Side,
        /// Column, from the left, from 0.
        x: u32,
        /// Row, from the top, from 0.
        y: u32,
        /// The variance found.
        variance: [f32; 3],
        /// The sample count found.
        samples: u32,
    },
    /// An option out of its range.
    #[error("`{option}` is {found}; accepted is {accepted}")]
    Option {
        /// Field of [`Options`].
        option: &'static str,
        /// The value found.
        found: f64,
        /// The range.
        accepted: &'static str,
    },
}

/// Measures `image` against `reference`.
///
/// If both are linear, all measures are given; the z-test needs statistics in both. If either is display-referred (a
/// PNG), both are compared as a screen shows them, and `linear` and `z_test` are absent.
///
/// # Errors
/// [`MetricError`] for different sizes, empty pictures, values that are not finite, and options out of range.
pub fn compare(image: &Picture, reference: &Picture, options: &Options) -> Result<Report, MetricError> {
    check_options(options)?;
    check_picture(image, Side::Image)?;
    check_picture(reference, Side::Reference)?;
    let (width, height) = image.size();
    if (width, height) != reference.size() {
        return Err(MetricError::Size { image: (width, height), reference: reference.size() });
    }

    let shown = |picture: &Picture| match picture {
        Picture::Linear(image) => tonemap::display(image, options.exposure).pixels,
        Picture::Display(image) => image.pixels.clone(),
    };
    let (a, b) = (shown(image), shown(reference));
    let flip_map = flip::flip(&a, &b, width as usize, options.pixels_per_degree);
    let (linear, z_test) = match (image, reference) {
        (Picture::Linear(a), Picture::Linear(b)) => {
            (Some(linear::linear_errors(a, b)), ztest::z_test(a, b, options.z_block))
        }
        _ => (None, None),
    };
    Ok(Report {
        width,
        height,
        linear,
        psnr_db: structure::psnr_db(&a, &b),
        ssim: structure::ssim(&a, &b, width as usize),
        flip_mean: flip::mean(&flip_map),
        flip_p99: flip::percentile(&flip_map, 0.99),
        z_test,
        flip_map,
    })
}

fn check_options(options: &Options) -> Result<(), MetricError> {
    let check = |option, found: f64, valid: bool, accepted| {
        if valid { Ok(()) } else { Err(MetricError::Option { option, found, accepted }) }
    };
    let Options { exposure, pixels_per_degree: ppd, z_block } = *options;
    check("exposure", exposure.into(), exposure.abs() <= 100.0, "-100 to 100 EV")?;
    check("pixels_per_degree", ppd.into(), (5.0..=1000.0).contains(&ppd), "5 to 1000 pixels")?;
    check("z_block", z_block.into(), z_block >= 1, "1 pixel or more")
}

fn check_picture(picture: &Picture, side: Side) -> Result<(), MetricError> {
    let (checked, pixels) = match picture {
        Picture::Linear(image) => (image.check(), &image.pixels),
        Picture::Display(image) => (image.check(), &image.pixels),
    };
    checked.map_err(|source| MetricError::Malformed { side, source })?;
    let width = picture.size().0;
    let at = |i: usize| ((i % width as usize) as u32, (i / width as usize) as u32);
    if let Some(i) = pixels.as_flattened().iter().position(|v| !v.is_finite()) {
        let (x, y) = at(i / 3);
        let value = pixels.as_flattened()[i];
        return Err(MetricError::NotFinite { side, x, y, channel: ['R', 'G', 'B'][i % 3], value });
    }
    if let Picture::Linear(Image { statistics: Some(statistics), .. }) = picture {
        for (i, (&variance, &samples)) in statistics.variance.iter().zip(&statistics.samples).enumerate() {
            if samples == 0 || !variance.iter().all(|v| (0.0..f32::INFINITY).contains(v)) {
                let (x, y) = at(i);
                return Err(MetricError::Statistics { side, x, y, variance, samples });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod test;
