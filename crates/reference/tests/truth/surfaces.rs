//! Surfaces and media together, against the one-page tracer; what no world may break.

use std::sync::Arc;

use glam::{DVec3, Mat4, Vec3};
use tyndall_reference::simple::Simple;
use tyndall_reference::{Options, Random, Tracer, render};
use tyndall_scene::surface::TriangleMesh;
use tyndall_scene::{EnvironmentMap, World, image::Image};

use crate::tolerance::{Estimate, agree};
use crate::worlds::*;

/// Smoke before a rough metal, a block of glass, a mirror and a coloured corner, under two area lights, a lamp, a spot and a sky.
fn everything() -> World {
    let mut world = scene(
        r#"
        materials.red.lambert.reflectance = [0.8, 0.1, 0.1]
        materials.metal.metallic_roughness = { base_color = [0.9, 0.7, 0.3], metallic = 1, roughness = 0.6 }
        materials.plastic.metallic_roughness = { base_color = [0.2, 0.5, 0.8], metallic = 0, roughness = 0.5 }
        materials.glass.dielectric.ior = 1.4
        materials.mirror.mirror.reflectance = 0.8
        [surfaces.floor]
        material = "plastic"
        shape.quad = { corner = [-1.5, 0, 1.5], edges = [[3, 0, 0], [0, 0, -3]] }
        [surfaces.wall]
        material = "red"
        shape.quad = { corner = [-1.5, 0, -1.5], edges = [[3, 0, 0], [0, 2, 0]] }
        [surfaces.box]
        material = "metal"
        shape.box = { min = [-1, 0, -1], max = [-0.3, 0.7, -0.2] }
        [surfaces.mirror]
        material = "mirror"
        shape.quad = { corner = [1.2, 0, -1], edges = [[0.2, 0, 2], [0, 1.5, 0]] }
        [surfaces.ball]
        material = "glass"
        shape.box = { min = [0.2, 0.1, 0], max = [0.8, 0.7, 0.5] }
        transform.rotate = [10, 30, 0]
        [surfaces.panel]
        radiance = [4, 4, 3]
        shape.quad = { corner = [-0.5, 1.8, -0.5], edges = [[1, 0, 0], [0, 0, 1]] }
        [surfaces.lantern]
        radiance = [0.5, 1, 2]
        double_sided = true
        shape.quad = { corner = [-1.2, 0.2, 0.5], edges = [[0.4, 0, 0], [0, 0.4, 0.1]] }
        [lights.lamp.point]
        position = [0.2, 1.2, 0.9]
        intensity = [0.3, 0.6, 0.3]
        [lights.spot.spot]
        position = [1, 1.7, 1.4]
        direction = [-0.6, -1, -0.8]
        intensity = 2
        inner_angle = 15
        outer_angle = 30
        [media.smoke]
        density.homogeneous = { min = [-1.4, 0.1, -1.4], max = [1.1, 1.2, 1.4] }
        optics.coefficients = { sigma_s = [0.6, 0.5, 0.8], sigma_a = [0.1, 0.2, 0.1], emission = [0, 0.05, 0.1], phase.hg.g = 0.4 }
        [media.ember]
        density.sphere = { center = [0, 0.4, 0.8], radius = 0.4 }
        optics.coefficients = { sigma_s = 2, sigma_a = 0.5 }
    "#,
    );
    let pixels = (0..8 * 4).map(|i| [0.1 + 0.1 * (i % 8) as f32, 0.3, 0.02 * i as f32]).collect();
    let sky = Image { width: 8, height: 4, pixels, ..Image::default() };
    world.environment = Some(Arc::new(EnvironmentMap::new(sky, 0.5).unwrap()));
    world
}

fn rays(n: u64) -> impl Iterator<Item = (DVec3, DVec3)> {
    (0..n).map(|i| {
        let mut rng = Random::new(8, i, 0);
        let mut point =
            |center: DVec3, size: f64| center + size * DVec3::from_array([0; 3].map(|_| rng.uniform() - 0.5));
        let eye =
            if i % 3 == 0 { point(DVec3::new(0.0, 0.8, 0.3), 1.0) } else { point(DVec3::new(0.0, 1.0, 4.0), 1.0) };
        (eye, (point(DVec3::new(0.0, 0.5, 0.0), 1.5) - eye).normalize())
    })
}

type Seen = Vec<Estimate>;

fn see(of: &(dyn Fn(DVec3, DVec3, &mut Random) -> DVec3 + Sync), samples: u32, seed: u64) -> Seen {
    rays(12).enumerate().map(|(i, (o, d))| Estimate::of(samples, seed + i as u64, |rng| of(o, d, rng))).collect()
}

fn pairs(a: &Seen, b: &Seen) -> Vec<(Estimate, Estimate)> {
    a.iter().copied().zip(b.iter().copied()).collect()
}

/// The one-page tracer agrees, whatever the depth, and notices another depth, and another roughness.
#[test]
fn simple_tracer_agrees() {
    let world = everything();
    let (tracer, simple) = (Tracer::new(&world).unwrap(), Simple::new(&world));
    let full = |depth| see(&|o, d, rng| tracer.radiance(o, d, depth, rng), 8_000, 100);
    let slow = |depth| see(&|o, d, rng| simple.radiance(o, d, depth, rng), 40_000, 500);
    let all = slow(None);
    agree(&pairs(&full(None), &all), 0.03).unwrap();
    assert!(agree(&pairs(&full(Some(1)), &all), 0.03).is_err());
    for depth in [0, 1, 3] {
        agree(&pairs(&full(Some(depth)), &slow(Some(depth))), 0.03)
            .unwrap_or_else(|error| panic!("depth {depth}: {error}"));
    }
}

/// Ground truth 9 with walls and smoke: light from a lamp at A that a sphere of directions sees at B is as much as from B at A.
#[test]
fn reciprocity() {
    let ends = [Vec3::new(0.3, 0.8, 0.4), Vec3::new(0.7, 0.2, 0.6)];
    let fluence = |from: Vec3, to: Vec3, seed| {
        let mut world = room(
            r#"
            materials.grey.lambert.reflectance = [0.7, 0.5, 0.3]
            materials.metal.metallic_roughness = { base_color = 0.9, metallic = 0.5, roughness = 0.7 }
            [surfaces.screen]
            material = "metal"
            shape.quad = { corner = [0, 0.5, 0], edges = [[0.5, 0, 0], [0, 0, 1]] }
            [media.smoke]
            density.homogeneous = { min = [0, 0, 0], max = [1, 0.6, 1] }
            optics.coefficients = { sigma_s = 1, sigma_a = 0.2, phase.hg.g = 0.5 }
        "#,
            |side| if side == "left" { "material = \"metal\"" } else { "material = \"grey\"" },
        );
        let lamp = tyndall_scene::description::Light::Point { position: from, intensity: Vec3::ONE };
        world.lights.insert("lamp".into(), lamp);
        let tracer = Tracer::new(&world).unwrap();
        Estimate::of(60_000, seed, |rng| {
            let (z, phi) = (2.0 * rng.uniform() - 1.0, std::f64::consts::TAU * rng.uniform());
            let radius = (1.0 - z * z).sqrt();
            tracer.radiance(to.as_dvec3(), DVec3::new(radius * phi.cos(), radius * phi.sin(), z), None, rng)
        })
    };
    agree(&[(fluence(ends[0], ends[1], 1), fluence(ends[1], ends[0], 2))], 0.02).unwrap();
}

fn finite(world: &World) -> Image {
    let mut world = world.clone();
    world.scene.film.size = [12, 8];
    let options = Options { samples: Some(16), ..Options::default() };
    let picture = render(&world, &options, None, &mut |_| std::ops::ControlFlow::Continue(())).unwrap();
    assert!(picture.pixels.iter().flatten().all(|x| x.is_finite() && *x >= 0.0));
    picture
}

/// Nothing at all, surfaces alone, media alone: pictures without a NaN; and so with the camera in a solid or at a corner.
#[test]
fn pictures_are_numbers() {
    assert!(finite(&scene("")).pixels.iter().flatten().all(|&x| x == 0.0));
    let all = everything();
    finite(&World { volumes: Vec::new(), ..all.clone() });
    finite(&World { surfaces: Vec::new(), ..all.clone() });
    for position in
        [Vec3::new(-0.6, 0.3, -0.6), Vec3::new(0.5, 0.4, 0.2), Vec3::new(-1.5, 0.0, -1.5), Vec3::new(0.2, 1.2, 0.9)]
    {
        let mut world = all.clone();
        world.scene.camera.position = position;
        finite(&world);
    }
    // A metre or a micrometre, here or a thousand kilometres away.
    for transform in [Mat4::from_scale(Vec3::splat(1e-6)), Mat4::from_translation(Vec3::new(1e6, 0.0, 0.0))] {
        let mut world = all.clone();
        for surface in &mut world.surfaces {
            surface.world_from_object = transform * surface.world_from_object;
        }
        world.scene.camera.position = transform.transform_point3(Vec3::new(0.0, 0.5, 0.9));
        world.scene.camera.target = transform.transform_point3(Vec3::new(0.0, 0.4, 0.0));
        finite(&world);
    }
}

/// Triangles without an area, with positions that are no numbers, or vertices that are not there, are left out, lights among
/// them; what else there is is shown as it is without them.
#[test]
fn broken_meshes() {
    let whole = room("materials.wall.lambert.reflectance = 0.5", |_| "material = \"wall\"\nradiance = 0.5");
    let mut broken = whole.clone();
    let mut surface = broken.surfaces[0].clone();
    let [a, b] = [Vec3::splat(0.5), Vec3::splat(0.6)];
    surface.mesh = Arc::new(TriangleMesh {
        positions: vec![a, a, b, Vec3::NAN, Vec3::INFINITY],
        triangles: vec![[0, 1, 2], [0, 0, 0], [0, 2, 3], [0, 2, 4], [0, 2, 77]],
        ..TriangleMesh::default()
    });
    broken.surfaces.push(surface.clone());
    assert_eq!(finite(&broken), finite(&whole));
    // Vertices with positions alone will do.
    let mesh = TriangleMesh { positions: vec![a, b, Vec3::X], triangles: vec![[0, 1, 2]], ..TriangleMesh::default() };
    surface.mesh = Arc::new(mesh);
    finite(&World { surfaces: vec![surface], ..whole });
}

/// A lamp in a box lights nothing outside; with the lid open it does. What scatters light near it is in its shadow, too.
#[test]
fn shadows_in_media() {
    let of = |lid: bool| {
        let lid = if lid {
            "[surfaces.lid]\nshape.quad = { corner = [0, 1, 0], edges = [[1, 0, 0], [0, 0, 1]] }"
        } else {
            ""
        };
        let sides = CUBE.iter().filter(|(name, _)| *name != "ceiling");
        let sides: String = sides.map(|(name, shape)| format!("[surfaces.{name}]\n{shape}\n")).collect();
        scene(&format!(
            r#"{sides}
            {lid}
            [lights.lamp.point]
            position = [0.5, 0.9, 0.5]
            intensity = 5
            [media.fog]
            density.homogeneous = {{ min = [-2, -2, -2], max = [3, 3, 3] }}
            optics.coefficients = {{ sigma_s = 0.5, sigma_a = 0.1 }}
        "#
        ))
    };
    let above = |world: &World| look(world, DVec3::new(-3.0, 1.3, 0.5), DVec3::X, None, 5000).mean;
    assert_eq!(above(&of(true)), DVec3::ZERO);
    assert!(above(&of(false)).min_element() > 0.1);
    // Seen from within, the lamp's surroundings are bright all the same.
    assert!(look(&of(true), DVec3::new(0.1, 0.5, 0.5), DVec3::X, None, 5000).mean.min_element() > 0.1);
}
