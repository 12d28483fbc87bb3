//! The terms of a ray's integral, against closed forms.

use std::ops::ControlFlow;

use glam::{DVec3, Vec3};
use tyndall_reference::{Point, probe};
use tyndall_scene::description::{Camera, Film, Light, Phase};
use tyndall_scene::{Field, World};

use crate::tolerance::{Estimate, SIGMAS, agree};
use crate::worlds::*;

const SAMPLES: u32 = 2000;

/// Level through the unit cube in the sun, 0.5 m below its top.
fn points(sun: f32, field: Field) -> Vec<Point> {
    let light = Light::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::splat(sun) };
    let medium = volume(field, Vec3::ZERO, Vec3::ONE, optics(Vec3::new(1.0, 2.0, 3.0), Vec3::ONE, Phase::Isotropic));
    let mut world = world(vec![medium], vec![light]);
    world.scene.camera = Camera { position: Vec3::new(0.5, 0.5, 2.0), target: Vec3::splat(0.5), ..world.scene.camera };
    world.scene.film = Film { size: [1, 1], ..world.scene.film };
    probe(&world, [0, 0], [0.5, 2.5], 20, SAMPLES, &mut |_| ControlFlow::Continue(())).unwrap().unwrap()
}

/// How many standard errors the farthest term is off: T = e^{−σ_t s}, S = E σ_s e^{−σ_t/2}/4π, L = S (1 − e^{−σ_t s})/σ_t at
/// depth s of a homogeneous cube; 0 extinction outside.
fn worst(points: &[Point]) -> f64 {
    let (sigma_s, sigma_t) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(2.0, 3.0, 4.0));
    let source = 4.0 * sigma_s * (-0.5 * sigma_t).exp() / (4.0 * std::f64::consts::PI);
    let mut worst = 0f64;
    for point in points {
        let s = (point.distance - 1.0).clamp(0.0, 1.0);
        let within = if s > 0.0 && s < 1.0 { 1.0 } else { 0.0 };
        let transmittance = (-sigma_t * s).exp();
        let truths = [sigma_t * within, transmittance, source * within, source * (1.0 - transmittance) / sigma_t];
        let found = [point.extinction, point.transmittance, point.source, point.radiance];
        for (truth, found) in truths.into_iter().zip(found) {
            let [mean, error] = [found.mean, found.error].map(DVec3::from);
            assert!(error.max_element() < 0.01, "an error of {error} says something");
            worst = worst.max(((mean - truth).abs() / (error + 1e-6)).max_element());
        }
    }
    worst
}

#[test]
fn a_slab_in_the_sun() {
    let worst = worst(&points(4.0, Field::Homogeneous));
    assert!(worst < SIGMAS, "{worst} standard errors off");
}

#[test]
fn another_sun_is_seen() {
    let worst = worst(&points(4.2, Field::Homogeneous));
    assert!(worst > SIGMAS, "{worst}");
}

/// Beyond all media the radiance of a ray through noise is that of paths of depth 1.
#[test]
fn the_whole_ray_is_single_scattering() {
    let light = Light::Directional { direction: Vec3::new(0.3, -1.0, 0.2), irradiance: Vec3::splat(4.0) };
    let medium = |field| volume(field, Vec3::ZERO, Vec3::ONE, optics(Vec3::splat(6.0), Vec3::ONE, coloured_table()));
    let mut dark = world(vec![medium(noise([6; 3]))], vec![light]);
    dark.scene.camera.position = Vec3::new(0.4, 0.3, 2.0);
    dark.scene.camera.target = Vec3::new(0.5, 0.6, 0.5);
    dark.scene.film.size = [1, 1];
    let origin = dark.scene.camera.position.as_dvec3();
    let direction = (dark.scene.camera.target.as_dvec3() - origin).normalize();
    let compare = |world: &World, behind: f64| {
        let points =
            probe(world, [0, 0], [0.0, 4.0], 64, SAMPLES, &mut |_| ControlFlow::Continue(())).unwrap().unwrap();
        let last = points.last().unwrap();
        let (radiance, share) = (last.radiance, last.transmittance);
        let mean = DVec3::from(radiance.mean) + behind * DVec3::from(share.mean);
        let error = DVec3::from(radiance.error) + behind * DVec3::from(share.error);
        let paths = look(world, origin, direction, Some(1), 200_000);
        agree(&[(Estimate { mean, error }, paths)], 0.02).unwrap();
    };
    compare(&dark, 0.0);
    // Paths see the sky behind the medium; a probe has only what the sky sends into it.
    dark.lights.insert("sky".into(), sky(1.0));
    compare(&dark, 1.0);
}
