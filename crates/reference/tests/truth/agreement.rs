//! The tracer against itself: other data for the same medium, other channels, another tracer.

use std::sync::Arc;

use glam::{DVec3, Mat4, Quat, Vec3};
use tyndall_reference::simple::Simple;
use tyndall_reference::{Random, Tracer};
use tyndall_scene::description::{Light, Mie, Optics, Phase};
use tyndall_scene::field::{Expression, Formula, Fractal, Noise, Sphere};
use tyndall_scene::phase::PhaseFunction;
use tyndall_scene::{Field, Volume, World};

use crate::tolerance::{Estimate, agree};
use crate::worlds::*;

fn lamps() -> Vec<Light> {
    vec![
        Light::Directional { direction: Vec3::new(1.0, -2.0, -0.5), irradiance: Vec3::new(3.0, 2.0, 1.0) },
        Light::Point { position: Vec3::new(0.5, 2.0, 2.0), intensity: Vec3::ONE },
        sky(0.2),
    ]
}

/// Rays from all sides, and some from within.
fn rays(n: u64) -> Vec<(DVec3, DVec3)> {
    let ray = |i| {
        let mut rng = Random::new(3, i, 0);
        let mut point = |scale: f64| DVec3::from_array([0; 3].map(|_| 0.5 + scale * (rng.uniform() - 0.5)));
        let (origin, target) = (point(if i % 4 == 0 { 0.8 } else { 6.0 }), point(0.8));
        (origin, (target - origin).normalize())
    };
    (0..n).map(ray).collect()
}

type Seen = Vec<Estimate>;

fn see(world: &World, depth: Option<u32>, samples: u32, seed: u64) -> Seen {
    let tracer = Tracer::new(world).unwrap();
    let of = |(i, (o, d)): (usize, (DVec3, DVec3))| {
        Estimate::of(samples, seed + i as u64, |rng| tracer.radiance(o, d, depth, rng))
    };
    rays(12).into_iter().enumerate().map(of).collect()
}

fn pairs(a: Seen, b: Seen) -> Vec<(Estimate, Estimate)> {
    a.into_iter().zip(b).collect()
}

/// Ground truth 5: a grid of constant density gives the homogeneous medium's picture.
#[test]
fn constant_grid_is_homogeneous() {
    let medium = |field| volume(field, Vec3::ZERO, Vec3::ONE, grey(1.2, 0.2, Phase::Hg { g: 0.6 }));
    let grid = world(vec![medium(grid([30, 7, 12], |_, _, _| 2.0))], lamps());
    let optics = grey(2.4, 0.4, Phase::Hg { g: 0.6 });
    let homogeneous = world(vec![unit(optics)], lamps());
    agree(&pairs(see(&grid, None, 40_000, 100), see(&homogeneous, None, 40_000, 200)), 0.01).unwrap();
}

/// Overlapping media a and b are the medium a + b; and not the medium a + 1.1·b.
#[test]
fn overlapping_media_add() {
    let [a, b] = [Vec3::new(0.5, 1.0, 2.0), Vec3::new(1.5, 0.2, 0.4)];
    let of = |sigma_s, sigma_a| unit(optics(sigma_s, sigma_a, Phase::Isotropic));
    let both = see(&world(vec![of(a, b * 0.2), of(b, a * 0.1)], lamps()), None, 40_000, 100);
    let sum = |b: Vec3| see(&world(vec![of(a + b, b * 0.2 + a * 0.1)], lamps()), None, 40_000, 200);
    agree(&pairs(both.clone(), sum(b)), 0.01).unwrap();
    assert!(agree(&pairs(both, sum(b * 1.1)), 0.01).is_err());
}

/// Each channel of a coloured medium is as if it were alone: three grey runs give the same.
#[test]
fn colours_do_not_mix() {
    let (s, a) = (Vec3::new(1.0, 6.0, 3.0), Vec3::new(2.0, 0.0, 0.5));
    let emission = Vec3::new(0.0, 0.5, 1.0);
    assert_channels_alone(|filter| {
        let optics = Optics::Coefficients {
            sigma_s: filter(s),
            sigma_a: filter(a),
            emission: filter(emission),
            phase: Phase::Rayleigh,
        };
        vec![volume(noise([20; 3]), Vec3::ZERO, Vec3::ONE, optics)]
    });
}

/// The same where media of opposite colours and phase functions overlap: each channel has its own mixture of them.
#[test]
fn coloured_mixtures() {
    assert_channels_alone(|filter| {
        let of = |sigma_s, g| unit(optics(filter(sigma_s), Vec3::ZERO, Phase::Hg { g }));
        vec![of(Vec3::new(4.0, 0.5, 0.0), 0.8), of(Vec3::new(0.2, 2.0, 4.0), -0.7)]
    });
}

/// Compares a coloured world with its channels, each as a grey world. `volumes` makes the media, each coefficient put
/// through the function it is given.
#[track_caller]
fn assert_channels_alone(volumes: impl Fn(&dyn Fn(Vec3) -> Vec3) -> Vec<Volume>) {
    let coloured = see(&world(volumes(&|x| x), lamps()), None, 40_000, 100);
    let grey = [0, 1, 2].map(|channel| {
        let world = world(volumes(&|x| Vec3::splat(x[channel])), lamps());
        see(&world, None, 40_000, 200 + 50 * channel as u64)
    });
    let merged = (0..coloured.len()).map(|i| Estimate {
        mean: DVec3::new(grey[0][i].mean.x, grey[1][i].mean.y, grey[2][i].mean.z),
        error: DVec3::new(grey[0][i].error.x, grey[1][i].error.y, grey[2][i].error.z),
    });
    agree(&pairs(coloured, merged.collect()), 0.012).unwrap();
}

/// A world with everything in it: coloured smoke, fog, a turned box that glows, all overlapping, four lights.
fn everything() -> World {
    let smoke = optics(Vec3::new(6.0, 4.0, 2.0), Vec3::new(0.2, 1.0, 0.1), Phase::Hg { g: 0.7 });
    let glowing = Optics::Coefficients {
        sigma_s: Vec3::splat(0.5),
        sigma_a: Vec3::new(0.1, 0.5, 1.0),
        emission: Vec3::new(0.3, 0.2, 0.0),
        phase: Phase::Isotropic,
    };
    let turned = Mat4::from_translation(Vec3::new(0.2, 0.1, 0.3)) * Mat4::from_quat(Quat::from_rotation_x(0.6));
    let fog = Field::Exponential { base: 0.3, scale: 0.4 };
    let volumes = vec![
        volume(noise([20, 12, 9]), Vec3::ZERO, Vec3::ONE, smoke),
        volume(fog, Vec3::splat(-0.5), Vec3::splat(1.5), grey(0.3, 0.02, Phase::Rayleigh)),
        moved(noise([9, 9, 40]), turned * Mat4::from_scale(Vec3::splat(0.7)), glowing),
    ];
    let spot = Light::Spot {
        position: Vec3::new(-2.0, 2.0, 0.5),
        direction: Vec3::new(1.0, -0.7, 0.0),
        intensity: Vec3::splat(8.0),
        inner_angle: 10.0,
        outer_angle: 25.0,
    };
    let mut lights = lamps();
    lights.push(spot);
    world(volumes, lights)
}

fn see_simply(world: &World, depth: Option<u32>, samples: u32) -> Seen {
    let simple = Simple::new(world);
    let of = |(i, (o, d)): (usize, (DVec3, DVec3))| {
        Estimate::of(samples, 900 + i as u64, |rng| simple.radiance(o, d, depth, rng))
    };
    rays(12).into_iter().enumerate().map(of).collect()
}

/// The one-page tracer agrees, whatever the depth; and notices when the depth is another.
#[test]
fn simple_tracer_agrees() {
    let world = everything();
    let simple = see_simply(&world, None, 30_000);
    agree(&pairs(see(&world, None, 20_000, 100), simple.clone()), 0.02).unwrap();
    assert!(agree(&pairs(see(&world, Some(2), 20_000, 100), simple), 0.02).is_err());
    for depth in 0..3 {
        let pairs = pairs(see(&world, Some(depth), 20_000, 100), see_simply(&world, Some(depth), 20_000));
        agree(&pairs, 0.03).unwrap_or_else(|message| panic!("depth {depth}: {message}"));
    }
}

/// The one-page tracer, which knows one bound for all of a field, agrees on fields that are functions.
#[test]
fn simple_tracer_agrees_on_functions() {
    let fractal = Fractal { octaves: 4, gain: 0.6, lacunarity: 2.1, seed: 5 };
    let noise = Noise { fractal, threshold: -0.05, origin: Vec3::splat(-1.3), extent: Vec3::splat(2.5) };
    let formula = Formula::parse("exp(-8*dot(p, p)) * (0.5 + fbm(5*p, 3))").unwrap();
    let expression = Expression { formula, min: Vec3::splat(-0.5), size: Vec3::ONE, highest: 1.0 };
    for field in [Field::Sphere(Sphere { falloff: 0.6 }), Field::Noise(noise), Field::Expression(Arc::new(expression))]
    {
        let optics = optics(Vec3::new(6.0, 4.0, 2.0), Vec3::new(0.2, 1.0, 0.1), Phase::Hg { g: 0.6 });
        let world = world(vec![volume(field, Vec3::ZERO, Vec3::ONE, optics)], lamps());
        let simple = see_simply(&world, None, 20_000);
        agree(&pairs(see(&world, None, 20_000, 100), simple), 0.03).unwrap();
    }
}

/// The one-page tracer agrees where two media overlap of which each has another phase function in every channel; and
/// notices when that of one is another.
#[test]
fn phase_functions_by_channel() {
    let of = |radius: f32| {
        let Phase::Mie(mie) = coloured_mie() else { unreachable!() };
        let spheres = optics(Vec3::new(2.0, 1.0, 3.0), Vec3::splat(0.1), Phase::Mie(Mie { radius, ..mie }));
        let paper = optics(Vec3::new(1.0, 3.0, 0.5), Vec3::new(0.1, 0.0, 0.2), coloured_table());
        world(vec![unit(spheres), volume(noise([9; 3]), Vec3::ZERO, Vec3::ONE, paper)], lamps())
    };
    let simple = see_simply(&of(0.3), None, 30_000);
    agree(&pairs(see(&of(0.3), None, 30_000, 100), simple.clone()), 0.02).unwrap();
    assert!(agree(&pairs(see(&of(0.1), None, 30_000, 100), simple), 0.02).is_err());
}

/// Ground truth 9: light from a point lamp at A that a sphere of directions sees at B is as much as from B at A.
#[test]
fn reciprocity() {
    let ends = [Vec3::new(-0.5, 0.3, 0.2), Vec3::new(0.6, 1.7, 0.9)];
    let anywhere = tyndall_reference::phase::Phase::new(&PhaseFunction::Isotropic);
    let fluence = |from: Vec3, to: Vec3, seed| {
        let medium = volume(noise([20, 12, 9]), Vec3::ZERO, Vec3::ONE, grey(8.0, 0.4, Phase::Hg { g: 0.5 }));
        let world = world(vec![medium], vec![Light::Point { position: from, intensity: Vec3::ONE }]);
        let tracer = Tracer::new(&world).unwrap();
        Estimate::of(300_000, seed, |rng| {
            let direction = anywhere.sample(0, DVec3::Z, rng);
            tracer.radiance(to.as_dvec3(), direction, None, rng)
        })
    };
    agree(&[(fluence(ends[0], ends[1], 1), fluence(ends[1], ends[0], 2))], 0.03).unwrap();
}
