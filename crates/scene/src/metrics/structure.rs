//! PSNR and SSIM of display values.

use rayon::prelude::*;

use super::filter::{gaussian, separable};

/// Side of SSIM's window [pixel]. [Wang04, 3.C]
const WINDOW: usize = 11;
/// Standard deviation of SSIM's window [pixel]. [Wang04, 3.C]
const SIGMA: f32 = 1.5;
/// K₁² and K₂² for values in 0..=1. [Wang04, 3.C]
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// Peak signal-to-noise ratio [dB]: −10 log₁₀ of the mean squared difference over pixels and channels, the peak being
/// 1. Infinite if `a` equals `b`.
#[must_use]
pub fn psnr_db(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let (a, b) = (a.as_flattened(), b.as_flattened());
    let sum: f64 = a.par_iter().zip(b).map(|(&a, &b)| (f64::from(a) - f64::from(b)).powi(2)).sum();
    -10.0 * (sum / a.len() as f64).log10()
}

/// Mean structural similarity [Wang04 (13), (17)] of the luma (Rec. 709 weights on sRGB-encoded values), −1..=1.
///
/// Gaussian window of 11×11 pixels, σ = 1.5, K₁ = 0.01, K₂ = 0.03, over the pixels whose window lies wholly inside.
/// Where the image is smaller than the window, the window shrinks in that direction to the largest odd length that
/// fits.
#[must_use]
pub fn ssim(a: &[[f32; 3]], b: &[[f32; 3]], width: usize) -> f64 {
    let height = a.len() / width;
    let radius = |length: usize| (WINDOW.min(length) - 1) / 2;
    let (rx, ry) = (radius(width), radius(height));
    let (across, down) = (gaussian(SIGMA, rx), gaussian(SIGMA, ry));
    let mean = |plane: &[f32]| separable(plane, width, &across, &down);
    let product = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| a * b).collect::<Vec<f32>>();

    let (a, b) = (luma(a), luma(b));
    let (mean_a, mean_b) = (mean(&a), mean(&b));
    let (mean_aa, mean_bb, mean_ab) = (mean(&product(&a, &a)), mean(&product(&b, &b)), mean(&product(&a, &b)));
    let at = |i: usize| {
        let (ma, mb) = (f64::from(mean_a[i]), f64::from(mean_b[i]));
        let variances = f64::from(mean_aa[i]) + f64::from(mean_bb[i]) - ma * ma - mb * mb;
        let covariance = f64::from(mean_ab[i]) - ma * mb;
        // [Wang04 (13)]
        (2.0 * ma * mb + C1) * (2.0 * covariance + C2) / ((ma * ma + mb * mb + C1) * (variances + C2))
    };
    let rows = ry..height - ry;
    let count = rows.len() * (width - 2 * rx);
    let sum: f64 = rows.flat_map(|y| y * width + rx..(y + 1) * width - rx).map(at).sum();
    sum / count as f64
}

/// Luma of sRGB-encoded values. [ITU-R BT.709-6]
fn luma(pixels: &[[f32; 3]]) -> Vec<f32> {
    pixels.par_iter().map(|[r, g, b]| 0.2126 * r + 0.7152 * g + 0.0722 * b).collect()
}

#[cfg(test)]
mod test {
    use super::*;

    fn grey(values: impl IntoIterator<Item = f32>) -> Vec<[f32; 3]> {
        values.into_iter().map(|v| [v; 3]).collect()
    }

    fn texture(width: usize, height: usize) -> Vec<[f32; 3]> {
        grey((0..width * height).map(|i| 0.5 + 0.4 * ((i * i % 97) as f32).sin()))
    }

    #[test]
    fn psnr_of_a_constant_offset() {
        let (a, b) = (grey([0.25; 8]), grey([0.35; 8]));
        assert!((psnr_db(&a, &b) - 20.0).abs() < 1e-4);
        assert_eq!(psnr_db(&a, &a), f64::INFINITY);
        let one_channel = [[0.3, 0.5, 0.5]];
        assert!((psnr_db(&one_channel, &grey([0.5])) - -10.0 * (0.04f64 / 3.0).log10()).abs() < 1e-4);
    }

    #[test]
    fn ssim_of_equal_images_is_one() {
        for (width, height) in [(40, 30), (11, 11), (12, 4), (3, 50), (2, 2), (1, 1)] {
            let image = texture(width, height);
            assert!((ssim(&image, &image, width) - 1.0).abs() < 1e-6, "{width}×{height}");
        }
    }

    #[test]
    fn ssim_of_two_constants_is_the_luminance_term() {
        let (a, b) = (0.25f64, 0.75f64);
        let expected = (2.0 * a * b + C1) / (a * a + b * b + C1);
        let found = ssim(&grey([0.25; 400]), &grey([0.75; 400]), 20);
        assert!((found - expected).abs() < 1e-4, "{found} {expected}");
    }

    #[test]
    fn ssim_of_one_window_is_the_formula() {
        // An 11×11 image has one window inside; moments by direct double sums.
        let a = texture(11, 11);
        let b: Vec<[f32; 3]> = a.iter().enumerate().map(|(i, p)| p.map(|v| 0.7 * v + (i % 5) as f32 * 0.05)).collect();
        let mut weighted = Vec::new();
        for y in -5i32..=5 {
            for x in -5i32..=5 {
                let i = ((y + 5) * 11 + x + 5) as usize;
                weighted.push((f64::from(-(x * x + y * y)) / 4.5, f64::from(a[i][0]), f64::from(b[i][0])));
            }
        }
        let total: f64 = weighted.iter().map(|w| w.0.exp()).sum();
        let mean = |f: &dyn Fn(f64, f64) -> f64| weighted.iter().map(|w| w.0.exp() * f(w.1, w.2)).sum::<f64>() / total;
        let (ma, mb) = (mean(&|a, _| a), mean(&|_, b| b));
        let (va, vb) = (mean(&|a, _| (a - ma).powi(2)), mean(&|_, b| (b - mb).powi(2)));
        let cov = mean(&|a, b| (a - ma) * (b - mb));
        let expected = (2.0 * ma * mb + C1) * (2.0 * cov + C2) / ((ma * ma + mb * mb + C1) * (va + vb + C2));
        assert!((ssim(&a, &b, 11) - expected).abs() < 1e-4);
    }

    #[test]
    fn ssim_sees_noise_and_inversion() {
        let image = texture(40, 30);
        let inverse: Vec<_> = image.iter().map(|p| p.map(|v| 1.0 - v)).collect();
        assert!(ssim(&image, &inverse, 40) < 0.0);
        let mut shifted = image.clone();
        shifted.rotate_left(1);
        assert!(ssim(&image, &shifted, 40) < 0.5);
    }
}
