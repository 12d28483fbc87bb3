//! An error map as a picture.

use super::Report;
use crate::image::DisplayImage;

/// The FLIP error of every pixel in the magma colour map: black is no error, then purple, orange, and pale yellow at 1.
#[must_use]
pub fn error_map(report: &Report) -> DisplayImage {
    let pixels = report.flip_map.iter().map(|&error| magma(error)).collect();
    DisplayImage { width: report.width, height: report.height, pixels }
}

/// The colour map "magma" of Smith and van der Walt (matplotlib, CC0), sRGB-encoded, at `t` in 0..=1; within 0.03 of
/// their table. The polynomials are Matt Zucker's fit, <https://www.shadertoy.com/view/WlfXRN> (CC0).
fn magma(t: f32) -> [f32; 3] {
    const COEFFICIENTS: [[f32; 3]; 7] = [
        [-0.002_136_485, -0.000_749_655, -0.005_386_128],
        [0.251_660_54, 0.677_523_24, 2.494_026_6],
        [8.353_717, -3.577_719_5, 0.314_467_9],
        [-27.668_733, 14.264_731, -13.649_213],
        [52.176_14, -27.943_606, 12.944_169],
        [-50.768_524, 29.046_583, 4.234_153],
        [18.655_706, -11.489_774, -5.601_961_5],
    ];
    let t = t.clamp(0.0, 1.0);
    std::array::from_fn(|c| COEFFICIENTS.iter().rev().fold(0.0, |sum, k| sum * t + k[c]).clamp(0.0, 1.0))
}

#[cfg(test)]
mod test {
    use super::*;

    #[test]
    fn magma_is_within_its_tolerance() {
        let table = nv_flip::magma_lut().to_vec();
        for (i, expected) in table.chunks(3).enumerate() {
            let found = magma(i as f32 / 255.0);
            for c in 0..3 {
                let expected = f32::from(expected[c]) / 255.0;
                assert!((found[c] - expected).abs() < 0.03, "{i}: {found:?} {expected:?}");
            }
        }
    }

    #[test]
    fn magma_grows_brighter() {
        let brightness = |i: u32| magma(i as f32 / 64.0).iter().sum::<f32>();
        assert!((1..=64).all(|i| brightness(i) > brightness(i - 1)));
    }
}
