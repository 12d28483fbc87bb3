//! Single scattering: ground truth 6.

use glam::{DVec3, Vec3};
use tyndall_scene::Field;
use tyndall_scene::description::{Light, Phase};
use tyndall_scene::phase::PhaseFunction;

use crate::tolerance::integrate;
use crate::worlds::*;

/// The phase functions once more, from their definitions; tables from their nodes.
pub fn p(phase: &Phase, mu: f64) -> DVec3 {
    let pi = std::f64::consts::PI;
    let peak = |g: f64| (1.0 - g * g) / (4.0 * pi * (1.0 + g * g - 2.0 * g * mu).powf(1.5));
    let draine = |g: f64, alpha: f64| peak(g) * (1.0 + alpha * mu * mu) / (1.0 + alpha * (1.0 + 2.0 * g * g) / 3.0);
    DVec3::splat(match phase {
        Phase::Isotropic => 1.0 / (4.0 * pi),
        Phase::Rayleigh => 3.0 / (16.0 * pi) * (1.0 + mu * mu),
        &Phase::Hg { g } => peak(g.into()),
        &Phase::CornetteShanks { g } => {
            let g = f64::from(g);
            let denominator = 8.0 * pi * (2.0 + g * g) * (1.0 + g * g - 2.0 * g * mu).powf(1.5);
            3.0 * (1.0 - g * g) * (1.0 + mu * mu) / denominator
        }
        &Phase::Draine { g, alpha } => draine(g.into(), alpha.into()),
        &Phase::Droplets { diameter } => {
            let d = f64::from(diameter);
            let w = (-0.599085 / (d - 0.641583) - 0.665888).exp();
            let alpha = (3.62489 - 8.29288 / (d + 5.52825)).exp();
            let [g_hg, g_d] = [-0.0990567 / (d - 1.67154), -2.20679 / (d + 3.91029) - 0.428934].map(f64::exp);
            (1.0 - w) * peak(g_hg) + w * draine(g_d, alpha)
        }
        Phase::Tabulated { .. } | Phase::Mie(_) => match PhaseFunction::new(phase, "phase") {
            Ok(PhaseFunction::Table(table)) => return table.value(mu),
            other => panic!("{other:?}"),
        },
    })
}

/// The sun straight down on the unit cube, seen along d from a point at depth s₀ below the top: after a way t the
/// light's depth is s₀ − d_y t, so L = E σ_s p(d_y) e^{−σ_t s₀} (1 − e^{−σ_t(1−d_y)T})/(σ_t(1−d_y)). Level, rising,
/// falling, and straight down, along the light.
#[test]
fn sun_in_a_box() {
    let (sigma_s, sigma_a) = (Vec3::new(0.5, 2.0, 1.0), Vec3::new(0.5, 0.1, 3.0));
    let irradiance = Vec3::new(3.0, 1.0, 2.0);
    for phase in phases() {
        let sun = Light::Directional { direction: Vec3::new(0.0, -2.0, 0.0), irradiance };
        let world = world(vec![unit(optics(sigma_s, sigma_a, phase.clone()))], vec![sun]);
        for (entry, direction, length) in [
            (DVec3::new(0.0, 0.6, 0.5), DVec3::X, 1.0),
            (DVec3::new(0.0, 0.1, 0.5), DVec3::new(0.8, 0.6, 0.0), 1.25),
            (DVec3::new(0.0, 0.9, 0.5), DVec3::new(0.8, -0.6, 0.0), 1.25),
            (DVec3::new(0.4, 1.0, 0.5), DVec3::NEG_Y, 1.0),
        ] {
            let sigma_t = (sigma_s + sigma_a).as_dvec3();
            let rate = sigma_t * (1.0 - direction.y);
            let integral = (1.0 - (-rate * length).exp()) / rate;
            let truth = irradiance.as_dvec3()
                * sigma_s.as_dvec3()
                * p(&phase, direction.y)
                * (-sigma_t * (1.0 - entry.y)).exp()
                * integral;
            look(&world, entry - direction, direction, Some(1), 60_000).assert(truth, 0.008);
        }
    }
}

/// A wrong phase angle would be seen: with θ reversed the closed form above does not hold.
#[test]
#[should_panic]
fn the_phase_angle_matters() {
    let sun = Light::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::ONE };
    let world = world(vec![unit(grey(1.0, 0.0, Phase::Hg { g: 0.5 }))], vec![sun]);
    let truth = p(&Phase::Hg { g: 0.5 }, 1.0) * (0.5 * (1.0 - (-2.0f64).exp()));
    look(&world, DVec3::new(0.5, 2.0, 0.5), DVec3::NEG_Y, Some(1), 60_000).assert(truth, 0.01);
}

/// Single scattering of a light of intensity `share(direction)` above a slab 0 ≤ y ≤ 1, by quadrature along a ray from
/// `entry` in the slab over a length.
fn by_quadrature(entry: DVec3, d: DVec3, length: f64, phase: Phase, lamp: DVec3, share: impl Fn(DVec3) -> f64) -> f64 {
    let (sigma_s, sigma_t) = (1.2, 1.5);
    integrate(0.0, length, 20_000, |t| {
        let x = entry + d * t;
        let (distance, travel) = ((x - lamp).length(), (x - lamp).normalize());
        let within = distance * (1.0 - x.y) / (lamp.y - x.y);
        let light = share(travel) / (distance * distance) * (-sigma_t * (within + t)).exp();
        sigma_s * p(&phase, -d.dot(travel)).x * light
    })
}

pub fn slab(light: Light, phase: Phase) -> tyndall_scene::World {
    let (min, max) = (Vec3::new(-20.0, 0.0, -20.0), Vec3::new(20.0, 1.0, 20.0));
    world(vec![volume(Field::Homogeneous, min, max, grey(1.2, 0.3, phase))], vec![light])
}

/// A point light over a slab.
#[test]
fn point_light() {
    let position = Vec3::new(0.5, 1.5, 0.25);
    for phase in greys() {
        let world = slab(Light::Point { position, intensity: Vec3::splat(2.0) }, phase.clone());
        let (entry, d) = (DVec3::new(-1.0, 0.0, 0.0), DVec3::new(0.8, 0.6, 0.0));
        let truth = by_quadrature(entry, d, 1.0 / 0.6, phase, position.as_dvec3(), |_| 2.0);
        look(&world, entry - d, d, Some(1), 100_000).assert(DVec3::splat(truth), 0.01);
    }
}

/// A point light within the medium, near which the ray passes at .05 and at .4: in a large box, the light's way to a
/// point is all in the medium.
#[test]
fn point_light_within() {
    for (phase, y) in [(Phase::Isotropic, 0.05), (Phase::Hg { g: 0.7 }, 0.05), (Phase::Rayleigh, 0.4)] {
        let lamp = Light::Point { position: Vec3::ZERO, intensity: Vec3::ONE };
        let medium = volume(Field::Homogeneous, Vec3::splat(-3.0), Vec3::splat(3.0), grey(1.2, 0.3, phase.clone()));
        let world = world(vec![medium], vec![lamp]);
        let truth = integrate(-1.0, 3.0, 50_000, |x| {
            let r2 = x * x + y * y;
            1.2 * p(&phase, -x / r2.sqrt()).x / r2 * (-1.5 * (r2.sqrt() + x + 1.0)).exp()
        });
        look(&world, DVec3::new(-1.0, y, 0.0), DVec3::X, Some(1), 100_000).assert(DVec3::splat(truth), 0.005);
    }
}

/// A spot light: full within 20°, falling as the squared ramp of the cosine to 0 at 40°, nothing beyond.
#[test]
fn spot_light() {
    let position = Vec3::new(0.0, 2.0, 0.0);
    let axis = Vec3::new(0.0, -3.0, 0.0);
    let [inner_angle, outer_angle] = [20.0f32, 40.0];
    let light = Light::Spot { position, direction: axis, intensity: Vec3::ONE, inner_angle, outer_angle };
    let world = slab(light, Phase::Rayleigh);
    let cosine = |angle: f32| f64::from(angle).to_radians().cos();
    let share = |travel: DVec3| {
        let ramp = (-travel.y - cosine(outer_angle)) / (cosine(inner_angle) - cosine(outer_angle));
        ramp.clamp(0.0, 1.0).powi(2)
    };
    let d = DVec3::new(0.8, 0.6, 0.0);
    // Across the whole cone; across its rim; past it.
    for (x, z) in [(-0.9, 0.0), (-0.9, 0.9)] {
        let entry = DVec3::new(x, 0.0, z);
        let truth = by_quadrature(entry, d, 1.0 / 0.6, Phase::Rayleigh, position.as_dvec3(), share);
        look(&world, entry - d, d, Some(1), 300_000).assert(DVec3::splat(truth), 0.01);
    }
    let past = look(&world, DVec3::new(1.8, -0.1, 0.0), d, Some(1), 10_000);
    assert_eq!(past.mean, DVec3::ZERO);
}
