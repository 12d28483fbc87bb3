//! Legendre's polynomials.

use super::Linear;

/// F_k = √(2k + 1) P_k(2z − 1), orthonormal on [0, 1].
#[derive(Clone, Copy, Debug)]
pub struct Legendre {
    /// Functions, the constant among them; at least 1.
    pub count: usize,
}

impl Linear for Legendre {
    fn count(&self) -> usize {
        self.count
    }

    fn dual(&self, k: usize, z: f64) -> f64 {
        norm(k) * polynomials(k, z)[1]
    }

    // (2k + 1) P_k = P′_{k+1} − P′_{k−1}, over x = 2z − 1.
    fn dual_integral(&self, k: usize, z: f64) -> f64 {
        let [before, _, after] = polynomials(k, z);
        (after - before) / (2.0 * norm(k))
    }

    fn integral(&self, k: usize, d: f64) -> f64 {
        self.dual_integral(k, d)
    }
}

fn norm(k: usize) -> f64 {
    ((2 * k + 1) as f64).sqrt()
}

/// P_{k−1}, P_k and P_{k+1} of 2z − 1; P_{−1} stands as −1, which is what makes the integral of P₀ begin at 0.
fn polynomials(k: usize, z: f64) -> [f64; 3] {
    let x = 2.0 * z - 1.0;
    let mut found = [-1.0, 1.0, x];
    for n in 1..=k {
        let n = n as f64;
        // (n + 1) P_{n+1} = (2n + 1) x P_n − n P_{n−1}
        found = [found[1], found[2], ((2.0 * n + 1.0) * x * found[2] - n * found[1]) / (n + 1.0)];
    }
    found
}
