//! Particles: their profile, their files, their source.

use std::time::Instant;

use proptest::prelude::*;

use super::*;
use crate::assets::Embedded;
use crate::description::{BodyFile, Emitter, Transform};
use crate::volume::tests::{BUDGET, apply, damage, damaged_cases};

/// What `fixtures/make.py` made, with NumPy where it has the format.
const FILES: [(&str, &[u8]); 7] = [
    ("ascii.ply", include_bytes!("fixtures/ascii.ply")),
    ("little.ply", include_bytes!("fixtures/little.ply")),
    ("big.ply", include_bytes!("fixtures/big.ply")),
    ("stored.npz", include_bytes!("fixtures/stored.npz")),
    ("deflated.npz", include_bytes!("fixtures/deflated.npz")),
    ("table.npy", include_bytes!("fixtures/table.npy")),
    ("table.csv", include_bytes!("fixtures/table.csv")),
];

fn read(file: &str, bytes: &[u8], given: &BodyFile) -> Result<Particles, String> {
    read_particles(file, given, &Embedded(vec![(file, bytes)]), BUDGET).map_err(|error| error.to_string())
}

fn plain(file: &str, text: &str) -> Result<Particles, String> {
    read(file, text.as_bytes(), &BodyFile::default())
}

/// What holds of all particles.
fn assert_valid(particles: &Particles) {
    particles.list().iter().enumerate().for_each(|(i, particle)| particle.check(i).unwrap());
}

/// The depth along a ray is the density's integral (Simpson's rule), and the profile's share of that through the centre.
#[test]
fn the_profile_is_the_integral_of_the_density() {
    let particle =
        Particle { position: Vec3::new(1.0, 2.0, 3.0), radius: 0.3, color: Vec3::ONE, depth: optical_depth(0.7) };
    let center = particle.position.as_dvec3();
    for impact in [0.0f32, 0.2, 0.5, 0.9, 1.0, 1.3] {
        let n = 2000;
        let step = 0.8 / f64::from(n);
        let at =
            |i: i32| particle.density(center + DVec3::new(0.3 * f64::from(impact), f64::from(i) * step - 0.4, 0.0));
        let sum: f64 = (0..=n).map(|i| at(i) * [2.0, 4.0][i as usize % 2]).sum::<f64>() - at(0) - at(n);
        let expected = f64::from(particle.depth * Particle::profile(impact));
        assert!((sum * step / 3.0 - expected).abs() < 1e-6, "{impact}: {} is not {expected}", sum * step / 3.0);
    }
}

#[test]
fn opacities_are_capped() {
    assert_eq!(optical_depth(0.0), 0.0);
    assert_eq!(optical_depth(1.0), MAX_DEPTH);
    assert!((optical_depth(0.5) - 2f32.ln()).abs() < 1e-7);
    assert!((optical_depth(1e-6) - 1e-6).abs() < 1e-11, "without cancellation");
}

#[test]
fn every_format_has_the_same_particles() {
    for (file, bytes) in FILES {
        let particles = read(file, bytes, &BodyFile::default()).unwrap_or_else(|error| panic!("{file}: {error}"));
        assert_valid(&particles);
        let expected = [
            ([0.25, -1.5, 2.0], 0.5, 0.5, [1.0, 0.0, 0.2]),
            ([1.0, 0.0, -0.75], 0.25, 0.25, [0.4, 0.8, 1.0]),
            ([-2.0, 3.0, 0.5], 1.0, 1.0, [0.0; 3]),
        ];
        assert_eq!(particles.list().len(), 3, "{file}");
        for (particle, (position, radius, opacity, color)) in particles.list().iter().zip(expected) {
            assert_eq!(particle.position, Vec3::from(position), "{file}");
            assert_eq!((particle.radius, particle.depth), (radius, optical_depth(opacity)), "{file}");
            assert!(particle.color.abs_diff_eq(color.into(), 1e-6), "{file}: {}", particle.color);
        }
        assert_eq!(particles.bounds(), Some([Vec3::new(-3.0, -2.0, -1.0), Vec3::new(1.25, 4.0, 2.5)]));
    }
}

#[test]
fn the_scene_stands_for_the_file() {
    let given =
        BodyFile { radius: Some(0.125), opacity: Some(0.75), color: Some(Vec3::splat(0.5)), ..BodyFile::default() };
    for (file, bytes) in FILES {
        for particle in read(file, bytes, &given).unwrap().list() {
            assert_eq!((particle.radius, particle.color), (0.125, Vec3::splat(0.5)));
            assert_eq!(particle.depth, optical_depth(0.75));
        }
    }
    let bare = read("a.csv", b"x,y,z\n1,2,3\n", &given).unwrap();
    assert_eq!(bare.list()[0].position, Vec3::new(1.0, 2.0, 3.0));
    assert_eq!(plain("a.csv", "x,y,z,radius,opacity\n1,2,3,1,0.5\n").unwrap().list()[0].color, Vec3::ONE);
    assert_eq!(plain("a.csv", "x,y,z,radius,opacity\n").unwrap().bounds(), None);
}

#[test]
fn refusals_say_what_is_accepted() {
    let csv = |text: &str| plain("a.csv", text).unwrap_err();
    for (text, message) in [
        ("", "not a CSV file: it begins with \"\"; accepted: a line that names the columns"),
        (
            "x,y,z,radius,opacity\n1,2,3,-1,0.5\n",
            "the file is corrupt: the radius of particle 0 is -1.0; accepted: 1e-7 to 1e6 m",
        ),
        (
            "x,y,z,radius,opacity\n1,2,nan,1,0.5",
            "the file is corrupt: the position of particle 0 is [1.0, 2.0, NaN]; accepted: at most 1e9 m from the origin",
        ),
        (
            "x,y,z,radius,opacity\n1,2,3,1,1.5",
            "the file is corrupt: the opacity of particle 0 is 1.5; accepted: 0 to 1",
        ),
        ("x,y,z,radius,opacity\n1,2,3,1", "the file is corrupt: line 2 has fewer than 5 fields"),
        ("x,y,z,radius,opacity\n1,2,3,1,0.5,6", "the file is corrupt: line 2 has more than 5 fields"),
        (
            "x,y,z,radius,opacity\n1,2,3,wide,0.5",
            "the file is corrupt: line 2: radius is \"wide\"; it must be a number",
        ),
        ("x,x,y,z,radius,opacity\n", "the file is corrupt: two of its columns are \"x\""),
    ] {
        assert_eq!(csv(text), message);
    }
    let color = csv("x,y,z,radius,opacity,red,green,blue\n1,2,3,1,0.5,255,0,0");
    assert!(color.contains("the colour of particle 0 is [255.0, 0.0, 0.0]"), "{color}");
    let missing = csv("x,y,radius,red\n");
    assert!(
        missing.starts_with("unsupported: particles without z, opacity, green, blue; accepted: x, y, z"),
        "{missing}"
    );
    assert!(plain("a.xyz", "").unwrap_err().ends_with("accepted: .ply, .npz, .npy, .csv"));

    let ply = |lines: &str| plain("a.ply", &format!("ply\n{lines}\nend_header\n")).unwrap_err();
    let vertex = "element vertex 4000000000\nproperty float x\nproperty float y\nproperty float z";
    assert!(ply(vertex).starts_with("unsupported: a header without `format`"));
    assert!(ply("format ascii 1.0").starts_with("unsupported: a header without `element vertex`"));
    assert!(ply("format ascii 2.0").starts_with("unsupported: \"format ascii 2.0\" in the header"));
    // Nothing is allocated for what a header claims.
    assert!(ply(&format!("format binary_little_endian 1.0\n{vertex}")).contains("within the vertices"));
    assert!(ply(&format!("format ascii 1.0\n{vertex}")).contains("within the vertices"));
    assert!(ply("format ascii 1.0\nelement vertex 4000000000").starts_with("unsupported: particles without x, y, z"));
    let list = "format ascii 1.0\nelement face 1\nproperty list uchar int v\n";
    assert!(ply(&format!("{list}{vertex}")).starts_with("unsupported: \"element vertex"));
}

#[test]
fn the_budget_is_held() {
    for (file, bytes) in FILES {
        let given = BodyFile::default();
        let assets = Embedded(vec![(file, bytes)]);
        // What is unpacked counts, too.
        let enough = Budget(3 * Particles::BYTES + 2000);
        assert!(read_particles(file, &given, &assets, enough).is_ok(), "{file}");
        let error = read_particles(file, &given, &assets, Budget(bytes.len() as u64)).map(drop);
        let little = Particles::BYTES * 3 > bytes.len() as u64;
        assert!(!little || error.unwrap_err().to_string().contains("the budget is"), "{file}");
    }
}

#[test]
fn every_truncation_is_an_error() {
    for (file, bytes) in FILES {
        let text = file.starts_with("ascii") || file.ends_with("csv");
        // What follows the vertices is not read; nor does the last number of a text that is cut short cease to be one.
        let needed = bytes.len() - if file.ends_with("ply") { 14 } else { 0 } - if text { 4 } else { 0 };
        for cut in 0..needed {
            let whole = text && read(file, &bytes[..cut], &BodyFile::default()).is_ok();
            // A table of text may end after any line.
            assert!(
                !whole || file.ends_with("csv") && bytes[..cut].trim_ascii_end().len() <= cut,
                "{file} cut at {cut}"
            );
            assert!(text || read(file, &bytes[..cut], &BodyFile::default()).is_err(), "{file} cut at {cut}");
        }
    }
}

proptest! {
    #![proptest_config(damaged_cases())]

    #[test]
    fn damaged_files_give_errors_or_particles(which in 0..FILES.len(), damage in damage()) {
        let mut bytes = FILES[which].1.to_vec();
        apply(&mut bytes, &damage);
        let start = Instant::now();
        match read(FILES[which].0, &bytes, &BodyFile::default()) {
            Ok(particles) => assert_valid(&particles),
            Err(error) => prop_assert!(error.len() < 500, "{error}"),
        }
        prop_assert!(start.elapsed().as_secs_f32() < 1.0, "took {:?}", start.elapsed());
    }
}

/// The sum over the balls that overlap at a point, and the mean of their colours.
#[test]
fn overlapping_particles_add() {
    let ball = |x: f32, color| Particle { position: Vec3::X * x, radius: 1.0, color, depth: 1.0 };
    let particles = Particles::new(vec![ball(0.0, Vec3::X), ball(0.5, Vec3::Y), ball(5.0, Vec3::Z)]).unwrap();
    let here = particles.at(DVec3::ZERO);
    let [a, b] = [1.0, 0.75 * 0.75].map(|share| 15.0 / 16.0 * share);
    assert!((here.density - a - b).abs() < 1e-12);
    assert!(here.color.abs_diff_eq(DVec3::new(a, b, 0.0) / (a + b), 1e-12));
    assert_eq!(particles.at(DVec3::Y * 3.0), Here { density: 0.0, color: DVec3::ONE });
    assert_eq!(Particles::default().at(DVec3::ZERO).density, 0.0);
}

#[test]
fn a_transform_moves_and_scales() {
    let particles = Particles::new(vec![Particle { position: Vec3::X, radius: 0.5, color: Vec3::ONE, depth: 2.0 }]);
    let transform = Transform { scale: Vec3::splat(2.0), rotate: Vec3::Z * 90.0, translate: Vec3::Z };
    let moved = particles.unwrap().moved(&transform).unwrap();
    assert!(moved.list()[0].position.abs_diff_eq(Vec3::new(0.0, 2.0, 1.0), 1e-6));
    assert_eq!((moved.list()[0].radius, moved.list()[0].depth), (1.0, 2.0));
    assert_eq!(moved.packed(), vec![[moved.list()[0].position.extend(1.0), Vec4::new(1.0, 1.0, 1.0, 2.0)]]);
    assert!(moved.moved(&Transform { scale: Vec3::splat(1e9), ..Transform::default() }).is_err());
}

fn emitter() -> Emitter {
    let emitter: Emitter = serde_json::from_str("{}").unwrap();
    Emitter { number: 300, ..emitter }
}

fn emitted(emitter: &Emitter) -> Vec<Particle> {
    Emission::new(emitter, BUDGET).unwrap().at(emitter.time.into()).unwrap().list().to_vec()
}

#[test]
fn a_plume_depends_on_its_numbers_alone() {
    let emitter = emitter();
    let plume = emitted(&Emitter { time: 5.0, ..emitter.clone() });
    assert_eq!(plume.len(), 300);
    assert_eq!(plume, emitted(&Emitter { time: 5.0, ..emitter.clone() }));
    assert_ne!(plume, emitted(&Emitter { time: 5.0, seed: 1, ..emitter.clone() }));
    // Pictures before it, in and out of order, change nothing.
    let mut emission = Emission::new(&emitter, BUDGET).unwrap();
    for time in [0.0, 0.015, 3.001, 4.99, 7.001, 2.001, 20.001, 5.0] {
        let count = emission.at(time).unwrap().list().len();
        assert_eq!(count, ((time / 4.0 * 300.0) as usize + 1).min(300), "at {time} s");
    }
    assert_eq!(plume, emission.at(5.0).unwrap().list());
}

/// A picture later, every particle has moved on by about its velocity times the time, but for one that died and one that was
/// born; both are as good as invisible.
#[test]
fn nothing_pops() {
    let emitter = Emitter { frame_rate: 30.0, number: 240, turbulence: 0.3, ..emitter() };
    let mut emission = Emission::new(&emitter, BUDGET).unwrap();
    let before = emission.at(6.0).unwrap().list().to_vec();
    let after = emission.at(6.0 + 1.0 / 60.0).unwrap().list().to_vec();
    for (a, b) in before[1..].iter().zip(&after) {
        assert!(a.position.distance(b.position) < 4.0 / 60.0, "{a:?} {b:?}");
        assert!((a.depth - b.depth).abs() < 0.1 && (a.radius - b.radius).abs() < 0.01);
    }
    assert!(before[0].depth < 0.01 && after.last().unwrap().depth < 0.01);
    let [low, high] = emission.at(6.0).unwrap().bounds().unwrap();
    assert!(low.y < 0.0 && high.y > 3.0 && high.y < 7.0, "a plume of 4 s at 1 m/s reaches from {low} to {high}");
}

/// Twice as many steps give the same way within a part that falls by four.
#[test]
fn steps_converge() {
    let plume = |frame_rate| emitted(&Emitter { frame_rate, number: 100, turbulence: 0.3, octaves: 1, ..emitter() });
    let error = |a: Vec<Particle>, b: Vec<Particle>| {
        // Of the young: old ones have forgotten where they came from.
        a.iter().zip(&b).rev().take(50).map(|(a, b)| a.position.distance(b.position)).sum::<f32>()
    };
    let [coarse, fine] = [(15.0, 30.0), (30.0, 60.0)].map(|(a, b)| error(plume(a), plume(b)));
    assert!(fine < 0.4 * coarse, "{fine} of {coarse}");
}
