//! What surfaces scatter, and the samplers of it.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use tyndall_reference::Random;
use tyndall_reference::bsdf::{Bsdf, Rough};

use crate::tolerance::{CHI_SQUARED, Estimate, chi_squared_critical, integrate};

const NORMAL: DVec3 = DVec3::Y;

fn rough(base: f64, metallic: f64, roughness: f64) -> Bsdf {
    Bsdf::Rough(Rough::new(DVec3::new(base, 0.8 * base, 0.5 * base), metallic, roughness))
}

fn all() -> Vec<Bsdf> {
    vec![
        Bsdf::Lambert { reflectance: DVec3::new(0.8, 0.5, 0.1) },
        rough(0.9, 1.0, 1.0),
        rough(0.9, 1.0, 0.4),
        rough(0.7, 0.0, 0.5),
        rough(0.7, 0.5, 0.7),
        rough(0.0, 0.0, 0.6),
    ]
}

/// Towards the eye: straight, slanted, grazing.
fn views() -> [DVec3; 3] {
    [0.999, 0.6, 0.08].map(|cosine: f64| {
        DVec3::new(0.6 * (1.0 - cosine * cosine).sqrt(), cosine, 0.8 * (1.0 - cosine * cosine).sqrt())
    })
}

/// A direction of the upper half by its cosine to the normal and its azimuth.
fn direction(cosine: f64, phi: f64) -> DVec3 {
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    DVec3::new(sine * phi.cos(), cosine, sine * phi.sin())
}

/// ∫ over cosines and azimuths by Simpson's rule.
fn over(cosines: [f64; 2], azimuths: [f64; 2], n: u32, f: impl Fn(DVec3) -> f64) -> f64 {
    integrate(cosines[0], cosines[1], n, |cosine| {
        integrate(azimuths[0], azimuths[1], n, |phi| f(direction(cosine, phi)))
    })
}

/// χ² of sampled directions against a density over 12 × 16 cells of cosine and azimuth, and those below the surface, which
/// end; cells that expect fewer than 10 are pooled. And its critical value.
fn chi_squared(sampled: &Bsdf, expected: &Bsdf, view: DVec3) -> (f64, f64) {
    const SAMPLES: u32 = 100_000;
    const CELLS: [usize; 2] = [12, 16];
    let mut counts = [[0u32; CELLS[1]]; CELLS[0]];
    for i in 0..SAMPLES {
        let Some(sample) = sampled.sample(view, NORMAL, &mut Random::new(5, 0, i.into())) else { continue };
        assert!((sample.towards.length() - 1.0).abs() < 1e-12);
        let phi = sample.towards.z.atan2(sample.towards.x).rem_euclid(TAU) / TAU;
        let cell = [sample.towards.y * CELLS[0] as f64, phi * CELLS[1] as f64].map(|x| x as usize);
        counts[cell[0].min(CELLS[0] - 1)][cell[1].min(CELLS[1] - 1)] += 1;
    }
    let (mut chi, mut degrees, mut rest, mut total) = (0.0, 0, [0.0; 2], 0.0);
    for (i, row) in counts.iter().enumerate() {
        for (j, &count) in row.iter().enumerate() {
            let cosines = [i, i + 1].map(|i| i as f64 / CELLS[0] as f64);
            let azimuths = [j, j + 1].map(|j| j as f64 * TAU / CELLS[1] as f64);
            let share = over(cosines, azimuths, 12, |towards| expected.pdf(view, towards, NORMAL));
            total += share;
            let expected = share * f64::from(SAMPLES);
            if expected < 10.0 {
                rest = [rest[0] + f64::from(count), rest[1] + expected];
            } else {
                chi += (f64::from(count) - expected).powi(2) / expected;
                degrees += 1;
            }
        }
    }
    let below = (1.0 - total) * f64::from(SAMPLES);
    let ended = f64::from(SAMPLES - counts.as_flattened().iter().sum::<u32>());
    for [count, expected] in [rest, [ended, below]] {
        if expected > 10.0 {
            chi += (count - expected).powi(2) / expected;
            degrees += 1;
        }
    }
    (chi, chi_squared_critical(degrees - 1, CHI_SQUARED))
}

/// Samplers are distributed as their densities, from every view.
#[test]
fn samplers() {
    for bsdf in all() {
        for view in views() {
            let (chi, critical) = chi_squared(&bsdf, &bsdf, view);
            assert!(chi < critical, "{bsdf:?} from {view}: χ² = {chi}, critical {critical}");
        }
    }
}

/// A sampler of a slightly different surface is found out.
#[test]
fn a_wrong_sampler_fails() {
    for (sampled, expected) in [
        (rough(0.9, 1.0, 0.5), rough(0.9, 1.0, 0.52)),
        (rough(0.7, 0.0, 0.5), rough(0.4, 0.0, 0.5)),
        (all()[0], rough(0.7, 0.1, 1.0)),
    ] {
        let (chi, critical) = chi_squared(&sampled, &expected, views()[1]);
        assert!(chi > critical, "{sampled:?}: χ² = {chi}, critical {critical}");
    }
}

/// A sample's weight is value times cosine over density, and nothing is reflected behind the normal, nor seen from there.
#[test]
fn weights() {
    for bsdf in all() {
        for (i, view) in views().into_iter().enumerate() {
            for n in 0..200 {
                let Some(sample) = bsdf.sample(view, NORMAL, &mut Random::new(6, i as u64, n)) else { continue };
                let value = bsdf.value(view, sample.towards, NORMAL) * sample.towards.dot(NORMAL);
                let density = bsdf.pdf(view, sample.towards, NORMAL);
                assert!((sample.weight * density - value).abs().max_element() < 1e-9 * density.max(1.0));
                assert!((sample.density.unwrap() / density - 1.0).abs() < 1e-9);
            }
            let behind = direction(-0.3, 1.0);
            assert_eq!((bsdf.value(view, behind, NORMAL), bsdf.pdf(view, behind, NORMAL)), (DVec3::ZERO, 0.0));
            assert_eq!(bsdf.value(behind, view, NORMAL), DVec3::ZERO);
            assert!(bsdf.sample(behind, NORMAL, &mut Random::new(1, 0, 0)).is_none());
        }
    }
}

/// Light and eye may be swapped.
#[test]
fn reciprocity() {
    for bsdf in all() {
        for n in 0..500 {
            let mut rng = Random::new(7, 0, n);
            let [a, b] = [0; 2].map(|_| direction(rng.uniform().max(1e-3), TAU * rng.uniform()));
            let [there, back] = [bsdf.value(a, b, NORMAL), bsdf.value(b, a, NORMAL)];
            assert!((there - back).abs().max_element() < 1e-12 * there.max_element(), "{bsdf:?}: {there} and {back}");
        }
    }
}

/// The metallic-roughness model once more, from its definition [glTF2, B]: of a metal with α = 0.16 at two angles.
#[test]
fn values() {
    let (view, towards) = (direction(0.8, 0.0), direction(0.6, 2.5));
    let half = (view + towards).normalize();
    let [nv, nl, nh, vh] = [view.y, towards.y, half.y, view.dot(half)];
    let square = 0.4f64.powi(4);
    let d = square / (PI * (nh * nh * (square - 1.0) + 1.0).powi(2));
    let lambda = |c: f64| 0.5 * ((1.0 + square * (1.0 / (c * c) - 1.0)).sqrt() - 1.0);
    let g = 1.0 / (1.0 + lambda(nv) + lambda(nl));
    let fresnel = |f0: f64| f0 + (1.0 - f0) * (1.0 - vh).powi(5);
    let facets = d * g / (4.0 * nv * nl);
    let (metal, dielectric) = (facets * fresnel(0.9), facets * fresnel(0.04) + (1.0 - fresnel(0.04)) * 0.9 / PI);
    for metallic in [0.0, 0.3, 1.0] {
        let value = rough(0.9, metallic, 0.4).value(view, towards, NORMAL).x;
        let truth = metallic * metal + (1.0 - metallic) * dielectric;
        assert!((value / truth - 1.0).abs() < 1e-12, "{value} should be {truth}");
    }
}

/// No surface reflects more than arrives, and the samplers reflect what the values say.
#[test]
fn energy() {
    for bsdf in all().into_iter().chain([rough(1.0, 1.0, 0.3), rough(1.0, 0.0, 1.0)]) {
        for view in views() {
            let estimate =
                Estimate::of(20_000, 3, |rng| bsdf.sample(view, NORMAL, rng).map_or(DVec3::ZERO, |s| s.weight));
            assert!(estimate.mean.max_element() <= 1.0 + 1e-9, "{bsdf:?} from {view} reflects {}", estimate.mean);
            // Azimuths about the mirrored one in π·t³, as a grazing lobe is narrow there.
            let middle = view.z.atan2(view.x) + PI;
            let part = |channel: usize| {
                integrate(0.0, 1.0, 150, |cosine| {
                    integrate(-1.0, 1.0, 150, |t| {
                        let l = direction(cosine, middle + PI * t.powi(3));
                        3.0 * PI * t * t * (bsdf.value(view, l, NORMAL) * l.dot(NORMAL))[channel]
                    })
                })
            };
            let truth = DVec3::new(part(0), part(1), part(2));
            let close = (estimate.mean - truth).abs().cmple(estimate.error * 4.5 + 1e-4).all();
            assert!(close, "{bsdf:?} from {view}: {} ± {} should be {truth}", estimate.mean, estimate.error);
        }
    }
}

/// White facets scatter light once, and lose what they scatter to one another: a white furnace of the model shows less than 1.
/// Straight on facets of α = 1 it is ∫ c/(1 + c) dc = 1 − ln 2, of polished ones nearly all.
#[test]
fn white_furnace_of_facets() {
    let shown = |roughness: f64, cosine: f64| {
        let white = Bsdf::Rough(Rough::new(DVec3::ONE, 1.0, roughness));
        let view = direction(cosine, 0.0);
        Estimate::of(100_000, 9, |rng| white.sample(view, NORMAL, rng).map_or(DVec3::ZERO, |s| s.weight))
    };
    shown(1.0, 1.0).assert(DVec3::splat(1.0 - 2f64.ln()), 0.004);
    assert!(shown(0.1, 0.9).mean.min_element() > 0.999);
}

/// Glass splits light without loss, whatever the angle; what goes through is radiance, which the index squares down.
#[test]
fn glass_and_mirrors() {
    let glass = Bsdf::Dielectric { eta: 1.5 };
    for view in views() {
        let flux = |rng: &mut Random| {
            let sample = glass.sample(view, NORMAL, rng).unwrap();
            assert_eq!(sample.density, None);
            sample.weight * if sample.towards.y < 0.0 { 2.25 } else { 1.0 }
        };
        assert!((Estimate::of(1000, 1, flux).mean - 1.0).abs().max_element() < 1e-12);
        let mirror = Bsdf::Mirror { reflectance: DVec3::new(0.9, 0.5, 0.2) };
        let sample = mirror.sample(view, NORMAL, &mut Random::new(1, 0, 0)).unwrap();
        assert!((sample.towards - DVec3::new(-view.x, view.y, -view.z)).length() < 1e-15);
        assert_eq!((sample.weight, sample.density), (DVec3::new(0.9, 0.5, 0.2), None));
        assert_eq!(mirror.value(view, sample.towards, NORMAL), DVec3::ZERO);
    }
}
