//! Phase functions and their samplers: ground truth 8.

use glam::DVec3;
use tyndall_reference::{Random, phase};
use tyndall_scene::description::Phase;

use crate::tolerance::{CHI_SQUARED, Estimate, chi_squared_critical, integrate};

const ALL: [Phase; 7] = [
    Phase::Isotropic,
    Phase::Rayleigh,
    Phase::Hg { g: 0.0 },
    Phase::Hg { g: 1e-4 },
    Phase::Hg { g: 0.5 },
    Phase::Hg { g: 0.95 },
    Phase::Hg { g: -0.7 },
];

/// ∫ p dω = 1, and ∫ p cosθ dω = g.
#[test]
fn normalised_with_mean_cosine() {
    for phase in ALL {
        let moment = |power: i32| {
            std::f64::consts::TAU * integrate(-1.0, 1.0, 100_000, |mu| mu.powi(power) * phase::pdf(phase, mu))
        };
        let g = if let Phase::Hg { g } = phase { f64::from(g) } else { 0.0 };
        assert!((moment(0) - 1.0).abs() < 1e-8, "{phase:?}: {}", moment(0));
        assert!((moment(1) - g).abs() < 1e-8, "{phase:?}: {}", moment(1));
    }
}

/// χ² of sampled directions against a phase function over 24 × 12 cells of equal cosine and azimuth, those that
/// expect fewer than 10 pooled; and its critical value.
fn chi_squared(sampled: Phase, expected: Phase) -> (f64, f64) {
    const SAMPLES: u32 = 200_000;
    const COSINES: usize = 24;
    const AZIMUTHS: usize = 12;
    let axis = DVec3::new(0.3, -0.9, 0.2).normalize();
    let (x, y) = axis.any_orthonormal_pair();
    let mut counts = [0u32; COSINES * AZIMUTHS];
    for sample in 0..SAMPLES {
        let direction = phase::sample(sampled, axis, &mut Random::new(5, 0, sample.into()));
        assert!((direction.length() - 1.0).abs() < 1e-12);
        let cosine = ((direction.dot(axis) + 1.0) / 2.0 * COSINES as f64) as usize;
        let azimuth = direction.dot(y).atan2(direction.dot(x)) / std::f64::consts::TAU + 0.5;
        let azimuth = (azimuth * AZIMUTHS as f64) as usize;
        counts[cosine.min(COSINES - 1) * AZIMUTHS + azimuth.min(AZIMUTHS - 1)] += 1;
    }
    let width = 2.0 / COSINES as f64;
    let (mut chi, mut cells, mut rest) = (0.0, 0, (0.0, 0.0));
    for (i, &count) in counts.iter().enumerate() {
        let low = -1.0 + width * (i / AZIMUTHS) as f64;
        let share = integrate(low, low + width, 200, |mu| phase::pdf(expected, mu)) * std::f64::consts::TAU;
        let expected = share / AZIMUTHS as f64 * f64::from(SAMPLES);
        if expected < 10.0 {
            rest = (rest.0 + f64::from(count), rest.1 + expected);
        } else {
            chi += (f64::from(count) - expected).powi(2) / expected;
            cells += 1;
        }
    }
    if rest.1 > 10.0 {
        chi += (rest.0 - rest.1).powi(2) / rest.1;
        cells += 1;
    }
    (chi, chi_squared_critical(cells - 1, CHI_SQUARED))
}

/// Samplers are distributed as their densities, around any direction.
#[test]
fn samplers() {
    for phase in ALL {
        let (chi, critical) = chi_squared(phase, phase);
        assert!(chi < critical, "{phase:?}: χ² = {chi}, critical {critical}");
    }
}

/// A sampler of a slightly different g is found out.
#[test]
fn a_wrong_sampler_fails() {
    let (chi, critical) = chi_squared(Phase::Hg { g: 0.5 }, Phase::Hg { g: 0.52 });
    assert!(chi > critical, "χ² = {chi}, critical {critical}");
    let (chi, critical) = chi_squared(Phase::Isotropic, Phase::Rayleigh);
    assert!(chi > critical, "χ² = {chi}, critical {critical}");
}

/// The mean cosine of Henyey–Greenstein samples is g, also where the density is too narrow for cells.
#[test]
fn mean_cosine() {
    for g in [-0.999f32, -0.3, 0.0, 1e-7, 0.6, 0.9, 0.999] {
        let phase = Phase::Hg { g };
        let estimate = Estimate::of(100_000, 3, |rng| DVec3::splat(phase::sample(phase, DVec3::Z, rng).z));
        let error = estimate.error.max_element();
        assert!((estimate.mean.x - f64::from(g)).abs() < 4.5 * error && error < 0.003, "{g}: {estimate:?}");
    }
}
