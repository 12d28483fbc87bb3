//! From linear radiance to what a screen shows: exposure, then AgX, then the sRGB transfer function.
//!
//! AgX is Troy Sobotka's view transform [Sobotka22]: colours are first pulled towards grey (the inset), then every
//! channel runs through a sigmoid over 16.5 stops of log₂ exposure, then the inset is undone. Very bright saturated
//! light so goes to white, as film and eye have it, instead of clipping to a pure primary. The sigmoid is Benjamin
//! Wrensch's polynomial of degree six fitted to the "base" look [Wrensch23],
//! <https://iolite-engine.com/blog_posts/minimal_agx_implementation>.
//!
//! 18 % grey comes out at 0.50 (sRGB-encoded), 2^-12.47 and darker at 0, 2^4.03 = 16.3 and brighter at 0.999.

use glam::{Mat3, Vec3};
use rayon::prelude::*;

use super::{DisplayImage, Image};

/// log₂ of the darkest linear value that is told apart from black. [Wrensch23]
const MIN_EV: f32 = -12.47393;
/// log₂ of the brightest linear value that is told apart from white. [Wrensch23]
const MAX_EV: f32 = 4.026069;
/// Input is limited to the largest half float, far beyond white, so that infinity cannot turn into NaN.
const MAX_INPUT: f32 = 65504.0;

/// Linear Rec. 709 → the inset working space, column by column. [Wrensch23]
const INSET: Mat3 = Mat3::from_cols(
    Vec3::new(0.842_479_05, 0.042_328_224, 0.042_375_655),
    Vec3::new(0.078_433_6, 0.878_468_63, 0.078_433_6),
    Vec3::new(0.079_223_745, 0.079_166_13, 0.879_143),
);

/// The exact inverse of [`INSET`].
const OUTSET: Mat3 = Mat3::from_cols(
    Vec3::new(1.196_879, -0.052_896_85, -0.052_971_64),
    Vec3::new(-0.098_020_88, 1.151_903_2, -0.098_043_45),
    Vec3::new(-0.099_029_74, -0.098_961_18, 1.151_073_7),
);

/// The sRGB transfer function, linear 0..=1 → encoded 0..=1. [IEC 61966-2-1]
#[must_use]
pub fn srgb_encode(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The inverse of [`srgb_encode`], encoded 0..=1 → linear 0..=1. [IEC 61966-2-1]
#[must_use]
pub fn srgb_decode(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// AgX of one pixel.
///
/// Input: linear Rec. 709 after exposure, 1 being the radiance shown as diffuse white; negative and NaN channels count
/// as 0. Output: sRGB-encoded display values (Rec. 709 primaries, IEC 61966-2-1 transfer) in 0..=1, never NaN.
///
/// The polynomial's own output is meant for a pure 2.2 power display; it is made linear with that power and encoded
/// anew, so that the result is right for the sRGB transfer function that PNG viewers and sRGB swap chains assume.
#[must_use]
pub fn agx(rgb: Vec3) -> Vec3 {
    // NaN is not greater than 0 either.
    let limited = rgb.map(|c| if c > 0.0 { c.min(MAX_INPUT) } else { 0.0 });
    let stops = (INSET * limited).map(|c| ((c.log2() - MIN_EV) / (MAX_EV - MIN_EV)).clamp(0.0, 1.0));
    let display = OUTSET * stops.map(sigmoid);
    display.map(|c| srgb_encode(c.clamp(0.0, 1.0).powf(2.2)))
}

/// The "base" AgX curve: log exposure 0..=1 → display value for a 2.2 power display, −0.002..=0.999. [Wrensch23]
fn sigmoid(x: f32) -> f32 {
    const COEFFICIENTS: [f32; 7] = [-0.00232, 0.1191, 0.4298, -6.868, 31.96, -40.14, 15.5];
    COEFFICIENTS.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// What a screen shows of `image`: multiplied by 2^`exposure` (`exposure` in stops, EV), then [`agx`].
#[must_use]
pub fn display(image: &Image, exposure: f32) -> DisplayImage {
    let scale = exposure.exp2();
    let pixels = image.pixels.par_iter().map(|&p| agx(Vec3::from(p) * scale).to_array()).collect();
    DisplayImage { width: image.width, height: image.height, pixels }
}

#[cfg(test)]
mod test {
    use super::*;

    fn grey(value: f32) -> f32 {
        let out = agx(Vec3::splat(value));
        assert!((out.max_element() - out.min_element()).abs() < 1e-3, "grey {value} became coloured: {out}");
        out.y
    }

    #[test]
    fn greys_are_monotone_and_land_where_documented() {
        assert!(grey(0.0) < 1e-3);
        assert!(grey(2f32.powf(-12.5)) < 1e-3);
        assert!((grey(0.18) - 0.50).abs() < 5e-3, "{}", grey(0.18));
        assert!((grey(16.3) - 0.999).abs() < 1e-3, "{}", grey(16.3));
        let mut last = -1.0;
        for step in 0..=2000 {
            let value = grey(2f32.powf(-15.0 + step as f32 * 0.01));
            assert!(value >= last, "at step {step}: {value} after {last}");
            last = value;
        }
    }

    #[test]
    fn the_outset_undoes_the_inset() {
        assert!((OUTSET * INSET).abs_diff_eq(Mat3::IDENTITY, 1e-6));
    }

    #[test]
    fn bright_saturated_light_goes_to_white() {
        for primary in [Vec3::X, Vec3::Y, Vec3::Z] {
            let saturation = |v: Vec3| v.max_element() - v.min_element();
            assert!(saturation(agx(primary * 0.5)) > 0.3);
            assert!(agx(primary * 1000.0).min_element() > 0.99);
        }
    }

    #[test]
    fn no_input_gives_nan() {
        let values = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, -0.0, 0.0, 1e-40, 1.0, f32::MAX];
        for r in values {
            for g in values {
                for b in values {
                    let out = agx(Vec3::new(r, g, b));
                    assert!(out.to_array().iter().all(|c| (0.0..=1.0).contains(c)), "{r} {g} {b}: {out}");
                }
            }
        }
        assert_eq!(agx(Vec3::splat(-3.0)), agx(Vec3::ZERO));
    }

    #[test]
    fn the_srgb_transfer_function_round_trips() {
        for code in 0..=255 {
            let encoded = code as f32 / 255.0;
            assert!((srgb_encode(srgb_decode(encoded)) - encoded).abs() < 1e-6);
        }
        assert!((srgb_encode(0.214_041_14) - 0.5).abs() < 1e-6);
    }

    #[test]
    fn exposure_counts_in_stops() {
        let image = |v: f32| Image { width: 1, height: 1, pixels: vec![[v, 2.0 * v, 0.0]], ..Image::default() };
        assert_eq!(display(&image(0.1), 2.0), display(&image(0.4), 0.0));
        assert_ne!(display(&image(0.1), 1.0), display(&image(0.4), 0.0));
    }
}
