//! Total reflectance of an index-matched half-space, isotropic: ground truth 4, [Chandrasekhar60].

use glam::{DVec3, Vec3};
use tyndall_reference::Tracer;
use tyndall_scene::Field;
use tyndall_scene::description::Phase;

use crate::tolerance::Estimate;
use crate::worlds::*;

/// α, and reflectance of normally incident and of uniform diffuse light.
const TABLE: [(f32, f64, f64); 5] = [
    (0.2, 0.03523, 0.04626),
    (0.5, 0.11523, 0.14654),
    (0.8, 0.28525, 0.34187),
    (0.95, 0.53554, 0.59667),
    (0.99, 0.75272, 0.79456),
];

/// The table has five digits.
const DIGITS: f64 = 0.5e-5;

/// By reciprocity, the radiance seen under a uniform sky of 1 is the albedo for light that comes the same way. A box of
/// 10⁴ mean free paths stands for the half-space.
#[test]
fn reflectance() {
    for (albedo, normal, diffuse) in TABLE {
        let optics = grey(albedo, 1.0 - albedo, Phase::Isotropic);
        let (min, max) = (Vec3::new(-5e3, -1e4, -5e3), Vec3::new(5e3, 0.0, 5e3));
        let world = world(vec![volume(Field::Homogeneous, min, max, optics)], vec![sky(1.0)]);
        let tracer = Tracer::new(&world).unwrap();
        let eye = DVec3::Y;
        let near = |estimate: Estimate, truth: f64| {
            let error = estimate.error + DIGITS;
            Estimate { error, ..estimate }.assert(DVec3::splat(truth), 1e-3 / truth);
        };
        near(Estimate::of(150_000, 1, |rng| tracer.radiance(eye, DVec3::NEG_Y, None, rng)), normal);
        let cosine = Estimate::of(150_000, 2, |rng| {
            let (u, phi) = (rng.uniform(), std::f64::consts::TAU * rng.uniform());
            let direction = DVec3::new(u.sqrt() * phi.cos(), -(1.0 - u).sqrt(), u.sqrt() * phi.sin());
            tracer.radiance(eye, direction.normalize(), None, rng)
        });
        near(cosine, diffuse);
    }
}
