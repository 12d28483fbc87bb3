//! The Rust twin of `phase.wesl`: phase functions [sr⁻¹] in double precision, for the probes that hold the shader
//! against it.

use std::f64::consts::PI;

use glam::Vec4;
use tyndall_scene::phase::{Blend, PhaseFunction};

/// The phase function's number in shaders, and its parameters: g of Henyey–Greenstein's, g and α of Draine's, the share of
/// Draine's; 0 where it has none.
pub fn encode(phase: &PhaseFunction) -> (u32, Vec4) {
    let parameters = |g_hg: f64, g_d: f64, alpha: f64, w_d: f64| Vec4::from([g_hg, g_d, alpha, w_d].map(|x| x as f32));
    match *phase {
        PhaseFunction::Isotropic => (0, Vec4::ZERO),
        PhaseFunction::Rayleigh => (1, Vec4::ZERO),
        PhaseFunction::HenyeyGreenstein { g } => (2, parameters(g, 0.0, 0.0, 0.0)),
        PhaseFunction::Draine { g, alpha } => (3, parameters(0.0, g, alpha, 1.0)),
        PhaseFunction::Blend(Blend { g_hg, g_d, alpha, w_d }) => (4, parameters(g_hg, g_d, alpha, w_d)),
        PhaseFunction::Table(_) => (5, Vec4::ZERO),
    }
}

/// The value [sr⁻¹] of a phase function as [`encode`] gives it, other than a table; `cos_theta` is between the directions
/// of travel before and after scattering.
pub fn phase(kind: u32, parameters: Vec4, cos_theta: f64) -> f64 {
    let [g_hg, g_d, alpha, w_d] = parameters.as_dvec4().to_array();
    let henyey_greenstein = |g: f64| (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cos_theta).powf(1.5));
    let weight = (1.0 + alpha * cos_theta * cos_theta) / (1.0 + alpha * (1.0 + 2.0 * g_d * g_d) / 3.0);
    match kind {
        1 => 3.0 / (16.0 * PI) * (1.0 + cos_theta * cos_theta),
        2 => henyey_greenstein(g_hg),
        3 => henyey_greenstein(g_d) * weight,
        4 => (1.0 - w_d) * henyey_greenstein(g_hg) + w_d * henyey_greenstein(g_d) * weight,
        _ => 1.0 / (4.0 * PI),
    }
}

/// Where a table has the value of an angle θ: √(√2 sin(θ/4)).
pub fn phase_table_coordinate(cos_theta: f64) -> f64 {
    (std::f64::consts::SQRT_2 * (0.25 * cos_theta.acos()).sin()).sqrt()
}
