use super::*;
use crate::Random;

fn point(rng: &mut Random) -> DVec3 {
    DVec3::from_array([0; 3].map(|_| 2.0 * rng.uniform() - 1.0))
}

fn soup(seed: u64, n: usize, size: f64, at: DVec3) -> Vec<Triangle> {
    let mut rng = Random::new(seed, 0, 0);
    let triangle = |_| {
        let center = at + point(&mut rng);
        Triangle([0; 3].map(|_| (center + point(&mut rng) * size).as_vec3().as_dvec3()))
    };
    (0..n).map(triangle).collect()
}

/// The tree finds what a loop over all triangles finds, near the origin and a kilometre away, from within and from afar.
#[test]
fn finds_what_brute_force_finds() {
    for at in [DVec3::ZERO, DVec3::new(1000.0, -3.0, 0.1)] {
        let triangles = soup(1, 300, 0.1, at);
        let bvh = Bvh::new(&triangles);
        let mut met = 0;
        for i in 0..4000 {
            let mut rng = Random::new(2, i, 0);
            let origin = at + point(&mut rng) * if i % 2 == 0 { 1.0 } else { 50.0 };
            let mut direction = (at + point(&mut rng) - origin).normalize();
            if i % 5 == 0 {
                direction = DVec3::AXES[i as usize % 3];
            }
            let all = triangles.iter().enumerate().filter_map(|(i, triangle)| {
                let (distance, ..) = triangle.meet(origin, direction)?;
                (distance > 0.0).then_some((distance, i))
            });
            let truth = all.min_by(|a, b| a.0.total_cmp(&b.0));
            let found = bvh.nearest(origin, direction, f64::INFINITY, |_| true);
            assert_eq!(found.map(|meeting| (meeting.distance, meeting.triangle)), truth);
            assert_eq!(bvh.blocked(origin, direction, f64::INFINITY, |_| true), truth.is_some());
            if let Some((distance, _)) = truth {
                met += 1;
                assert!(
                    !bvh.blocked(origin, direction, distance, |_| true)
                        || bvh.nearest(origin, direction, distance, |_| true).is_some()
                );
                assert!(bvh.nearest(origin, direction, distance, |_| true).is_none());
            }
        }
        assert!(met > 500, "{met}");
    }
}

/// No ray leaves a closed fan through an edge or a corner, though it is aimed at them.
#[test]
fn is_watertight() {
    let mut rng = Random::new(3, 0, 0);
    let rim: Vec<_> = (0..12)
        .map(|i| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / 12.0).sin_cos();
            DVec3::new(cos, sin, 0.2 * rng.uniform()) + DVec3::new(0.1, 0.3, 7.0)
        })
        .collect();
    let hub = DVec3::new(0.13, 0.27, 7.1);
    let fan: Vec<_> = (0..12).map(|i| Triangle([hub, rim[i], rim[(i + 1) % 12]])).collect();
    let bvh = Bvh::new(&fan);
    for i in 0..20_000 {
        let origin = point(&mut rng);
        let spoke = hub.lerp(rim[i % 12], if i % 7 == 0 { 0.0 } else { 0.99 * rng.uniform() });
        assert!(bvh.nearest(origin, (spoke - origin).normalize(), f64::INFINITY, |_| true).is_some());
    }
}

/// What does not exist is passed through.
#[test]
fn passes_through_what_does_not_exist() {
    let square = |z: f64| Triangle([DVec3::new(0.0, 0.0, z), DVec3::new(2.0, 0.0, z), DVec3::new(0.0, 2.0, z)]);
    let bvh = Bvh::new(&[square(1.0), square(3.0)]);
    let (origin, direction) = (DVec3::new(0.5, 0.5, 5.0), DVec3::NEG_Z);
    let second = bvh.nearest(origin, direction, 9.0, |meeting| meeting.triangle == 0).unwrap();
    assert_eq!((second.distance, second.front), (4.0, true));
    assert_eq!(second.weights, [0.5, 0.25, 0.25]);
    let behind = bvh.nearest(DVec3::new(0.5, 0.5, 2.0), DVec3::Z, 9.0, |_| true).unwrap();
    assert_eq!((behind.triangle, behind.front), (1, false));
    assert!(Bvh::new(&[]).nearest(origin, direction, 9.0, |_| true).is_none());
}
