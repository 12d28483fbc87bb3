//! Whether noise alone explains the difference of two Monte Carlo images.
//!
//! If both images estimate the same radiance, the difference of two means divided by its standard deviation,
//! z = (a − b) / √(v_a/n_a + v_b/n_b), is nearly normal with variance 1. Each block of pixels and each channel is one
//! test; all of them together may fail a right renderer with probability [`ALPHA`] at most (Šidák's correction: of m
//! tests each is held to 1 − (1 − α)^(1/m)). After Mitsuba 3's render tests and [Subr07].
//!
//! - Samples of a path tracer are skewed (few, bright), and a mean of few of them is not normal; so pixels are first
//!   averaged over blocks. At least 16 samples a pixel should stand behind the variances.
//! - Channels are tested one by one, since variances a channel do not say the variance of a luminance. They rise and
//!   fall together, which makes the correction slightly too lenient towards the renderer, never too strict.
//! - A difference of [`ROUNDING`] times the larger value is no evidence: it is taken off before the division. Without
//!   any noise a difference beyond that is an infinite z.

use crate::image::{Image, Statistics};

/// Probability that a right image fails, over all its blocks and channels together.
pub const ALPHA: f64 = 0.01;
/// Default side of the blocks that are averaged before the test [pixel]; those at the right and lower edge may be
/// smaller.
pub const BLOCK: u32 = 8;
/// Relative difference that is put down to `f32` arithmetic.
pub const ROUNDING: f64 = 1e-5;

/// What the z-test found.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct ZTest {
    /// Whether noise explains the difference: `max_z` is at most `threshold`.
    pub pass: bool,
    /// Largest |z| of all tests [standard deviations]; infinite if values differ that carry no noise.
    pub max_z: f64,
    /// Largest |z| that passes [standard deviations].
    pub threshold: f64,
    /// Probability of a |z| of at least `max_z` in one test, if the images estimate the same.
    pub min_p: f64,
    /// Probability that one test is held to, after Šidák's correction.
    pub threshold_p: f64,
    /// Column of the block of `max_z`, its left edge [pixel].
    pub x: u32,
    /// Row of the block of `max_z`, its upper edge [pixel].
    pub y: u32,
    /// Number of tests: blocks times channels.
    pub tests: usize,
    /// Mean z² over the tests that have noise; near 1 if the variances are right, well below if they are overestimated
    /// (as for stratified samples), above if the images differ. Absent if nothing has noise.
    pub mean_z_squared: Option<f64>,
}

/// Tests two images of one size in blocks of `block`² pixels. `None` unless both carry statistics.
#[must_use]
pub fn z_test(a: &Image, b: &Image, block: u32) -> Option<ZTest> {
    let (statistics_a, statistics_b) = (a.statistics.as_ref()?, b.statistics.as_ref()?);
    let block = block.max(1);
    let (mut max_z, mut x, mut y, mut tests) = (0.0, 0, 0, 0);
    let (mut noisy, mut sum) = (0usize, 0.0);
    for y0 in (0..a.height).step_by(block as usize) {
        for x0 in (0..a.width).step_by(block as usize) {
            let columns = x0..x0.saturating_add(block).min(a.width);
            let rows = y0..y0.saturating_add(block).min(a.height);
            let pixels = rows.flat_map(|y| columns.clone().map(move |x| y as usize * a.width as usize + x as usize));
            let mut means = [Block::default(); 3];
            for i in pixels {
                for (c, mean) in means.iter_mut().enumerate() {
                    mean.add(
                        a.pixels[i][c],
                        b.pixels[i][c],
                        [(statistics_a, i, c), (statistics_b, i, c)].map(variance),
                    );
                }
            }
            for mean in means {
                let z = mean.z();
                if mean.variance > 0.0 {
                    noisy += 1;
                    sum += z * z;
                }
                if z > max_z {
                    (max_z, x, y) = (z, x0, y0);
                }
                tests += 1;
            }
        }
    }
    // 1 − (1 − α)^(1/m), without losing digits for large m.
    let threshold_p = -((-ALPHA).ln_1p() / tests as f64).exp_m1();
    let threshold = z_of_p(threshold_p);
    Some(ZTest {
        pass: max_z <= threshold,
        max_z,
        threshold,
        min_p: p_of_z(max_z),
        threshold_p,
        x,
        y,
        tests,
        mean_z_squared: (noisy > 0).then(|| sum / noisy as f64),
    })
}

/// Variance of the mean of a pixel's channel.
fn variance((statistics, i, c): (&Statistics, usize, usize)) -> f64 {
    f64::from(statistics.variance[i][c]) / f64::from(statistics.samples[i])
}

/// Sums over the pixels of a block; the pixel count cancels in z.
#[derive(Clone, Copy, Default)]
struct Block {
    a: f64,
    b: f64,
    variance: f64,
}

impl Block {
    fn add(&mut self, a: f32, b: f32, variances: [f64; 2]) {
        self.a += f64::from(a);
        self.b += f64::from(b);
        self.variance += variances[0] + variances[1];
    }

    /// |z|, [`ROUNDING`] taken off.
    fn z(&self) -> f64 {
        let excess = (self.a - self.b).abs() - ROUNDING * self.a.abs().max(self.b.abs());
        if excess <= 0.0 { 0.0 } else { excess / self.variance.sqrt() }
    }
}

/// Probability that a standard normal variable is at least `z` from 0.
fn p_of_z(z: f64) -> f64 {
    erfc(z / std::f64::consts::SQRT_2)
}

/// The inverse of [`p_of_z`] for p in 1e-300..=1, by bisection.
fn z_of_p(p: f64) -> f64 {
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if p_of_z(middle) > p { low = middle } else { high = middle }
    }
    high
}

/// The complementary error function for x ≥ 0, to a relative error of 1e-12. Series below 2 [DLMF 7.6.2], continued
/// fraction above [DLMF 7.9.1].
fn erfc(x: f64) -> f64 {
    use std::f64::consts::PI;
    if x < 2.0 {
        // erf x = 2/√π exp(−x²) Σ 2ⁿ x²ⁿ⁺¹ / (2n+1)!!
        let (mut term, mut sum) = (x, x);
        for n in 1..100 {
            term *= 2.0 * x * x / f64::from(2 * n + 1);
            sum += term;
        }
        1.0 - 2.0 / PI.sqrt() * (-x * x).exp() * sum
    } else if x.is_finite() {
        // erfc x = exp(−x²)/√π · 1/(x + (1/2)/(x + 1/(x + (3/2)/(x + ...)))), from the inside out.
        let tail = (1..=100).rev().fold(x, |tail, n| x + 0.5 * f64::from(n) / tail);
        (-x * x).exp() / (PI.sqrt() * tail)
    } else {
        0.0
    }
}

#[cfg(test)]
mod test;
