use proptest::prelude::*;

use super::*;
use crate::surface::TriangleMesh;
use crate::surface::tests::{area, assert_valid, read, read_within, survive, warnings};
use crate::volume::tests::{apply, damage, damaged_cases};

const HEADER: &str = "element vertex 5
property float x
property double y
property float32 z
property uchar red
property uchar green
property uchar blue
element edge 1
property short a
property list uchar int b
element face 2
property list uchar int vertex_indices
property float quality
end_header
";
/// A unit square and a triangle on it, coloured.
const VERTICES: [([f64; 3], [u8; 3]); 5] = [
    ([0.0, 0.0, 0.0], [255, 0, 0]),
    ([1.0, 0.0, 0.0], [0, 255, 0]),
    ([1.0, 1.0, 0.0], [0, 0, 255]),
    ([0.0, 1.0, 0.0], [188, 188, 188]),
    ([0.0, 0.0, 1.0], [255, 255, 255]),
];
const FACES: [&[i32]; 2] = [&[0, 1, 2, 3], &[0, 1, 4]];

fn text() -> Vec<u8> {
    let mut text = format!("ply\nformat ascii 1.0\ncomment made here\n{HEADER}");
    for ([x, y, z], [r, g, b]) in VERTICES {
        text += &format!("{x} {y} {z} {r} {g} {b}\n");
    }
    text += "7 2 1 2\n";
    for face in FACES {
        let corners: Vec<_> = face.iter().map(i32::to_string).collect();
        text += &format!("{} {} 0.5\n", face.len(), corners.join(" "));
    }
    text.into_bytes()
}

fn binary(big: bool) -> Vec<u8> {
    let format = if big { "binary_big_endian" } else { "binary_little_endian" };
    let mut bytes = format!("ply\r\nformat {format} 1.0\n{HEADER}").into_bytes();
    macro_rules! put {
        ($($value:expr),*) => { $(bytes.extend(if big { $value.to_be_bytes() } else { $value.to_le_bytes() });)* };
    }
    for ([x, y, z], [r, g, b]) in VERTICES {
        put!(x as f32, y, z as f32, r, g, b);
    }
    put!(7i16, 2u8, 1i32, 2i32);
    for face in FACES {
        put!(face.len() as u8);
        for corner in face {
            put!(corner);
        }
        put!(0.5f32);
    }
    bytes
}

fn mesh(bytes: &[u8]) -> TriangleMesh {
    let mut model = read(&[("s.ply", bytes)], "s.ply").unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(model.parts.len(), 1);
    (*model.parts.remove(0).mesh).clone()
}

#[test]
fn the_same_in_every_encoding() {
    let first = mesh(&text());
    assert_valid(&first);
    assert_eq!((first.triangles.len(), area(&first)), (3, 1.5));
    assert_eq!(first.positions[2], Vec3::new(1.0, 1.0, 0.0));
    assert_eq!(first.colors[0], Vec4::new(1.0, 0.0, 0.0, 1.0));
    assert!((first.colors[3].x - 0.5).abs() < 0.005, "bytes are sRGB");
    assert_eq!(mesh(&binary(false)), first);
    assert_eq!(mesh(&binary(true)), first);
}

fn message(from: &str, to: &str) -> String {
    let text = String::from_utf8(text()).unwrap();
    assert!(text.contains(from), "{from}");
    let edited = text.replacen(from, to, 1);
    match read(&[("s.ply", edited.as_bytes())], "s.ply") {
        Ok(_) => "accepted".into(),
        Err(error) => error.to_string(),
    }
}

#[test]
fn messages() {
    for (from, to, expected) in [
        ("ply\n", "plyx\n", "it does not begin with a line \"ply\""),
        ("ascii", "utf8", "its header has \"format utf8 1.0\""),
        ("format ascii 1.0\n", "", "its header has no format"),
        ("property float x", "property float w", "vertices have no property \"x\""),
        ("property float x", "property list int float x", "the property \"x\" of vertices is a list"),
        ("double y", "quad y", "its header has \"property quad y\""),
        ("end_header\n", "", "its header has \"0 0 0 255 0 0\""),
        ("vertex 5", "vertex 4000000000", "4000000000 elements \"vertex\" in 437 bytes"),
        ("4 0 1 2 3", "4 0 1 2 5", "face 0 has the corner 5, of 5 vertices before it"),
        ("4 0 1 2 3", "4 0 1 2 -1", "face 0 has the corner -1, of 5 vertices before it"),
        ("4 0 1 2 3", "4 0 1 2 1.5", "face 0 has the corner 1.5, of 5 vertices before it"),
        ("4 0 1 2 3", "4000 0 1 2 3", "a list of 4000 values in 28 bytes"),
        ("3 0 1 4 0.5", "3 0 1 4", "it ends within its elements"),
        ("0 1 2 3 0.5", "0 1 2 3 half", "\"half\" is no number"),
    ] {
        assert_eq!(message(from, to), format!("the file is corrupt: {expected}"), "{to}");
    }
    assert_eq!(message("element face 2", "element tristrips 2"), "unsupported: strips of triangles; accepted: faces");
    // Elements without properties are passed over, however many there are.
    assert_eq!(message("element edge 1\n", "element nothing 18446744073709551615\nelement edge 1\n"), "accepted");
    let error = read_within(&[("s.ply", &text())], "s.ply", 486).map(|_| ()).unwrap_err().to_string();
    assert!(error.ends_with("the budget is 486"), "{error}");
}

#[test]
fn broken_numbers_are_warned_about() {
    let broken = String::from_utf8(text()).unwrap().replacen("0 0 1 255", "nan 0 1 255", 1);
    let (mesh, warned) = warnings(|| mesh(broken.as_bytes()));
    assert_eq!(mesh.triangles.len(), 2);
    assert!(warned.contains("thing: 1 of 3 triangles have no area or no finite corners"), "{warned}");
}

#[test]
fn every_truncation() {
    for bytes in [text(), binary(false), binary(true)] {
        for end in 0..bytes.len() {
            survive(&[("s.ply", &bytes[..end])], "s.ply");
        }
    }
}

proptest! {
    #![proptest_config(damaged_cases())]

    #[test]
    fn damaged(which in 0..3, damage in damage()) {
        let mut bytes = match which { 0 => text(), 1 => binary(false), _ => binary(true) };
        apply(&mut bytes, &damage);
        survive(&[("s.ply", &bytes)], "s.ply");
    }
}
