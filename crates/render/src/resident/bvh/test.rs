use glam::{Vec3, Vec4, Vec4Swizzles};

use super::*;
use crate::graph::{Shader, shader};
use crate::test::probe::{probe_with, spread};
use crate::test::{gpu, tolerance};

/// Triangles of many sizes, some without area.
fn cloud(count: usize) -> Vec<[Vec3; 3]> {
    let point = |i: usize| Vec3::new(spread(i, 0), spread(i, 1), spread(i, 2));
    let triangle = |i: usize| {
        let size = if i.is_multiple_of(50) { 1.0 } else { 0.3 };
        let (a, b, c) = (point(i), point(3 * i + 7) - 0.5, point(5 * i + 1) - 0.5);
        [a, a + size * b, if i % 97 == 3 { a + 0.5 * size * b } else { a + size * c }]
    };
    (0..count).map(triangle).collect()
}

/// Origins (with how far) and directions in turn; some directions run along axes.
fn rays(count: usize) -> Vec<Vec4> {
    let ray = |i: usize| {
        let origin = 3.0 * Vec3::new(spread(i, 3), spread(i, 4), spread(i, 5)) - 1.0;
        let axis = if i % 8 == 1 { Vec3::new(0.0, 1.0, 0.0) } else { Vec3::ONE };
        let direction = (Vec3::new(spread(7 * i, 0), spread(7 * i, 1), spread(7 * i, 2)) - 0.5) * axis;
        [origin.extend(if i.is_multiple_of(3) { 1.0 } else { 1e30 }), direction.extend(0.0)]
    };
    (0..count).flat_map(ray).collect()
}

/// All triangles, one by one.
fn brute(triangles: &[[Vec3; 3]], origin: Vec3, direction: Vec3, limit: f32) -> Option<Hit> {
    let hits = triangles.iter().enumerate().filter_map(|(i, &t)| Corners::new(t, i as u32).meet(origin, direction));
    hits.filter(|hit| hit.distance < limit).min_by(|a, b| a.distance.total_cmp(&b.distance))
}

fn checked(bvh: &Bvh, triangles: &[[Vec3; 3]]) -> usize {
    let mut hits = 0;
    for ray in rays(2000).chunks(2) {
        let (origin, direction, limit) = (ray[0].truncate(), ray[1].truncate(), ray[0].w);
        let expected = brute(triangles, origin, direction, limit);
        assert_eq!(bvh.closest(origin, direction, limit), expected);
        assert_eq!(bvh.occluded(origin, direction, limit), expected.is_some());
        hits += usize::from(expected.is_some());
    }
    hits
}

#[test]
fn the_walk_finds_what_brute_force_finds() {
    let triangles = cloud(700);
    let mut bvh = Bvh::new(&triangles);
    assert!(bvh.nodes() > 300);
    let hits = checked(&bvh, &triangles);
    assert!((100..900).contains(&hits), "{hits}");
    let moved: Vec<_> = triangles.iter().map(|t| t.map(|p| Vec3::new(p.y, -p.x + 0.3 * p.z, p.z))).collect();
    bvh.refit(&moved);
    checked(&bvh, &moved);
}

/// Nothing, one triangle, many at one place, and corners that are no numbers.
#[test]
fn odd_input() {
    let one = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let (origin, direction) = (Vec3::new(0.2, 0.2, 1.0), -Vec3::Z);
    assert_eq!(Bvh::new(&[]).closest(origin, direction, 9.0), None);
    let broken = [[Vec3::NAN, Vec3::X, Vec3::Y], one, [Vec3::INFINITY, Vec3::X, Vec3::Y]];
    assert_eq!(Bvh::new(&broken).closest(origin, direction, 9.0).unwrap().triangle, 1);
    assert!(Bvh::new(&vec![one; 100]).occluded(origin, direction, 9.0));
    assert!(!Bvh::new(&[one]).occluded(origin, direction, 1.0), "nothing at the limit itself");
}

#[test]
fn the_devices_walk_equals_its_twin() {
    const PROBE: Shader = shader!("test/probes/bvh");
    let Some(gpu) = gpu() else { return };
    let triangles = cloud(700);
    let bvh = Bvh::new(&triangles);
    let nodes = bvh.nodes();
    let source = PROBE.source.replace("override NODES: u32;", &format!("const NODES: u32 = {nodes}u;"));
    let source = source.replace("override VISITS: u32;", &format!("const VISITS: u32 = {nodes}u;"));
    let shader = Shader { name: PROBE.name, source: source.into() };
    let textures = pollster::block_on(bvh.textures(&gpu)).unwrap();
    let also = [("nodes", (&textures[0]).into()), ("corners", (&textures[1]).into())];
    let input = rays(3200);
    let mut disagree = 0;
    for (ray, found) in input.chunks(2).zip(probe_with(&gpu, &shader, &input, &also).chunks(2)) {
        let expected = bvh.closest(ray[0].truncate(), ray[1].truncate(), ray[0].w);
        // Another rounding may miss an edge that is met.
        let same = match expected {
            Some(hit) => found[0].x as i64 == i64::from(hit.triangle) && found[1].x >= 0.0,
            None => found[0].x == -1.0 && found[1].x == -1.0,
        };
        disagree += usize::from(!same);
        if let (Some(hit), true) = (expected, same) {
            let (a, b) = (found[0], Vec4::new(0.0, hit.distance, hit.weights[0], hit.weights[1]));
            // Rays nearly within a triangle's plane lose digits.
            assert!((a - b).yzw().abs().max_element() < tolerance::HIT * (1.0 + hit.distance), "{a} for {b}");
        }
    }
    assert!(disagree <= 2, "{disagree} of 3200");
}
