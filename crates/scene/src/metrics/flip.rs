//! FLIP: what an observer notices when flipping between two pictures [Andersson20].
//!
//! The colour pipeline blurs both pictures as the eye does at the viewing distance (contrast sensitivity, in the
//! opponent space YCxCz), then takes their distance in Hunt-adjusted L*a*b*. The feature pipeline compares edges and
//! points. A pixel error is the colour error raised to one minus the feature error, so that visible structure amplifies
//! it.
//!
//! Agrees with NVIDIA's own implementation (crate `nv-flip`) to 2e-4 in every pixel, see the tests.

use glam::{Mat3, Vec3};
use rayon::prelude::*;

use super::filter::{gaussian, separable};
use crate::image::tonemap::srgb_decode;

/// The default viewing condition: 0.7 m from a screen of 0.7 m and 3840 pixels. [Andersson20]
pub const PIXELS_PER_DEGREE: f32 = 67.0;

/// Linear Rec. 709 → CIE XYZ, column by column. [IEC 61966-2-1]
const XYZ_FROM_RGB: Mat3 = Mat3::from_cols(
    Vec3::new(0.412_390_8, 0.212_639, 0.019_330_82),
    Vec3::new(0.357_584_33, 0.715_168_65, 0.119_194_78),
    Vec3::new(0.180_480_8, 0.072_192_32, 0.950_532_14),
);

/// The contrast sensitivity of the three opponent channels, as sums of Gaussians: weight and scale b [degree²].
/// [Andersson20]
const SENSITIVITY_Y: [(f32, f32); 1] = [(1.0, 0.0047)];
const SENSITIVITY_CX: [(f32, f32); 1] = [(1.0, 0.0053)];
const SENSITIVITY_CZ: [(f32, f32); 2] = [(34.1, 0.04), (13.5, 0.025)];
/// The widest of them sets the size of all filters.
const WIDEST: f32 = 0.04;

/// Exponent of the colour distance. [Andersson20]
const Q_C: f32 = 0.7;
/// Colour distances up to this part of the largest ...
const P_C: f32 = 0.4;
/// ... take this part of the scale. [Andersson20]
const P_T: f32 = 0.95;
/// Width of the features that are looked for [degree]. [Andersson20]
const FEATURE_WIDTH: f32 = 0.082;
/// Exponent of the feature distance. [Andersson20]
const Q_F: f32 = 0.5;

/// FLIP error of every pixel, 0..=1, between two pictures of `width` columns and sRGB-encoded values. Which one is the
/// reference makes no difference.
#[must_use]
pub fn flip(a: &[[f32; 3]], b: &[[f32; 3]], width: usize, pixels_per_degree: f32) -> Vec<f32> {
    let (seen_a, seen_b) = (see(a, width, pixels_per_degree), see(b, width, pixels_per_degree));
    let scale = ColourScale::new();
    let error = |(a, b): (&Seen, &Seen)| {
        let edges = (a.edge - b.edge).abs();
        let points = (a.point - b.point).abs();
        // [Andersson20]
        let feature = (edges.max(points) * std::f32::consts::FRAC_1_SQRT_2).powf(Q_F).min(1.0);
        // [Andersson20]
        scale.error(a.lab, b.lab).powf(1.0 - feature)
    };
    seen_a.par_iter().zip(&seen_b).map(error).collect()
}

/// Mean of an error map.
#[must_use]
pub fn mean(errors: &[f32]) -> f64 {
    errors.par_iter().map(|&e| f64::from(e)).sum::<f64>() / errors.len() as f64
}

/// The smallest error that at least the part `fraction` (0..=1) of all pixels does not exceed; `errors` is not empty.
#[must_use]
pub fn percentile(errors: &[f32], fraction: f64) -> f64 {
    let rank = (errors.len() as f64 * fraction).ceil() as usize;
    let index = rank.clamp(1, errors.len()) - 1;
    let mut sorted = errors.to_vec();
    f64::from(*sorted.select_nth_unstable_by(index, f32::total_cmp).1)
}

/// What the eye has of a pixel.
#[derive(Clone, Copy)]
struct Seen {
    /// Hunt-adjusted L*a*b* of the blurred picture.
    lab: Vec3,
    /// Strength of an edge through the pixel.
    edge: f32,
    /// Strength of a point or line on the pixel.
    point: f32,
}

fn see(pixels: &[[f32; 3]], width: usize, pixels_per_degree: f32) -> Vec<Seen> {
    let opponent: Vec<Vec3> = pixels.par_iter().map(|p| opponent_from_srgb(Vec3::from(*p))).collect();
    let plane = |c: usize| opponent.par_iter().map(|p| p[c]).collect::<Vec<f32>>();
    let blur = |c, sensitivity: &[_]| contrast_sensitivity(&plane(c), width, sensitivity, pixels_per_degree);
    let (y, cx, cz) = (blur(0, &SENSITIVITY_Y), blur(1, &SENSITIVITY_CX), blur(2, &SENSITIVITY_CZ));

    // Y of YCxCz is 116 Y/Yn − 16; features are looked for in 0..=1. [Andersson20]
    let lightness: Vec<f32> = opponent.par_iter().map(|p| (p.x + 16.0) / 116.0).collect();
    let kernels = FeatureKernels::new(pixels_per_degree);
    let strength = |kernel: &[f32]| {
        let across = separable(&lightness, width, kernel, &kernels.smooth);
        let down = separable(&lightness, width, &kernels.smooth, kernel);
        across.into_iter().zip(down).map(|(x, y)| x.hypot(y)).collect::<Vec<f32>>()
    };
    let (edge, point) = (strength(&kernels.edge), strength(&kernels.point));
    let seen = |i: usize| Seen {
        lab: hunt_lab(rgb_from_opponent(Vec3::new(y[i], cx[i], cz[i])).clamp(Vec3::ZERO, Vec3::ONE)),
        edge: edge[i],
        point: point[i],
    };
    (0..pixels.len()).into_par_iter().map(seen).collect()
}

/// Blurs one opponent channel by its contrast sensitivity, a sum of Gaussians a √(π/b) exp(−π² r²/b), r in degrees,
/// normalised as a whole. [Andersson20] Each term is separable, so each is normalised on its own and weighted by the
/// volume under it.
fn contrast_sensitivity(plane: &[f32], width: usize, terms: &[(f32, f32)], pixels_per_degree: f32) -> Vec<f32> {
    use std::f32::consts::PI;
    let sigma = |b: f32| (b / (2.0 * PI * PI)).sqrt() * pixels_per_degree;
    let radius = (3.0 * sigma(WIDEST)).ceil() as usize;
    let volume = |(a, b): (f32, f32)| {
        let across: f32 =
            (0..=2 * radius).map(|k| (-0.5 * ((k as f32 - radius as f32) / sigma(b)).powi(2)).exp()).sum();
        a * (PI / b).sqrt() * across * across
    };
    let total: f32 = terms.iter().copied().map(volume).sum();
    let mut sum = vec![0.0; plane.len()];
    for &term in terms {
        let share = volume(term) / total;
        let kernel = gaussian(sigma(term.1), radius);
        for (sum, value) in sum.iter_mut().zip(separable(plane, width, &kernel, &kernel)) {
            *sum += share * value;
        }
    }
    sum
}

/// A Gaussian and its first two derivatives. Positive weights of a derivative sum to 1, negative ones to −1.
/// [Andersson20]
struct FeatureKernels {
    smooth: Vec<f32>,
    edge: Vec<f32>,
    point: Vec<f32>,
}

impl FeatureKernels {
    fn new(pixels_per_degree: f32) -> Self {
        let sigma = 0.5 * FEATURE_WIDTH * pixels_per_degree;
        let radius = (3.0 * sigma).ceil() as usize;
        let smooth = gaussian(sigma, radius);
        let derivative = |weight: fn(f32) -> f32| {
            let raw = smooth.iter().enumerate().map(|(k, g)| weight((k as f32 - radius as f32) / sigma) * g);
            let raw: Vec<f32> = raw.collect();
            let positive: f32 = raw.iter().filter(|&&w| w > 0.0).sum();
            let negative: f32 = -raw.iter().filter(|&&w| w < 0.0).sum::<f32>();
            raw.into_iter().map(|w| w / if w > 0.0 { positive } else { negative }).collect()
        };
        let (edge, point) = (derivative(|x| -x), derivative(|x| x * x - 1.0));
        Self { smooth, edge, point }
    }
}

/// Maps colour distances to 0..=1. [Andersson20]
struct ColourScale {
    /// The largest distance between two colours of the display: green and blue.
    largest: f32,
}

impl ColourScale {
    fn new() -> Self {
        Self { largest: hyab(hunt_lab(Vec3::Y), hunt_lab(Vec3::Z)).powf(Q_C) }
    }

    fn error(&self, a: Vec3, b: Vec3) -> f32 {
        let distance = hyab(a, b).powf(Q_C);
        let bend = P_C * self.largest;
        let error = if distance < bend {
            P_T / bend * distance
        } else {
            P_T + (distance - bend) / (self.largest - bend) * (1.0 - P_T)
        };
        error.min(1.0)
    }
}

/// City-block distance in lightness, Euclidean in colour. [Andersson20]
fn hyab(a: Vec3, b: Vec3) -> f32 {
    let d = a - b;
    d.x.abs() + d.y.hypot(d.z)
}

/// XYZ of the display's white, linear (1, 1, 1).
fn white() -> Vec3 {
    XYZ_FROM_RGB * Vec3::ONE
}

/// sRGB-encoded → YCxCz: a linear relative of L*a*b*, so that blurring it is blurring light. [Andersson20]
fn opponent_from_srgb(srgb: Vec3) -> Vec3 {
    let v = XYZ_FROM_RGB * srgb.map(srgb_decode) / white();
    Vec3::new(116.0 * v.y - 16.0, 500.0 * (v.x - v.y), 200.0 * (v.y - v.z))
}

/// YCxCz → linear Rec. 709, possibly outside 0..=1.
fn rgb_from_opponent(opponent: Vec3) -> Vec3 {
    let y = (opponent.x + 16.0) / 116.0;
    let v = Vec3::new(y + opponent.y / 500.0, y, y - opponent.z / 200.0);
    XYZ_FROM_RGB.inverse() * (v * white())
}

/// Linear Rec. 709 → L*a*b* [CIE 15], its colours weakened in the dark (Hunt effect). [Andersson20]
fn hunt_lab(rgb: Vec3) -> Vec3 {
    const DELTA: f32 = 6.0 / 29.0;
    let root = |t: f32| {
        if t > DELTA.powi(3) { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    };
    let v = (XYZ_FROM_RGB * rgb / white()).map(root);
    let lightness = 116.0 * v.y - 16.0;
    let hunt = 0.01 * lightness;
    Vec3::new(lightness, hunt * 500.0 * (v.x - v.y), hunt * 200.0 * (v.y - v.z))
}

#[cfg(test)]
mod test;
