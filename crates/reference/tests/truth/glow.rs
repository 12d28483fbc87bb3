//! Media with grids of temperature and colour.

use std::sync::Arc;

use glam::{DVec3, Mat4, Vec3};
use tyndall_reference::Tracer;
use tyndall_reference::simple::Simple;
use tyndall_scene::description::{Light, Optics, Phase};
use tyndall_scene::volume::{Grid, Voxels};
use tyndall_scene::{Color, Field, PlacedGrid, Temperature, Volume, World, black_body};

use crate::tolerance::{Estimate, agree};
use crate::worlds::*;

/// A grid over a box.
fn placed(dims: [u32; 3], min: Vec3, max: Vec3, value: impl Fn(u32) -> f32) -> PlacedGrid {
    let voxels = (0..dims.iter().product()).map(value).collect();
    let grid = Arc::new(Grid::dense(dims, Voxels::F32(voxels), Mat4::IDENTITY));
    PlacedGrid { grid, unit_from_world: (Mat4::from_translation(min) * Mat4::from_scale(max - min)).inverse() }
}

fn hot(grid: PlacedGrid, volume: Volume) -> Volume {
    // 1500 K where the grid is 1, in units of a kilokelvin.
    let temperature = Temperature { grid, kelvin: 1000.0, offset: 500.0, radiance_scale: 0.01 };
    Volume { temperature: Some(temperature), ..volume }
}

fn tinted(value: Vec3, volume: Volume) -> Volume {
    let grids = value.to_array().map(|value| placed([2, 3, 1], Vec3::ZERO, Vec3::ONE, |_| value));
    Volume { color: Some(Color { grids }), ..volume }
}

fn lamps() -> Vec<Light> {
    let sun = Light::Directional { direction: Vec3::new(1.0, -2.0, -0.5), irradiance: Vec3::new(3.0, 2.0, 1.0) };
    vec![sun, sky(0.2)]
}

const RAYS: [(DVec3, DVec3); 3] = [
    (DVec3::new(-2.0, 0.4, 0.6), DVec3::X),
    (DVec3::new(0.7, 0.3, 3.0), DVec3::NEG_Z),
    (DVec3::new(0.2, 0.5, 0.5), DVec3::new(0.6, 0.0, 0.8)),
];

fn see(world: &World, samples: u32, seed: u64) -> Vec<Estimate> {
    let tracer = Tracer::new(world).unwrap();
    RAYS.map(|(o, d)| Estimate::of(samples, seed, |rng| tracer.radiance(o, d, None, rng))).into()
}

fn see_simply(world: &World, samples: u32, seed: u64) -> Vec<Estimate> {
    let simple = Simple::new(world);
    RAYS.map(|(o, d)| Estimate::of(samples, seed, |rng| simple.radiance(o, d, None, rng))).into()
}

fn pairs(a: Vec<Estimate>, b: Vec<Estimate>) -> Vec<(Estimate, Estimate)> {
    a.into_iter().zip(b).collect()
}

/// A body of one temperature that only absorbs: L = (1 − e^{−σ_a·s})·B(T), as does one that emits σ_a·B(T) itself; in
/// the one-page tracer, too. At another temperature it does not.
#[test]
fn a_hot_body_emits_as_a_black_one() {
    let sigma_a = Vec3::new(0.5, 1.0, 2.0);
    let radiance = 0.01 * black_body(1500.0);
    let absorbing = || unit(optics(Vec3::ZERO, sigma_a, Phase::Isotropic));
    let everywhere = |value: f32| placed([3, 2, 2], Vec3::splat(-0.5), Vec3::splat(1.5), move |_| value);
    let heated = |value| world(vec![hot(everywhere(value), absorbing())], vec![]);
    let truth = radiance.as_dvec3() * (DVec3::ONE - (-sigma_a.as_dvec3()).exp());
    let (origin, direction) = RAYS[0];
    look(&heated(1.0), origin, direction, None, 200_000).assert(truth, 0.003);
    assert!(look(&heated(1.1), origin, direction, None, 200_000).check(truth, 0.01).is_err());

    let emission = sigma_a * radiance;
    let given = Optics::Coefficients { sigma_s: Vec3::ZERO, sigma_a, emission, phase: Phase::Isotropic };
    let given = world(vec![unit(given)], vec![]);
    agree(&pairs(see(&heated(1.0), 40_000, 1), see(&given, 40_000, 2)), 0.01).unwrap();
    agree(&pairs(see(&heated(1.0), 40_000, 1), see_simply(&heated(1.0), 100_000, 2)), 0.02).unwrap();
}

/// The grid has a box of its own: beyond it the temperature is `offset`, here too cold to glow, so that a ray through a
/// thin medium collects half of what it would.
#[test]
fn outside_its_grid_a_body_is_cold() {
    let sigma_a = Vec3::splat(1.0);
    let half = placed([1, 1, 1], Vec3::ZERO, Vec3::new(0.5, 1.0, 1.0), |_| 1.0);
    let world = world(vec![hot(half, unit(optics(Vec3::ZERO, sigma_a, Phase::Isotropic)))], vec![]);
    let [hot, cold] = [1500.0, 500.0].map(|kelvin| 0.01 * black_body(kelvin).as_dvec3());
    let near = 1.0 - (-0.5f64).exp();
    let truth = hot * near + cold * (near * (-0.5f64).exp());
    look(&world, RAYS[0].0, RAYS[0].1, None, 200_000).assert(truth, 0.004);
}

/// White changes nothing; a colour is the medium of albedo c·σ_s/σ_t and the same extinction; another is another.
#[test]
fn colour_divides_the_extinction() {
    let (s, a) = (Vec3::new(2.0, 3.0, 1.0), Vec3::splat(0.25));
    let medium = |s, a| volume(noise([9, 7, 8]), Vec3::ZERO, Vec3::ONE, optics(s, a, Phase::Hg { g: 0.4 }));
    let plain = world(vec![medium(s, a)], lamps());
    let white = world(vec![tinted(Vec3::ONE, medium(s, a))], lamps());
    let truth = see(&plain, 40_000, 1);
    agree(&pairs(see(&white, 40_000, 2), truth.clone()), 0.01).unwrap();
    // Values beyond 0 and 1 count as those.
    let whiter = world(vec![tinted(Vec3::splat(7.0), medium(s, a))], lamps());
    agree(&pairs(see(&whiter, 40_000, 3), truth.clone()), 0.01).unwrap();

    let c = Vec3::new(0.5, 0.2, 1.0);
    let coloured = world(vec![tinted(c, medium(s, a))], lamps());
    let adjusted = world(vec![medium(s * c, a + s * (1.0 - c))], lamps());
    let adjusted = see(&adjusted, 40_000, 4);
    agree(&pairs(see(&coloured, 40_000, 5), adjusted.clone()), 0.01).unwrap();
    agree(&pairs(see_simply(&coloured, 60_000, 6), adjusted.clone()), 0.03).unwrap();
    assert!(agree(&pairs(truth, adjusted), 0.01).is_err());

    // Half of the box: beyond the grid the colour is white.
    let mut half = tinted(Vec3::ZERO, unit(optics(s, a, Phase::Isotropic)));
    let black = placed([1, 1, 1], Vec3::ZERO, Vec3::new(0.5, 1.0, 1.0), |_| 0.0);
    half.color = Some(Color { grids: [black.clone(), black.clone(), black] });
    let of = |x: f32, s, a| {
        volume(Field::Homogeneous, Vec3::X * x, Vec3::new(0.5 + x, 1.0, 1.0), optics(s, a, Phase::Isotropic))
    };
    let two = world(vec![of(0.0, Vec3::ZERO, s + a), of(0.5, s, a)], lamps());
    agree(&pairs(see(&world(vec![half], lamps()), 40_000, 7), see(&two, 40_000, 8)), 0.01).unwrap();
}
