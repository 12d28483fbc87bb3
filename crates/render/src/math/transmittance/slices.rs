//! Slices of constant extinction: opacity shadow maps [Kim01].

use super::Linear;

/// F_k = 1 in slice k of n, else 0; the optical depth is linear within a slice [Jansen10].
#[derive(Clone, Copy, Debug)]
pub struct Slices {
    /// How many; at least 1.
    pub count: usize,
}

impl Linear for Slices {
    fn count(&self) -> usize {
        self.count
    }

    fn dual(&self, k: usize, z: f64) -> f64 {
        // The last slice has both its ends.
        let slice = ((z * self.count as f64) as usize).min(self.count - 1);
        f64::from(u8::from(slice == k))
    }

    fn dual_integral(&self, k: usize, z: f64) -> f64 {
        self.integral(k, z) / self.count as f64
    }

    // [Jansen10]: n [(d − k/n) H(d − k/n) − (d − (k+1)/n) H(d − (k+1)/n)].
    fn integral(&self, k: usize, d: f64) -> f64 {
        (d * self.count as f64 - k as f64).clamp(0.0, 1.0)
    }
}
