//! Separable filters on single-channel images, edges repeated outwards.

use rayon::prelude::*;

/// Convolves the rows with `across` and the columns with `down`. Both kernels have odd length and their centre in the
/// middle; `kernel[k]` weighs the pixel `k - length / 2` further right or down. Beyond its edges the image repeats its
/// outermost pixels.
pub fn separable(plane: &[f32], width: usize, across: &[f32], down: &[f32]) -> Vec<f32> {
    vertical(&horizontal(plane, width, across), width, down)
}

fn horizontal(plane: &[f32], width: usize, kernel: &[f32]) -> Vec<f32> {
    let radius = kernel.len() / 2;
    let mut out = vec![0.0; plane.len()];
    out.par_chunks_mut(width).zip(plane.par_chunks(width)).for_each(|(out, row)| {
        let mut padded = vec![row[0]; radius];
        padded.extend_from_slice(row);
        padded.resize(width + 2 * radius, row[width - 1]);
        for (k, &weight) in kernel.iter().enumerate() {
            add_scaled(out, &padded[k..k + width], weight);
        }
    });
    out
}

fn vertical(plane: &[f32], width: usize, kernel: &[f32]) -> Vec<f32> {
    let (radius, height) = (kernel.len() / 2, plane.len() / width);
    let mut out = vec![0.0; plane.len()];
    out.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        for (k, &weight) in kernel.iter().enumerate() {
            let from = (y + k).saturating_sub(radius).min(height - 1);
            add_scaled(out, &plane[from * width..(from + 1) * width], weight);
        }
    });
    out
}

fn add_scaled(out: &mut [f32], values: &[f32], weight: f32) {
    for (out, value) in out.iter_mut().zip(values) {
        *out += weight * value;
    }
}

/// exp(−x²/2σ²) for x = −radius..=radius, summing to 1. `sigma` [pixel].
pub fn gaussian(sigma: f32, radius: usize) -> Vec<f32> {
    let radius = radius as i32;
    let kernel: Vec<f32> = (-radius..=radius).map(|x| (-0.5 * (x as f32 / sigma).powi(2)).exp()).collect();
    let sum: f32 = kernel.iter().sum();
    kernel.into_iter().map(|w| w / sum).collect()
}

#[cfg(test)]
mod test {
    use super::*;

    #[test]
    fn a_shift_kernel_shifts_and_repeats_the_edge() {
        let plane = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        // The pixel to the right, from the row below.
        let shifted = separable(&plane, 3, &[0.0, 0.0, 1.0], &[0.0, 0.0, 1.0]);
        assert_eq!(shifted, [5.0, 6.0, 6.0, 5.0, 6.0, 6.0]);
        assert_eq!(separable(&plane, 3, &[1.0, 0.0, 0.0], &[1.0]), [1.0, 1.0, 2.0, 4.0, 4.0, 5.0]);
    }

    #[test]
    fn a_kernel_wider_than_the_image_averages_it() {
        let smooth = separable(&[0.0, 1.0], 2, &gaussian(50.0, 20), &[1.0]);
        assert!((smooth[0] - 0.5).abs() < 0.02 && (smooth[1] - 0.5).abs() < 0.02, "{smooth:?}");
    }

    #[test]
    fn a_gaussian_sums_to_one() {
        let kernel = gaussian(1.5, 5);
        assert_eq!(kernel.len(), 11);
        assert!((kernel.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        assert!((kernel[6] / kernel[5] - (-1.0f32 / 4.5).exp()).abs() < 1e-6);
    }
}
