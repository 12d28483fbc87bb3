//! A medium that only scatters, under the same light from everywhere, cannot be seen: ground truth 3.

use glam::{DVec3, Mat4, Quat, Vec3};
use tyndall_scene::description::Phase;
use tyndall_scene::{Field, World};

use crate::worlds::*;

/// Every path returns exactly the sky's radiance.
fn assert_invisible(world: &World) {
    for (origin, direction) in [
        (DVec3::new(-1.0, 0.4, 0.6), DVec3::X),
        (DVec3::new(0.3, 0.4, 0.5), DVec3::new(1.0, -2.0, 0.5)),
        (DVec3::new(0.5, 3.0, 0.5), DVec3::new(0.05, -1.0, 0.0)),
    ] {
        let estimate = look(world, origin, direction, None, 2000);
        estimate.assert(DVec3::splat(0.7), 1e-9);
    }
}

/// Albedo 1 in the sky's 0.7: everything measures 0.7, for every phase function and density.
#[test]
fn white_medium() {
    for phase in greys() {
        for field in [noise([20, 9, 13]), Field::Homogeneous, Field::Exponential { base: 0.5, scale: 0.1 }] {
            let medium = volume(field, Vec3::ZERO, Vec3::ONE, grey(6.0, 0.0, phase.clone()));
            assert_invisible(&world(vec![medium], vec![sky(0.3), sky(0.4)]));
        }
    }
}

/// The same where media of different phase functions overlap, one of them turned.
#[test]
fn white_media_overlapping() {
    let turned = Mat4::from_quat(Quat::from_rotation_y(0.7)) * Mat4::from_scale(Vec3::splat(0.8));
    let volumes = vec![
        volume(noise([8, 40, 8]), Vec3::ZERO, Vec3::ONE, grey(10.0, 0.0, Phase::Hg { g: 0.9 })),
        unit(grey(1.0, 0.0, Phase::Rayleigh)),
        moved(noise([30, 30, 30]), turned, grey(4.0, 0.0, Phase::Isotropic)),
    ];
    assert_invisible(&world(volumes, vec![sky(0.7)]));
}

/// White in every channel though each scatters with another strength: 0.7 on average in each.
#[test]
fn white_chromatic_medium() {
    let optics = optics(Vec3::new(1.0, 4.0, 8.0), Vec3::ZERO, Phase::Rayleigh);
    let world = world(vec![volume(noise([16; 3]), Vec3::ZERO, Vec3::ONE, optics)], vec![sky(0.7)]);
    let estimate = look(&world, DVec3::new(-1.0, 0.4, 0.6), DVec3::X, None, 100_000);
    estimate.assert(DVec3::splat(0.7), 0.003);
}

/// The same for phase functions of which each channel has another.
#[test]
fn white_medium_of_coloured_phase_functions() {
    for phase in [coloured_table(), coloured_mie()] {
        let medium = volume(noise([16; 3]), Vec3::ZERO, Vec3::ONE, grey(6.0, 0.0, phase));
        let world = world(vec![medium], vec![sky(0.7)]);
        let estimate = look(&world, DVec3::new(-1.0, 0.4, 0.6), DVec3::X, None, 100_000);
        estimate.assert(DVec3::splat(0.7), 0.005);
    }
}

/// A furnace that absorbs a thousandth is not white: the test above has teeth.
#[test]
#[should_panic]
fn almost_white_is_seen() {
    let medium = volume(noise([20; 3]), Vec3::ZERO, Vec3::ONE, grey(6.0, 0.006, Phase::Isotropic));
    assert_invisible(&world(vec![medium], vec![sky(0.7)]));
}
