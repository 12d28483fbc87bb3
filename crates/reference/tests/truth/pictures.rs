//! Whole pictures: passes, continuation, interruption, stopping.

use std::ops::ControlFlow::{self, Break, Continue};

use glam::Vec3;
use tyndall_reference::{Options, Progress, ReferenceError, render};
use tyndall_scene::World;
use tyndall_scene::description::{Camera, Film, Light, Phase};
use tyndall_scene::image::Image;

use crate::tolerance::ROUNDING;
use crate::worlds::*;

fn scene() -> World {
    let medium = volume(noise([20; 3]), Vec3::splat(-0.5), Vec3::splat(0.5), grey(4.0, 0.5, Phase::Hg { g: 0.5 }));
    let sun = Light::Directional { direction: Vec3::new(1.0, -1.0, 0.0), irradiance: Vec3::new(3.0, 2.0, 1.0) };
    let mut world = world(vec![medium], vec![sun, sky(0.3)]);
    world.scene.film = Film { size: [24, 18], exposure: 0.0 };
    world
}

fn on(_: &Progress) -> ControlFlow<()> {
    Continue(())
}

fn samples(samples: u32) -> Options {
    Options { samples: Some(samples), ..Options::default() }
}

#[track_caller]
fn assert_same(a: &Image, b: &Image) {
    let (x, y) = (a.statistics.as_ref().unwrap(), b.statistics.as_ref().unwrap());
    assert_eq!(x.samples, y.samples);
    for (x, y) in [(&a.pixels, &b.pixels), (&x.variance, &y.variance)] {
        for (x, y) in x.iter().flatten().zip(y.iter().flatten()) {
            assert!(f64::from((x - y).abs()) <= ROUNDING * f64::from(1.0 + x.abs()), "{x} and {y}");
        }
    }
}

/// Eight samples and eight more are sixteen; another seed gives another picture.
#[test]
fn continuation() {
    let world = scene();
    let whole = render(&world, &samples(16), None, &mut on).unwrap();
    let half = render(&world, &samples(8), None, &mut on).unwrap();
    assert_ne!(half.pixels, whole.pixels);
    let continued = render(&world, &samples(16), Some(half), &mut on).unwrap();
    assert_same(&whole, &continued);
    let other = render(&world, &Options { seed: 1, ..samples(16) }, None, &mut on).unwrap();
    assert_ne!(other.pixels, whole.pixels);
}

/// The same bits from one thread and from five.
#[test]
fn independent_of_threads() {
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| render(&scene(), &samples(5), None, &mut on)).unwrap()
    };
    assert_eq!(with(1), with(5));
}

/// Interrupted in the middle of a pass, no sample is lost: continued, it is the same picture.
#[test]
fn interruption_keeps_everything() {
    let world = scene();
    let mut watch = |progress: &Progress| match progress.paths {
        0 => Continue(()),
        _ => Break(()),
    };
    let stopped = render(&world, &samples(40), None, &mut watch).unwrap();
    let taken = &stopped.statistics.as_ref().unwrap().samples;
    assert!(taken.contains(&0) && taken.contains(&1), "{taken:?}");
    let continued = render(&world, &samples(6), Some(stopped), &mut on).unwrap();
    assert_same(&render(&world, &samples(6), None, &mut on).unwrap(), &continued);
}

/// Stopped before the first sample, there is an image of none, which can be continued.
#[test]
fn interruption_at_once() {
    let world = scene();
    let none = render(&world, &samples(4), None, &mut |_| Break(())).unwrap();
    assert!(none.statistics.as_ref().unwrap().samples.iter().all(|&n| n == 0));
    let continued = render(&world, &samples(4), Some(none), &mut on).unwrap();
    assert_same(&render(&world, &samples(4), None, &mut on).unwrap(), &continued);
}

/// Stops at the relative error asked for, which is the error against a much better picture; never before 16 samples.
#[test]
fn stops_at_error() {
    let world = scene();
    let mut last = None;
    let options = Options { error: Some(0.03), ..Options::default() };
    let picture = render(&world, &options, None, &mut |p| {
        last = Some(*p);
        Continue(())
    });
    let (picture, last) = (picture.unwrap(), last.unwrap());
    assert!(last.relative_error <= 0.03 && last.relative_error > 0.027 && last.samples > 16, "{last:?}");
    let truth = render(&world, &Options { seed: 9, ..samples(1500) }, None, &mut on).unwrap();
    let both = || picture.pixels.iter().flatten().zip(truth.pixels.iter().flatten());
    let squares: f64 = both().map(|(a, b)| f64::from(a - b).powi(2)).sum();
    let signal: f64 = both().map(|(_, b)| f64::from(*b).powi(2)).sum();
    // 1296 correlated channels: the measured error scatters by some percent around the expected one.
    let measured = (squares / signal).sqrt() / last.relative_error;
    assert!((0.85..1.15).contains(&measured), "{measured}");

    let coarse = render(&world, &Options { error: Some(100.0), ..Options::default() }, None, &mut on).unwrap();
    assert!(coarse.statistics.unwrap().samples.iter().all(|&n| n == 16));
}

/// What it says of its progress is true.
#[test]
fn progress() {
    let world = scene();
    let mut seen: Vec<Progress> = Vec::new();
    render(&world, &samples(20), None, &mut |p| {
        seen.push(*p);
        Continue(())
    })
    .unwrap();
    let (first, last) = (seen[0], seen[seen.len() - 1]);
    assert_eq!((first.samples, first.paths, first.done), (0, 0, Some(0.0)));
    assert!(first.relative_error.is_infinite() && first.eta.is_none());
    assert_eq!((last.samples, last.paths, last.done), (20, 20 * 24 * 18, Some(1.0)));
    assert!(last.eta.is_some_and(|eta| eta.is_zero()) && last.paths_per_second > 0.0);
    assert!(seen.windows(2).all(|w| w[0].done <= w[1].done && w[0].paths <= w[1].paths));
}

/// The camera: y up in row 0, x to the right, the vertical field of view from edge to edge. A box of emission in the
/// upper right quadrant of the view lights exactly the pixels that it covers.
#[test]
fn orientation_and_field_of_view() {
    let optics = tyndall_scene::description::Optics::Coefficients {
        sigma_s: Vec3::ZERO,
        sigma_a: Vec3::splat(1e4),
        emission: Vec3::splat(1e4),
        phase: Phase::Isotropic,
    };
    // From (0, 0, 2), 90° high: the plane z = 0 is seen from y = −2 to 2, x = −4 to 4.
    let medium = volume(tyndall_scene::Field::Homogeneous, Vec3::new(1.0, 1.0, -0.1), Vec3::new(3.0, 2.0, 0.0), optics);
    let mut world = world(vec![medium], vec![]);
    world.scene.camera = Camera { position: Vec3::new(0.0, 0.0, 2.0), fov: 90.0, ..Camera::default() };
    world.scene.film.size = [16, 8];
    let picture = render(&world, &samples(64), None, &mut on).unwrap();
    for (i, pixel) in picture.pixels.iter().enumerate() {
        let (x, y) = (i % 16, i / 16);
        // Half a metre a pixel; the box's depth behind z = 0 is seen nowhere beside its face.
        let covered = (10..14).contains(&x) && y < 2;
        assert!((pixel[0] - if covered { 1.0 } else { 0.0 }).abs() < 0.25, "({x}, {y}): {pixel:?}");
    }
}

/// Images that do not fit are refused with a message.
#[test]
fn misfits_are_refused() {
    let world = scene();
    let image = Image { width: 2, height: 1, pixels: vec![[0.0; 3]; 2], ..Image::default() };
    let refused = |image| render(&world, &samples(1), Some(image), &mut on).unwrap_err();
    assert_eq!(refused(image), ReferenceError::Size { found: [2, 1], expected: [24, 18] });
    let image = Image { width: 24, height: 18, pixels: vec![[0.0; 3]; 24 * 18], ..Image::default() };
    assert_eq!(refused(image.clone()), ReferenceError::NoStatistics);
    assert!(matches!(refused(Image { pixels: vec![], ..image }), ReferenceError::Image(_)));
}
