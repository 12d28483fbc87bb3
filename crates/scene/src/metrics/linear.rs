//! Errors in radiance, and what part of them is noise.
//!
//! With a = image, b = reference, v = variance of one sample, n = samples, and all sums over pixels and channels:
//!
//! - rmse = √(Σ(a−b)² / N)
//! - relative rmse = √(Σ(a−b)² / Σb²)
//! - noise = √(Σ v/n / Σb²), the relative rmse that the image's (or the reference's) own noise alone would cause
//! - relative bias = √(max(0, Σ((a−b)² − v_a/n_a − v_b/n_b)) / Σb²), since E(a−b)² is the squared bias plus both
//!   variances

use rayon::prelude::*;

use crate::image::Image;

/// Errors of an image against a reference, in radiance.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct LinearErrors {
    /// Root of the mean squared difference over all pixels and channels [W·sr⁻¹·m⁻²].
    pub rmse: f64,
    /// `rmse` over the root mean square of the reference; infinite if only the reference is black.
    pub relative_rmse: f64,
    /// The part of `relative_rmse` that the image's own noise explains; absent without its statistics.
    pub noise: Option<f64>,
    /// The part of `relative_rmse` that the reference's noise explains; absent without its statistics. An error near
    /// this says more of the reference than of the image.
    pub reference_noise: Option<f64>,
    /// `relative_rmse` after the known variances are taken out: what more samples would not mend. 0 if noise explains
    /// all; absent if neither image has statistics. If only one has, the other's noise counts as bias.
    pub relative_bias: Option<f64>,
}

/// Errors of `a` against the reference `b`, two images of one size. See the module for the formulas.
#[must_use]
pub fn linear_errors(a: &Image, b: &Image) -> LinearErrors {
    let (pixels_a, pixels_b) = (a.pixels.as_flattened(), b.pixels.as_flattened());
    let squared: f64 = pixels_a.par_iter().zip(pixels_b).map(|(&a, &b)| (f64::from(a) - f64::from(b)).powi(2)).sum();
    let power: f64 = pixels_b.par_iter().map(|&b| f64::from(b).powi(2)).sum();
    let (variance_a, variance_b) = (variance_of_means(a), variance_of_means(b));
    let relative = |sum: f64| {
        if sum == 0.0 { 0.0 } else { (sum / power).sqrt() }
    };
    let known = match (variance_a, variance_b) {
        (None, None) => None,
        _ => Some(variance_a.unwrap_or(0.0) + variance_b.unwrap_or(0.0)),
    };
    LinearErrors {
        rmse: (squared / pixels_a.len() as f64).sqrt(),
        relative_rmse: relative(squared),
        noise: variance_a.map(relative),
        reference_noise: variance_b.map(relative),
        relative_bias: known.map(|variance| relative((squared - variance).max(0.0))),
    }
}

/// Σ v/n over pixels and channels [(W·sr⁻¹·m⁻²)²].
fn variance_of_means(image: &Image) -> Option<f64> {
    let statistics = image.statistics.as_ref()?;
    let of_pixel = |(v, &n): (&[f32; 3], &u32)| v.iter().map(|&v| f64::from(v)).sum::<f64>() / f64::from(n);
    Some(statistics.variance.par_iter().zip(&statistics.samples).map(of_pixel).sum())
}

#[cfg(test)]
mod test {
    use super::*;
    use crate::image::Statistics;

    fn image(pixels: Vec<[f32; 3]>, variance: Option<(f32, u32)>) -> Image {
        let count = pixels.len();
        let statistics = variance.map(|(v, n)| Statistics { variance: vec![[v; 3]; count], samples: vec![n; count] });
        Image { width: count as u32, height: 1, pixels, statistics, ..Image::default() }
    }

    #[test]
    fn a_constant_offset_is_the_rmse() {
        let a = image(vec![[1.5, 2.5, 3.5], [0.5, 0.5, 0.5]], None);
        let b = image(vec![[1.0, 2.0, 3.0], [0.0, 0.0, 0.0]], None);
        let errors = linear_errors(&a, &b);
        assert!((errors.rmse - 0.5).abs() < 1e-12);
        assert!((errors.relative_rmse - (6.0 * 0.25 / 14.0f64).sqrt()).abs() < 1e-12);
        assert_eq!((errors.noise, errors.reference_noise, errors.relative_bias), (None, None, None));
    }

    #[test]
    fn noise_and_bias_add_in_squares() {
        // Difference 0.5 everywhere; variances of the means 0.16 and 0.05 leave a squared bias of 0.04.
        let a = image(vec![[2.5; 3]; 4], Some((0.64, 4)));
        let b = image(vec![[2.0; 3]; 4], Some((0.10, 2)));
        let errors = linear_errors(&a, &b);
        assert!((errors.noise.unwrap() - 0.4 / 2.0).abs() < 1e-6);
        assert!((errors.reference_noise.unwrap() - 0.05f64.sqrt() / 2.0).abs() < 1e-6);
        assert!((errors.relative_bias.unwrap() - 0.2 / 2.0).abs() < 1e-6);
    }

    #[test]
    fn a_difference_below_the_noise_is_no_bias() {
        let errors = linear_errors(&image(vec![[1.1; 3]], Some((1.0, 4))), &image(vec![[1.0; 3]], None));
        assert_eq!(errors.relative_bias, Some(0.0));
    }

    #[test]
    fn a_black_reference_gives_zero_or_infinity() {
        let black = image(vec![[0.0; 3]], None);
        assert_eq!(linear_errors(&black, &black).relative_rmse, 0.0);
        assert_eq!(linear_errors(&image(vec![[1.0; 3]], None), &black).relative_rmse, f64::INFINITY);
    }
}
