//! The film: mean and variance of every pixel's samples, numerically stable [Welford62].

use glam::DVec3;
use tyndall_scene::image::{Image, Statistics};

use crate::ReferenceError;

/// A pixel's samples so far.
#[derive(Clone, Copy, Default)]
pub(crate) struct Pixel {
    pub samples: u32,
    mean: DVec3,
    /// Sum of squared deviations from the mean.
    squares: DVec3,
}

impl Pixel {
    pub fn add(&mut self, sample: DVec3) {
        self.samples += 1;
        let delta = sample - self.mean;
        self.mean += delta / f64::from(self.samples);
        self.squares += delta * (sample - self.mean);
    }

    /// The mean and its standard error; 0 where there are fewer than two samples.
    pub fn estimate(&self) -> [DVec3; 2] {
        [self.mean, (self.variance() / f64::from(self.samples.max(1))).map(f64::sqrt)]
    }

    /// Unbiased variance of one sample; 0 where there are fewer than two.
    fn variance(&self) -> DVec3 {
        self.squares / f64::from(self.samples.saturating_sub(1).max(1))
    }
}

/// A picture in the making.
pub(crate) struct Film {
    pub width: u32,
    pub height: u32,
    pub pixels: Vec<Pixel>,
    attributes: std::collections::BTreeMap<String, String>,
}

impl Film {
    /// An empty film of this size, or the continuation of an image.
    pub fn new(size: [u32; 2], previous: Option<Image>) -> Result<Self, ReferenceError> {
        let [width, height] = size;
        let Some(image) = previous else {
            let pixels = vec![Pixel::default(); width as usize * height as usize];
            return Ok(Self { width, height, pixels, attributes: Default::default() });
        };
        if [image.width, image.height] != size {
            return Err(ReferenceError::Size { found: [image.width, image.height], expected: size });
        }
        image.check().map_err(|error| ReferenceError::Image(error.to_string()))?;
        let statistics = image.statistics.ok_or(ReferenceError::NoStatistics)?;
        let rows = image.pixels.iter().zip(&statistics.variance).zip(&statistics.samples);
        let pixels = rows.map(|((mean, variance), &samples)| {
            let [mean, variance] = [mean, variance].map(|rgb| glam::Vec3::from(*rgb).as_dvec3());
            if !mean.is_finite() || !variance.is_finite() {
                return Err(ReferenceError::Image("a pixel or its variance is not finite".into()));
            }
            Ok(match samples {
                0 => Pixel::default(),
                n => Pixel { samples: n, mean, squares: variance * f64::from(n - 1) },
            })
        });
        Ok(Self { width, height, pixels: pixels.collect::<Result<_, _>>()?, attributes: image.attributes })
    }

    /// The samples that every pixel has; a film without pixels has all it can have.
    pub fn passes(&self) -> u32 {
        self.pixels.iter().map(|pixel| pixel.samples).min().unwrap_or(u32::MAX)
    }

    /// √(Σ variance/n / Σ mean²) over pixels and channels; infinite before every pixel has two samples.
    pub fn relative_error(&self) -> f64 {
        let (mut noise, mut signal) = (0.0, 0.0);
        for pixel in &self.pixels {
            if pixel.samples < 2 {
                return f64::INFINITY;
            }
            noise += pixel.variance().element_sum() / f64::from(pixel.samples);
            signal += pixel.mean.length_squared();
        }
        if noise == 0.0 { 0.0 } else { (noise / signal).sqrt() }
    }

    /// The picture with its statistics.
    pub fn into_image(self) -> Image {
        let rgb = |v: DVec3| v.as_vec3().to_array();
        Image {
            width: self.width,
            height: self.height,
            pixels: self.pixels.iter().map(|pixel| rgb(pixel.mean)).collect(),
            channels: Default::default(),
            statistics: Some(Statistics {
                variance: self.pixels.iter().map(|pixel| rgb(pixel.variance())).collect(),
                samples: self.pixels.iter().map(|pixel| pixel.samples).collect(),
            }),
            attributes: self.attributes,
        }
    }
}
