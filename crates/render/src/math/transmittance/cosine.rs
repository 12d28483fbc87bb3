//! The cosine series.

use std::f64::consts::{PI, SQRT_2};

use super::{Linear, Window};

/// F₀ = 1, F_k = √2 cos(πkz): the ray continued by its mirror image, so that its ends do not meet. The highest frequency of
/// as many numbers is that of Fourier's series.
#[derive(Clone, Copy, Debug)]
pub struct Cosine {
    /// Functions, the constant among them; at least 1.
    pub count: usize,
    /// How much each of them counts.
    pub window: Window,
}

impl Linear for Cosine {
    fn count(&self) -> usize {
        self.count
    }

    fn dual(&self, k: usize, z: f64) -> f64 {
        if k == 0 { 1.0 } else { SQRT_2 * (PI * k as f64 * z).cos() }
    }

    fn dual_integral(&self, k: usize, z: f64) -> f64 {
        if k == 0 { z } else { SQRT_2 * (PI * k as f64 * z).sin() / (PI * k as f64) }
    }

    fn integral(&self, k: usize, d: f64) -> f64 {
        self.window.factor(k, self.count - 1) * self.dual_integral(k, d)
    }
}
