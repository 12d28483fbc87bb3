//! Phase functions: which way scattered light goes.
//!
//! θ is the angle between the directions of travel before and after scattering, so cosθ = 1 is straight on. All are
//! symmetric under reversal of the path, so a path may be followed from the eye.

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::DVec3;
use tyndall_scene::description::Phase;

use crate::Random;

/// The density of scattering by an angle [sr⁻¹]; its integral over the sphere is 1.
#[inline]
pub fn pdf(phase: Phase, cos_theta: f64) -> f64 {
    match phase {
        Phase::Isotropic => 0.25 * FRAC_1_PI,
        Phase::Rayleigh => 3.0 / 16.0 * FRAC_1_PI * (1.0 + cos_theta * cos_theta),
        Phase::Hg { g } => {
            // [Henyey41]; (1 − g)² + 2g(1 − cosθ) = 1 + g² − 2g cosθ, without cancellation.
            let g = f64::from(g);
            let d = (1.0 - g) * (1.0 - g) + 2.0 * g * (1.0 - cos_theta);
            0.25 * FRAC_1_PI * (1.0 - g * g) / (d * d.sqrt())
        }
    }
}

/// The cosine of a random scattering angle, distributed as [`pdf`], from a number `u` in [0, 1).
#[inline]
pub fn sample_cosine(phase: Phase, u: f64) -> f64 {
    let s = 2.0 * u - 1.0;
    match phase {
        Phase::Isotropic => s,
        Phase::Rayleigh => {
            // The real root of μ³ + 3μ = 4s, by Cardano [Frisvad11].
            let a = (2.0 * s + (1.0 + 4.0 * s * s).sqrt()).cbrt();
            (a - 1.0 / a).clamp(-1.0, 1.0)
        }
        Phase::Hg { g } => {
            // [Witt77], (1 + g² − ((1−g²)/(1+gs))²)/2g, multiplied out so that nothing is divided by g.
            let g = f64::from(g);
            let d = 1.0 + g * s;
            let numerator = 2.0 * s * (1.0 + g * g) + g * (3.0 - g * g + s * s * (1.0 + g * g));
            (numerator / (2.0 * d * d)).clamp(-1.0, 1.0)
        }
    }
}

/// A random direction after scattering, for one of travel `direction` before; both unit vectors.
#[inline]
pub fn sample(phase: Phase, direction: DVec3, rng: &mut Random) -> DVec3 {
    let cos_theta = sample_cosine(phase, rng.uniform());
    let sin_theta = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
    let (sin_phi, cos_phi) = (TAU * rng.uniform()).sin_cos();
    let (x, y) = direction.any_orthonormal_pair();
    (x * (sin_theta * cos_phi) + y * (sin_theta * sin_phi) + direction * cos_theta).normalize()
}
