//! Trigonometric moments of the absorbance along a ray [Munstermann18].
//!
//! b_k = Σ_i −ln(1 − α_i) e^{ikφ_i} with φ = (2π − ω) z: depths lie on a circle, of which [`WRAPPING_ZONE`] stays empty between the
//! end and the beginning. As with power moments, what is taken lies between the least and the greatest part of the absorbance that
//! can lie before a depth; no end of the ray is favoured.

use std::f64::consts::{PI, TAU};
use std::ops::{Add, Mul, Sub};

use super::moments::OVERESTIMATION;
use super::{Basis, roots::roots};

/// Sums b₀, then the real and imaginary parts of b₁ … b_m, with m = 2, 3 or 4.
#[derive(Clone, Copy, Debug)]
pub struct Trigonometric {
    /// m.
    pub moments: usize,
    /// How much of the moments of what lies everywhere alike, which vanish, is mixed into them, so that rounding leaves them moments
    /// of something.
    pub bias: f64,
}

impl Trigonometric {
    /// For sums in 32-bit floats [Munstermann18].
    pub fn single(moments: usize) -> Self {
        Self { moments, bias: BIAS[moments - 2] }
    }
}

/// The bias of m = 2, 3, 4 moments in 32-bit floats [Munstermann18].
const BIAS: [f64; 3] = [4e-7, 8e-7, 1.5e-6];

/// ω, the angle in which nothing lies [Munstermann18]. A layer that is found there lies as much before the ray's beginning as behind its
/// end, as it is near to either.
pub const WRAPPING_ZONE: f64 = 0.1 * PI;

/// The angle of a depth of 1.
const TURN: f64 = TAU - WRAPPING_ZONE;

impl Basis for Trigonometric {
    fn count(&self) -> usize {
        2 * self.moments + 1
    }

    fn deposit(&self, sums: &mut [f64], depth: f64, absorbance: f64) {
        for (k, sum) in sums.iter_mut().enumerate() {
            let (sin, cos) = (k.div_ceil(2) as f64 * TURN * depth).sin_cos();
            *sum += absorbance * if is_sine(k) { sin } else { cos };
        }
    }

    fn deposit_segment(&self, sums: &mut [f64], [begin, end]: [f64; 2], extinction: f64) {
        for (k, sum) in sums.iter_mut().enumerate() {
            let frequency = k.div_ceil(2) as f64 * TURN;
            let integral = |z: f64| match k {
                0 => z,
                _ if is_sine(k) => -(frequency * z).cos() / frequency,
                _ => (frequency * z).sin() / frequency,
            };
            *sum += extinction * (integral(end) - integral(begin));
        }
    }

    fn optical_depth(&self, sums: &[f64], depth: f64) -> f64 {
        if sums[0] <= 0.0 {
            return 0.0;
        }
        let m = self.moments;
        let share = (1.0 - self.bias) / sums[0];
        let moment = |k: usize| if k == 0 { ONE } else { Complex(sums[2 * k - 1] * share, sums[2 * k] * share) };
        let lower = cholesky(m, |j, k| moment(j - k));
        let phase = TURN * depth;
        let here = powers(m, phase);
        // K(z) = Σ conj(q_k) z^k with B q = (1, z₀, …): its roots are the other places of the distribution of m + 1 layers with these
        // moments that has one at z₀. [Jones89]
        let mut q = forward(&lower, &here);
        for i in (0..=m).rev() {
            let known = (i + 1..=m).fold(ZERO, |sum, k| sum + lower[k][i].conjugate() * q[k]);
            q[i] = (q[i] - known).scaled(1.0 / lower[i][i].0);
        }
        // With z = z₀ (t − i)/(t + i) it is a real polynomial of t, and t = −cot(δ/2) where z is δ ahead of z₀.
        let mut polynomial = vec![ZERO; m + 1];
        let mut others = vec![ZERO; m + 1];
        polynomial[0] = q[m].conjugate() * here[m];
        others[0] = ONE;
        for k in (0..m).rev() {
            multiply(&mut polynomial, Complex(0.0, -1.0));
            multiply(&mut others, Complex(0.0, 1.0));
            let factor = q[k].conjugate() * here[k];
            for (sum, other) in polynomial.iter_mut().zip(&others) {
                *sum = *sum + factor * *other;
            }
        }
        let real: Vec<f64> = polynomial.iter().map(|c| c.0).collect();
        // The weight of a layer at z is 1 / K(z, z).
        let weight = |at: &[Complex]| 1.0 / forward(&lower, at).iter().map(|c| c.0 * c.0 + c.1 * c.1).sum::<f64>();
        let own = weight(&here);
        let (mut before, mut all) = (OVERESTIMATION * own, own);
        for t in roots(&real) {
            let angle = phase + 2.0 * 1f64.atan2(-t);
            let weight = weight(&powers(m, angle));
            before += weight * ((angle - TURN) / WRAPPING_ZONE).clamp(0.0, 1.0);
            all += weight;
        }
        sums[0] * (before / all).clamp(0.0, 1.0)
    }
}

fn is_sine(k: usize) -> bool {
    k > 0 && k.is_multiple_of(2)
}

#[derive(Clone, Copy, Debug)]
struct Complex(f64, f64);

const ZERO: Complex = Complex(0.0, 0.0);
const ONE: Complex = Complex(1.0, 0.0);

impl Complex {
    fn conjugate(self) -> Self {
        Self(self.0, -self.1)
    }

    fn scaled(self, factor: f64) -> Self {
        Self(self.0 * factor, self.1 * factor)
    }
}

impl Add for Complex {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0, self.1 + other.1)
    }
}

impl Sub for Complex {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0, self.1 - other.1)
    }
}

impl Mul for Complex {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        Self(self.0 * other.0 - self.1 * other.1, self.0 * other.1 + self.1 * other.0)
    }
}

/// 1, z, … z^m at an angle.
fn powers(m: usize, angle: f64) -> Vec<Complex> {
    (0..=m).map(|k| (k as f64 * angle).sin_cos()).map(|(sin, cos)| Complex(cos, sin)).collect()
}

/// Cholesky's decomposition L of a Hermitian matrix, of which the lower half is given: the moments are those of a distribution, so that
/// no pivot vanishes.
fn cholesky(m: usize, entry: impl Fn(usize, usize) -> Complex) -> Vec<Vec<Complex>> {
    let mut lower = vec![vec![ZERO; m + 1]; m + 1];
    for i in 0..=m {
        for j in 0..=i {
            let known = (0..j).fold(ZERO, |sum, k| sum + lower[i][k] * lower[j][k].conjugate());
            let rest = entry(i, j) - known;
            lower[i][j] =
                if i == j { Complex(rest.0.max(1e-30).sqrt(), 0.0) } else { rest.scaled(1.0 / lower[j][j].0) };
        }
    }
    lower
}

/// L⁻¹ v.
fn forward(lower: &[Vec<Complex>], v: &[Complex]) -> Vec<Complex> {
    let mut solved: Vec<Complex> = Vec::with_capacity(v.len());
    for (row, &right) in lower.iter().zip(v) {
        let rest = solved.iter().zip(row).fold(right, |rest, (&x, &l)| rest - l * x);
        solved.push(rest.scaled(1.0 / row[solved.len()].0));
    }
    solved
}

/// Multiplies a polynomial of t, lowest power first, by t + c; its highest power is 0 before.
fn multiply(polynomial: &mut [Complex], c: Complex) {
    for k in (0..polynomial.len()).rev() {
        let below = if k == 0 { ZERO } else { polynomial[k - 1] };
        polynomial[k] = polynomial[k] * c + below;
    }
}
