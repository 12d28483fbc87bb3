//! Particles and strands: against closed forms, quadrature, and the simple tracer.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use tyndall_reference::Tracer;
use tyndall_reference::simple::Simple;
use tyndall_scene::description::{Light, Optics, Phase, Plane};
use tyndall_scene::particles::{Particle, Particles, optical_depth};
use tyndall_scene::strands::{Knot, Strands};
use tyndall_scene::{Field, Volume, World};

use crate::tolerance::{Estimate, SUM, agree, integrate};
use crate::worlds::*;

fn random(i: u64) -> impl FnMut(f64, f64) -> f64 {
    let mut rng = tyndall_reference::Random::new(7, i, 0);
    move |low, high| low + (high - low) * rng.uniform()
}

fn point(of: &mut impl FnMut(f64, f64) -> f64, half: f64) -> DVec3 {
    DVec3::new(of(-half, half), of(-half, half), of(-half, half))
}

/// Balls of all sizes and opacities in a cube of 2 m, and one far away.
fn balls(n: u64) -> Vec<Particle> {
    let ball = |i| {
        let mut of = random(i);
        Particle {
            position: if i == 0 { Vec3::new(90.0, 3.0, 0.0) } else { point(&mut of, 1.0).as_vec3() },
            radius: of(0.05, 0.5) as f32,
            color: Vec3::new(of(0.0, 1.0) as f32, of(0.0, 1.0) as f32, 1.0),
            depth: optical_depth(of(0.05, 0.6) as f32),
        }
    };
    (0..n).map(ball).collect()
}

/// Crooked strands across the same cube, of a thickness in metres.
fn strands(n: u64, points: u32, radius: f64) -> Strands {
    let knot = |i: u64| {
        let mut of = random(1000 + i);
        Knot {
            position: point(&mut of, 1.0).as_vec3(),
            radius: of(0.5 * radius, radius) as f32,
            color: Vec3::new(of(0.0, 1.0) as f32, of(0.0, 1.0) as f32, 1.0),
            depth: optical_depth(of(0.05, 0.6) as f32),
        }
    };
    let knots = (0..n * u64::from(points)).map(knot).collect();
    Strands::new(knots, &vec![points; n as usize]).unwrap()
}

fn particles(list: Vec<Particle>) -> Field {
    Field::Particles(Arc::new(Particles::new(list).unwrap()))
}

fn medium(field: Field, optics: Optics) -> Volume {
    let mut volume = unit(optics);
    volume.set_bodies(field);
    volume
}

fn rays(n: u64) -> impl Iterator<Item = (DVec3, DVec3)> {
    (0..n).map(|i| {
        let mut of = random(2000 + i);
        // From outside, from within, and along an axis.
        let from = point(&mut of, if i % 3 == 0 { 0.8 } else { 4.0 });
        let to = point(&mut of, 0.8);
        let axis = DVec3::AXES[i as usize % 3];
        if i % 5 == 0 { (to - 3.0 * axis, axis) } else { (from, (to - from).normalize()) }
    })
}

/// One look is all it takes: nothing is left to chance.
fn share(world: &World, origin: DVec3, direction: DVec3, distance: f64) -> DVec3 {
    let estimate = pass(world, origin, direction, distance, 3);
    assert_eq!(estimate.error, DVec3::ZERO);
    estimate.mean
}

#[track_caller]
fn assert_same(found: DVec3, truth: DVec3) {
    assert!((found - truth).abs().cmple(truth * SUM + 1e-300).all(), "{found} should be {truth}");
}

/// A ball of opacity α takes α of a ray through its centre and 1 − (1 − α)^((1 − b²/r²)^{5/2}) of one that passes it at b.
#[test]
fn a_ball_is_its_billboard() {
    let center = DVec3::new(0.3, -0.2, 0.1);
    let ball = Particle { position: center.as_vec3(), radius: 0.25, color: Vec3::ONE, depth: optical_depth(0.75) };
    let world = world(vec![medium(particles(vec![ball]), grey(0.7, 0.3, Phase::Isotropic))], vec![]);
    let center = ball.position.as_dvec3();
    for (x, way) in [(0.0, DVec3::Z), (0.1, DVec3::new(1.0, 2.0, -0.5)), (0.2, DVec3::NEG_X), (0.3, DVec3::Y)] {
        let way = way.normalize();
        let q = (1.0 - (x / 0.25f64).powi(2)).max(0.0);
        let truth = (-f64::from(ball.depth) * q.powf(2.5)).exp();
        let from = center + way.any_orthonormal_vector() * x - way * 2.0;
        assert!((share(&world, from, way, f64::INFINITY).x - truth).abs() < 1e-6, "at {x}");
        // Half of the way is half of the depth.
        assert!((share(&world, from, way, 2.0).x - truth.sqrt()).abs() < 1e-6, "half at {x}");
    }
}

/// Of many balls, T = exp(−Σ τᵢ) in every channel, each τᵢ in closed form.
#[test]
fn balls_multiply() {
    let list = balls(400);
    let sigma_t = DVec3::new(0.5, 1.0, 2.0);
    let optics = optics(Vec3::new(0.25, 0.5, 1.0), Vec3::new(0.25, 0.5, 1.0), Phase::Isotropic);
    let world = world(vec![medium(particles(list.clone()), optics)], vec![]);
    for (from, way) in rays(60) {
        let depth = |ball: &Particle| {
            let offset = ball.position.as_dvec3() - from;
            let ahead = offset.dot(way);
            let r = f64::from(ball.radius);
            let q = 1.0 - (offset - way * ahead).length_squared() / (r * r);
            // From outside all that there is; from within by quadrature.
            let density = |t: f64| ball.density(from + way * t);
            let half = r * q.max(0.0).sqrt();
            if q <= 0.0 || ahead <= -half {
                0.0
            } else if ahead >= half {
                f64::from(ball.depth) * q.powf(2.5)
            } else {
                integrate(0.0, ahead + half, 200, density)
            }
        };
        let sum: f64 = list.iter().map(depth).sum();
        assert_same(share(&world, from, way, f64::INFINITY), (-sigma_t * sum).map(f64::exp));
    }
}

/// A fibre of opacity α takes α of a ray that crosses its axis at a right angle, and of others as their chord is long.
#[test]
fn a_fibre_is_a_cylinder() {
    let knot = |x: f32| Knot { position: Vec3::X * x, radius: 40e-6, color: Vec3::ONE, depth: optical_depth(0.4) };
    let field = Field::Strands(Arc::new(Strands::new(vec![knot(-1.0), knot(1.0)], &[2]).unwrap()));
    let world = world(vec![medium(field, grey(0.7, 0.3, Phase::Isotropic))], vec![]);
    let radius = f64::from(40e-6f32);
    let depth = f64::from(optical_depth(0.4));
    let see = |from: DVec3, way: DVec3| share(&world, from, way.normalize(), f64::INFINITY).x.ln() / -depth;
    for angle in [90.0f64, 45.0, 5.0] {
        let (sin, cos) = angle.to_radians().sin_cos();
        for part in [0.0, 0.6, 0.99] {
            let from = DVec3::new(-5.0 * cos, -5.0 * sin, part * radius);
            let chord = f64::sqrt(1.0 - part * part) / sin;
            let found = see(from, DVec3::new(cos, sin, 0.0));
            assert!((found - chord).abs() < 1e-6 * chord, "{angle}°, {part}: {found} should be {chord}");
        }
        assert_eq!(see(DVec3::new(-5.0 * cos, -5.0 * sin, 1.001 * radius), DVec3::new(cos, sin, 0.0)), 0.0);
    }
}

/// Of many strands, T = exp(−Σ σᵢ·chordᵢ): the chords by quadrature of their densities along the ray.
#[test]
fn strands_multiply() {
    let strands = strands(40, 6, 0.15);
    let world =
        world(vec![medium(Field::Strands(Arc::new(strands.clone())), grey(0.1, 0.1, Phase::Isotropic))], vec![]);
    let tracer = Tracer::new(&world).unwrap();
    for (from, way) in rays(8) {
        let n = 30_000;
        let step = 8.0 / f64::from(n);
        let at = |i| strands.at(from + way * (step * (f64::from(i) + 0.5))).density;
        let sum: f64 = (0..n).map(at).sum::<f64>() * step;
        let mut rng = tyndall_reference::Random::new(1, 0, 0);
        let found = -tracer.transmittance(from, way, 8.0, &mut rng).x.ln() / 0.2;
        // A chord is off by a step at most at both of its ends.
        assert!(sum > 0.1 && (found - sum).abs() < 0.003 * sum, "{found} should be {sum}");
    }
}

/// Where planes cut a ball, half of it is left.
#[test]
fn clipped_balls() {
    let ball = Particle { position: Vec3::ZERO, radius: 0.5, color: Vec3::ONE, depth: 1.0 };
    let mut cut = medium(particles(vec![ball]), grey(0.5, 0.5, Phase::Isotropic));
    cut.clip = vec![Plane { normal: Vec3::X, distance: 0.0 }];
    let world = world(vec![cut], vec![sky(1.0)]);
    assert_same(share(&world, DVec3::NEG_X, DVec3::X, f64::INFINITY), DVec3::splat((-0.5f64).exp()));
    let truth = DVec3::splat((-0.5f64).exp());
    look(&world, DVec3::NEG_X, DVec3::X, Some(0), 4).assert(truth, 1e-6);
    look(&world, DVec3::new(0.1, 0.0, -2.0), DVec3::Z, Some(1), 4).assert(DVec3::ONE, 1e-6);
}

/// A white medium in a uniform environment cannot be seen: balls, fibres, and fog among them.
#[test]
fn a_furnace_of_bodies() {
    let white = |mut list: Vec<Particle>| {
        list.iter_mut().for_each(|ball| ball.color = Vec3::ONE);
        particles(list)
    };
    let knots: Vec<_> = strands(40, 6, 0.1).knots().iter().map(|knot| Knot { color: Vec3::ONE, ..*knot }).collect();
    let fibres = Field::Strands(Arc::new(Strands::new(knots, &[6; 40]).unwrap()));
    let volumes = vec![
        medium(white(balls(100)), optics(Vec3::new(1.0, 2.0, 0.5), Vec3::ZERO, Phase::Hg { g: 0.5 })),
        medium(fibres, grey(1.0, 0.0, Phase::Isotropic)),
        volume(noise([9; 3]), Vec3::splat(-1.0), Vec3::ONE, grey(1.5, 0.0, Phase::Rayleigh)),
    ];
    let world = world(volumes, vec![sky(1.0)]);
    for (from, way) in rays(4) {
        look(&world, from, way, None, 1000).assert(DVec3::ONE, 0.03);
    }
}

/// Single scattering of a sun's light in balls: the camera ray's integral by quadrature, all depths in closed form.
#[test]
fn single_scattering_by_quadrature() {
    let list = balls(60);
    let way_of_light = Vec3::new(0.3, -1.0, 0.2);
    let sun = Light::Directional { direction: way_of_light, irradiance: Vec3::splat(3.0) };
    let optics = optics(Vec3::new(0.8, 0.5, 1.0), Vec3::new(0.1, 0.5, 0.2), Phase::Hg { g: 0.3 });
    let (sigma_s, sigma_t) = (DVec3::new(0.8f32.into(), 0.5, 1.0), DVec3::new(0.9, 1.0, 1.2));
    let field = particles(list.clone());
    let world = world(vec![medium(field.clone(), optics)], vec![sun]);
    let depth = |from: DVec3, way: DVec3, to: f64| -> f64 {
        list.iter()
            .map(|ball| {
                let r = f64::from(ball.radius);
                let offset = ball.position.as_dvec3() - from;
                let middle = offset.dot(way);
                let q = (1.0 - (offset - way * middle).length_squared() / (r * r)).max(0.0);
                let at = |t: f64| {
                    let s = ((t - middle) / r).clamp(-q.sqrt(), q.sqrt());
                    s * q * q - 2.0 / 3.0 * q * s.powi(3) + 0.2 * s.powi(5)
                };
                15.0 / 16.0 * f64::from(ball.depth) * (at(to) - at(0.0))
            })
            .sum()
    };
    let light = way_of_light.as_dvec3().normalize();
    for (from, way) in rays(4) {
        let g = 0.3f64;
        let phase = (1.0 - g * g) / (2.0 * TAU * (1.0 + g * g + 2.0 * g * way.dot(light)).powf(1.5));
        let channel = |c: usize| {
            integrate(0.0, 8.0, 1500, |t| {
                let point = from + way * t;
                let here = field.bodies_at(point).unwrap();
                let all = depth(from, way, t) + depth(point, -light, 100.0);
                sigma_s[c] * here.density * here.color[c] * phase * 3.0 * (-sigma_t[c] * all).exp()
            })
        };
        let truth = DVec3::new(channel(0), channel(1), channel(2));
        look(&world, from, way, Some(1), 10_000).assert(truth, 0.03);
    }
}

/// Everything together: coloured balls that glow, coloured fibres, fog between, seen by the tracer and the simple one.
#[test]
fn the_simple_tracer_agrees() {
    let glowing = Optics::Coefficients {
        sigma_s: Vec3::new(1.0, 0.5, 0.8),
        sigma_a: Vec3::new(0.1, 0.6, 0.2),
        emission: Vec3::new(0.2, 0.1, 0.0),
        phase: Phase::Hg { g: 0.4 },
    };
    let fibres = Field::Strands(Arc::new(strands(6, 3, 0.3)));
    let volumes = vec![
        medium(particles(balls(25)), glowing),
        medium(fibres, optics(Vec3::new(0.4, 0.9, 0.7), Vec3::splat(0.1), Phase::Isotropic)),
        volume(noise([9; 3]), Vec3::splat(-1.0), Vec3::ONE, grey(0.8, 0.1, Phase::Rayleigh)),
    ];
    let sun = Light::Directional { direction: Vec3::new(1.0, -1.0, 0.3), irradiance: Vec3::splat(2.0) };
    let lamp = Light::Point { position: Vec3::new(0.2, 0.9, 0.1), intensity: Vec3::ONE };
    // The far ball would make the simple tracer's world a hundred times larger.
    let mut world = world(volumes, vec![sun, lamp, sky(0.2)]);
    let Field::Particles(all) = &world.volumes[0].field else { unreachable!() };
    let near = particles(all.list()[1..].to_vec());
    world.volumes[0].set_bodies(near);
    let simple = Simple::new(&world);
    let plain = |depth, samples| {
        let of = |(from, way)| Estimate::of(samples, 2, |rng| simple.radiance(from, way, depth, rng));
        rays(3).map(of).collect::<Vec<_>>()
    };
    let full = |depth| rays(3).map(|(from, way)| look(&world, from, way, depth, 8000)).collect::<Vec<_>>();
    let single = plain(Some(1), 8000);
    for (depth, plain) in [(Some(0), plain(Some(0), 8000)), (Some(1), single.clone()), (None, plain(None, 4000))] {
        let pairs: Vec<_> = full(depth).into_iter().zip(plain).collect();
        agree(&pairs, 0.06).unwrap_or_else(|message| panic!("depth {depth:?}: {message}"));
    }
    // It notices when the depth is another.
    let pairs: Vec<_> = full(Some(0)).into_iter().zip(single).collect();
    assert!(agree(&pairs, 0.06).is_err());
}
