//! Mie's solution against miepython's figures, tables against what they interpolate, the droplets' fit against Mie.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use super::*;
use crate::description::Mie;

fn sphere(refractive_index: [f32; 2], radius: f32, spread: f32, wavelength: f32) -> Phase {
    Phase::Mie(Mie { refractive_index, radius, spread, wavelengths: Vec3::splat(wavelength) })
}

fn table(phase: &Phase) -> Arc<PhaseTable> {
    match PhaseFunction::new(phase, "phase") {
        Ok(PhaseFunction::Table(table)) => table,
        other => panic!("{other:?}"),
    }
}

/// ∫ f dω by Simpson's rule, with steps that are short at both ends.
fn integrate(f: impl Fn(f64) -> f64) -> f64 {
    // A multiple of the cells of a table, so that its kinks are between steps.
    const STEPS: u32 = 48 * (PhaseTable::NODES as u32 - 1);
    let value = |i: u32| {
        let t = f64::from(i) / f64::from(STEPS);
        // cosθ = 1 − 2 share(z), in z.
        let slope = 8.0 * t.powi(3) * (1.0 - t.powi(4));
        f(1.0 - 2.0 * PhaseTable::share(t)) * 2.0 * TAU * slope
    };
    let inner = (1..STEPS).map(|i| value(i) * if i % 2 == 1 { 4.0 } else { 2.0 });
    (value(0) + value(STEPS) + inner.sum::<f64>()) / (3.0 * f64::from(STEPS))
}

fn mean_cosine(table: &PhaseTable, channel: usize) -> f64 {
    integrate(|mu| mu * table.value(mu)[channel])
}

#[test]
fn the_coordinate_is_its_inverse() {
    for i in 0..=1000 {
        let theta = PI * f64::from(i) / 1000.0;
        let z = PhaseTable::coordinate(theta.cos());
        assert!((z - (std::f64::consts::SQRT_2 * (theta / 4.0).sin()).sqrt()).abs() < 1e-8, "{theta}");
        assert!((PhaseTable::share(z) - (theta / 2.0).sin().powi(2)).abs() < 1e-15, "{theta}");
    }
}

/// A table's integral is 1 by quadrature too, and halves of the sphere are known by symmetry.
#[test]
fn tables_are_normalised() {
    let list = |values: &[f32]| values.iter().map(|&v| Relative(Vec3::new(v, 1.0, 1.0 - v))).collect::<Vec<_>>();
    let angles = [10.0, 40.0, 90.0].map(Angle).to_vec();
    let table = table(&Phase::Tabulated { angles, values: list(&[0.75, 0.5, 0.0]) });
    for channel in 0..3 {
        let total = integrate(|mu| table.value(mu)[channel]);
        assert!((total - 1.0).abs() < 1e-7, "{channel}: {total}");
    }
    let value = |degrees: f64, channel: usize| table.value(degrees.to_radians().cos())[channel];
    assert!((value(77.0, 1) * 4.0 * PI - 1.0).abs() < 1e-6);
    assert_eq!((value(90.1, 0), value(180.0, 0)), (0.0, 0.0));
    assert_eq!(value(0.0, 2), value(9.9, 2));
    assert!((value(25.0, 0) / value(0.0, 0) - 0.625 / 0.75).abs() < 1e-4);
    let wrong = integrate(|mu| table.value(mu)[1] * 1.001);
    assert!((wrong - 1.0).abs() > 9e-4, "the quadrature sees no error");
}

/// A table of another phase function has its mean cosine.
#[test]
fn tables_keep_the_mean_cosine() {
    let g = 0.9;
    let hg = |theta: f64| DVec3::splat((1.0 + g * g - 2.0 * g * theta.cos()).powf(-1.5));
    let table = PhaseTable::new(hg).unwrap();
    assert!((mean_cosine(&table, 0) - g).abs() < 1e-6, "{}", mean_cosine(&table, 0));
}

#[test]
fn what_is_nowhere_seen_is_refused() {
    let angles = [60.0, 60.001, 60.002].map(Angle).to_vec();
    let values = [Vec3::ZERO, Vec3::X, Vec3::ZERO].map(Relative).to_vec();
    let message = PhaseFunction::new(&Phase::Tabulated { angles, values }, "phase").unwrap_err().to_string();
    assert!(message.starts_with("phase.tabulated.values: found a channel that is 0 wherever light goes"), "{message}");
}

/// Refractive index, size parameter, [extinction, scattering efficiency, mean cosine], and the phase function [sr⁻¹] at
/// θ = 0°, 0.3°, 30°, 90°, 139°, 180°, by miepython 3.3.0 (`efficiencies_mx`, `i_unpolarized(norm = "one")`).
type Figures = ((f64, f64), f64, [f64; 3], [f64; 6]);
#[rustfmt::skip]
const MIEPYTHON: [Figures; 8] = [
    ((1.33, 0.0), 0.001, [1.1098880952e-13, 1.1098880952e-13, 1.8327782430e-07], [1.19366260e-01, 1.19364624e-01, 1.04445472e-01, 5.96831037e-02, 9.36777643e-02, 1.19366154e-01]),
    ((1.33, 0.0), 0.5, [6.7731398838e-03, 6.7731398838e-03, 4.5464781761e-02], [1.32829825e-01, 1.32827835e-01, 1.14763884e-01, 5.95571742e-02, 8.57016504e-02, 1.06593023e-01]),
    ((1.33, 0.0), 5.0, [3.5910329236e+00, 3.5910329236e+00, 8.4534044109e-01], [2.07736460e+00, 2.07698855e+00, 2.71969096e-01, 6.76921981e-03, 7.70756814e-03, 7.64536475e-03]),
    ((1.5, 0.01), 20.0, [2.1134171695e+00, 1.5108132291e+00, 8.1597052197e-01], [2.39263222e+01, 2.38434796e+01, 3.26846508e-02, 8.75851179e-03, 2.89937339e-03, 3.56313598e-02]),
    ((0.2, 3.0), 7.5, [3.0334945188e+00, 2.8410216612e+00, 5.7901852405e-01], [3.63042059e+00, 3.62837076e+00, 1.13610074e-01, 3.54635445e-02, 1.80280396e-02, 1.26256114e-02]),
    ((1.333, 0.0), 57.12, [2.1110200822e+00, 2.1110200822e+00, 8.3773492707e-01], [1.38954286e+02, 1.35536749e+02, 2.23412199e-01, 2.00681287e-03, 2.06524016e-02, 9.96959948e-02]),
    ((1.333, 0.0001), 300.0, [2.0690210199e+00, 1.9704100860e+00, 8.8670794470e-01], [3.89391326e+03, 2.01472871e+03, 1.12244937e-01, 1.91116196e-03, 3.45738055e-02, 5.39989715e-04]),
    ((1.333, 0.0), 1000.0, [2.0228114332e+00, 2.0228114332e+00, 8.8009449871e-01], [4.02545214e+04, 6.95099304e+02, 1.47984737e-01, 1.49080389e-03, 4.75450058e-02, 1.37472815e-01]),
];
const ANGLES: [f64; 6] = [0.0, 0.3, 30.0, 90.0, 139.0, 180.0];

/// Extinction and scattering efficiency [Bohren83, (4.61), (4.62)].
fn efficiencies(sphere: &mie::Sphere, x: f64) -> [f64; 2] {
    let terms = (1..).zip(&sphere.modes).map(|(n, [sum, difference])| {
        // modes are c·(a ± b): c·(|a|² + |b|²) is half the sum of their squares, over c.
        let n = f64::from(n);
        let c = (2.0 * n + 1.0) / (n * (n + 1.0));
        let squares = 0.5 * (sum.norm_sqr() + difference.norm_sqr()) / c;
        [sum.re, squares].map(|term| n * (n + 1.0) * term)
    });
    terms.fold([0.0; 2], |sums, term| [0, 1].map(|i| sums[i] + 2.0 / (x * x) * term[i]))
}

#[test]
fn mie_is_miepythons() {
    for ((n, k), x, [extinction, scattering, g], values) in MIEPYTHON {
        let sphere = mie::Sphere::new(num_complex::Complex64::new(n, k), x);
        let [found_extinction, found_scattering] = efficiencies(&sphere, x);
        assert!((found_extinction / extinction - 1.0).abs() < 1e-8, "{n} {k} {x}: {found_extinction} {extinction}");
        assert!((found_scattering / scattering - 1.0).abs() < 1e-8, "{n} {k} {x}: {found_scattering} {scattering}");
        let intensity = |mu: f64| sphere.intensity(&mie::angular(mu, sphere.modes.len()));
        // ∫ (|S₁|² + |S₂|²)/2 dω = π x² Q_sca [Bohren83, (4.61)]
        let total = PI * x * x * scattering;
        for (theta, value) in ANGLES.into_iter().zip(values) {
            let found = intensity(theta.to_radians().cos()) / total;
            assert!((found / value - 1.0).abs() < 1e-6, "{n} {k} {x} at {theta}: {found}, miepython {value}");
        }
        let mean = integrate(|mu| mu * intensity(mu)) / total;
        assert!((mean - g).abs() < 1e-6, "{n} {k} {x}: mean cosine {mean}, miepython {g}");
    }
}

/// Much smaller than the wavelength: Rayleigh's phase function.
#[test]
fn small_spheres_are_rayleighs() {
    let table = table(&sphere([1.5, 0.1], 0.002, 1.3, 600.0));
    for i in 0..=20 {
        let mu = f64::from(i) / 10.0 - 1.0;
        let rayleigh = 3.0 / (16.0 * PI) * (1.0 + mu * mu);
        assert!((table.value(mu).x / rayleigh - 1.0).abs() < 2e-3, "{mu}");
    }
}

/// At the ends of what is accepted a table is finite and normalised, or refused.
#[test]
fn extremes() {
    for (index, radius, spread, wavelength) in [
        ([1.333, 0.0], 0.001, 1.0, 8000.0),
        ([1.333, 0.0], 0.001, 4.0, 8000.0),
        ([20.0, 20.0], 10.0, 1.0, 100.0),
        ([1e-30, 0.0], 1.0, 1.0, 550.0),
        ([1e-3, 20.0], 1.0, 1.2, 550.0),
        ([1.000_000_1, 0.0], 1.0, 1.0, 550.0),
        ([1.333, 0.0], 87.0, 1.0, 550.0),
    ] {
        match PhaseFunction::new(&sphere(index, radius, spread, wavelength), "phase") {
            Ok(PhaseFunction::Table(table)) => {
                let total = integrate(|mu| table.value(mu).x);
                assert!((total - 1.0).abs() < 1e-6, "{index:?} {radius} {spread}: {total}");
            }
            Ok(other) => panic!("{other:?}"),
            Err(error) => assert!(error.to_string().starts_with("phase.mie: found spheres that scatter too little")),
        }
    }
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig::with_cases(64))]

    /// Whatever a scene may state, a table is finite and integrates to 1, or is refused.
    #[test]
    fn any_table(mut points in proptest::collection::vec((0.0f32..=180.0, 0.0f32..=f32::MAX), 0..6), fine in 0u8..3) {
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let scale = [1.0, 1e-30, 1e-38][usize::from(fine)];
        let angles = points.iter().map(|&(angle, _)| Angle(angle)).collect();
        let values = points.iter().map(|&(_, value)| Relative(Vec3::new(value * scale, 1.0, value))).collect();
        if let Ok(PhaseFunction::Table(table)) = PhaseFunction::new(&Phase::Tabulated { angles, values }, "phase") {
            let total = integrate(|mu| table.value(mu).x);
            proptest::prop_assert!((total - 1.0).abs() < 1e-5, "{total}");
        }
    }
}

/// What linear interpolation between the nodes costs: a droplet of 10 µm at 550 nm, one size.
#[test]
fn interpolation_error_of_a_droplet() {
    let (radius, wavelength) = (5.0, 550.0);
    let table = table(&sphere([1.333, 0.0], radius, 1.0, wavelength));
    let x = TAU * f64::from(radius) * 1e3 / f64::from(wavelength);
    let sphere = mie::Sphere::new(f64::from(1.333f32).into(), x);
    let total = PI * x * x * efficiencies(&sphere, x)[1];
    let exact = |mu: f64| sphere.intensity(&mie::angular(mu, sphere.modes.len())) / total;
    assert!((table.value(1.0).x / exact(1.0) - 1.0).abs() < 1e-5);
    let off = integrate(|mu| (table.value(mu).x - exact(mu)).abs());
    assert!(off < 2e-4, "{off}");
}

/// Eight thousand sizes, evenly in ln r, give the same to 10 % at every angle: spheres that do not absorb have resonances far narrower than
/// any step, which side-scattering shows.
#[test]
fn sizes_are_enough() {
    let cosines: Vec<_> =
        [0.0, 0.5, 2.0, 20.0, 60.0, 90.0, 120.0, 141.0, 165.0, 180.0f64].map(|t| t.to_radians().cos()).into();
    for (radius, spread) in [(0.3, 2.0), (5.0, 1.5), (10.0, 1.1)] {
        let Phase::Mie(mie) = sphere([1.333, 0.0], radius, spread, 550.0) else { unreachable!() };
        let (median, sigma) = (f64::from(mie.radius), mie.deviation());
        let mut all = vec![0.0; cosines.len()];
        let ([least, largest], count) = (mie.radii(), 8000);
        for i in 0..count {
            let radius = least * (largest / least).powf((f64::from(i) + 0.5) / f64::from(count));
            let number = (-0.5 * ((radius / median).ln() / sigma).powi(2)).exp();
            let sphere = mie::Sphere::new(f64::from(1.333f32).into(), TAU * radius / 0.55);
            for (sum, &mu) in all.iter_mut().zip(&cosines) {
                *sum += number * sphere.intensity(&mie::angular(mu, sphere.modes.len()));
            }
        }
        let found = mie::intensity(&mie);
        for (&mu, all) in cosines.iter().zip(all) {
            let step = (mie.radii()[1] / mie.radii()[0]).ln() / 8000.0;
            let (found, all) = (found(mu.acos()).x, all * step);
            assert!((found / all - 1.0).abs() < 0.1, "{radius} µm, {spread}, at {mu}");
        }
    }
}

/// The fit is a mixture for every diameter. Its mean cosine is near that of droplets at 550 nm: to 0.02 from 5 µm on; for
/// smaller ones, whose phase function changes much with size and colour, to 0.1.
#[test]
fn droplets_fit() {
    let mut d = 0.01;
    while d <= 50.0 {
        let Blend { g_hg, g_d, alpha, w_d } = droplets::fit(d);
        assert!(g_hg.abs() < 1.0 && g_d.abs() < 1.0 && alpha >= 0.0 && (0.0..=1.0).contains(&w_d), "{d} µm");
        d *= 1.01;
    }
    for diameter in [0.02, 0.08, 0.3, 1.0, 2.0, 4.0, 6.0, 20.0, 45.0] {
        let tolerance = if diameter < 5.0 { 0.1 } else { 0.02 };
        let Blend { g_hg, g_d, alpha, w_d } = droplets::fit(diameter.into());
        let draine =
            g_d * (1.0 + alpha * (3.0 + 2.0 * g_d * g_d) / 5.0) / (1.0 + alpha * (1.0 + 2.0 * g_d * g_d) / 3.0);
        let fitted = (1.0 - w_d) * g_hg + w_d * draine;
        let exact = mean_cosine(&table(&sphere([1.333, 0.0], 0.5 * diameter, 1.1, 550.0)), 0);
        assert!((fitted - exact).abs() < tolerance, "{diameter} µm: {fitted}, Mie {exact}");
    }
}
