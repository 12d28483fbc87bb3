//! Nothing hangs, nothing is NaN.

use std::time::Instant;

use glam::{DVec3, Vec3};
use tyndall_reference::{Options, ReferenceError, Tracer, render};
use tyndall_scene::Field;
use tyndall_scene::description::{Light, Phase};

use crate::tolerance::Estimate;
use crate::worlds::*;

/// A world without media, and one with a medium that is nothing, are the sky at once.
#[test]
fn emptiness() {
    let start = Instant::now();
    let nothing = volume(grid([4; 3], |_, _, _| 0.0), Vec3::ZERO, Vec3::ONE, grey(5.0, 1.0, Phase::Isotropic));
    for volumes in [vec![], vec![nothing], vec![unit(grey(0.0, 0.0, Phase::Isotropic))]] {
        let mut world = world(volumes, vec![sky(0.4)]);
        world.scene.film.size = [64, 48];
        let options = Options { samples: Some(4), ..Options::default() };
        let picture = render(&world, &options, None, &mut |_| std::ops::ControlFlow::Continue(())).unwrap();
        assert!(picture.pixels.iter().flatten().all(|x| (x - 0.4).abs() < 1e-6));
    }
    assert!(start.elapsed().as_secs() < 10);
}

/// Rays along faces, edges and grid lines, from corners, and in the directions of axes: finite, and the sky at most.
#[test]
fn degenerate_rays() {
    let medium = volume(noise([16; 3]), Vec3::ZERO, Vec3::ONE, grey(2.0, 2.0, Phase::Hg { g: -0.9 }));
    let world = world(vec![medium, unit(grey(0.1, 0.0, Phase::Rayleigh))], vec![sky(1.0)]);
    let values = [-1.0, 0.0, 0.5, 1.0, 2.0];
    let tracer = Tracer::new(&world).unwrap();
    for (i, x) in values.into_iter().enumerate() {
        for (j, y) in values.into_iter().enumerate() {
            for direction in [DVec3::X, DVec3::NEG_Y, DVec3::Z, DVec3::new(-0.0, -1.0, 0.0), DVec3::new(1.0, 1.0, 0.0)]
            {
                let seed = (10 * i + j) as u64;
                let origin = DVec3::new(x, y, 1.0);
                let e = Estimate::of(50, seed, |rng| tracer.radiance(origin, direction.normalize(), None, rng));
                assert!(e.mean.max_element() <= 1.0 + 1e-9, "{origin} {direction}: {}", e.mean);
            }
        }
    }
}

/// A point light within the medium, one at the eye, one on the ray, one a micrometre away: all samples are finite.
#[test]
fn lamps_in_the_medium() {
    let eye = Vec3::splat(0.5);
    for position in [eye, eye + Vec3::X * 0.1, eye + Vec3::Y * 1e-6] {
        let lamp = Light::Point { position, intensity: Vec3::ONE };
        let world = world(vec![unit(grey(3.0, 1.0, Phase::Hg { g: 0.9 }))], vec![lamp]);
        let e = look(&world, eye.as_dvec3(), DVec3::X, None, 20_000);
        assert!(e.mean.min_element() > 0.0);
    }
}

/// 10⁴ mean free paths: nothing comes through, all is dark within, and it does not take long.
#[test]
fn opaque() {
    let world = world(vec![unit(grey(5e3, 5e3, Phase::Isotropic))], vec![sky(1.0)]);
    let within = look(&world, DVec3::splat(0.5), DVec3::X, None, 2000);
    assert_eq!(within.mean, DVec3::ZERO);
    assert!(pass(&world, DVec3::new(-1.0, 0.5, 0.5), DVec3::X, f64::INFINITY, 10).mean.max_element() < 1e-300);
}

/// A density that overflows is refused by name, not traced.
#[test]
fn overflow_is_refused() {
    let field = Field::Exponential { base: 1000.0, scale: 1.0 };
    let world = world(vec![volume(field, Vec3::ZERO, Vec3::ONE, grey(1.0, 0.0, Phase::Isotropic))], vec![]);
    let error = Tracer::new(&world).err().unwrap();
    assert_eq!(error, ReferenceError::Unbounded { medium: "medium".into() });
    assert!(error.to_string().contains("media.medium"));
}
