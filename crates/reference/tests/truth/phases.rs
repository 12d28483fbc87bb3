//! Phase functions and their samplers: ground truth 8.

use glam::DVec3;
use tyndall_reference::Random;
use tyndall_reference::phase::Phase;
use tyndall_scene::description::Phase as Description;
use tyndall_scene::phase::{Blend, PhaseFunction};

use crate::tolerance::{CHI_SQUARED, Estimate, TABLE, chi_squared_critical, integrate_cosine};
use crate::worlds::{coloured_mie, phases};

/// Every kind, and Henyey–Greenstein's and Draine's towards their limits.
fn all() -> Vec<Description> {
    let more = [0.0, 1e-4, 0.5, 0.95].map(|g| Description::Hg { g });
    let limits = vec![
        Description::CornetteShanks { g: 0.0 },
        Description::Draine { g: 0.9, alpha: 1000.0 },
        Description::Droplets { diameter: 0.05 },
        Description::Droplets { diameter: 0.7 },
        Description::Droplets { diameter: 3.0 },
    ];
    [phases(), more.into(), limits].concat()
}

fn function(phase: &Description) -> PhaseFunction {
    PhaseFunction::new(phase, "phase").unwrap()
}

fn phase(phase: &Description) -> Phase {
    Phase::new(&function(phase))
}

/// The mean cosine in closed form, where there is one.
fn mean_cosine(function: &PhaseFunction) -> Option<f64> {
    // ∫ cos³θ of Henyey–Greenstein's is (3g + 2g³)/5.
    let draine =
        |g: f64, alpha: f64| g * (1.0 + alpha * (3.0 + 2.0 * g * g) / 5.0) / (1.0 + alpha * (1.0 + 2.0 * g * g) / 3.0);
    match function {
        PhaseFunction::Isotropic | PhaseFunction::Rayleigh => Some(0.0),
        &PhaseFunction::HenyeyGreenstein { g } => Some(g),
        &PhaseFunction::Draine { g, alpha } => Some(draine(g, alpha)),
        &PhaseFunction::Blend(Blend { g_hg, g_d, alpha, w_d }) => Some((1.0 - w_d) * g_hg + w_d * draine(g_d, alpha)),
        PhaseFunction::Table(_) => None,
    }
}

/// ∫ p dω = 1, and ∫ p cosθ dω is the mean cosine.
#[test]
fn normalised_with_mean_cosine() {
    for description in all() {
        let phase = phase(&description);
        let moment = |power: i32, channel: usize| {
            std::f64::consts::TAU * integrate_cosine(-1.0, 1.0, 100_000, |mu| mu.powi(power) * phase.pdf(mu)[channel])
        };
        let Some(mean) = mean_cosine(&function(&description)) else {
            for channel in 0..3 {
                let total = moment(0, channel);
                assert!((total - 1.0).abs() < TABLE, "{description:?}: {total}");
            }
            continue;
        };
        assert!((moment(0, 0) - 1.0).abs() < 1e-8, "{description:?}: {}", moment(0, 0));
        assert!((moment(1, 0) - mean).abs() < 1e-8, "{description:?}: {}", moment(1, 0));
    }
}

/// χ² of sampled directions against a phase function over 24 × 12 cells of equal cosine and azimuth, those that
/// expect fewer than 10 pooled; and its critical value.
fn chi_squared(sampled: (&Phase, usize), expected: (&Phase, usize)) -> (f64, f64) {
    const SAMPLES: u32 = 200_000;
    const COSINES: usize = 24;
    const AZIMUTHS: usize = 12;
    let axis = DVec3::new(0.3, -0.9, 0.2).normalize();
    let (x, y) = axis.any_orthonormal_pair();
    let mut counts = [0u32; COSINES * AZIMUTHS];
    for sample in 0..SAMPLES {
        let direction = sampled.0.sample(sampled.1, axis, &mut Random::new(5, 0, sample.into()));
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
        let share = integrate_cosine(low, (low + width).min(1.0), 1000, |mu| expected.0.pdf(mu)[expected.1])
            * std::f64::consts::TAU;
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

/// Samplers are distributed as their densities, around any direction; tables in each channel.
#[test]
fn samplers() {
    for description in all() {
        let phase = phase(&description);
        for channel in if phase.is_grey() { 0..1 } else { 0..3 } {
            let (chi, critical) = chi_squared((&phase, channel), (&phase, channel));
            assert!(chi < critical, "{description:?}: χ² = {chi}, critical {critical}");
        }
    }
}

/// A sampler of a slightly different phase function is found out, and one of another channel.
#[test]
fn a_wrong_sampler_fails() {
    for (sampled, expected) in [
        (Description::Hg { g: 0.5 }, Description::Hg { g: 0.52 }),
        (Description::Isotropic, Description::Rayleigh),
        (Description::CornetteShanks { g: 0.5 }, Description::CornetteShanks { g: 0.52 }),
        (Description::CornetteShanks { g: 0.5 }, Description::Hg { g: 0.5 }),
        (Description::Draine { g: 0.5, alpha: 2.0 }, Description::Draine { g: 0.5, alpha: 2.5 }),
        (Description::Droplets { diameter: 6.0 }, Description::Droplets { diameter: 8.0 }),
    ] {
        let (chi, critical) = chi_squared((&phase(&sampled), 0), (&phase(&expected), 0));
        assert!(chi > critical, "{sampled:?}, {expected:?}: χ² = {chi}, critical {critical}");
    }
    let mie = phase(&coloured_mie());
    let (chi, critical) = chi_squared((&mie, 0), (&mie, 1));
    assert!(chi > critical, "χ² = {chi}, critical {critical}");
}

/// The mean cosine of samples, also where the density is too narrow for cells.
#[test]
fn mean_cosine_of_samples() {
    let narrow = [-0.999f32, -0.3, 0.0, 1e-7, 0.6, 0.9, 0.999].map(|g| Description::Hg { g });
    for description in [all(), narrow.into()].concat() {
        let phase = phase(&description);
        let mean = mean_cosine(&function(&description)).unwrap_or_else(|| {
            std::f64::consts::TAU * integrate_cosine(-1.0, 1.0, 100_000, |mu| mu * phase.pdf(mu)[0])
        });
        let estimate = Estimate::of(100_000, 3, |rng| DVec3::splat(phase.sample(0, DVec3::Z, rng).z));
        let error = estimate.error.max_element();
        assert!((estimate.mean.x - mean).abs() < 4.5 * error + 1e-12 && error < 0.003, "{description:?}: {estimate:?}");
    }
}
