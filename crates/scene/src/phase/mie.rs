//! Scattering by homogeneous spheres: Mie's solution of Maxwell's equations [Bohren83].

use std::f64::consts::TAU;

use glam::DVec3;
use num_complex::Complex64;

use crate::description::Mie;

/// Scattered intensity of unpolarised light, summed over the sizes, as a function of θ [radians]; a channel a wavelength,
/// and each but for a constant factor.
pub fn intensity(mie: &Mie) -> impl Fn(f64) -> DVec3 + Sync {
    let [n, k] = mie.refractive_index.map(f64::from);
    let channels = mie.wavelengths.as_dvec3().to_array().map(|wavelength| {
        let sphere = |(radius, number)| (Sphere::new(Complex64::new(n, k), TAU * radius * 1e3 / wavelength), number);
        sizes(mie, wavelength).into_iter().map(sphere).collect::<Vec<_>>()
    });
    let terms = channels.iter().flatten().map(|(sphere, _)| sphere.modes.len()).max().unwrap_or(0);
    move |theta| {
        let angular = angular(theta.cos(), terms);
        let sum = |spheres: &Vec<(Sphere, f64)>| -> f64 {
            spheres.iter().map(|(sphere, number)| number * sphere.intensity(&angular)).sum()
        };
        DVec3::from_array([0, 1, 2].map(|channel| sum(&channels[channel])))
    }
}

/// Radii [µm] and the number of spheres of each, but for a factor: the midpoint rule. From one size to the next ln r grows
/// by at most σ/32, and the way across the sphere and back by at most a quarter of a wavelength [nm], so that their rings blend.
fn sizes(mie: &Mie, wavelength: f64) -> Vec<(f64, f64)> {
    let (sigma, median) = (mie.deviation(), f64::from(mie.radius));
    if sigma == 0.0 {
        return vec![(median, 1.0)];
    }
    let [mut from, largest] = mie.radii();
    let mut sizes = Vec::new();
    while from < largest {
        let step = (from * sigma / 32.0).min(wavelength * 1e-3 / 16.0);
        let radius = from + 0.5 * step;
        let deviation = (radius / median).ln() / sigma;
        sizes.push((radius, (-0.5 * deviation * deviation).exp() * step / radius));
        from += step;
    }
    sizes
}

/// A sphere's scattering coefficients.
pub(super) struct Sphere {
    /// (2n + 1)/(n(n + 1))·(a_n ± b_n), from n = 1.
    pub modes: Vec<[Complex64; 2]>,
}

impl Sphere {
    /// The sphere of refractive index `m` and size parameter `x`, to as many terms as matter [Wiscombe80].
    pub fn new(m: Complex64, x: f64) -> Self {
        let terms = if x <= 8.0 { x + 4.0 * x.cbrt() + 1.0 } else { x + 4.05 * x.cbrt() + 2.0 }.ceil() as usize;
        let inside = log_derivatives(m * x, terms);
        let outside = log_derivatives(x.into(), terms);
        // Riccati–Bessel functions ψ_n and χ_n at n − 1 and n; ξ_n = ψ_n − iχ_n [Bohren83, section 4.4].
        let (mut psi, mut chi) = ([x.cos(), x.sin()], [-x.sin(), x.cos()]);
        let modes = (1..=terms).map(|n| {
            let order = n as f64;
            let next = |f: [f64; 2]| [f[1], (2.0 * order - 1.0) / x * f[1] - f[0]];
            // Upwards this loses ψ beyond n = x; there its logarithmic derivative serves.
            psi = if order <= x { next(psi) } else { [psi[1], psi[1] / (outside[n].re + order / x)] };
            chi = next(chi);
            let xi = [0, 1].map(|i| Complex64::new(psi[i], -chi[i]));
            // [Bohren83, (4.88)]
            let coefficient = |d: Complex64| {
                let factor = d + order / x;
                (factor * psi[1] - psi[0]) / (factor * xi[1] - xi[0])
            };
            let (a, b) = (coefficient(inside[n] / m), coefficient(inside[n] * m));
            [a + b, a - b].map(|c| c * ((2.0 * order + 1.0) / (order * (order + 1.0))))
        });
        Self { modes: modes.collect() }
    }

    /// Intensity of scattered unpolarised light, (|S₁|² + |S₂|²)/2 [Bohren83, (4.74), (4.77)]: half of (|S₁ + S₂|² +
    /// |S₁ − S₂|²)/2, which need one real factor a term.
    pub fn intensity(&self, angular: &[[f64; 2]]) -> f64 {
        let mut sums = [Complex64::ZERO; 2];
        for (mode, factor) in self.modes.iter().zip(angular) {
            sums[0] += mode[0] * factor[0];
            sums[1] += mode[1] * factor[1];
        }
        0.25 * (sums[0].norm_sqr() + sums[1].norm_sqr())
    }
}

/// The angular functions π_n ± τ_n, from n = 1 [Bohren83, (4.47)].
pub fn angular(cos_theta: f64, terms: usize) -> Vec<[f64; 2]> {
    let mut pi = [0.0, 1.0];
    (1..=terms)
        .map(|n| {
            let n = n as f64;
            let tau = n * cos_theta * pi[1] - (n + 1.0) * pi[0];
            let sums = [pi[1] + tau, pi[1] - tau];
            pi = [pi[1], ((2.0 * n + 1.0) * cos_theta * pi[1] - (n + 1.0) * pi[0]) / n];
            sums
        })
        .collect()
}

/// Logarithmic derivatives D_n(z) of the Riccati–Bessel function ψ_n, n from 0 to `terms`, by downward recurrence, which
/// forgets where it began once it is well beyond |z| [Bohren83, (4.89)].
fn log_derivatives(z: Complex64, terms: usize) -> Vec<Complex64> {
    let mut derivatives = vec![Complex64::ZERO; terms + 1];
    let mut derivative = Complex64::ZERO;
    let beyond = z.norm() + 8.0 * z.norm().cbrt() + 16.0;
    for n in (1..=terms.max(beyond as usize)).rev() {
        if let Some(slot) = derivatives.get_mut(n) {
            *slot = derivative;
        }
        let ratio = n as f64 / z;
        derivative = ratio - (derivative + ratio).inv();
    }
    derivatives
}
