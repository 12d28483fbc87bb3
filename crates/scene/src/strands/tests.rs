//! Strands: cylinders, files, heads of hair.

use proptest::prelude::*;

use super::*;
use crate::assets::Embedded;
use crate::description::{BodyFile, Head};
use crate::particles::optical_depth;
use crate::volume::Budget;
use crate::volume::tests::{BUDGET, apply, damage, damaged_cases};

/// What `particles/fixtures/make.py` made.
const FILES: [(&str, &[u8]); 2] = [
    ("strands.hair", include_bytes!("../particles/fixtures/strands.hair")),
    ("strands.txt", include_bytes!("../particles/fixtures/strands.txt")),
];

fn read(file: &str, bytes: &[u8], given: &BodyFile) -> Result<Strands, String> {
    read_strands(file, given, &Embedded(vec![(file, bytes)]), BUDGET).map_err(|error| error.to_string())
}

fn assert_valid(strands: &Strands) {
    strands.knots().iter().enumerate().for_each(|(i, knot)| knot.check(i).unwrap());
    assert_eq!(strands.strands().map(<[Knot]>::len).sum::<usize>(), strands.knots().len());
    assert_eq!(strands.count() + strands.strands().len(), strands.knots().len());
}

#[test]
fn both_formats_have_the_same_strands() {
    for (file, bytes) in FILES {
        let strands = read(file, bytes, &BodyFile::default()).unwrap_or_else(|error| panic!("{file}: {error}"));
        assert_valid(&strands);
        assert_eq!(strands.strands().map(<[Knot]>::len).collect::<Vec<_>>(), [3, 2], "{file}");
        let color = Vec3::new(0.5, 0.25, 1.0);
        let knot = |[x, y, z]: [f32; 3], radius, opacity| Knot {
            position: Vec3::new(x, y, z),
            radius,
            color,
            depth: optical_depth(opacity),
        };
        let expected = [
            knot([0.0, 0.0, 0.0], 0.125, 0.5),
            knot([0.0, 0.5, 0.0], 0.0625, 0.5),
            knot([0.25, 1.0, 0.0], 0.03125, 0.25),
            knot([1.0, 0.0, 0.0], 0.25, 1.0),
            knot([1.0, 1.0, 0.5], 0.125, 0.0),
        ];
        for (knot, expected) in strands.knots().iter().zip(expected) {
            // A logarithm that the compiler takes may differ in the last place.
            assert!((knot.depth - expected.depth).abs() < 1e-6, "{file}: {knot:?}");
            assert_eq!(Knot { depth: expected.depth, ..*knot }, expected, "{file}");
        }
        let second = strands.segment(1);
        assert_eq!((second.ends, second.radius), ([expected[1].position, expected[2].position], 0.046875));
        assert_eq!(strands.segment(2).ends[0], expected[3].position, "no segment joins two strands");
    }
}

#[test]
fn a_point_is_within_a_cylinder_or_not() {
    for (file, bytes) in FILES {
        let given = BodyFile { radius: Some(0.1), opacity: Some(0.5), ..BodyFile::default() };
        let strands = read(file, bytes, &given).unwrap();
        let density = 2f64.ln() / 0.2;
        let at = |x, y, z| strands.at(DVec3::new(x, y, z)).density;
        assert!((at(0.05, 0.25, 0.08) - density).abs() < 1e-6);
        assert_eq!((at(0.08, 0.25, 0.08), at(0.0, -0.01, 0.0)), (0.0, 0.0), "beside it, and before its flat end");
        // Inside the bend both are there.
        assert!((at(0.05, 0.49, 0.0) - 2.0 * density).abs() < 1e-6);
    }
}

#[test]
fn every_truncation_is_an_error() {
    let (_, bytes) = FILES[0];
    for cut in 0..bytes.len() {
        assert!(read("a.hair", &bytes[..cut], &BodyFile::default()).is_err(), "cut at {cut}");
    }
    let (_, text) = FILES[1];
    for cut in 0..text.len() {
        // A text may end after most numbers; it may not hold another strand.
        if let Ok(strands) = read("a.txt", &text[..cut], &BodyFile::default()) {
            assert_valid(&strands);
        }
    }
}

#[test]
fn refusals_say_what_is_accepted() {
    let text = |text: &str| read("a.txt", text.as_bytes(), &BodyFile::default()).unwrap_err();
    let accepted = "accepted: x y z, then radius, opacity, and red green blue where the scene does not give them";
    for (line, found) in [
        ("0 0 0", "3 numbers"),
        ("0 0 0 1 0.5 1", "6 numbers"),
        ("1 2 3 4 5 6 7 8 9", "more than 8 numbers"),
        ("0 0 zero", "\"zero\""),
    ] {
        assert_eq!(text(line), format!("the file is corrupt: line 1 has {found}; {accepted}"));
    }
    assert!(text("0 0 0 1 0.5\n").contains("strand 0 has 1 points; accepted: 2 or more"));
    assert!(text("0 0 0 -1 0.5\n").contains("the radius of point 0 of the strands is -1.0; accepted: 1e-7 to 1e6 m"));
    assert!(text("0 0 nan 1 0.5\n").contains("accepted: at most 1e9 m from the origin"));
    assert!(text("0 0 0 1 2\n").contains("the opacity of point 0 of the strands is 2.0; accepted: 0 to 1"));
    assert!(read("a.obj", b"", &BodyFile::default()).unwrap_err().ends_with("accepted: .hair, .txt"));
    // A header that claims four thousand million points.
    let mut bytes = FILES[0].1.to_vec();
    bytes[8..12].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(read("a.hair", &bytes, &BodyFile::default()).unwrap_err().contains("within the strands"));
    let mut bytes = FILES[0].1.to_vec();
    bytes[12] = 2;
    assert!(read("a.hair", &bytes, &BodyFile::default()).unwrap_err().contains("2 strands of 0 segments"));
    let assets = Embedded(FILES.to_vec());
    let error = read_strands("strands.hair", &BodyFile::default(), &assets, Budget(240)).unwrap_err().to_string();
    assert!(error.ends_with("the budget is 240"), "{error}");
}

proptest! {
    #![proptest_config(damaged_cases())]

    #[test]
    fn damaged_files_give_errors_or_strands(which in 0..FILES.len(), damage in damage()) {
        let mut bytes = FILES[which].1.to_vec();
        apply(&mut bytes, &damage);
        match read(FILES[which].0, &bytes, &BodyFile::default()) {
            Ok(strands) => assert_valid(&strands),
            Err(error) => prop_assert!(error.len() < 500, "{error}"),
        }
    }
}

fn head() -> Head {
    let head: Head = serde_json::from_str("{}").unwrap();
    Head { number: 200, ..head }
}

#[test]
fn hair_grows_out_of_the_scalp_and_falls() {
    let head = head();
    let hair = grow(&head, BUDGET).unwrap();
    assert_valid(&hair);
    assert_eq!((hair.strands().len(), hair.count()), (200, 200 * 24));
    for strand in hair.strands() {
        let [root, tip] = [strand[0], strand[24]];
        assert!((root.position.length() - 0.1).abs() < 1e-6 && root.position.y > -0.02);
        assert!(strand.iter().skip(1).all(|knot| knot.position.length() > 0.0999), "no hair grows into the head");
        assert!(tip.position.y < root.position.y + 0.05, "{tip:?}");
        assert_eq!((root.radius, tip.radius), (40e-6, 20e-6));
        let length: f32 = strand.windows(2).map(|ends| ends[0].position.distance(ends[1].position)).sum();
        assert!((0.15..0.31).contains(&length), "{length}");
    }
    assert_eq!(hair.knots(), grow(&head, BUDGET).unwrap().knots());
    assert_ne!(hair.knots(), grow(&Head { seed: 1, ..head.clone() }, BUDGET).unwrap().knots());
    assert!(matches!(grow(&Head { number: 1 << 24, ..head }, BUDGET), Err(VolumeError::TooMany { .. })));
}

#[test]
fn curls_are_wide_and_clumps_meet() {
    let straight = grow(&head(), BUDGET).unwrap();
    let curly = grow(&Head { curl: 0.01, ..head() }, BUDGET).unwrap();
    for (a, b) in straight.strands().zip(curly.strands()) {
        let off = |i: usize| a[i].position.distance(b[i].position);
        assert!(off(0) < 1e-6 && (off(12) - 0.005).abs() < 1e-5 && (off(24) - 0.01).abs() < 1e-5);
    }
    let clumped = grow(&Head { clumps: 5, clumping: 1.0, ..head() }, BUDGET).unwrap();
    let mut tips: Vec<_> = clumped.strands().map(|strand| (strand[24].position * 1e4).round().as_ivec3()).collect();
    tips.sort_by_key(|tip| tip.to_array());
    tips.dedup();
    assert!(tips.len() <= 5, "{} tips", tips.len());
}
