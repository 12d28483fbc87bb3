//! Cutting planes: what is cut away is as if it were not there.

use glam::{DVec3, Mat4, Quat, Vec3};
use tyndall_reference::simple::Simple;
use tyndall_reference::{ReferenceError, Tracer};
use tyndall_scene::Volume;
use tyndall_scene::description::{Bounds, Clip, Cut, Isosurface, Light, Optics, Phase, Transfer};

use crate::tolerance::{Estimate, agree};
use crate::worlds::*;

const INF: f64 = f64::INFINITY;

fn clipped(volume: Volume, planes: &[(Vec3, Vec3)], kept: Option<Bounds>) -> Volume {
    let planes = planes.iter().map(|&(point, normal)| Cut { point, normal }).collect();
    Volume { clip: Clip { planes, kept }.planes(), ..volume }
}

/// A plane through the middle halves the optical depth, straight and from within; beyond it there is nothing.
#[test]
fn a_plane_halves_the_optical_depth() {
    let half = clipped(unit(grey(1.0, 3.0, Phase::Isotropic)), &[(Vec3::splat(0.5), Vec3::X)], None);
    let world = world(vec![half], vec![]);
    let truth = |length: f64| DVec3::splat((-4.0 * length).exp());
    pass(&world, DVec3::new(-1.0, 0.5, 0.5), DVec3::X, INF, 100).assert(truth(0.5), 1e-9);
    pass(&world, DVec3::new(2.0, 0.5, 0.5), DVec3::NEG_X, INF, 100).assert(truth(0.5), 1e-9);
    pass(&world, DVec3::new(0.25, 0.5, 0.5), DVec3::X, INF, 100).assert(truth(0.25), 1e-9);
    pass(&world, DVec3::new(0.75, 0.5, 0.5), DVec3::NEG_X, 0.5, 100).assert(truth(0.25), 1e-9);
    // Through what is cut away, along the plane on either side, and up to a distance before the plane.
    pass(&world, DVec3::new(0.75, 0.5, -1.0), DVec3::Z, INF, 100).assert(DVec3::ONE, 1e-9);
    pass(&world, DVec3::new(0.75, 0.5, 0.5), DVec3::X, INF, 100).assert(DVec3::ONE, 1e-9);
    pass(&world, DVec3::new(0.49, 0.5, -1.0), DVec3::Z, INF, 100).assert(truth(1.0), 1e-9);
    pass(&world, DVec3::new(2.0, 0.5, 0.5), DVec3::NEG_X, 1.4, 100).assert(DVec3::ONE, 1e-9);
}

/// An oblique plane through the middle of a turned box: the chord on its kept side.
#[test]
fn a_plane_stands_in_the_world() {
    let turned = Mat4::from_quat(Quat::from_rotation_y(0.7)) * Mat4::from_translation(Vec3::splat(-0.5));
    let box_ = moved(tyndall_scene::Field::Homogeneous, turned, grey(0.0, 2.0, Phase::Isotropic));
    let world = world(vec![clipped(box_, &[(Vec3::ZERO, Vec3::new(-1.0, 1.0, 0.0))], None)], vec![]);
    let half = 0.5 / 0.7f64.cos();
    // Along x the plane is met where x = y.
    for y in [-0.2, 0.0, 0.3] {
        let truth = DVec3::splat((-2.0 * (half - y)).exp());
        pass(&world, DVec3::new(-3.0, y, 0.0), DVec3::X, INF, 100).assert(truth, 1e-6);
    }
}

fn lamps() -> Vec<Light> {
    vec![
        Light::Directional { direction: Vec3::new(1.0, -2.0, -0.5), irradiance: Vec3::new(3.0, 2.0, 1.0) },
        // Where the larger box is cut away.
        Light::Point { position: Vec3::new(0.9, 0.6, 0.5), intensity: Vec3::ONE },
        sky(0.2),
    ]
}

fn rays() -> [(DVec3, DVec3); 4] {
    let ray = |origin: [f64; 3], target: [f64; 3]| {
        let (origin, target) = (DVec3::from(origin), DVec3::from(target));
        (origin, (target - origin).normalize())
    };
    [
        ray([-2.0, 0.4, 0.6], [0.4, 0.5, 0.5]),
        ray([0.9, 0.9, 3.0], [0.3, 0.4, 0.5]),
        ray([0.95, 0.5, 0.5], [0.2, 0.4, 0.6]),
        ray([0.4, 0.5, 0.6], [1.0, 0.3, 0.1]),
    ]
}

/// A box cut smaller is the smaller box, in all its light: with multiple scattering, a lamp where it is cut away, and in
/// the one-page tracer, too. A box cut differently is not.
#[test]
fn a_clipped_box_is_a_smaller_box() {
    let (min, max) = (Vec3::new(0.1, 0.2, 0.0), Vec3::new(0.7, 0.8, 1.0));
    let optics = || grey(3.0, 0.5, Phase::Hg { g: 0.4 });
    let cut = |max| world(vec![clipped(unit(optics()), &[], Some(Bounds { min, max }))], lamps());
    let small = world(vec![volume(tyndall_scene::Field::Homogeneous, min, max, optics())], lamps());
    let see = |world: &_, seed: u64| {
        let tracer = Tracer::new(world).unwrap();
        rays().map(|(o, d)| Estimate::of(40_000, seed, |rng| tracer.radiance(o, d, None, rng)))
    };
    let pairs = |a: [Estimate; 4], b: [Estimate; 4]| a.into_iter().zip(b).collect::<Vec<_>>();
    let truth = see(&small, 1);
    agree(&pairs(see(&cut(max), 2), truth), 0.01).unwrap();
    assert!(agree(&pairs(see(&cut(max + Vec3::X * 0.1), 2), truth), 0.01).is_err());

    let world = cut(max);
    let simple = Simple::new(&world);
    let simply = rays().map(|(o, d)| Estimate::of(40_000, 3, |rng| simple.radiance(o, d, None, rng)));
    agree(&pairs(simply, truth), 0.03).unwrap();
}

/// What is drawn and no physics is refused by name.
#[test]
fn drawing_is_refused() {
    let isosurfaces = vec![Isosurface { value: 0.5, color: Vec3::ONE, opacity: 1.0 }];
    let drawn = Optics::Transfer(Transfer { isosurfaces, ..Transfer::default() });
    let error = Tracer::new(&world(vec![unit(drawn)], vec![])).err().unwrap();
    assert_eq!(error, ReferenceError::Unphysical { medium: "medium".into(), field: "isosurfaces" });
    assert_eq!(
        error.to_string(),
        "media.medium.optics.transfer.isosurfaces: found a way of drawing that is no physics; accepted by the reference: \
         a transfer function without it"
    );
}
