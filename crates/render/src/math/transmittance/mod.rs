//! How the transmittance of a light ray is kept in a few numbers: the Rust twins, in double precision, of the bases that
//! maps of transmittance are made in.
//!
//! A light ray has a depth z from 0, where media begin, to 1, where they end. Its extinction σ(z), per unit of z, is kept as sums
//! of what every primitive and every segment deposits, in any order [Jansen10]:
//!
//! A_k = Σ_i −ln(1 − α_i) D_k(z_i) + Σ_segments σ ∫ D_k dz,  τ(d) = Σ_k A_k G_k(d),  T(d) = e^{−max(τ(d), 0)}
//!
//! with G_k the integral from 0 of a function F_k of the basis, of which D_k is the dual. Moments keep sums of the same kind and
//! find τ from them by other means ([`moments`], [`trigonometric`]).

pub mod cosine;
pub mod fourier;
pub mod haar;
pub mod legendre;
pub mod moments;
#[cfg(test)]
mod probe;
pub mod roots;
pub mod slices;
#[cfg(test)]
mod test;
pub mod trigonometric;
pub mod window;

pub use cosine::Cosine;
pub use fourier::Fourier;
pub use haar::Haar;
pub use legendre::Legendre;
pub use moments::Moments;
pub use slices::Slices;
pub use trigonometric::Trigonometric;
pub use window::Window;

/// The greatest absorbance of a primitive: α = 1 would be infinite. Its transmittance is e^{−10}, which no one sees.
pub const MOST_ABSORBANCE: f64 = 10.0;

/// −ln(1 − α) of an opacity from 0 to 1, at most [`MOST_ABSORBANCE`].
pub fn absorbance(opacity: f64) -> f64 {
    (-(-opacity).ln_1p()).min(MOST_ABSORBANCE)
}

/// A family of numbers that a light ray's extinction is kept in.
pub trait Basis {
    /// How many numbers a ray has.
    fn count(&self) -> usize;

    /// Adds what a primitive of this absorbance deposits at a depth from 0 to 1.
    fn deposit(&self, sums: &mut [f64], depth: f64, absorbance: f64);

    /// Adds what a homogeneous segment between two depths deposits; `extinction` is per unit of depth.
    fn deposit_segment(&self, sums: &mut [f64], span: [f64; 2], extinction: f64);

    /// The optical depth from 0 to a depth, as the sums say: it may be negative where they ring.
    fn optical_depth(&self, sums: &[f64], depth: f64) -> f64;

    /// The transmittance from 0 to a depth, from 0 to 1.
    fn transmittance(&self, sums: &[f64], depth: f64) -> f64 {
        (-self.optical_depth(sums, depth).max(0.0)).exp()
    }
}

/// A basis in which both deposit and optical depth are linear.
pub trait Linear {
    /// How many functions it has.
    fn count(&self) -> usize;

    /// D_k(z): what absorbance 1 at depth z adds to number k.
    fn dual(&self, k: usize, z: f64) -> f64;

    /// ∫₀^z D_k.
    fn dual_integral(&self, k: usize, z: f64) -> f64;

    /// G_k(d) = ∫₀^d F_k, windowed where the basis has a window.
    fn integral(&self, k: usize, d: f64) -> f64;
}

impl<B: Linear> Basis for B {
    fn count(&self) -> usize {
        Linear::count(self)
    }

    fn deposit(&self, sums: &mut [f64], depth: f64, absorbance: f64) {
        for (k, sum) in sums.iter_mut().enumerate() {
            *sum += absorbance * self.dual(k, depth);
        }
    }

    fn deposit_segment(&self, sums: &mut [f64], [begin, end]: [f64; 2], extinction: f64) {
        for (k, sum) in sums.iter_mut().enumerate() {
            *sum += extinction * (self.dual_integral(k, end) - self.dual_integral(k, begin));
        }
    }

    fn optical_depth(&self, sums: &[f64], depth: f64) -> f64 {
        sums.iter().enumerate().map(|(k, sum)| sum * self.integral(k, depth)).sum()
    }
}
