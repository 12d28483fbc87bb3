//! Factors of harmonics that trade ringing for blur.

use std::f64::consts::PI;

/// Which harmonics count how much.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Window {
    /// All of them fully: the least mean square error, with ringing.
    #[default]
    Off,
    /// 1 − k/(n + 1): the kernel is nowhere negative, so that τ never falls [Fejer03].
    Fejer,
    /// sinc(k/(n + 1)): nearly no ringing, with less blur [Lanczos56].
    Lanczos,
}

impl Window {
    /// The factor of harmonic `k` of `harmonics`, beside the constant.
    pub fn factor(self, k: usize, harmonics: usize) -> f64 {
        let share = k as f64 / (harmonics + 1) as f64;
        match self {
            _ if k == 0 => 1.0,
            Window::Off => 1.0,
            Window::Fejer => 1.0 - share,
            Window::Lanczos => (PI * share).sin() / (PI * share),
        }
    }
}
