//! Power moments of the absorbance along a ray [Munstermann18].
//!
//! b_k = Σ_i −ln(1 − α_i) x_i^k with x = 2z − 1. Of all distributions of absorbance with these moments, the theory of moments
//! gives the least and the greatest part that can lie before a depth; what is taken lies between them. It is exact for as many
//! layers as half the moments; T(1) is not exact, as the bound takes a share of the last layer.

use super::{Basis, roots::roots};

/// Sums b₀ and b₁ … b_m, with m = 4, 6 or 8.
#[derive(Clone, Copy, Debug)]
pub struct Moments {
    /// m.
    pub moments: usize,
    /// How much of [`SAFE`] is mixed into them, so that rounding leaves them moments of something.
    pub bias: f64,
}

impl Moments {
    /// For sums in 32-bit floats [Munstermann18].
    pub fn single(moments: usize) -> Self {
        Self { moments, bias: BIAS[moments / 2 - 2] }
    }
}

/// How far, from the least of what can lie before a depth to the greatest, the absorbance is taken [Munstermann18].
pub const OVERESTIMATION: f64 = 0.1;

/// The bias of m = 4, 6, 8 moments in 32-bit floats [Munstermann18].
const BIAS: [f64; 3] = [5e-7, 5e-6, 5e-5];

/// Even moments of distributions well within what moments can be [Munstermann18].
pub const SAFE: [[f64; 4]; 3] =
    [[0.375, 0.375, 0.0, 0.0], [0.48, 0.451, 0.45, 0.0], [0.75, 0.676_666_67, 0.63, 0.600_303_03]];

impl Basis for Moments {
    fn count(&self) -> usize {
        self.moments + 1
    }

    fn deposit(&self, sums: &mut [f64], depth: f64, absorbance: f64) {
        for (k, sum) in sums.iter_mut().enumerate() {
            *sum += absorbance * (2.0 * depth - 1.0).powi(k as i32);
        }
    }

    fn deposit_segment(&self, sums: &mut [f64], span: [f64; 2], extinction: f64) {
        let [begin, end] = span.map(|z| 2.0 * z - 1.0);
        for (k, sum) in sums.iter_mut().enumerate() {
            let power = k as i32 + 1;
            *sum += extinction * (end.powi(power) - begin.powi(power)) / f64::from(2 * power);
        }
    }

    fn optical_depth(&self, sums: &[f64], depth: f64) -> f64 {
        if sums[0] <= 0.0 {
            return 0.0;
        }
        let which = self.moments / 2 - 2;
        let mut b: Vec<f64> = sums.iter().map(|sum| sum / sums[0]).collect();
        for (k, moment) in b.iter_mut().enumerate().skip(1) {
            let safe = if k % 2 == 0 { SAFE[which][k / 2 - 1] } else { 0.0 };
            *moment += self.bias * (safe - *moment);
        }
        let x = 2.0 * depth - 1.0;
        let mut nodes = vec![x];
        nodes.extend(others(&b, x));
        // The interpolation polynomial, in Newton's form, of 1 before x, 0 behind it, and the overestimation at x.
        let mut steps: Vec<f64> = nodes
            .iter()
            .enumerate()
            .map(|(i, &node)| if i == 0 { OVERESTIMATION } else { f64::from(u8::from(node < x)) })
            .collect();
        for order in 1..nodes.len() {
            for i in (order..nodes.len()).rev() {
                steps[i] = (steps[i] - steps[i - 1]) / (nodes[i] - nodes[i - order]);
            }
        }
        // As a polynomial of powers, whose expectation the moments give.
        let mut powers = vec![0.0; nodes.len()];
        for i in (0..nodes.len()).rev() {
            for k in (1..nodes.len()).rev() {
                powers[k] = powers[k - 1] - nodes[i] * powers[k];
            }
            powers[0] = steps[i] - nodes[i] * powers[0];
        }
        let before: f64 = powers.iter().zip(&b).map(|(power, moment)| power * moment).sum();
        sums[0] * before.clamp(0.0, 1.0)
    }
}

/// The other nodes of the distribution of n + 1 layers with moments b₀ = 1 … b_{2n} that has one at x: the roots of
/// Σ q_k z^k where Σ_k b_{j+k} q_k = x^j.
fn others(b: &[f64], x: f64) -> Vec<f64> {
    let n = b.len() / 2;
    // Cholesky's decomposition: the moments are those of a distribution, so that no pivot vanishes.
    let mut lower = vec![vec![0.0; n + 1]; n + 1];
    for i in 0..=n {
        for j in 0..=i {
            let rest: f64 = b[i + j] - (0..j).map(|k| lower[i][k] * lower[j][k]).sum::<f64>();
            lower[i][j] = if i == j { rest.max(1e-30).sqrt() } else { rest / lower[j][j] };
        }
    }
    let mut q: Vec<f64> = (0..=n).map(|j| x.powi(j as i32)).collect();
    for i in 0..=n {
        q[i] = (q[i] - (0..i).map(|k| lower[i][k] * q[k]).sum::<f64>()) / lower[i][i];
    }
    for i in (0..=n).rev() {
        q[i] = (q[i] - (i + 1..=n).map(|k| lower[k][i] * q[k]).sum::<f64>()) / lower[i][i];
    }
    roots(&q)
}
