//! Particles and strands in maps of transmittance, against sums over all of them.

use std::sync::Arc;

use glam::{DVec3, Vec3, Vec4};
use tyndall_scene::particles::{Particle, Particles};
use tyndall_scene::strands::{Knot, Strands};
use tyndall_scene::{Field, World};

use crate::graph::{Graph, Shader, Tile, shader};
use crate::math::bodies::{ball_passage, ball_profile, cylinder_span};
use crate::math::transmittance::{Basis, Fourier, Window};
use crate::test::probe::spread;
use crate::test::{gpu, picture, tolerance, world};
use crate::{Frame, Gpu};

/// The shipped plume of particles.
const PARTICLES: &str = include_str!("../../../../../scenes/particles.toml");

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
            let balls = bodies.len() == 1 && matches!(bodies[0], Field::Particles(_));
            let (resolution, most) = if balls { (512, tolerance::DRAWN) } else { (1024, tolerance::DRAWN_STRANDS) };
            let world = scene(light, &format!("coefficients = 3\nresolution = {resolution}"), bodies);
            // Where rays through the bodies' cube leave them all behind.
            let rays: Vec<(DVec3, DVec3)> = (0..6400).map(|i| way(place, 0.9 * point(i + 7).as_dvec3())).collect();
            let positions: Vec<_> = rays.iter().map(|(origin, way)| (*origin + 9.0 * *way).as_vec3()).collect();
            let (mut squares, mut all, mut lost, mut sum) = (0.0, 0.0, 0.0, 0.0);
            for ((origin, way), found) in rays.iter().zip(looked_up(&gpu, &world, &positions)) {
                let expected: f64 = events(bodies, *origin, *way).iter().map(|event| event.1).sum();
                let off = f64::from(found.x) - expected;
                squares += off * off;
                all += expected * expected;
                lost += off;
                sum += expected;
            }
            let (error, lost) = ((squares / all).sqrt(), lost / sum);
            assert!(error < most, "{error} with {light}");
            assert!(lost.abs() < tolerance::DRAWN_SUM, "{lost} with {light}");
        }
    }
}

/// Three layers are known exactly by seven or nine sums of moments, before and behind each; not by five.
#[test]
fn moments_know_three_layers() {
    let Some(gpu) = gpu() else { return };
    let way = SUN_WAY.normalize();
    let layers = [(-1.2, 0.5), (0.1, 0.9), (1.2, 0.3)];
    let ball =
        |(at, depth): (f64, f32)| Particle { position: (at * way).as_vec3(), radius: 0.5, color: Vec3::ONE, depth };
    let fields = [Field::Particles(Arc::new(Particles::new(layers.map(ball).to_vec()).unwrap()))];
    // Around the axis, and well between layers.
    let places: Vec<_> = (0..640)
        .map(|i| {
            let aside = 0.25 * point(i).as_dvec3().reject_from(way);
            (aside - 5.0 * way, [3.2, 4.4, 5.7, 7.0][i % 4] + 0.3 * f64::from(spread(i, 5)))
        })
        .collect();
    let positions: Vec<_> = places.iter().map(|(origin, distance)| (*origin + *distance * way).as_vec3()).collect();
    let exact: Vec<_> = places
        .iter()
        .map(|(origin, distance)| {
            let met = events(&fields, *origin, way).into_iter().filter(|event| event.0 < *distance);
            Vec3::splat(met.map(|event| event.1).sum::<f64>() as f32)
        })
        .collect();
    for basis in ["moments", "trigonometric"] {
        let error = |count: u32| {
            let settings = format!("basis = \"{basis}\"\ncoefficients = {count}\nresolution = 128\ndepths = \"light\"");
            apart(&looked_up(&gpu, &scene(SUN, &settings, &fields), &positions), &exact)
        };
        let [five, seven, nine] = [5, 7, 9].map(error);
        assert!(seven.max(nine) < tolerance::MAPPED_LAYERS, "{seven} with 7, {nine} with 9 of {basis}");
        assert!(five > 100.0 * seven, "{five} with 5, {seven} with 7 of {basis}");
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

/// The shipped plume of 16K particles, the sky left out, with these settings of maps.
fn plume(settings: &str, bodies: &Field) -> World {
    plume_at(64, settings, bodies)
}

/// As [`plume`], with so many texels a side.
fn plume_at(resolution: u32, settings: &str, bodies: &Field) -> World {
    let text = PARTICLES
        .replace("[480, 480]", "[96, 96]")
        .replace("[lights.sky.constant]\nradiance = [0.15, 0.2, 0.28]", "")
        .replace("number = 16384", "number = 2");
    let mut world = world(&format!("{text}\n[techniques.transmittance]\nresolution = {resolution}\n{settings}"));
    world.volumes[0].set_bodies(bodies.clone());
    world
}

/// Relative root mean square error of transmittances against those of a deep map.
fn off(found: &[Vec3], exact: &[Vec3]) -> f64 {
    let transmittance = |depth: &Vec3| f64::from(-depth.x).exp();
    let squares: f64 = found.iter().zip(exact).map(|(a, b)| (transmittance(a) - transmittance(b)).powi(2)).sum();
    (squares / exact.iter().map(|b| transmittance(b).powi(2)).sum::<f64>()).sqrt()
}

/// The optical depth up to a distance along a ray, of what bodies deposit in a basis from the first of them to where `deepest` is reached:
/// the series alone, without texels.
fn truncated(basis: &dyn Basis, events: &[(f64, f64)], at: f64, deepest: f64) -> f64 {
    let mut met: Vec<_> = events.iter().copied().filter(|event| event.1 > 0.0).collect();
    met.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut depth = 0.0;
    let kept = met.iter().take_while(|event| {
        let before = depth;
        depth += event.1;
        before < deepest
    });
    let kept: Vec<_> = kept.copied().collect();
    let (Some(first), Some(last)) = (kept.first(), kept.last()) else { return 0.0 };
    // As range.wesl's.
    let margin = 0.4 / (basis.count() as f64 - 1.0) * (last.0 - first.0) + 1e-9;
    let place = |distance: f64| ((distance - first.0 + margin) / (last.0 - first.0 + 2.0 * margin)).clamp(0.0, 1.0);
    let mut sums = vec![0.0; basis.count()];
    for event in &kept {
        basis.deposit(&mut sums, place(event.0), event.1);
    }
    basis.optical_depth(&sums, place(at)).max(0.0)
}

/// A good part of what is off within the plume is the series: so far off are its closed forms on the rays themselves, without texels, in
/// double precision. By 15 of Fourier's coefficients 1 % of light is out of reach.
#[test]
fn what_is_off_within_is_the_series() {
    let Some(gpu) = gpu() else { return };
    let Field::Particles(particles) = world(PARTICLES).volumes.remove(0).field else { panic!("particles") };
    let balls = particles.list().iter().step_by(32).enumerate();
    let positions: Vec<_> = balls.map(|(i, ball)| ball.position + 0.6 * ball.radius * point(i)).collect();
    let bodies = Field::Particles(particles);
    let way = DVec3::new(-0.7, -1.0, -0.35).normalize();
    let fields = [bodies.clone()];
    let rays: Vec<_> = positions.iter().map(|p| events(&fields, p.as_dvec3() - 9.0 * way, way)).collect();
    let exact = rays.iter().map(|ray| ray.iter().filter(|event| event.0 <= 9.0).map(|event| event.1).sum::<f64>());
    let exact: Vec<_> = exact.map(|depth| Vec3::splat(depth as f32)).collect();
    for harmonics in [3, 7] {
        let basis = Fourier { harmonics, window: Window::Off };
        let kept = rays.iter().map(|ray| Vec3::splat(truncated(&basis, ray, 9.0, 6.0) as f32));
        let series = apart(&kept.collect::<Vec<_>>(), &exact);
        let settings = format!("coefficients = {}", 2 * harmonics + 1);
        let found = apart(&looked_up(&gpu, &plume_at(256, &settings, &bodies), &positions), &exact);
        assert!(series > 0.01, "{settings}: {series}");
        let share = (series / found).powi(2);
        assert!(share > tolerance::SERIES && share < 1.0, "{settings}: {found} of maps, {series} of the series");
    }
}

/// Root mean square difference of transmittances.
fn apart(found: &[Vec3], exact: &[Vec3]) -> f64 {
    let transmittance = |depth: &Vec3| f64::from(-depth.x).exp();
    let squares: f64 = found.iter().zip(exact).map(|(a, b)| (transmittance(a) - transmittance(b)).powi(2)).sum();
    (squares / found.len() as f64).sqrt()
}

/// The shadow of 16K particles on the ground is as of a deep map, with any number of coefficients; within, where the optical depth goes up
/// to 20, more of them say more, ranges of depths for each texel as much, and slices less.
#[test]
fn the_plume_shades_the_ground_and_itself() {
    let Some(gpu) = gpu() else { return };
    let Field::Particles(particles) = world(PARTICLES).volumes.remove(0).field else { panic!("particles") };
    let balls = particles.list().iter().step_by(16).enumerate();
    let inside: Vec<_> = balls.map(|(i, ball)| ball.position + 0.6 * ball.radius * point(i)).collect();
    let ground = (0..1024).map(|i| Vec3::new(4.0 * spread(i, 0) - 3.0, -0.15, 3.0 * spread(i, 1) - 2.0));
    let positions: Vec<_> = inside.iter().copied().chain(ground).collect();
    let bodies = Field::Particles(particles);
    let exact = looked_up(&gpu, &plume("basis = \"deep\"", &bodies), &positions);
    let errors = |settings: &str| {
        let found = looked_up(&gpu, &plume(settings, &bodies), &positions);
        let (a, b) = (found.split_at(inside.len()), exact.split_at(inside.len()));
        let errors = [off(a.0, b.0), off(a.1, b.1)];
        assert!(errors[1] < tolerance::PLUME_GROUND, "{} on the ground with {settings}", errors[1]);
        errors[0]
    };
    let (seven, fifteen) = (errors("coefficients = 7"), errors("coefficients = 15"));
    let cosines = errors("coefficients = 15\nbasis = \"cosine\"");
    let whole = ["fourier", "slices"]
        .map(|basis| errors(&format!("coefficients = 15\ndepths = \"light\"\nbasis = \"{basis}\"")));
    assert!(seven < tolerance::PLUME_INSIDE_7, "{seven}");
    assert!(fifteen < tolerance::PLUME_INSIDE, "{fifteen}");
    assert!(cosines < tolerance::PLUME_INSIDE_COSINES, "{cosines}");
    assert!(whole[0] > 1.5 * fifteen, "{} with one range for all, {fifteen} with one a texel", whole[0]);
    assert!(whole[1] > 1.2 * whole[0], "{} with slices, {} with as many coefficients", whole[1], whole[0]);
}

/// [Jansen10, figs. 5-7] As the maps' bounds see it, drawn: bounds a tenth wider, bodies that move in them, and one far away that lets them
/// reach half as far again, change what 15 coefficients say less than they change 15 slices.
#[test]
fn bounds_hardly_matter_to_what_is_drawn() {
    let Some(gpu) = gpu() else { return };
    let way = SUN_WAY.as_vec3().normalize();
    let positions: Vec<_> = (0..512).map(|i| 0.9 * point(i + 7)).collect();
    // Around all of them, nearly nothing says where depths begin and end.
    let ends = [-1.6, 1.6];
    let seen = |basis: &str, ends: [f32; 2], moved: f32| {
        let mut list = balls(60);
        for ball in &mut list {
            ball.position += moved * way;
        }
        let end = |at: f32| Particle { position: at * way, radius: 0.2, color: Vec3::ONE, depth: 1e-6 };
        list.extend(ends.map(end));
        let fields = [Field::Particles(Arc::new(Particles::new(list).unwrap()))];
        let settings = format!("basis = \"{basis}\"\ncoefficients = 15\nresolution = 128\ndepths = \"light\"");
        let positions: Vec<_> = positions.iter().map(|position| position + moved * way).collect();
        looked_up(&gpu, &scene(SUN, &settings, &fields), &positions)
    };
    for (what, changed, moved, most) in [
        ("wider", [[-1.78, 1.78], [-1.71, 1.71], [-1.66, 1.66]], [0.0; 3], tolerance::BOUNDS),
        ("moved", [ends; 3], [0.04, 0.08, 0.12], tolerance::BOUNDS),
        ("outlier", [[-1.6, 3.2], [-1.6, 3.2], [-1.6, 3.3]], [0.0; 3], tolerance::OUTLIER),
    ] {
        let change = |basis: &str| {
            let still = seen(basis, ends, 0.0);
            let changes = changed.iter().zip(moved).map(|(&ends, moved)| apart(&seen(basis, ends, moved), &still));
            changes.fold(0.0, f64::max)
        };
        let (fourier, slices) = (change("fourier"), change("slices"));
        assert!(fourier < most && fourier < slices, "{what}: {fourier} against {slices}");
    }
}

/// Fog under a ball in light from above, as the march looks it up: L = E σ_s/4π ∫ e^{−0.7 (1 − z²/r²)^{5/2}} dz.
#[test]
fn marched_media_receive_shadows_of_bodies() {
    let Some(gpu) = gpu() else { return };
    for (basis, most) in [
        ("deep", tolerance::MARCHED_SHADOW),
        ("cosine", tolerance::MARCHED_SHADOW_COSINE),
        ("fourier", tolerance::MARCHED_SHADOW_FOURIER),
    ] {
        let text = format!(
            "camera = {{ position = [0, 0, 5], target = [0, 0, 0], fov = 0.001 }}\nfilm.size = [2, 2]\n\
             lights.sun.directional = {{ direction = [0, -1, 0], irradiance = 4 }}\n\
             techniques.march = {{}}\ntechniques.transmittance = {{ resolution = 128, coefficients = 15, basis = \"{basis}\" }}\n\
             [media.ball]\ndensity.emitter = {{ number = 2, time = 0.1 }}\noptics.coefficients.sigma_a = 1\n\
             [media.fog]\ndensity.homogeneous = {{ min = [-0.5, -0.5, -0.5], max = [0.5, 0.5, 0.5] }}\n\
             optics.coefficients.sigma_s = 1e-3"
        );
        let mut world = world(&text);
        let ball = Particle { position: 2.0 * Vec3::Y, radius: 0.8, color: Vec3::ONE, depth: 0.7 };
        world.volumes[0].set_bodies(Field::Particles(Arc::new(Particles::new(vec![ball]).unwrap())));
        let arrives = |i: i32| {
            let z = (f64::from(i) + 0.5) / 1000.0 - 0.5;
            (-0.7 * ball_profile(1.0 - z * z / 0.64)).exp() / 1000.0
        };
        let expected = 4e-3 / (4.0 * std::f64::consts::PI) * (0..1000).map(arrives).sum::<f64>();
        let found = f64::from(picture(&gpu, &world).pixels[0][0]);
        assert!((found / expected - 1.0).abs() < most, "{found} for {expected}, {basis}");
    }
}

/// The order in which bodies are drawn changes sums by rounding alone; half floats stand still where what is added is less than half a step of
/// theirs: layers of α = 0.001 at an optical depth of 4 (a0 = 8).
#[test]
fn sums_do_not_depend_on_the_order_and_half_floats_stall() {
    let Some(gpu) = gpu() else { return };
    let seen = |list: Vec<Particle>, settings: &str, positions: &[Vec3]| {
        let fields = [Field::Particles(Arc::new(Particles::new(list).unwrap()))];
        looked_up(&gpu, &scene(SUN, &format!("resolution = 64\n{settings}"), &fields), positions)
    };
    let positions: Vec<_> = (0..256).map(point).collect();
    let one = seen(balls(200), "depths = \"light\"", &positions);
    let other = seen(balls(200).into_iter().rev().collect(), "depths = \"light\"", &positions);
    for (a, b) in one.iter().zip(other) {
        assert!((a.x - b.x).abs() < 1e-4, "{a} for {b}");
    }
    let layer = Particle { position: Vec3::ZERO, radius: 1.0, color: Vec3::ONE, depth: -(-0.001f32).ln_1p() };
    let behind = [4.0 * SUN_WAY.as_vec3()];
    let [single, half] = ["single", "half"].map(|precision| {
        seen(
            vec![layer; 10_000],
            &format!("coefficients = 1\ndepths = \"light\"\nprecision = \"{precision}\""),
            &behind,
        )[0]
        .x
    });
    assert!((single - 10.0).abs() < 0.1, "{single}");
    // A device that rounds down stands still twice as early.
    assert!((half - 4.0).abs() < 0.1 || (half - 2.0).abs() < 0.1, "{half}");
}

/// A floor under a ball, in light from above: E·ρ/π·T in each channel, where the march leaves balls to the maps.
#[test]
fn surfaces_receive_shadows_of_bodies() {
    let Some(gpu) = gpu() else { return };
    let scene = |maps: &str| {
        let text = format!(
            "camera = {{ position = [0, -0.8, 1.5], target = [0, -1, 0], fov = 0.1 }}\nfilm.size = [2, 2]\n\
             lights.sun.directional = {{ direction = [0, -1, 0], irradiance = 3 }}\n{maps}\ntechniques.march = {{}}\n\
             materials.white.lambert.reflectance = 0.8\n\
             surfaces.floor = {{ shape.quad = {{ corner = [-2, -1, 2], edges = [[4, 0, 0], [0, 0, -4]] }}, material = \"white\" }}\n\
             [media.ball]\ndensity.emitter = {{ number = 2, time = 0.1 }}\noptics.coefficients = {{ sigma_s = 0.5, sigma_a = [0.5, 1, 2] }}"
        );
        let mut world = world(&text);
        let ball = Particle { position: Vec3::ZERO, radius: 0.5, color: Vec3::ONE, depth: 0.7 };
        world.volumes[0].set_bodies(Field::Particles(Arc::new(Particles::new(vec![ball]).unwrap())));
        world
    };
    for basis in ["fourier", "deep"] {
        let maps = format!("techniques.transmittance = {{ resolution = 128, basis = \"{basis}\" }}");
        let found = picture(&gpu, &scene(&maps)).pixels[0];
        for (found, sigma_t) in found.into_iter().zip([1.0, 1.5, 2.5f32]) {
            let expected = 3.0 * 0.8 / std::f32::consts::PI * (-0.7 * sigma_t).exp();
            assert!((found / expected - 1.0).abs() < 2e-3, "{found} for {expected}, {basis}");
        }
    }
}
