//! Spheres and noise: values, bounds, edge cases.

use proptest::prelude::*;
use tyndall_scene::Field;
use tyndall_scene::assets::Embedded;
use tyndall_scene::field::{Fractal, MAX_COORDINATE, Noise, Sphere, gradient_noise, pcg3d};
use tyndall_scene::glam::{UVec3, Vec3, Vec3Swizzles as _};
use tyndall_scene::volume::Budget;
use tyndall_scene::{Document, Volume, World};

use crate::CAMERA;

fn volume(density: &str) -> Volume {
    let text = format!("{CAMERA}[media.a]\noptics.coefficients = {{}}\ndensity.{density}");
    let scene = Document::new("s.toml", text).parse().unwrap_or_else(|error| panic!("{error}"));
    World::load(scene, &Embedded::default(), Budget(0)).unwrap().volumes.remove(0)
}

/// The density at a point of the world [m].
fn at(volume: &Volume, point: Vec3) -> f32 {
    volume.field.value(volume.unit_from_world.transform_point3(point))
}

#[test]
fn a_sphere_is_where_it_should_be() {
    let center = Vec3::new(1.0, -2.0, 0.5);
    let soft = volume("sphere = { center = [1, -2, 0.5], radius = 2, falloff = 0.5 }");
    let hard = volume("sphere = { center = [1, -2, 0.5], radius = 2 }");
    let whole = volume("sphere = { center = [1, -2, 0.5], radius = 2, falloff = 2 }");
    let direction = Vec3::new(0.6, 0.0, -0.8);
    let ramp = |t: f32| t * t * (3.0 - 2.0 * t);
    for (distance, expected) in [
        (0.0, [1.0, 1.0, 1.0]),
        (1.0, [1.0, 1.0, 0.5]),
        (1.49, [1.0, 1.0, ramp(0.255)]),
        (1.75, [0.5, 1.0, ramp(0.125)]),
        (1.875, [ramp(0.25), 1.0, ramp(0.0625)]),
        (1.9999, [0.0, 1.0, 0.0]),
        (2.0001, [0.0, 0.0, 0.0]),
        (5.0, [0.0, 0.0, 0.0]),
    ] {
        let point = center + distance * direction;
        let found = [at(&soft, point), at(&hard, point), at(&whole, point)];
        assert!(found.iter().zip(expected).all(|(f, e)| (f - e).abs() < 1e-5), "{distance}: {found:?}, {expected:?}");
    }
    // The box is the ball's: its faces touch the surface.
    let corner = soft.world_from_unit.transform_point3(Vec3::ZERO);
    assert!(corner.abs_diff_eq(center - 2.0, 1e-6), "{corner}");
    assert_eq!(hard.field.value(Vec3::new(0.5, 0.0, 0.5)), 1.0, "the surface belongs to it");
    assert_eq!(hard.field.value(Vec3::ZERO), 0.0);
}

#[test]
fn hashes_are_those_of_the_paper() {
    // Computed from the listing in Python, where integers do not wrap by themselves.
    for (v, expected) in HASHES {
        assert_eq!(pcg3d(UVec3::from(v)), UVec3::from(expected));
    }
}

const HASHES: [([u32; 3], [u32; 3]); 3] = [
    ([0, 0, 0], [2611992518, 2833812075, 1058359340]),
    ([1, 2, 3], [4204755366, 1223881804, 1500469937]),
    ([4294967295, 2147483648, 7], [2845072970, 4054249933, 1255343331]),
];

#[test]
fn noise_is_0_at_lattice_points_and_continuous_across_them() {
    let key = UVec3::new(7, 8, 9);
    for i in -3..3 {
        for point in [Vec3::new(i as f32, 2.0, -1.0), Vec3::new(0.0, i as f32 * 1000.0, 5.0)] {
            assert_eq!(gradient_noise(point, key), 0.0);
            let near = |d: f32| gradient_noise(point + Vec3::new(d, 0.3, 0.7), key);
            assert!((near(-1e-4) - near(1e-4)).abs() < 1e-3, "{point}");
        }
    }
    // Other keys, other places, other noise; no mirror image at negative places.
    let x = Vec3::new(0.3, 0.6, 0.2);
    let values = [
        gradient_noise(x, key),
        gradient_noise(x, UVec3::ZERO),
        gradient_noise(-x, key),
        gradient_noise(x + 1.0, key),
        gradient_noise(x - 1.0, key),
        gradient_noise(x.zxy(), key),
    ];
    for (i, a) in values.iter().enumerate() {
        assert!(values[..i].iter().all(|b| (a - b).abs() > 1e-4), "{values:?}");
    }
}

/// Places that no lattice has: a number where there is one, never a panic.
#[test]
fn noise_at_the_end_of_numbers() {
    for x in [MAX_COORDINATE, 1e9, -1e9, 2147483648.0, -2147483648.0, 1e30, f32::MAX, f32::MIN] {
        for key in [UVec3::ZERO, UVec3::MAX] {
            let value = gradient_noise(Vec3::new(x, 0.5, -x), key);
            assert!(value.abs() <= 1.5, "{value} at {x}");
        }
    }
    assert!(gradient_noise(Vec3::NAN, UVec3::ZERO).is_nan());
    assert!(gradient_noise(Vec3::splat(f32::INFINITY), UVec3::ZERO).is_nan());
}

/// Mean 0 and the standard deviation that `docs/fields.md` states; nearly half of it is negative.
#[test]
fn noise_is_balanced() {
    let n = 200_000;
    let values = (0..n).map(|i| {
        let x = (pcg3d(UVec3::new(i, 1, 2)) >> 8u32).as_vec3() / 16777216.0;
        f64::from(gradient_noise(1000.0 * x - 500.0, UVec3::ZERO))
    });
    let (sum, squares, negative) =
        values.fold((0.0, 0.0, 0), |(s, q, n), v| (s + v, q + v * v, n + u32::from(v < 0.0)));
    let (mean, deviation) = (sum / f64::from(n), (squares / f64::from(n)).sqrt());
    assert!(mean.abs() < 0.003, "{mean}");
    assert!((deviation - 0.191).abs() < 0.003, "{deviation}");
    assert!((f64::from(negative) / f64::from(n) - 0.5).abs() < 0.01, "{negative}");
}

#[test]
fn noise_is_a_sum_above_a_threshold() {
    let text = |more: &str| format!("noise = {{ min = [-1, 0, 2], max = [1, 4, 3], scale = 0.5, {more} }}");
    let volume = volume(&text("octaves = 3, gain = 0.6, lacunarity = 2.5, threshold = 0.1, seed = 9"));
    let mut filled = 0;
    for i in 0..1000 {
        let unit = (pcg3d(UVec3::new(i, 0, 0)) >> 8u32).as_vec3() / 16777216.0;
        let p = Vec3::new(-1.0, 0.0, 2.0) + unit * Vec3::new(2.0, 4.0, 1.0);
        let mut sum = 0.0;
        for k in 0..3 {
            let key = pcg3d(UVec3::new(9, k, 0));
            let shift = (key >> 8u32).as_vec3() / 16777216.0;
            sum += 0.6f32.powi(k as i32) * gradient_noise(p / 0.5 * 2.5f32.powi(k as i32) + shift, key);
        }
        let (found, expected) = (at(&volume, p), (sum - 0.1).max(0.0));
        assert!((found - expected).abs() < 1e-4, "{found} for {expected} at {p}");
        filled += i32::from(found > 0.0);
    }
    assert!((200..500).contains(&filled), "{filled}");
    let Field::Noise(noise) = volume.field else { panic!() };
    let Field::Noise(other) = self::volume(&text("octaves = 3, gain = 0.6, lacunarity = 2.5, seed = 10")).field else {
        panic!()
    };
    assert_ne!(noise.fractal.value(Vec3::splat(0.3)), other.fractal.value(Vec3::splat(0.3)));
}

fn vector(range: std::ops::Range<f32>) -> impl Strategy<Value = Vec3> {
    [range.clone(), range.clone(), range].prop_map(Vec3::from)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]

    /// In a box, a field is within the bounds it states; the bounds of a small box are not far from its values.
    #[test]
    fn bounds_hold(
        low in vector(0.0..1.0),
        size in prop_oneof![Just(1.0f32), Just(0.1), Just(0.01), Just(0.001)],
        inside in prop::collection::vec(vector(0.0..1.0), 20),
        falloff in prop_oneof![Just(0.0f32), 0.0f32..=1.0],
        octaves in 1u32..=12,
        gain in 0.0f32..=1.0,
        seed in any::<u32>(),
        origin in vector(-100.0..100.0),
        scale in 0.1f32..20.0,
        threshold in -1.0f32..1.0,
    ) {
        let high = (low + size).min(Vec3::ONE);
        let fractal = Fractal { octaves, gain, lacunarity: 2.0, seed };
        let noise = Noise { fractal, threshold, origin, extent: Vec3::splat(scale) };
        let sphere = Sphere { falloff };
        for unit in inside {
            let unit = (low + unit * (high - low)).clamp(low, high);
            for (value, [least, most]) in
                [(sphere.value(unit), sphere.range(low, high)), (noise.value(unit), noise.range(low, high))]
            {
                prop_assert!(least <= value && value <= most, "{value} is not in [{least}, {most}]");
            }
        }
        let amplitudes: f32 = (0..octaves).map(|k| gain.powi(k as i32)).sum();
        let most = noise.range(Vec3::ZERO, Vec3::ONE)[1];
        prop_assert!(most <= (1.5 * amplitudes * 1.00001 - threshold).max(0.0));
        let coarse = Noise { fractal: Fractal { octaves: 1, ..fractal }, threshold: -2.0, ..noise };
        let [least, most] = coarse.range(low, low + 0.001);
        prop_assert!(most - least < 0.03 * scale, "{least} to {most}");
    }
}
