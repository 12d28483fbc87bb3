//! The Rust twin of `slab.wesl`.

/// (1 − e^{−x})/x: the transmittance in the mean over optical depths from 0 to `x` ≥ 0.
pub fn mean_transmittance(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { -(-x).exp_m1() / x }
}
