//! The G-buffer against rays cast on the host.

use glam::{DVec3, Vec2, Vec3};
use tyndall_scene::World;

use super::GBuffer;
use crate::graph::{Graph, Tile};
use crate::math::octahedral::unpack_direction;
use crate::renderer::read_texels;
use crate::resident::surfaces::triangles;
use crate::resident::{Resident, View};
use crate::test::{gpu, tolerance, world};

/// Floor, wall, box and ball.
pub const SCENE: &str = "camera = { position = [1.1, 1.3, 3.1], target = [0, 0.3, 0], fov = 50 }\nfilm.size = [141, 97]\n\
    surfaces.floor.shape.quad = { corner = [-2, 0, 2], edges = [[4, 0, 0], [0, 0, -4]] }\n\
    surfaces.ball.shape.sphere = { center = [0.2, 0.5, 0], radius = 0.5 }\n\
    surfaces.wall.shape.quad = { corner = [-1.2, 0, 1], edges = [[0.01, 0, -2], [0, 1.4, 0.3]] }\n\
    [surfaces.block]\nshape.box = { min = [0.6, 0, 0.6], max = [0.9, 0.7, 0.9] }\ntransform.rotate = [0, 20, 0]\n";

/// What a device makes of a world with these two views.
fn gbuffer(gpu: &crate::Gpu, world: &World, view: &View, previous: &View) -> GBuffer {
    let resident = pollster::block_on(Resident::new(gpu, world)).unwrap();
    let [view, previous] = [view, previous].map(|view| gpu.buffer("view", view));
    let mut graph = Graph::new(gpu);
    let gbuffer = pollster::block_on(GBuffer::new(gpu, &resident)).unwrap();
    pollster::block_on(gbuffer.fill(&mut graph, &resident, &view, &previous, 1.0)).unwrap();
    let mut profiler = wgpu_profiler::GpuProfiler::new(&gpu.device, Default::default()).unwrap();
    let size = resident.film.into();
    graph.submit(Tile { size, ..Default::default() }, &mut profiler);
    gbuffer
}

/// The nearest triangle that a ray meets: its number, the distance [m], and by how much the ray would have to move, in pixels,
/// to meet another.
pub fn cast(corners: &[[DVec3; 3]], origin: DVec3, direction: DVec3) -> Option<(usize, f64)> {
    let hits = corners.iter().enumerate().filter_map(|(i, [a, b, c])| {
        let (ab, ac) = (b - a, c - a);
        let p = direction.cross(ac);
        let (s, det) = (origin - a, ab.dot(p));
        let q = s.cross(ab);
        let [u, v, t] = [s.dot(p) / det, direction.dot(q) / det, ac.dot(q) / det];
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some((i, t))
    });
    hits.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// A world's camera, without an environment.
pub fn view_of(world: &World) -> View {
    View::new(&world.scene.camera, world.scene.film.size, Vec3::ZERO, 0.0)
}

/// The unit direction through a point of the film.
pub fn through(view: &View, film: Vec2) -> DVec3 {
    let size = Vec2::new(view.width as f32, view.height as f32).as_dvec2();
    let at = 2.0 * film.as_dvec2() / size - 1.0;
    (view.forward.as_dvec3() + at.x * view.right.as_dvec3() - at.y * view.up.as_dvec3()).normalize()
}

#[test]
fn it_is_what_rays_meet() {
    let Some(gpu) = gpu() else { return };
    let world = world(SCENE);
    let mut view = view_of(&world);
    // Through another point of the pixels than their middle: as anti-aliasing does.
    view.forward += view.right * (0.4 / 141.0) + view.up * (0.6 / 97.0);
    let gbuffer = gbuffer(&gpu, &world, &view, &view);
    let place: Vec<[f32; 4]> = pollster::block_on(read_texels(&gpu, &gbuffer.place)).unwrap();
    let facing: Vec<[u32; 4]> = pollster::block_on(read_texels(&gpu, &gbuffer.facing)).unwrap();
    let (vertices, list) = triangles(&world.surfaces);
    let corners: Vec<_> =
        list.iter().map(|t| [t.x, t.y, t.z].map(|i| vertices[i as usize].position.as_dvec3())).collect();
    let (mut others, mut seen, mut worst) = (0, 0, 0f64);
    for (i, (place, facing)) in place.iter().zip(&facing).enumerate() {
        let film = Vec2::new((i % 141) as f32, (i / 141) as f32) + 0.5;
        let hit = cast(&corners, view.position.as_dvec3(), through(&view, film));
        let number = hit.map_or(0, |(number, _)| number as u32 + 1);
        if facing[3] != number {
            others += 1;
            continue;
        }
        let Some((number, distance)) = hit else {
            assert!(place[0] >= 1e30);
            continue;
        };
        seen += 1;
        worst = worst.max((f64::from(place[0]) / distance - 1.0).abs());
        assert_eq!(facing[2], list[number].w);
        let [a, b, c] = corners[number];
        let normal = (b - a).cross(c - a).normalize();
        assert!(unpack_direction(facing[0]).distance(normal) < tolerance::PROBE_PACKED, "{normal}");
        if world.surfaces[facing[2] as usize].name == "ball" {
            let at = view.position.as_dvec3() + distance * through(&view, film);
            let expected = (at - DVec3::new(0.2, 0.5, 0.0)).normalize();
            assert!(unpack_direction(facing[1]).distance(expected) < 0.01, "{expected}");
        }
    }
    // Some 4000 triangles' edges are seen, of about 4 pixels each; one in a hundred comes as near as a rasteriser rounds.
    assert!(seen > 8000, "{seen}");
    assert!(others < 100, "{others} pixels see another triangle");
    assert!(worst < tolerance::DISTANCE, "{worst}");
}

/// Motion is that of the projections of points; where nothing is seen, of directions.
#[test]
fn motion_is_from_the_frame_before() {
    let Some(gpu) = gpu() else { return };
    let mut world = world(SCENE);
    let view = view_of(&world);
    world.scene.camera.position += Vec3::new(0.1, 0.05, -0.2);
    world.scene.camera.target += Vec3::new(0.2, -0.03, 0.0);
    let previous = view_of(&world);
    let gbuffer = gbuffer(&gpu, &world, &view, &previous);
    let place: Vec<[f32; 4]> = pollster::block_on(read_texels(&gpu, &gbuffer.place)).unwrap();
    let motion: Vec<[f32; 2]> = pollster::block_on(read_texels(&gpu, &gbuffer.motion)).unwrap();
    let (mut near, mut far) = (0, 0);
    for (i, (place, motion)) in place.iter().zip(motion).enumerate() {
        let film = Vec2::new((i % 141) as f32, (i / 141) as f32) + 0.5;
        let seen = place[0] < 1e30;
        let distance = if seen { f64::from(place[0]) } else { 1e9 };
        *(if seen { &mut near } else { &mut far }) += 1;
        let point = view.position.as_dvec3() + distance * through(&view, film);
        let back = through(&previous, film - Vec2::from(motion));
        let expected = (point - previous.position.as_dvec3()).normalize();
        // A pixel is some 0.006 rad.
        assert!(back.distance(expected) < 0.006 * tolerance::MOTION, "{film} {motion:?}");
    }
    assert!(near > 1000 && far > 1000, "{near} {far}");
}

/// Of a frame, motion is since the rendering before: none where the camera stands.
#[test]
fn a_frame_remembers_its_camera() {
    let Some(gpu) = gpu() else { return };
    let world = world(SCENE);
    let mut frame = pollster::block_on(crate::Frame::new(&gpu, &world)).unwrap();
    let longest = |frame: &mut crate::Frame| {
        frame.render();
        let motion = &frame.gbuffer().unwrap().motion;
        let motion: Vec<[f32; 2]> = pollster::block_on(read_texels(&gpu, motion)).unwrap();
        motion.iter().map(|&v| Vec2::from(v).length()).fold(0.0, f32::max)
    };
    assert!(longest(&mut frame) < tolerance::MOTION as f32);
    let mut camera = world.scene.camera.clone();
    camera.position.x += 0.1;
    frame.set_camera(&camera);
    let moved = longest(&mut frame);
    assert!(moved > 1.0 && moved < 20.0, "{moved}");
    assert!(longest(&mut frame) < tolerance::MOTION as f32);
}

/// Colours of vertices come through to what is lit, as the reference has them.
#[test]
fn colours_of_vertices() {
    let Some(gpu) = gpu() else { return };
    let sun = "[lights]\nsun.directional = { direction = [-1, -3, -1], irradiance = 3 }\n";
    let mut world = world(&format!("{SCENE}{sun}"));
    let color = glam::Vec4::new(0.5, 0.3, 1.0, 1.0);
    for surface in &mut world.surfaces {
        let mesh = std::sync::Arc::make_mut(&mut surface.mesh);
        mesh.colors = vec![color; mesh.positions.len()];
    }
    let colored = crate::test::picture(&gpu, &world);
    for surface in &mut world.surfaces {
        std::sync::Arc::make_mut(&mut surface.mesh).colors.clear();
    }
    let plain = crate::test::picture(&gpu, &world);
    for (colored, plain) in colored.pixels.iter().zip(&plain.pixels) {
        for c in 0..3 {
            // The root of a channel is rounded to 8 bits.
            let packed = ((255.0 * color[c].sqrt()).round() / 255.0).powi(2);
            assert!((colored[c] - packed * plain[c]).abs() <= 1e-5 * plain[c], "{colored:?} {plain:?}");
        }
    }
    assert!(plain.pixels.iter().any(|pixel| pixel[0] > 0.1));
}
