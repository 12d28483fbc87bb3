//! Light by way of mirrors, with and without.

use std::ops::ControlFlow::Continue;

use glam::DVec3;
use tyndall_reference::{Options, Tracer, render};
use tyndall_scene::World;

use crate::tolerance::{Estimate, agree};
use crate::worlds::*;

/// A floor beside a wall that is a mirror, or black, under a light that faces the wall and the floor.
fn beside(wall: &str) -> World {
    scene(&format!(
        r#"
        materials.white.lambert.reflectance = 0.8
        materials.black.lambert.reflectance = 0
        materials.mirror.mirror.reflectance = 0.9
        [surfaces.floor]
        material = "white"
        shape.quad = {{ corner = [0, 0, 1], edges = [[2, 0, 0], [0, 0, -2]] }}
        [surfaces.wall]
        material = "{wall}"
        shape.quad = {{ corner = [0, 0, 1], edges = [[0, 0, -2], [0, 2, 0]] }}
        [surfaces.light]
        material = "black"
        radiance = 5
        shape.quad = {{ corner = [1.2, 0.6, -0.3], edges = [[0, 0, 0.6], [-0.3, 0.3, 0]] }}
    "#
    ))
}

fn floor(world: &World, caustics: bool, seed: u64) -> Estimate {
    let mut tracer = Tracer::new(world).unwrap();
    if !caustics {
        tracer = tracer.without_caustics();
    }
    Estimate::of(60_000, seed, |rng| tracer.radiance(DVec3::new(0.4, 0.5, 0.0), DVec3::NEG_Y, None, rng))
}

/// A mirror beside the floor adds what the light's image behind it would, by its reflectance, and without caustics nothing.
#[test]
fn mirrored_light() {
    let (mirror, black) = (beside("mirror"), beside("black"));
    let direct = floor(&black, true, 1);
    agree(&[(floor(&mirror, false, 2), direct)], 0.01).unwrap();
    assert!(agree(&[(floor(&mirror, true, 2), direct)], 0.01).is_err());
    // The light mirrored in x = 0 in place of the wall, which turns its front over: the edges are swapped.
    let image = scene(
        r#"
        materials.white.lambert.reflectance = 0.8
        materials.black.lambert.reflectance = 0
        [surfaces.floor]
        material = "white"
        shape.quad = { corner = [0, 0, 1], edges = [[2, 0, 0], [0, 0, -2]] }
        [surfaces.light]
        material = "black"
        radiance = 4.5
        shape.quad = { corner = [-1.2, 0.6, -0.3], edges = [[0.3, 0.3, 0], [0, 0, 0.6]] }
    "#,
    );
    let (with, image) = (floor(&mirror, true, 3), floor(&image, true, 4));
    let sum =
        Estimate { mean: direct.mean + image.mean, error: (direct.error.powf(2.0) + image.error.powf(2.0)).powf(0.5) };
    agree(&[(with, sum)], 0.02).unwrap();
}

/// What the eye sees in a mirror stays without caustics, as does light that a mirror leads to another diffuse surface.
#[test]
fn mirrors_still_show() {
    let world = beside("mirror");
    let tracer = Tracer::new(&world).unwrap().without_caustics();
    let seen = Estimate::of(20_000, 1, |rng| {
        tracer.radiance(DVec3::new(1.0, 0.5, 0.0), DVec3::new(-1.0, 0.1, 0.0).normalize(), None, rng)
    });
    assert!(seen.mean.min_element() > 0.1, "{}", seen.mean);
}

/// Without caustics what they light is still lit: a wall onto which a mirror throws light, which the lamp's front does not see, lights
/// the floor. What is missing is what the floor has of the mirror itself, all of which is scattered twice.
#[test]
fn what_caustics_light_stays() {
    let mut world = beside("mirror");
    let other = scene(
        r#"
        materials.white.lambert.reflectance = 0.8
        [surfaces.other]
        material = "white"
        shape.quad = { corner = [2, 0, 1], edges = [[0, 2, 0], [0, 0, -2]] }
    "#,
    );
    world.surfaces.extend(other.surfaces);
    let of = |caustics: bool, depth, seed| {
        let mut tracer = Tracer::new(&world).unwrap();
        if !caustics {
            tracer = tracer.without_caustics();
        }
        let from = DVec3::new(1.9, 0.5, 0.0);
        Estimate::of(1_000_000, seed, |rng| tracer.radiance(from, DVec3::NEG_Y, depth, rng))
    };
    let less = |a: Estimate, b: Estimate| Estimate {
        mean: a.mean - b.mean,
        error: (a.error.powf(2.0) + b.error.powf(2.0)).powf(0.5),
    };
    let seen = less(of(true, Some(2), 1), of(false, Some(2), 2));
    let missing = less(of(true, None, 3), of(false, None, 4));
    agree(&[(missing, seen)], 0.05).unwrap();
}

/// Pictures say so, too.
#[test]
fn pictures_without_caustics() {
    let mut world = beside("mirror");
    world.scene.film.size = [8, 8];
    world.scene.camera.position = glam::Vec3::new(0.6, 1.5, 0.3);
    world.scene.camera.target = glam::Vec3::new(0.5, 0.0, 0.0);
    let of = |caustics| {
        let options = Options { caustics, samples: Some(64), ..Options::default() };
        let picture = render(&world, &options, None, &mut |_| Continue(())).unwrap();
        picture.pixels.iter().flatten().sum::<f32>()
    };
    assert!(Options::default().caustics);
    assert!(of(false) < of(true));
}
