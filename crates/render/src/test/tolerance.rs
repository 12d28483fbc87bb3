//! All tolerances of this crate's tests, each with its reason.

/// A WGSL function in single precision against its Rust twin in double precision: a few roundings of 2⁻²⁴, relative to
/// the larger of the value and 1.
pub const PROBE: f64 = 4e-6;
/// As [`PROBE`], for AgX: WGSL allows `pow` and `log2` errors of many roundings. A tenth of an 8-bit step.
pub const PROBE_AGX: f64 = 4e-4;
/// As [`PROBE`], for expressions: WGSL allows `sin` an error of 2⁻¹¹, drivers stay far below; p is computed twice.
pub const PROBE_EXPRESSION: f64 = 2e-5;
/// The marcher where its rule is exact (homogeneous media): single-precision sums over some hundred steps.
pub const EXACT: f64 = 2e-5;
/// The marcher on a smooth density at default steps: second order in 1/64 of the box.
pub const SMOOTH: f64 = 5e-4;
/// Single scattering in a homogeneous box at the default step of 1/64 of the box: second order, (σ_t/64)²/24 with σ_t = 6.
pub const SINGLE_SCATTERING: f64 = 4e-4;
/// Trilinear interpolation in hardware may have 8 fractional bits; a constant grid is exact but for half floats.
pub const CONSTANT_GRID: f64 = 5e-5;
/// Relative RMSE of the plume at default settings, against the reference: what the issue asks for.
pub const PLUME_DEFAULT: f64 = 0.02;
/// Relative RMSE of the plume at high settings.
pub const PLUME_HIGH: f64 = 0.005;
/// A camera ray marched in many rounds against one in few: the same operations, split.
pub const ROUNDS: f64 = 1e-6;
/// Mean FLIP of a golden: below this no one sees a difference, and another compiler's rounding stays below it.
pub const GOLDEN_FLIP: f64 = 0.002;
