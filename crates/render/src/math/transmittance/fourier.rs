//! The Fourier series [Jansen10].

use std::f64::consts::PI;

use super::{Linear, Window};

/// a₀, then a_k and b_k of each harmonic: 2n + 1 numbers. It takes the ray for periodic: what lies at one end rings at the
/// other.
#[derive(Clone, Copy, Debug)]
pub struct Fourier {
    /// Harmonics beside the constant.
    pub harmonics: usize,
    /// How much each of them counts.
    pub window: Window,
}

impl Linear for Fourier {
    fn count(&self) -> usize {
        2 * self.harmonics + 1
    }

    // [Jansen10]: a_k = 2∫σ cos(2πkz) dz, b_k = 2∫σ sin(2πkz) dz; of primitives, −2 Σ ln(1−α) cos(2πkd) and so on.
    fn dual(&self, k: usize, z: f64) -> f64 {
        let (sin, cos) = angle(k, z).sin_cos();
        2.0 * if is_sine(k) { sin } else { cos }
    }

    fn dual_integral(&self, k: usize, z: f64) -> f64 {
        let (sin, cos) = angle(k, z).sin_cos();
        match harmonic(k) {
            0.0 => 2.0 * z,
            n if is_sine(k) => (1.0 - cos) / (PI * n),
            n => sin / (PI * n),
        }
    }

    // [Jansen10]: τ(d) = a₀d/2 + Σ [a_k sin(2πkd) + b_k (1 − cos(2πkd))]/(2πk).
    fn integral(&self, k: usize, d: f64) -> f64 {
        let (sin, cos) = angle(k, d).sin_cos();
        let factor = self.window.factor(harmonic(k) as usize, self.harmonics);
        match harmonic(k) {
            0.0 => d / 2.0,
            n if is_sine(k) => factor * (1.0 - cos) / (2.0 * PI * n),
            n => factor * sin / (2.0 * PI * n),
        }
    }
}

/// The harmonic of number k.
fn harmonic(k: usize) -> f64 {
    k.div_ceil(2) as f64
}

fn is_sine(k: usize) -> bool {
    k > 0 && k.is_multiple_of(2)
}

fn angle(k: usize, z: f64) -> f64 {
    2.0 * PI * harmonic(k) * z
}
