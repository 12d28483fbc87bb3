//! Bodies as the device has them, and what it says of them, against the host.

use std::sync::Arc;

use glam::{Vec3, Vec4};
use tyndall_scene::particles::{Particle, Particles};
use tyndall_scene::strands::{Knot, Strands};
use tyndall_scene::{Field, World};

use crate::graph::{Shader, shader};
use crate::math::bodies as twin;
use crate::resident::Resident;
use crate::test::probe::{assert_close, probe_with, spread};
use crate::test::{gpu, tolerance, world};

static BODIES: Shader = shader!("test/probes/bodies");

/// A point in a cube of 2 m.
fn point(i: usize) -> Vec3 {
    2.0 * Vec3::new(spread(i, 0), spread(i, 1), spread(i, 2)) - 1.0
}

/// So many balls.
fn balls(count: usize) -> Field {
    let ball = |i| Particle { position: point(i), radius: 0.1 + spread(i, 3), color: Vec3::ONE, depth: spread(i, 4) };
    Field::Particles(Arc::new(Particles::new((0..count).map(ball).collect()).unwrap()))
}

/// Media in an order that is not the device's: balls, a box, strands, and more balls.
fn mixed() -> World {
    let optics = "optics.coefficients.sigma_a = 1";
    let bodies = |name| format!("[media.{name}]\ndensity.emitter = {{ number = 2, time = 0.1 }}\n{optics}\n");
    let mut world = world(&format!(
        "{}[media.b]\ndensity.homogeneous = {{ min = [0, 0, 0], max = [1, 1, 1] }}\n{optics}\n{}{}",
        bodies("a"),
        bodies("c"),
        bodies("d")
    ));
    let knot = |i| Knot { position: point(i), radius: 0.2, color: Vec3::new(1.0, 0.5, spread(i, 3)), depth: 2.0 };
    let strands = Strands::new((0..6).map(knot).collect(), &[4, 2]).unwrap();
    world.volumes[0].set_bodies(balls(5));
    world.volumes[2].set_bodies(Field::Strands(Arc::new(strands)));
    world.volumes[3].set_bodies(balls(7));
    world
}

#[test]
fn bodies_are_as_on_the_host() {
    let Some(gpu) = gpu() else { return };
    let world = mixed();
    let resident = pollster::block_on(Resident::new(&gpu, &world)).unwrap();
    assert_eq!((resident.traits.count, resident.bodies.ball_count, resident.bodies.segment_count), (1, 12, 4));
    let lists: Vec<_> = world.volumes.iter().map(|volume| &volume.field).collect();
    let [Field::Particles(first), _, Field::Strands(strands), Field::Particles(second)] = lists[..] else { panic!() };
    let input: Vec<_> = (0..6400)
        .flat_map(|i| {
            let (origin, towards) = (4.0 * point(i), point(i + 100));
            let s = 2.0 * spread(i, 5) - 1.0;
            [origin.extend(i as f32), (towards - origin).normalize().extend(s)]
        })
        .collect();
    let bodies = &resident.bodies;
    let also =
        [("balls", (&bodies.balls).into()), ("segments", (&bodies.segments).into()), ("bodies", (&bodies.info).into())];
    let mut met = 0;
    for (i, (ray, found)) in input.chunks(2).zip(probe_with(&gpu, &BODIES, &input, &also).chunks(2)).enumerate() {
        let [origin, direction] = [ray[0], ray[1]].map(|v: Vec4| v.truncate().as_dvec3());
        // The box comes first on the device.
        let (ball, medium) = match i % 12 {
            k @ 0..5 => (first.list()[k], 1.0),
            k => (second.list()[k - 5], 3.0),
        };
        let [radius, depth] = [ball.radius, ball.depth].map(f64::from);
        let passage = twin::ball_passage(ball.position.as_dvec3(), radius, origin, direction);
        let share = twin::ball_profile_before(passage.y, ray[1].w.into());
        assert_close(found[0].x.into(), passage.x, tolerance::PROBE, ray);
        assert_close(found[0].y.into(), depth * twin::ball_profile(passage.y), tolerance::PROBE_BODIES, ray);
        assert_close(found[0].z.into(), depth * share, tolerance::PROBE_BODIES, ray);
        let segment = strands.segment(i % 4);
        assert_eq!([found[0].w, found[1].w], [medium, 2.0]);
        assert_close(found[1].z.into(), f64::from(segment.depth * segment.color.z), tolerance::PROBE_PACKED_COLOR, ray);
        let ends = segment.ends.map(|end| end.as_dvec3());
        let span = twin::cylinder_span(ends, segment.radius.into(), origin, direction);
        let chord = (span.y - span.x).max(0.0);
        met += u32::from(chord > 0.0);
        // A chord of a ray that grazes goes with the root of what is rounded.
        let allowed = tolerance::PROBE_BODIES / (chord / f64::from(segment.radius)).max(0.01);
        assert_close((found[1].y - found[1].x).max(0.0).into(), chord, allowed, ray);
    }
    assert!(met > 500, "only {met} rays meet a segment");
}

/// The bodies of the next picture go into the same buffer as long as there is room.
#[test]
fn bodies_are_replaced() {
    let Some(gpu) = gpu() else { return };
    let mut world = mixed();
    let resident = pollster::block_on(Resident::new(&gpu, &world)).unwrap();
    world.volumes[0].set_bodies(balls(3));
    let fewer = pollster::block_on(resident.with_media(&gpu, &world)).unwrap().bodies;
    assert_eq!((fewer.ball_count, &fewer.balls), (10, &resident.bodies.balls));
    world.volumes[0].set_bodies(balls(30));
    let more = pollster::block_on(resident.with_media(&gpu, &world)).unwrap().bodies;
    assert_eq!((more.ball_count, &more.segments), (37, &resident.bodies.segments));
    assert_ne!(more.balls, resident.bodies.balls);
    assert!(more.bounds.unwrap()[0].x < -1.0, "{:?}", more.bounds);
}
