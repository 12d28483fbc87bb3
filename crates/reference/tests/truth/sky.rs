//! Light from an environment map.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DQuat, DVec2, DVec3, Mat4, Quat, Vec3};
use tyndall_reference::simple::Simple;
use tyndall_reference::sky::Sky;
use tyndall_reference::{Random, Tracer};
use tyndall_scene::description::{Light, Phase};
use tyndall_scene::image::Image;
use tyndall_scene::{EnvironmentMap, Field, Volume, World};

use crate::single::{p, slab};
use crate::tolerance::{CHI_SQUARED, Estimate, agree, chi_squared_critical};
use crate::worlds::*;

fn map(size: [u32; 2], rotation: f32, value: impl Fn(u32, u32) -> Vec3) -> Arc<EnvironmentMap> {
    let [width, height] = size;
    let pixels = (0..width * height).map(|i| value(i % width, i / width).to_array()).collect();
    Arc::new(EnvironmentMap::new(Image { width, height, pixels, ..Image::default() }, rotation).unwrap())
}

/// A blue sky with a soft sun, no two columns of it alike.
fn day(rotation: f32, sun: f32) -> Arc<EnvironmentMap> {
    map([24, 12], rotation, |i, j| {
        let sky = Vec3::new(0.2, 0.4, 1.0) * (0.3 + 0.03 * (i as f32) + 0.05 * (j * j % 7) as f32);
        if (i, j) == (5, 3) { Vec3::new(1.0, 0.9, 0.8) * sun } else { sky }
    })
}

fn under(map: Arc<EnvironmentMap>, volumes: Vec<Volume>, lights: Vec<Light>) -> World {
    World { environment: Some(map), ..world(volumes, lights) }
}

/// White media in a map that is 0.3 everywhere, and 0.4 of constant light: 0.7 everywhere.
#[test]
fn furnace() {
    for phase in phases() {
        let volumes = vec![
            volume(noise([20, 9, 13]), Vec3::ZERO, Vec3::ONE, grey(6.0, 0.0, phase)),
            unit(grey(1.0, 0.0, Phase::Rayleigh)),
        ];
        let world = under(map([7, 3], 1.0, |_, _| Vec3::splat(0.3)), volumes, vec![sky(0.4)]);
        let estimate = look(&world, DVec3::new(-1.0, 0.4, 0.6), DVec3::X, None, 60_000);
        estimate.assert(DVec3::splat(0.7), 0.003);
    }
}

/// A constant map is a constant environment, whatever the depth.
#[test]
fn a_constant_map_is_constant_light() {
    let media = || vec![unit(optics(Vec3::new(2.0, 4.0, 1.0), Vec3::new(0.1, 0.5, 2.0), Phase::Hg { g: 0.6 }))];
    let mapped = under(map([5, 8], 0.0, |_, _| Vec3::splat(0.5)), media(), vec![]);
    let constant = world(media(), vec![sky(0.5)]);
    for depth in [Some(0), Some(1), Some(3), None] {
        let seen = |world, seed| {
            let tracer = Tracer::new(world).unwrap();
            let (origin, direction) = (DVec3::new(-1.0, 0.4, 0.6), DVec3::X);
            Estimate::of(60_000, seed, |rng| tracer.radiance(origin, direction, depth, rng))
        };
        agree(&[(seen(&mapped, 1), seen(&constant, 2))], 0.01).unwrap();
    }
}

/// Behind an absorbing slab a direction shows e^{−τ} of what the map has there.
#[test]
fn seen_behind_media() {
    let map = day(0.4, 20.0);
    let world = under(map.clone(), vec![unit(grey(0.0, 1.5, Phase::Isotropic))], vec![]);
    for y in [-0.4, 0.0, 0.3] {
        let direction = DVec3::new(1.0, y, 0.0).normalize();
        let truth = map.radiance(direction.as_vec3()).as_dvec3() * (-1.5 / direction.x).exp();
        look(&world, DVec3::new(-0.1, 0.5 - 0.6 * y, 0.5), direction, None, 100).assert(truth, 1e-9);
    }
}

/// One bright texel is a sun of its irradiance E = L·Δφ·∫ tent(θ) sinθ dθ = L·Δφ·sinθ₀·2(1 − cosΔθ)/Δθ. Under it, an
/// infinite slab of depth 1 shows upwards along d, with c the sun's cosine to the zenith,
/// E σ_s p ∫ exp(−σ_t ((1 − d_y t)/c + t)) dt.
#[test]
fn a_bright_texel_is_a_sun() {
    const SIZE: [u32; 2] = [512, 256];
    let (column, row, radiance) = (150, 57, 3e4);
    let map = map(SIZE, 0.7, |i, j| if (i, j) == (column, row) { Vec3::splat(radiance) } else { Vec3::ZERO });
    let center = DVec2::new(f64::from(column) + 0.5, f64::from(row) + 0.5) / DVec2::new(512.0, 256.0);
    let towards = map.direction(center);
    let (phi, theta) = (TAU / 512.0, PI / 256.0);
    let irradiance = f64::from(radiance) * phi * (PI * center.y).sin() * 2.0 * (1.0 - theta.cos()) / theta;
    for phase in [Phase::Isotropic, Phase::Rayleigh, Phase::Hg { g: -0.5 }] {
        let dark = Light::Constant { radiance: Vec3::ZERO };
        let world = World { environment: Some(map.clone()), ..slab(dark, phase.clone()) };
        let d = DVec3::new(0.8, 0.6, 0.0);
        let (sigma_s, sigma_t) = (1.2, 1.5);
        let rate = sigma_t * (1.0 - d.y / towards.y);
        let integral = (-sigma_t / towards.y).exp() * (1.0 - (-rate / d.y).exp()) / rate;
        let truth = irradiance * sigma_s * p(&phase, d.dot(towards)).x * integral;
        let seen = look(&world, DVec3::new(-1.0, 0.0, 0.0) - d, d, Some(1), 150_000);
        seen.assert(DVec3::splat(truth), 0.005);
        // A few percent would be seen.
        assert!(seen.check(DVec3::splat(truth * 1.03), 0.005).is_err());
    }
}

/// A sampler's directions against a density, over cells of equal solid angle: χ² and its critical value.
fn chi_squared(sampled: &Sky, expected: &Sky) -> (f64, f64) {
    const SAMPLES: u32 = 200_000;
    const ROWS: usize = 20;
    const COLUMNS: usize = 14;
    const FINE: usize = 80;
    let mut counts = [0u32; ROWS * COLUMNS];
    for sample in 0..SAMPLES {
        let (direction, density) = sampled.sample(&mut Random::new(9, 0, sample.into())).unwrap();
        assert!((direction.length() - 1.0).abs() < 1e-12);
        assert!((density / sampled.pdf(direction) - 1.0).abs() < 1e-9, "{direction}: {density}");
        let row = ((1.0 - direction.y) / 2.0 * ROWS as f64) as usize;
        let column = ((direction.z.atan2(direction.x) / TAU + 0.5) * COLUMNS as f64) as usize;
        counts[row.min(ROWS - 1) * COLUMNS + column.min(COLUMNS - 1)] += 1;
    }
    let share = |cell: usize| {
        let at = |i: usize| {
            let y = 1.0 - 2.0 * ((cell / COLUMNS) as f64 + ((i / FINE) as f64 + 0.5) / FINE as f64) / ROWS as f64;
            let angle =
                TAU * (((cell % COLUMNS) as f64 + ((i % FINE) as f64 + 0.5) / FINE as f64) / COLUMNS as f64 - 0.5);
            let radius = (1.0 - y * y).sqrt();
            expected.pdf(DVec3::new(radius * angle.cos(), y, radius * angle.sin()))
        };
        (0..FINE * FINE).map(at).sum::<f64>() * 4.0 * PI / (ROWS * COLUMNS * FINE * FINE) as f64
    };
    let shares: Vec<_> = (0..ROWS * COLUMNS).map(share).collect();
    assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-3, "the density's integral");
    let chi = counts.iter().zip(&shares).map(|(&count, share)| {
        let expected = share * f64::from(SAMPLES);
        assert!(expected > 10.0);
        (f64::from(count) - expected).powi(2) / expected
    });
    (chi.sum(), chi_squared_critical(ROWS * COLUMNS - 1, CHI_SQUARED))
}

/// Directions are distributed as their density says, also where the map is a single texel; and a map a few degrees aside
/// is found out.
#[test]
fn sampler() {
    let of = |rotation| Sky::new(day(rotation, 12.0));
    for sky in [of(0.0), of(2.5), Sky::new(map([1, 1], 0.0, |_, _| Vec3::Z))] {
        let (chi, critical) = chi_squared(&sky, &sky);
        assert!(chi < critical, "χ² = {chi}, critical {critical}");
    }
    let (chi, critical) = chi_squared(&of(0.0), &of(0.05));
    assert!(chi > critical, "χ² = {chi}, critical {critical}");
}

/// A black map has no directions to sample, and gives no light.
#[test]
fn a_black_map_is_dark() {
    let black = || map([4, 2], 0.0, |_, _| Vec3::ZERO);
    assert!(Sky::new(black()).sample(&mut Random::new(1, 0, 0)).is_none());
    let world = under(black(), vec![unit(grey(3.0, 0.1, Phase::Isotropic))], vec![]);
    assert_eq!(look(&world, DVec3::new(-1.0, 0.5, 0.5), DVec3::X, None, 1000).mean, DVec3::ZERO);
}

/// Smoke in a thin fog under a map, turned about the y axis together.
fn smoke(map: Arc<EnvironmentMap>, turn: f32) -> World {
    let smoke = optics(Vec3::new(9.0, 7.0, 5.0), Vec3::new(0.2, 0.5, 0.1), Phase::Hg { g: 0.7 });
    let turn = Mat4::from_quat(Quat::from_rotation_y(turn));
    let low = Mat4::from_translation(Vec3::splat(-0.5));
    let volumes = vec![
        moved(noise([20, 12, 9]), turn * low, smoke),
        moved(
            Field::Homogeneous,
            turn * low * Mat4::from_scale(Vec3::new(1.5, 0.7, 1.0)),
            grey(0.5, 0.0, Phase::Rayleigh),
        ),
    ];
    under(map, volumes, vec![sky(0.1)])
}

/// Rays at it, turned about the y axis.
fn rays(turn: f64) -> impl Iterator<Item = (DVec3, DVec3)> {
    let turn = DQuat::from_rotation_y(turn);
    (0..10).map(move |i| {
        let mut rng = Random::new(3, i, 0);
        let mut point = |scale: f64| DVec3::from_array([0; 3].map(|_| scale * (rng.uniform() - 0.5)));
        let (origin, target) = (point(if i % 4 == 0 { 0.8 } else { 6.0 }), point(0.8));
        (turn * origin, turn * (target - origin).normalize())
    })
}

fn see(world: &World, turn: f64, depth: Option<u32>, seed: u64) -> Vec<Estimate> {
    let tracer = Tracer::new(world).unwrap();
    let seen = |(i, (o, d))| Estimate::of(20_000, seed + i, |rng| tracer.radiance(o, d, depth, rng));
    (0u64..).zip(rays(turn)).map(seen).collect()
}

fn pairs(a: Vec<Estimate>, b: Vec<Estimate>) -> Vec<(Estimate, Estimate)> {
    a.into_iter().zip(b).collect()
}

/// The one-page tracer, which finds the map only where paths escape, agrees whatever the depth; and notices a sun that is a
/// third brighter.
#[test]
fn simple_tracer_agrees() {
    let world = smoke(day(0.3, 12.0), 0.0);
    let simply = |depth| -> Vec<Estimate> {
        let simple = Simple::new(&world);
        let seen = |(i, (o, d))| Estimate::of(60_000, 900 + i, |rng| simple.radiance(o, d, depth, rng));
        (0u64..).zip(rays(0.0)).map(seen).collect()
    };
    for depth in [None, Some(0), Some(1), Some(2)] {
        agree(&pairs(see(&world, 0.0, depth, 100), simply(depth)), 0.03)
            .unwrap_or_else(|message| panic!("depth {depth:?}: {message}"));
    }
    let brighter = smoke(day(0.3, 16.0), 0.0);
    assert!(agree(&pairs(see(&brighter, 0.0, None, 100), simply(None)), 0.03).is_err());
}

/// Turning the map with scene and camera changes nothing; turning the map alone does.
#[test]
fn rotation() {
    let turn = 0.8;
    let still = see(&smoke(day(0.3, 12.0), 0.0), 0.0, None, 100);
    let turned = see(&smoke(day(0.3 + turn, 12.0), turn), turn.into(), None, 200);
    agree(&pairs(still.clone(), turned), 0.02).unwrap();
    let alone = see(&smoke(day(0.3 + turn, 12.0), 0.0), 0.0, None, 300);
    assert!(agree(&pairs(still, alone), 0.02).is_err());
}
