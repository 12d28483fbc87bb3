//! Diffuse exchange in the unit cube: ground truth 7, and radiosity [Goral84] as an oracle.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use tyndall_scene::World;

use crate::worlds::*;

/// A square of a wall of the unit cube, as its extents: one of the axes' is a number twice.
type Patch = [[f64; 2]; 3];

/// The form factor between two patches, of parallel or perpendicular walls [Ehlert93].
fn form_factor(from: &Patch, to: &Patch) -> f64 {
    let flat = |patch: &Patch| (0..3).find(|&axis| patch[axis][0] == patch[axis][1]).unwrap();
    let (a, b) = (flat(from), flat(to));
    let times_ln = |factor: f64, x: f64| if x > 0.0 { factor * x.ln() } else { 0.0 };
    let times_atan = |x: f64, root: f64| if root > 0.0 { x * root * (x / root).atan() } else { 0.0 };
    let (extents, kernel): ([[f64; 2]; 4], Box<dyn Fn(f64, f64, f64, f64) -> f64>) = if a == b {
        let [u, v] = [(a + 1) % 3, (a + 2) % 3];
        let z = from[a][0] - to[a][0];
        let parallel = move |x: f64, y: f64, eta: f64, xi: f64| {
            let (dx, dy) = (x - xi, y - eta);
            let square = z * z;
            times_atan(dy, (dx * dx + square).sqrt()) + times_atan(dx, (dy * dy + square).sqrt())
                - times_ln(0.5 * square, dx * dx + dy * dy + square)
        };
        ([from[u], from[v], to[v], to[u]], Box::new(parallel))
    } else {
        // Distances from the edge at which the walls meet.
        let off = |extent: [f64; 2], edge: f64| {
            let [x, y] = extent.map(|x| (x - edge).abs());
            [x.min(y), x.max(y)]
        };
        let along = 3 - a - b;
        let perpendicular = move |x: f64, y: f64, eta: f64, xi: f64| {
            let (square, dy) = (x * x + xi * xi, y - eta);
            times_atan(dy, square.sqrt()) - times_ln(0.25 * (square - dy * dy), square + dy * dy)
        };
        ([off(from[b], to[b][0]), from[along], to[along], off(to[a], from[a][0])], Box::new(perpendicular))
    };
    let mut sum = 0.0;
    for corner in 0..16usize {
        let at = |k: usize| extents[k][corner >> k & 1];
        let sign = if corner.count_ones() % 2 == 0 { 1.0 } else { -1.0 };
        sum += sign * kernel(at(0), at(1), at(2), at(3));
    }
    let [x, y] = [extents[0], extents[1]].map(|[low, high]| high - low);
    sum / (TAU * x * y)
}

/// The walls of the unit cube, each of n × n patches: floor, ceiling and a side first.
fn patches(n: usize) -> Vec<Patch> {
    let walls = [(1, 0.0), (1, 1.0), (0, 0.0), (0, 1.0), (2, 0.0), (2, 1.0)];
    let part = |i: usize| [i as f64 / n as f64, (i + 1) as f64 / n as f64];
    let of = |(axis, place): (usize, f64)| {
        (0..n * n).map(move |i| {
            let mut patch = [[place; 2]; 3];
            (patch[(axis + 1) % 3], patch[(axis + 2) % 3]) = (part(i % n), part(i / n));
            patch
        })
    };
    walls.into_iter().flat_map(of).collect()
}

/// Mean radiosities of floor, ceiling and a side, where the ceiling emits 1 and all reflect 0.5, with n × n patches a wall:
/// B = E + ρ F B.
fn radiosity(n: usize) -> [f64; 3] {
    let patches = patches(n);
    let walls = |i: usize| i / (n * n);
    let factors: Vec<Vec<f64>> = (0..patches.len())
        .map(|i| {
            let to = |j: usize| if walls(i) == walls(j) { 0.0 } else { form_factor(&patches[i], &patches[j]) };
            (0..patches.len()).map(to).collect()
        })
        .collect();
    let emitted = |i: usize| if walls(i) == 1 { 1.0 } else { 0.0 };
    let mut b: Vec<f64> = (0..patches.len()).map(emitted).collect();
    for _ in 0..60 {
        let gathered = |i: usize| factors[i].iter().zip(&b).map(|(f, b)| f * b).sum::<f64>();
        b = (0..patches.len()).map(|i| emitted(i) + 0.5 * gathered(i)).collect();
    }
    [0, 1, 2].map(|wall| b[wall * n * n..(wall + 1) * n * n].iter().sum::<f64>() / (n * n) as f64)
}

/// The published numbers of one patch a wall, which hold the form factors, too; and those of a closed room sum up to 1.
#[test]
fn one_patch_a_wall() {
    let walls = patches(1);
    let [opposite, adjacent] = [1, 2].map(|wall| form_factor(&walls[0], &walls[wall]));
    assert!((opposite - 0.199825).abs() < 5e-7 && (adjacent - 0.200044).abs() < 5e-7, "{opposite} {adjacent}");
    assert!((opposite + 4.0 * adjacent - 1.0).abs() < 1e-12);
    let [floor, ceiling, side] = radiosity(1);
    assert!((ceiling - 1.0909).abs() < 5e-5, "{ceiling}");
    assert!((floor - 0.18175).abs() < 5e-6 && (side - 0.18184).abs() < 5e-6, "{floor} {side}");
    let fine = patches(3);
    let all: f64 = (9..54).map(|j| form_factor(&fine[4], &fine[j])).sum();
    assert!((all - 1.0).abs() < 1e-12, "{all}");
}

/// A ceiling of radiance 1 over a black room: floor and walls, if they were white, would show the form factors.
#[test]
fn form_factors() {
    let materials = "materials.white.lambert.reflectance = 1\nmaterials.black.lambert.reflectance = 0";
    for (side, factor) in [("floor", 0.199825), ("left", 0.200044)] {
        let world = room(materials, |name| match name {
            "ceiling" => "material = \"black\"\nradiance = 1",
            _ if name == side => "material = \"white\"",
            _ => "material = \"black\"",
        });
        let truth = form_factor(&patches(1)[0], &patches(1)[if side == "floor" { 1 } else { 2 }]);
        assert!((truth - factor).abs() < 5e-7);
        mean_of_side(&world, side, Some(1), 200_000).assert(DVec3::splat(truth), 0.003);
    }
}

fn six_patches() -> World {
    room("materials.grey.lambert.reflectance = 0.5", |name| match name {
        // An emission of 1/π has the radiosity 1.
        "ceiling" => "material = \"grey\"\nradiance = 0.31830987",
        _ => "material = \"grey\"",
    })
}

/// The cube whose ceiling emits: with one patch a wall (1.0909, 0.18175, 0.18184) light is spread evenly over a wall at every bounce,
/// which nature does not; with n × n patches the means go to nature's as n⁻², and the tracer has those.
#[test]
fn six_patch_cube() {
    let world = six_patches();
    let [coarse, fine] = [3, 6].map(radiosity);
    for (i, side) in ["floor", "ceiling", "left"].into_iter().enumerate() {
        // [Richardson11]; what is left is less than what the extrapolation adds.
        let (limit, left) = ((4.0 * fine[i] - coarse[i]) / 3.0, (fine[i] - coarse[i]).abs() / 3.0);
        let mean = mean_of_side(&world, side, None, 400_000);
        let [shown, error] = [mean.mean.x * PI, mean.error.x * PI];
        assert!(error < 0.0015 * limit, "{side}: ± {error}");
        assert!((shown - limit).abs() < 4.5 * error + left, "{side}: {shown} ± {error} should be {limit} ± {left}");
    }
}
