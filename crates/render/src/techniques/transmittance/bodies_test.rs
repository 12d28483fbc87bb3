//! Particles and strands in maps of transmittance, against sums over all of them.

use std::sync::Arc;

use glam::{DVec3, Vec3, Vec4};
use tyndall_scene::particles::{Particle, Particles};
use tyndall_scene::strands::{Knot, Strands};
use tyndall_scene::{Field, World};

use crate::graph::{Graph, Shader, Tile, shader};
use crate::math::bodies::{ball_passage, ball_profile, cylinder_span};
use crate::test::probe::spread;
use crate::test::{gpu, tolerance, world};
use crate::{Frame, Gpu};

static SHADOWED: Shader = shader!("test/probes/shadowed");

/// The optical depths from the first light, of a world in which it has a map, to positions.
fn looked_up(gpu: &Gpu, world: &World, positions: &[Vec3]) -> Vec<Vec3> {
    let mut frame = pollster::block_on(Frame::new(gpu, world)).unwrap_or_else(|error| panic!("{error}"));
    frame.render();
    let input: Vec<Vec4> = positions.iter().map(|position| position.extend(0.0)).collect();
    let input = gpu.buffer("input", &input);
    let output = |usage| wgpu::BufferDescriptor { label: None, size: input.size(), usage, mapped_at_creation: false };
    let output = [
        wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
    ]
    .map(|usage| gpu.device.create_buffer(&output(usage)));
    let mut graph = Graph::new(gpu);
    let pass =
        graph.compute("shadowed", &SHADOWED).world(frame.resident()).read("input", &input).write("output", &output[0]);
    pollster::block_on(pass.dispatch([positions.len().div_ceil(64) as u32, 1, 1], 1)).unwrap();
    let mut profiler = wgpu_profiler::GpuProfiler::new(&gpu.device, Default::default()).unwrap();
    graph.submit(Tile { size: glam::UVec2::ONE, ..Default::default() }, &mut profiler);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(&output[0], 0, &output[1], 0, input.size());
    gpu.queue.submit([encoder.finish()]);
    let bytes = pollster::block_on(crate::renderer::map(gpu, &output[1])).unwrap();
    bytemuck::cast_slice::<u8, [f32; 4]>(&bytes).iter().map(|&[r, g, b, _]| Vec3::new(r, g, b)).collect()
}

/// A point in a cube of 2 m.
fn point(i: usize) -> Vec3 {
    2.0 * Vec3::new(spread(i, 0), spread(i, 1), spread(i, 2)) - 1.0
}

fn balls(count: usize) -> Vec<Particle> {
    let ball = |i| Particle {
        position: point(i),
        radius: 0.15 + 0.15 * spread(i, 3),
        color: Vec3::ONE,
        depth: 0.1 + 0.5 * spread(i, 4),
    };
    (0..count).map(ball).collect()
}

fn strands() -> Strands {
    let knot = |i: usize| {
        let turn = 0.35 * (i % 12) as f32 + (i / 12) as f32;
        let position = Vec3::new(0.7 * turn.cos(), 0.12 * (i % 12) as f32 - 0.6, 0.5 * turn.sin());
        Knot { position, radius: 0.06, color: Vec3::ONE, depth: 0.7 }
    };
    Strands::new((0..36).map(knot).collect(), &[12; 3]).unwrap()
}

/// A world of these bodies in a light.
fn scene(light: &str, settings: &str, fields: &[Field]) -> World {
    let mut text = format!(
        "camera = {{ position = [0, 0, 9], target = [0, 0, 0] }}\nfilm.size = [1, 1]\n{light}\n[techniques.transmittance]\n{settings}\n"
    );
    for i in 0..fields.len() {
        text += &format!(
            "[media.m{i}]\ndensity.emitter = {{ number = 2, time = 0.1 }}\noptics.coefficients = {{ sigma_s = 0.4, sigma_a = 0.6 }}\n"
        );
    }
    let mut world = world(&text);
    for (volume, field) in world.volumes.iter_mut().zip(fields) {
        volume.set_bodies(field.clone());
    }
    world
}

/// Along a ray, where bodies count and how much: (distance, optical depth).
fn events(fields: &[Field], origin: DVec3, direction: DVec3) -> Vec<(f64, f64)> {
    let mut events = Vec::new();
    for field in fields {
        match field {
            Field::Particles(particles) => events.extend(particles.list().iter().map(|ball| {
                let center = ball.position.as_dvec3();
                let passage = ball_passage(center, ball.radius.into(), origin, direction);
                let ahead = if passage.x > 0.0 { f64::from(ball.depth) } else { 0.0 };
                (passage.x, ahead * ball_profile(passage.y))
            })),
            Field::Strands(strands) => events.extend((0..strands.count()).map(|i| {
                let segment = strands.segment(i);
                let span =
                    cylinder_span(segment.ends.map(|end| end.as_dvec3()), segment.radius.into(), origin, direction);
                let chord = if span.x > 0.0 { (span.y - span.x).max(0.0) } else { 0.0 };
                (0.5 * (span.x + span.y), f64::from(segment.depth / (2.0 * segment.radius)) * chord)
            })),
            _ => {}
        }
    }
    events
}

const SUN: &str = "lights.a.directional = { direction = [1, -2, 0.5], irradiance = 3 }";
const SUN_WAY: DVec3 = DVec3::new(1.0, -2.0, 0.5);

const LAMP: &str = "lights.a.point = { position = [-1.4, 1.7, 1.6], intensity = 3 }";
const LAMP_PLACE: DVec3 = DVec3::new(-1.4, 1.7, 1.6);

/// The ray of light through a point: of a light at a place, or of the sun.
fn way(place: Option<DVec3>, through: DVec3) -> (DVec3, DVec3) {
    let way = place.map_or(SUN_WAY, |place| through - place).normalize();
    (place.unwrap_or(through - 5.0 * way), way)
}

/// Behind all bodies, T = Π(1 − α) for any number of coefficients, from every light: a lamp among them sees them over all edges
/// of its octahedron.
#[test]
fn all_that_bodies_take_is_taken() {
    let Some(gpu) = gpu() else { return };
    let fields = [Field::Particles(Arc::new(Particles::new(balls(40)).unwrap())), Field::Strands(Arc::new(strands()))];
    for (light, place) in [
        (SUN, None),
        (
            "lights.a.spot = { position = [2, 1.9, 1.3], direction = [-1, -1, -0.6], intensity = 3, inner_angle = 30, outer_angle = 70 }",
            Some(DVec3::new(2.0, 1.9, 1.3)),
        ),
        (LAMP, Some(LAMP_PLACE)),
        ("lights.a.point = { position = [2.2, 0.05, -0.1], intensity = 3 }", Some(DVec3::new(2.2, 0.05, -0.1))),
        ("lights.a.point = { position = [-0.03, 0.02, -2.3], intensity = 3 }", Some(DVec3::new(-0.03, 0.02, -2.3))),
    ] {
        for bodies in [&fields[..1], &fields[1..], &fields] {
            let world = scene(light, "coefficients = 3\nresolution = 512", bodies);
            // Where rays through the bodies' cube leave them all behind.
            let rays: Vec<(DVec3, DVec3)> = (0..640).map(|i| way(place, 0.9 * point(i + 7).as_dvec3())).collect();
            let positions: Vec<_> = rays.iter().map(|(origin, way)| (*origin + 9.0 * *way).as_vec3()).collect();
            let (mut squares, mut all) = (0.0, 0.0);
            for ((origin, way), found) in rays.iter().zip(looked_up(&gpu, &world, &positions)) {
                let expected: f64 = events(bodies, *origin, *way).iter().map(|event| event.1).sum();
                squares += (f64::from(found.x) - expected).powi(2);
                all += expected * expected;
            }
            let error = (squares / all).sqrt();
            let most = if bodies.len() == 1 && matches!(bodies[0], Field::Particles(_)) {
                tolerance::DRAWN
            } else {
                tolerance::DRAWN_STRANDS
            };
            assert!(error < most, "{error} with {light}");
        }
    }
}

/// A deep map is the exact product: at any depth, from every light, what lies before a position counts, and nothing else.
#[test]
fn deep_maps_are_exact() {
    let Some(gpu) = gpu() else { return };
    let fields = [Field::Particles(Arc::new(Particles::new(balls(40)).unwrap())), Field::Strands(Arc::new(strands()))];
    for (light, place) in [(SUN, None), (LAMP, Some(LAMP_PLACE))] {
        let world = scene(light, "basis = \"deep\"\nresolution = 256", &fields[..1]);
        let rays: Vec<(DVec3, DVec3)> = (0..640).map(|i| way(place, 0.9 * point(i + 7).as_dvec3())).collect();
        let distances: Vec<f64> = (0..640).map(|i| 1.5 + 5.0 * f64::from(spread(i, 5))).collect();
        let positions: Vec<_> = rays
            .iter()
            .zip(&distances)
            .map(|((origin, way), distance)| (*origin + *distance * *way).as_vec3())
            .collect();
        let (mut squares, mut all) = (0.0, 0.0);
        for ((ray, at), found) in rays.iter().zip(&distances).zip(looked_up(&gpu, &world, &positions)) {
            let before = |event: &&(f64, f64)| event.0 <= *at;
            let expected: f64 = events(&fields[..1], ray.0, ray.1).iter().filter(before).map(|event| event.1).sum();
            squares += (f64::from(found.x) - expected).powi(2);
            all += expected * expected;
        }
        let error = (squares / all).sqrt();
        println!("{error}");
        assert!(error < tolerance::DEEP, "{error} with {light}");
        // And as drawn, behind all: also in channels.
        let far: Vec<_> = rays.iter().map(|(origin, way)| (*origin + 9.0 * *way).as_vec3()).collect();
        let deep = looked_up(&gpu, &scene(light, "basis = \"deep\"\nresolution = 128", &fields), &far);
        let drawn = looked_up(&gpu, &scene(light, "coefficients = 5\nresolution = 128", &fields), &far);
        for (deep, drawn) in deep.iter().zip(drawn) {
            assert!((deep.x - drawn.x).abs() < 1e-4 * (1.0 + drawn.x), "{deep} for {drawn}");
        }
    }
}
