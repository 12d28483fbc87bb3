//! Light that stays in: ground truths 1 and 3 with surfaces.

use glam::{DVec3, Vec3};
use tyndall_reference::{Random, Tracer};
use tyndall_scene::World;
use tyndall_scene::description::Light;

use crate::tolerance::Estimate;
use crate::worlds::*;

const HALF: &str = "materials.wall.lambert.reflectance = 0.5";
const GLOWING: &str = "material = \"wall\"\nradiance = 0.5";

fn glimpses(world: &World, samples: u32) -> [Estimate; 3] {
    let rays = [
        (DVec3::splat(0.5), DVec3::new(0.3, 0.1, -1.0)),
        (DVec3::new(0.01, 0.02, 0.5), DVec3::new(-1.0, -1.0, 0.1)),
        (DVec3::new(0.9, 0.4, 0.7), DVec3::Y),
    ];
    rays.map(|(origin, direction)| look(world, origin, direction, None, samples))
}

/// A room that emits 0.5 and reflects 0.5 shows L_e/(1 − ρ) = 1, in its corners too; and with one that reflects 0.49 it is noticed.
#[test]
fn furnace() {
    for estimate in glimpses(&room(HALF, |_| GLOWING), 40_000) {
        estimate.assert(DVec3::ONE, 0.003);
    }
    let darker = room("materials.wall.lambert.reflectance = 0.49", |_| GLOWING);
    assert!(glimpses(&darker, 40_000).iter().all(|estimate| estimate.check(DVec3::ONE, 0.003).is_err()));
}

/// The same with everything in it that absorbs nothing: white smoke, a white box, a mirror and a glass ball that is polished by
/// its triangles (smoothed normals would lose light).
#[test]
fn furnace_with_white_things() {
    let things = r#"
        materials.wall.lambert.reflectance = 0.5
        materials.white.lambert.reflectance = 1
        materials.mirror.mirror.reflectance = 1
        materials.glass.dielectric.ior = 1.5
        [surfaces.box]
        material = "white"
        shape.box = { min = [0.1, 0.1, 0.1], max = [0.4, 0.3, 0.35] }
        [surfaces.mirror]
        material = "mirror"
        shape.quad = { corner = [0.2, 0.8, 0.2], edges = [[0.5, 0, 0.1], [0, -0.1, 0.5]] }
        [surfaces.ball]
        material = "glass"
        shape.sphere = { center = [0.65, 0.4, 0.4], radius = 0.2 }
        [media.smoke]
        density.homogeneous = { min = [0.05, 0.1, 0.1], max = [0.95, 0.9, 0.9] }
        optics.coefficients = { sigma_s = 3, sigma_a = 0, phase.hg.g = 0.6 }
    "#;
    let mut world = room(things, |_| GLOWING);
    let flat = |surface: &mut tyndall_scene::surface::Surface| {
        std::sync::Arc::make_mut(&mut surface.mesh).normals.clear();
    };
    world.surfaces.iter_mut().for_each(flat);
    for estimate in glimpses(&world, 40_000) {
        estimate.assert(DVec3::ONE, 0.005);
    }
}

/// White things in the open under a constant sky of 0.7 cannot be seen, as long as no path needs too long to get out.
#[test]
fn white_things_under_a_sky() {
    let world = scene(
        r#"
        materials.white.lambert.reflectance = 1
        materials.mirror.mirror.reflectance = 1
        [lights.sky.constant]
        radiance = 0.7
        [surfaces.floor]
        material = "white"
        shape.disc = { center = [0, 0, 0], normal = [0, 1, 0], radius = 2 }
        [surfaces.box]
        material = "white"
        shape.box = { min = [0, 0, 0], max = [0.5, 0.5, 0.5] }
        [surfaces.mirror]
        material = "mirror"
        shape.box = { min = [-0.7, 0, 0], max = [-0.5, 1, 0.5] }
        [media.smoke]
        density.homogeneous = { min = [-1, 0.2, -1], max = [1, 0.9, 1] }
        optics.coefficients = { sigma_s = 2, sigma_a = 0 }
    "#,
    );
    for direction in [DVec3::new(0.0, -0.2, -1.0), DVec3::new(-0.1, -0.3, -1.0), DVec3::new(0.05, -0.24, -1.0)] {
        look(&world, DVec3::new(0.0, 1.0, 4.0), direction, None, 3000).assert(DVec3::splat(0.7), 1e-9);
    }
}

/// A lamp of intensity I in a closed room of any shape with area A: what is absorbed is what is emitted, (1 − ρ)·E̅·A = 4πI, so
/// the mean radiance of the walls is ρE̅/π = 4ρI/((1 − ρ)A). In the unit sphere with ρ = 0.5 and I = π it is 1; the room
/// is the sphere's polyhedron, of which A is summed up.
#[test]
fn lamp_in_a_sphere() {
    let mut world = scene(
        r#"
        materials.wall.lambert.reflectance = 0.5
        [surfaces.sphere]
        material = "wall"
        shape.sphere = { center = [0, 0, 0], radius = 1 }
    "#,
    );
    let mesh = std::sync::Arc::make_mut(&mut world.surfaces[0].mesh);
    mesh.normals.clear();
    let triangles = mesh.triangles.iter().map(|corners| corners.map(|i| mesh.positions[i as usize].as_dvec3()));
    let triangles: Vec<_> = triangles.collect();
    let areas = triangles.iter().map(|[a, b, c]| 0.5 * (b - a).cross(c - a).length());
    let sums: Vec<f64> = areas
        .scan(0.0, |sum, area| {
            *sum += area;
            Some(*sum)
        })
        .collect();
    let area = *sums.last().unwrap();
    world
        .lights
        .insert("lamp".into(), Light::Point { position: Vec3::ZERO, intensity: Vec3::splat(std::f32::consts::PI) });
    let tracer = Tracer::new(&world).unwrap();
    let mean = Estimate::of(60_000, 4, |rng: &mut Random| {
        let chosen = rng.uniform() * area;
        let [a, b, c] = triangles[sums.partition_point(|&sum| sum <= chosen)];
        let (root, v) = (rng.uniform().sqrt(), rng.uniform());
        let point = a * (1.0 - root) + b * (root * (1.0 - v)) + c * (root * v);
        // From half way between the wall and the lamp, which sees the point: the polyhedron is convex.
        tracer.radiance(point * 0.5, point.normalize(), None, rng)
    });
    let truth = 4.0 * std::f64::consts::PI / area;
    // The polyhedron's area is 0.3 % short of the sphere's.
    assert!((truth - 1.0).abs() < 0.004, "{truth}");
    mean.assert(DVec3::splat(truth), 0.001);
}
