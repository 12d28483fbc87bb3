//! Absorption and emission along straight rays: ground truth 2.

use std::sync::Arc;

use glam::{DVec3, Mat4, Quat, Vec3};
use tyndall_scene::Field;
use tyndall_scene::description::{Optics, Phase, Stop, Transfer};
use tyndall_scene::field::{Expression, Formula, Sphere};

use crate::worlds::*;

const INF: f64 = f64::INFINITY;

/// Homogeneous: T = e^{−σ_t L}, whatever share of σ_t scatters, straight, oblique, from within, up to a distance, and
/// through a box that is turned.
#[test]
fn homogeneous_slab() {
    let world_ =
        world(vec![unit(optics(Vec3::new(0.5, 1.0, 2.0), Vec3::new(0.0, 3.0, 1.0), Phase::Isotropic))], vec![]);
    let truth = |length: f64| (DVec3::new(0.5, 4.0, 3.0) * -length).exp();
    pass(&world_, DVec3::new(-1.0, 0.5, 0.5), DVec3::X, INF, 100).assert(truth(1.0), 1e-9);
    pass(&world_, DVec3::new(0.25, 0.5, 0.5), DVec3::NEG_X, INF, 100).assert(truth(0.25), 1e-9);
    pass(&world_, DVec3::new(-1.0, 0.5, 0.5), DVec3::X, 1.5, 100).assert(truth(0.5), 1e-9);
    pass(&world_, DVec3::splat(-1.0), DVec3::ONE, INF, 100).assert(truth(3f64.sqrt()), 1e-9);
    pass(&world_, DVec3::new(-1.0, 2.0, 0.5), DVec3::X, INF, 100).assert(DVec3::ONE, 1e-9);

    let turned = Mat4::from_quat(Quat::from_rotation_z(0.5)) * Mat4::from_translation(Vec3::splat(-0.5));
    let turned = world(vec![moved(Field::Homogeneous, turned, grey(1.0, 1.0, Phase::Isotropic))], vec![]);
    let length = 1.0 / 0.5f64.cos();
    pass(&turned, DVec3::new(-3.0, 0.0, 0.0), DVec3::X, INF, 100).assert(DVec3::splat((-2.0 * length).exp()), 1e-9);
}

/// Emission and absorption: L = (1 − e^{−kL}) k_e/k in front of the sky's e^{−kL}; at k → 0, L = L·k_e.
#[test]
fn emission_and_absorption() {
    for k in [0.0f32, 0.01, 1.0, 8.0] {
        let emission = Vec3::new(0.5, 1.0, 3.0);
        let optics =
            Optics::Coefficients { sigma_s: Vec3::ZERO, sigma_a: Vec3::splat(k), emission, phase: Phase::Isotropic };
        let world = world(vec![unit(optics)], vec![sky(0.25)]);
        let k = f64::from(k);
        let length = if k == 0.0 { 1.0 } else { -(-k).exp_m1() / k };
        let truth = emission.as_dvec3() * length + 0.25 * (-k).exp();
        look(&world, DVec3::new(-1.0, 0.3, 0.7), DVec3::X, None, 200_000).assert(truth, 0.003);
        look(&world, DVec3::new(-1.0, 0.3, 0.7), DVec3::X, Some(0), 200_000).assert(truth, 0.003);
    }
}

/// Depth 0 counts scattering as loss, and what a scattering medium emits.
#[test]
fn depth_0() {
    let optics = Optics::Coefficients {
        sigma_s: Vec3::splat(1.5),
        sigma_a: Vec3::splat(0.5),
        emission: Vec3::ONE,
        phase: Phase::Isotropic,
    };
    let world = world(vec![unit(optics)], vec![sky(1.0)]);
    let opacity = -(-2.0f64).exp_m1();
    let truth = DVec3::splat(opacity / 2.0 + 1.0 - opacity);
    look(&world, DVec3::new(0.5, 0.5, 3.0), DVec3::NEG_Z, Some(0), 200_000).assert(truth, 0.003);
}

/// Exponential density: along y, τ = σ_t·H·(e^{−(y₀−b)/H} − e^{−(y₁−b)/H}); level, σ_t·L·e^{−(y−b)/H}.
#[test]
fn exponential_density() {
    let (height, base) = (0.4f64, 0.2f64);
    let field = Field::Exponential { base: base as f32, scale: height as f32 };
    let world = world(vec![volume(field, Vec3::ZERO, Vec3::ONE, grey(1.0, 0.5, Phase::Isotropic))], vec![]);
    let density = |y: f64| (-(y - base) / height).exp();
    let truth = |tau: f64| DVec3::splat((-1.5 * tau).exp());
    let upright = height * (density(0.0) - density(1.0));
    pass(&world, DVec3::new(0.5, 2.0, 0.5), DVec3::NEG_Y, INF, 100_000).assert(truth(upright), 0.002);
    let slope = DVec3::new(0.6, 0.8, 0.0);
    pass(&world, DVec3::new(0.0, 0.2, 0.5), slope, 0.75, 100_000)
        .assert(truth(height / 0.8 * (density(0.2) - density(0.8))), 0.002);
    pass(&world, DVec3::new(-1.0, 0.33, 0.5), DVec3::X, INF, 100_000).assert(truth(density(0.33)), 0.002);
}

/// A grid that rises linearly along x, v_i = (i + ½)/n, is x between the outermost voxel centres and constant in the
/// outer half voxels: ∫₀^a = h²/8 + a²/2 for h/2 ≤ a ≤ 1 − h/2, and ½ in all.
#[test]
fn linear_density() {
    for n in [5u32, 32, 600] {
        let h = 1.0 / f64::from(n);
        let field = grid([n, 3, 2], |i, _, _| (f64::from(i) * h + 0.5 * h) as f32);
        let world = world(vec![volume(field, Vec3::ZERO, Vec3::ONE, grey(0.0, 3.0, Phase::Isotropic))], vec![]);
        let truth = |tau: f64| DVec3::splat((-3.0 * tau).exp());
        let start = DVec3::new(0.0, 0.4, 0.6);
        pass(&world, start, DVec3::X, INF, 80_000).assert(truth(0.5), 0.008);
        pass(&world, start, DVec3::X, 0.7, 80_000).assert(truth(h * h / 8.0 + 0.245), 0.008);
        // The other way, and through the interpolation's flat directions.
        pass(&world, DVec3::new(2.0, 0.4, 0.6), DVec3::NEG_X, INF, 80_000).assert(truth(0.5), 0.008);
        pass(&world, DVec3::new(0.0, 0.0, 0.0), DVec3::ONE, INF, 80_000).assert(truth(0.5 * 3f64.sqrt()), 0.008);
    }
}

/// Flight is as transmittance is: seen before a white sky, a linear grid that absorbs is e^{−τ} bright, and one that
/// also emits at the rate it absorbs is 1.
#[test]
fn flight_agrees_with_transmittance() {
    let ramp = || grid([20, 1, 1], |i, _, _| (f64::from(i) / 20.0 + 0.025) as f32);
    let glowing = |emission: f32| Optics::Coefficients {
        sigma_s: Vec3::ZERO,
        sigma_a: Vec3::splat(3.0),
        emission: Vec3::splat(emission),
        phase: Phase::Isotropic,
    };
    let seen = |optics, radiance, samples| {
        let world = world(vec![volume(ramp(), Vec3::ZERO, Vec3::ONE, optics)], vec![sky(radiance)]);
        look(&world, DVec3::new(-1.0, 0.5, 0.5), DVec3::X, None, samples)
    };
    seen(glowing(0.0), 1.0, 100_000).assert(DVec3::splat((-1.5f64).exp()), 0.003);
    seen(glowing(3.0), 1.0, 400_000).assert(DVec3::ONE, 0.003);
    seen(glowing(3.0), 0.0, 400_000).assert(DVec3::splat(1.0 - (-1.5f64).exp()), 0.003);
}

/// A transfer function over a value that rises linearly from 0 to 1: opacity a tent of height ½ over [.4, .6] within
/// unit length .1, so that τ = −∫ ln(1 − o)/.1 dv = 2·(.1/.5)·∫₀^½ −ln(1 − o) do/.1 = 4·(½ − ½ ln 2)·…; emission of
/// colour c and radiance 2 makes an opaque body 2c bright: L = 2c(1 − e^{−τ}). The tent is narrower than a majorant cell.
#[test]
fn transfer_function() {
    let n = 400;
    let field = grid([n, 1, 1], |i, _, _| (i as f32 + 0.5) / n as f32);
    let color = Vec3::new(1.0, 0.5, 0.1);
    let stop = |value, opacity| Stop { value, opacity, color: Some(color) };
    let stops = vec![stop(0.4, 0.0), stop(0.5, 0.5), stop(0.6, 0.0)];
    let optics = Optics::Transfer(Transfer { unit_length: 0.1, radiance: 2.0, stops, ..Transfer::default() });
    let world = world(vec![volume(field, Vec3::ZERO, Vec3::ONE, optics)], vec![sky(0.1)]);
    // ∫₀^½ −ln(1 − o) do = ½ − ½ ln 2.
    let tau = 2.0 * (0.1 / 0.5) * (0.5 - 0.5 * 2f64.ln()) / 0.1;
    let share = (-tau).exp();
    let start = DVec3::new(-1.0, 0.5, 0.5);
    pass(&world, start, DVec3::X, INF, 50_000).assert(DVec3::splat(share), 0.003);
    let truth = 2.0 * color.as_dvec3() * (1.0 - share) + 0.1 * share;
    look(&world, start, DVec3::X, None, 400_000).assert(truth, 0.003);
}

/// A ball of radius r, passed at a distance b from its centre: T = exp(−σ·2·√(r² − b²)); beside it, 1.
#[test]
fn ball() {
    let (center, r) = (Vec3::new(1.0, 2.0, -1.0), 0.75f64);
    let field = Field::Sphere(Sphere { falloff: 0.0 });
    let ball = volume(field, center - r as f32, center + r as f32, grey(1.0, 0.5, Phase::Isotropic));
    let world = world(vec![ball], vec![]);
    let across = DVec3::new(0.48, 0.6, 0.64);
    let aside = across.cross(DVec3::Y).normalize();
    for b in [0.0f64, 0.3, 0.7, 0.74, 0.76] {
        let chord = 2.0 * (r * r - b * b).max(0.0).sqrt();
        let origin = center.as_dvec3() + aside * b - across * 5.0;
        pass(&world, origin, across, INF, 100_000).assert(DVec3::splat((-1.5 * chord).exp()), 0.003);
    }
}

/// A soft ball along a diameter: ∫ (3t² − 2t³) over a falloff of w is w/2 on either side, so that τ = σ·(2r − w).
#[test]
fn soft_ball() {
    let field = Field::Sphere(Sphere { falloff: 0.5 });
    let world = world(vec![volume(field, Vec3::ZERO, Vec3::ONE, grey(1.0, 0.5, Phase::Isotropic))], vec![]);
    pass(&world, DVec3::splat(-1.0), DVec3::ONE, INF, 200_000).assert(DVec3::splat((-1.5f64 * 0.75).exp()), 0.002);
}

/// exp(−y/H) written as a formula is the exponential density; and at its bound the formula is cut.
#[test]
fn exponential_formula() {
    let of = |wgsl: &str, highest| {
        let formula = Formula::parse(wgsl).unwrap();
        let (min, size) = (Vec3::new(-1.0, 0.0, 2.0), Vec3::new(2.0, 1.5, 1.0));
        let field = Field::Expression(Arc::new(Expression { formula, min, size, highest }));
        world(vec![volume(field, min, min + size, grey(1.0, 0.5, Phase::Isotropic))], vec![])
    };
    let exponential = of("exp(-p.y/0.3)", 1.0);
    let truth = |tau: f64| DVec3::splat((-1.5 * tau).exp());
    let upright = 0.3 * (1.0 - (-5.0f64).exp());
    pass(&exponential, DVec3::new(0.1, -1.0, 2.5), DVec3::Y, INF, 200_000).assert(truth(upright), 0.002);
    let slope = 0.3 / 0.6 * ((-0.2f64 / 0.3).exp() - (-0.8f64 / 0.3).exp());
    pass(&exponential, DVec3::new(-0.9, 0.2, 2.5), DVec3::new(0.8, 0.6, 0.0), 1.0, 200_000).assert(truth(slope), 0.002);
    let constant = of("5 * p.x + 10", 0.8);
    pass(&constant, DVec3::new(0.1, -1.0, 2.5), DVec3::Y, INF, 100_000).assert(truth(1.2), 0.01);
}
