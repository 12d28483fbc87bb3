//! What counts as agreement.
//!
//! An estimate comes with its standard error. It agrees with a truth that is within [`SIGMAS`] of them, and it says
//! something only where they are small enough: a test states that as its `power`.

use glam::DVec3;
use rayon::prelude::*;
use tyndall_reference::Random;

/// Standard errors that an estimate may be off: two-sided probability 7e-6.
pub const SIGMAS: f64 = 4.5;

/// Relative error of scene data in single precision, after some arithmetic.
pub const ROUNDING: f64 = 3e-6;

/// Relative error of a transmittance through hundreds of bodies, whose depths are sums in double precision.
pub const SUM: f64 = 1e-9;

/// A table's integral by a rule whose points miss its nodes, and its values' rounding to single precision.
pub const TABLE: f64 = 1e-6;

/// Probability with which a whole comparison of many pixels may fail by chance.
pub const FAMILY: f64 = 1e-5;

/// A mean and its standard error.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    pub mean: DVec3,
    pub error: DVec3,
}

impl Estimate {
    /// The mean of a random function over `samples` independent calls.
    pub fn of(samples: u32, seed: u64, f: impl Fn(&mut Random) -> DVec3 + Sync) -> Self {
        const BLOCK: u32 = 256;
        let shift = f(&mut Random::new(seed, 0, 0));
        let blocks: Vec<_> = (0..samples.div_ceil(BLOCK))
            .into_par_iter()
            .map(|block| {
                let of_block = block * BLOCK..samples.min((block + 1) * BLOCK);
                of_block.fold((DVec3::ZERO, DVec3::ZERO), |(sum, squares), sample| {
                    let x = f(&mut Random::new(seed, 0, sample.into()));
                    assert!(x.is_finite(), "sample {sample} of seed {seed} is {x}");
                    let x = x - shift;
                    (sum + x, squares + x * x)
                })
            })
            .collect();
        let (sum, squares) = blocks.into_iter().fold((DVec3::ZERO, DVec3::ZERO), |a, b| (a.0 + b.0, a.1 + b.1));
        let n = f64::from(samples);
        let (variance, mean) = ((squares - sum * sum / n) / (n - 1.0) / n, shift + sum / n);
        Self { mean, error: variance.max(DVec3::ZERO).map(f64::sqrt) }
    }

    /// Whether it agrees with a truth, with a standard error of at most `power` times the truth's largest channel.
    pub fn check(&self, truth: DVec3, power: f64) -> Result<(), String> {
        let scale = truth.abs().max_element();
        if self.error.max_element() > power * scale {
            return Err(format!("standard error {} is too large for a power of {power} at {truth}", self.error));
        }
        let bound = self.error * SIGMAS + ROUNDING * scale;
        if (self.mean - truth).abs().cmple(bound).all() {
            return Ok(());
        }
        Err(format!("{} ± {} should be {truth}", self.mean, self.error))
    }

    #[track_caller]
    pub fn assert(&self, truth: DVec3, power: f64) {
        if let Err(message) = self.check(truth, power) {
            panic!("{message}");
        }
    }
}

/// Whether pairs of independent estimates agree: a two-sample z-test of every channel, each at the significance at which
/// all together fail by chance with probability [`FAMILY`] [Šidák67]. `power` bounds the standard error of the mean
/// pair's difference, relative to its value.
pub fn agree(pairs: &[(Estimate, Estimate)], power: f64) -> Result<(), String> {
    let level = -(-FAMILY).ln_1p() / (3 * pairs.len()) as f64;
    let limit = normal_quantile(0.5 * level);
    let (mut error, mut value) = (0.0, 0.0);
    for (i, (a, b)) in pairs.iter().enumerate() {
        let sigma = (a.error * a.error + b.error * b.error).map(f64::sqrt);
        error += sigma.element_sum();
        value += a.mean.element_sum();
        let bound = sigma * limit + ROUNDING * a.mean.abs().max_element();
        if !(a.mean - b.mean).abs().cmple(bound).all() {
            return Err(format!("pair {i}: {} ± {} and {} ± {}", a.mean, a.error, b.mean, b.error));
        }
    }
    if error > power * value {
        return Err(format!("relative standard error {} is too large for a power of {power}", error / value));
    }
    Ok(())
}

/// The x that a normal variable exceeds with probability `tail` < 0.02, by bisection of Laplace's continued fraction.
fn normal_quantile(tail: f64) -> f64 {
    let exceeds = |x: f64| {
        let fraction = (1..60).rev().fold(x, |f, i| x + f64::from(i) / f);
        (-0.5 * x * x).exp() / (std::f64::consts::TAU.sqrt() * fraction)
    };
    let (mut low, mut high) = (2.0, 30.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if exceeds(middle) > tail { low = middle } else { high = middle }
    }
    low
}

/// Probability with which a χ² test may fail by chance.
pub const CHI_SQUARED: f64 = 1e-6;

/// The χ² that is exceeded with a probability [Wilson31].
pub fn chi_squared_critical(degrees: usize, tail: f64) -> f64 {
    let (k, z) = (degrees as f64, normal_quantile(tail));
    let h = 2.0 / (9.0 * k);
    k * (1.0 - h + z * h.sqrt()).powi(3)
}

/// Simpson's rule over [a, b] with 2n intervals.
pub fn integrate(a: f64, b: f64, n: u32, f: impl Fn(f64) -> f64) -> f64 {
    let h = (b - a) / f64::from(2 * n);
    let inner = (1..2 * n).map(|i| f(a + h * f64::from(i)) * if i % 2 == 1 { 4.0 } else { 2.0 });
    (f(a) + f(b) + inner.sum::<f64>()) * h / 3.0
}

/// ∫ f dcosθ between two cosines: in t, where cosθ = 1 − 2t⁴, which opens up a forward peak.
pub fn integrate_cosine(a: f64, b: f64, n: u32, f: impl Fn(f64) -> f64) -> f64 {
    let t = |mu: f64| (0.5 * (1.0 - mu)).max(0.0).powf(0.25);
    integrate(t(b), t(a), n, |t| 8.0 * t.powi(3) * f(1.0 - 2.0 * t.powi(4)))
}

#[test]
fn quantiles_are_those_of_tables() {
    assert!((normal_quantile(0.001) - 3.090232).abs() < 1e-5);
    assert!((normal_quantile(1e-6) - 4.753424).abs() < 1e-5);
    assert!((chi_squared_critical(50, 0.001) / 86.661 - 1.0).abs() < 1e-3);
    assert!((integrate(0.0, 1.0, 4, |x| x * x * x) - 0.25).abs() < 1e-12);
}

/// A bias of 1 % is found where the power allows it, and a test without power does not pass.
#[test]
fn comparators_refuse() {
    let fair = |rng: &mut Random| DVec3::splat(rng.uniform());
    let biased = |rng: &mut Random| DVec3::splat(rng.uniform() * 1.01);
    let half = DVec3::splat(0.5);
    Estimate::of(200_000, 1, fair).assert(half, 0.002);
    assert!(Estimate::of(200_000, 1, biased).check(half, 0.002).is_err());
    assert!(Estimate::of(100, 1, fair).check(half, 0.002).is_err());
    let pair = |n, f: fn(&mut Random) -> DVec3| vec![(Estimate::of(n, 1, fair), Estimate::of(n, 2, f)); 10];
    agree(&pair(200_000, fair), 0.002).unwrap();
    assert!(agree(&pair(200_000, biased), 0.002).is_err());
    assert!(agree(&pair(1000, fair), 0.002).is_err());
}
