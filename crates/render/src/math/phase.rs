//! The Rust twin of `phase.wesl`: phase functions [sr⁻¹] in double precision, for the probes that hold the shader
//! against it.

use std::f64::consts::PI;

use tyndall_scene::description::Phase;

/// The phase function's number in shaders, and its mean cosine g (0 where it has none).
pub fn encode(phase: Phase) -> (u32, f32) {
    match phase {
        Phase::Isotropic => (0, 0.0),
        Phase::Rayleigh => (1, 0.0),
        Phase::Hg { g } => (2, g),
    }
}

/// The phase function's value [sr⁻¹]; `cos_theta` is between the directions of travel before and after scattering.
pub fn phase(phase: Phase, cos_theta: f64) -> f64 {
    match phase {
        Phase::Isotropic => 1.0 / (4.0 * PI),
        Phase::Rayleigh => 3.0 / (16.0 * PI) * (1.0 + cos_theta * cos_theta),
        Phase::Hg { g } => {
            let g = f64::from(g);
            (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cos_theta).powf(1.5))
        }
    }
}
