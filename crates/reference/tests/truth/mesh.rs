//! Unstructured meshes: against closed forms, a homogeneous box, and the simple tracer.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use tyndall_reference::simple::Simple;
use tyndall_scene::Field;
use tyndall_scene::description::{Light, Optics, Phase, Stop, Transfer};
use tyndall_scene::volume::{Budget, Cell, Mesh, Values};

use crate::tolerance::{Estimate, agree};
use crate::worlds::*;

/// The unit cube as n³ hexahedra with crooked inner faces, those kept that `keep` says, and a field on its vertices.
fn hexahedra(n: u32, keep: impl Fn(DVec3) -> bool, field: impl Fn(DVec3) -> f64) -> Field {
    let side = n + 1;
    let places = (0..side.pow(3)).map(|v| [v % side, v / side % side, v / (side * side)]);
    let vertices: Vec<DVec3> = places
        .map(|place| {
            let inner = place.iter().all(|&x| x > 0 && x < n);
            let at = DVec3::from(place.map(f64::from));
            let crooked = DVec3::new((at.y * 5.0 + at.z).sin(), (at.z * 3.0 + at.x).sin(), (at.x * 7.0 + at.y).sin());
            (at + if inner { crooked * 0.2 } else { DVec3::ZERO }) / f64::from(n)
        })
        .collect();
    let at = |[i, j, k]: [u32; 3]| i + side * (j + side * k);
    let boxes = (0..n.pow(3)).map(|c| [c % n, c / n % n, c / (n * n)]);
    let kept = boxes.filter(|&place| keep((DVec3::from(place.map(f64::from)) + 0.5) / f64::from(n)));
    let cells: Vec<_> = kept
        .map(|[i, j, k]| {
            let [l, m, n] = [i + 1, j + 1, k + 1];
            let around = |k| [[i, j, k], [l, j, k], [l, m, k], [i, m, k]].map(at);
            let ([a, b, c, d], [e, f, g, h]) = (around(k), around(n));
            Cell::Hexahedron([a, b, c, d, e, f, g, h])
        })
        .collect();
    let values = Values::Vertices(vertices.iter().map(|&vertex| field(vertex) as f32).collect());
    Field::Mesh(Arc::new(Mesh::new(&vertices, &cells, values, Budget(1 << 28)).unwrap()))
}

const SLOPE: DVec3 = DVec3::new(0.5, 1.5, -0.8);

fn rising(x: DVec3) -> f64 {
    1.0 + SLOPE.dot(x)
}

/// f(x) = 1 + a·x on 6·5³ tetrahedra of a cube: T = exp(−σ_t·L·f(middle)) along every straight line, up to any distance.
#[test]
fn a_linear_field() {
    let world = world(
        vec![volume(hexahedra(5, |_| true, rising), Vec3::ZERO, Vec3::ONE, grey(0.6, 0.9, Phase::Isotropic))],
        vec![],
    );
    for (from, to) in [
        (DVec3::new(0.0, 0.3, 0.7), DVec3::new(1.0, 0.6, 0.2)),
        (DVec3::new(0.2, 1.0, 0.5), DVec3::new(0.7, 0.0, 0.4)),
        (DVec3::new(0.4, 0.45, 0.55), DVec3::new(0.9, 0.1, 1.0)),
    ] {
        let truth = (-1.5 * from.distance(to) * rising((from + to) / 2.0)).exp();
        let way = to - from;
        pass(&world, from, way, way.length(), 200_000).assert(DVec3::splat(truth), 0.006);
    }
    // From before the cube to beyond it.
    let truth = (-1.5 * rising(DVec3::new(0.5, 0.4, 0.3))).exp();
    pass(&world, DVec3::new(-1.0, 0.4, 0.3), DVec3::X, f64::INFINITY, 200_000).assert(DVec3::splat(truth), 0.006);
}

/// A mesh of constant value is the homogeneous box, in every light.
#[test]
fn a_constant_mesh_is_a_box() {
    let light = || Light::Directional { direction: Vec3::new(-0.3, -1.0, 0.2), irradiance: Vec3::splat(2.0) };
    let look = |field| {
        let medium = volume(field, Vec3::ZERO, Vec3::ONE, grey(2.0, 0.5, Phase::Hg { g: 0.4 }));
        let world = world(vec![medium], vec![light(), sky(0.3)]);
        [DVec3::new(2.0, 0.8, 0.4), DVec3::new(0.3, 0.4, 3.0)]
            .map(|from| crate::worlds::look(&world, from, DVec3::splat(0.5) - from, None, 150_000))
    };
    let [mesh, plain] = [look(hexahedra(4, |_| true, |_| 1.0)), look(Field::Homogeneous)];
    // Of one seed, but another sequence of collisions.
    let pairs: Vec<_> = mesh.into_iter().zip(plain).collect();
    agree(&pairs, 0.01).unwrap();
}

/// Where a cell is missing there is nothing, even if a transfer function is opaque at 0: through a cube without its middle
/// third along x, of value 0 and opacity ½ within 0.2 m, T = ½^(2/3/0.2).
#[test]
fn nothing_between_cells() {
    let stops = vec![
        Stop { value: 0.0, opacity: 0.5, color: Some(Vec3::ONE) },
        Stop { value: 1.0, opacity: 0.5, color: Some(Vec3::ONE) },
    ];
    let optics = Optics::Transfer(Transfer { unit_length: 0.2, radiance: 1.0, stops, ..Transfer::default() });
    let field = hexahedra(3, |middle| (middle.x - 0.5).abs() > 0.2, |_| 0.0);
    let world = world(vec![volume(field, Vec3::ZERO, Vec3::ONE, optics)], vec![]);
    // In the cube's face, where no vertex is moved.
    let from = DVec3::new(-1.0, 0.0, 0.02);
    pass(&world, from, DVec3::X, f64::INFINITY, 200_000).assert(DVec3::splat(0.5f64.powf(2.0 / 3.0 / 0.2)), 0.01);
}

/// Scattering, emission and absorption in a curved field, seen by the tracer and the simple one.
#[test]
fn the_simple_tracer_agrees() {
    let curved = |x: DVec3| 1.0 + (6.0 * x.x).sin() * (5.0 * x.y).cos() * x.z;
    let field = hexahedra(4, |middle| middle.distance(DVec3::splat(0.5)) < 0.6, curved);
    let optics = Optics::Coefficients {
        sigma_s: Vec3::new(1.0, 2.0, 0.5),
        sigma_a: Vec3::new(0.2, 0.3, 1.0),
        emission: Vec3::new(0.1, 0.0, 0.5),
        phase: Phase::Hg { g: 0.3 },
    };
    let light = Light::Directional { direction: Vec3::new(1.0, -1.0, 0.3), irradiance: Vec3::ONE };
    let world = world(vec![volume(field, Vec3::ZERO, Vec3::ONE, optics)], vec![light, sky(0.2)]);
    let simple = Simple::new(&world);
    let pairs: Vec<_> = [DVec3::new(2.0, 0.6, 0.3), DVec3::new(0.2, 0.3, 3.0)]
        .map(|from| {
            let way = (DVec3::splat(0.5) - from).normalize();
            let plain = Estimate::of(60_000, 2, |rng| simple.radiance(from, way, None, rng));
            (look(&world, from, way, None, 60_000), plain)
        })
        .into();
    agree(&pairs, 0.02).unwrap();
}
