use proptest::prelude::*;

use super::*;
use crate::surface::Bsdf;
use crate::surface::tests::{area, assert_valid, fronts_face, read, read_within, survive, warnings};
use crate::volume::tests::{apply, damage, damaged_cases, data};

/// A tetrahedron with a square beside it, in most ways that corners can be written.
const OBJ: &str = "# shapes
mtllib shapes.mtl
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1 1.0
vt 0 0
vt 1 0.25 0
vn 0 0 -1
o pyramid
usemtl red
f 1/1/1 3/2/1 2/1/1
f 1 2 4
f -4 -1 -2
s off
f 2// 3// 4//
g square
usemtl shiny
v 0 0 5
v 1 0 5
v 1 1 5
v 0 1 5
f 5 6 \\
7 8
usemtl nothing
f 8 7 6
";
const MTL: &str = "newmtl red
Kd 0.8 0.1 0.1
map_Kd -s 1 1 1 red.png
Ke 2 1 0
d 0.5
newmtl shiny
Kd 1
Pr 0.25
Pm 1
";
const FILES: [(&str, &[u8]); 2] = [("a/shapes.obj", OBJ.as_bytes()), ("a/shapes.mtl", MTL.as_bytes())];

fn message(text: &str) -> String {
    read(&[("s.obj", text.as_bytes())], "s.obj").unwrap_err().to_string()
}

#[test]
fn groups_become_parts_of_one_material() {
    let (model, warned) = warnings(|| read(&FILES, "a/shapes.obj").unwrap());
    let names: Vec<_> = model.parts.iter().map(|part| (part.name.as_str(), part.material.name.as_str())).collect();
    assert_eq!(names, [("pyramid", "red"), ("square", "shiny"), ("square", "default")]);
    for part in &model.parts {
        assert_valid(&part.mesh);
    }
    let pyramid = &model.parts[0].mesh;
    assert_eq!(pyramid.triangles.len(), 4);
    assert!((area(pyramid) - 1.5 - 0.75f32.sqrt()).abs() < 1e-6);
    fronts_face(pyramid, |center| center - Vec3::splat(0.25));
    let place = pyramid.positions.iter().zip(&pyramid.texcoords).find(|(p, uv)| **p == Vec3::Y && uv.x == 1.0);
    assert_eq!(place.unwrap().1, &Vec2::new(1.0, 0.75), "from the top");
    assert_eq!(model.parts[0].material.bsdf, Bsdf::Lambert { reflectance: Vec3::new(0.8, 0.1, 0.1), map: None });
    assert_eq!(model.parts[0].material.emission, Vec3::new(2.0, 1.0, 0.0));
    let Bsdf::MetallicRoughness { base_color, metallic, roughness, .. } = model.parts[1].material.bsdf else {
        panic!()
    };
    assert_eq!((base_color, metallic, roughness), (Vec3::ONE, 1.0, 0.25));
    for expected in [
        "thing: the picture \"a/red.png\" of the material \"red\" is left out, its plain colour stays: no embedded file of",
        "thing: the material \"red\" is transparent",
        "thing: the material \"nothing\" is in no file that it names; grey in its place",
    ] {
        assert!(warned.contains(expected), "{expected} is not in {warned}");
    }
}

#[test]
fn materials_that_are_missing_or_wrong_are_warned_about() {
    let (model, warned) = warnings(|| read(&FILES[..1], "a/shapes.obj").unwrap());
    assert_eq!(model.parts[0].material.bsdf, Material::default().bsdf);
    assert!(warned.contains("its materials \"a/shapes.mtl\" cannot be read: no embedded file"), "{warned}");
    let mtl = ("a/shapes.mtl", &b"Kd 1\nnewmtl red\nKd red\nPr 2\nKe nan\nmap_Kd\n"[..]);
    let (model, warned) = warnings(|| read(&[FILES[0], mtl], "a/shapes.obj").unwrap());
    assert_eq!(model.parts[0].material.emission, Vec3::ZERO);
    for expected in [
        "\"a/shapes.mtl\", line 3, of the material \"red\": \"red\" is no number",
        "line 4, of the material \"red\": 2; accepted: a number from 0 to 1",
        "line 5, of the material \"red\": [NaN",
    ] {
        assert!(warned.contains(expected), "{expected} is not in {warned}");
    }
}

#[test]
fn messages() {
    let three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (text, expected) in [
        ("v 0 0\n".to_owned(), "line 1: 2 numbers; there must be 3"),
        ("\n\nv 0 0 x\n".to_owned(), "line 3: \"x\" is no number"),
        (format!("{three}f 1 2 4\n"), "line 4: a corner of vertex 4, of 3"),
        (format!("{three}f 1 2 0\n"), "line 4: a corner of vertex 0, of 3"),
        (format!("{three}f 1 2 -4\n"), "line 4: a corner of vertex -4, of 3"),
        (format!("{three}f 1 2\n"), "line 4: a face of 2 corners; it must have three or more"),
        (format!("{three}f 1/1 2/1 3/1\n"), "line 4: a corner of texture coordinate 1, of 0"),
        (format!("{three}f 1//9223372036854775807 2 3\n"), "line 4: a corner of normal 9223372036854775807, of 0"),
        (format!("{three}f 99999999999999999999 2 3\n"), "line 4: the corner \"99999999999999999999\" is no index"),
        (format!("{three}f /1 2 3\n"), "line 4: a corner of texture coordinate 1, of 0"),
        (format!("{three}f / 2 3\n"), "line 4: the corner \"/\" has no vertex"),
    ] {
        assert_eq!(message(&text), format!("the file is corrupt: {expected}"), "{text}");
    }
    let error = read(&[("s.obj", b"v \xff")], "s.obj").unwrap_err().to_string();
    assert_eq!(error, "the file is corrupt: the byte at 2 is no UTF-8 text");
    let error = read(&[("s.stl", b"")], "s.stl").unwrap_err().to_string();
    assert_eq!(error, "unsupported: extension .stl; accepted: .gltf, .glb, .obj, .ply");
}

#[test]
fn faces_beyond_the_budget_are_refused_as_they_are_read() {
    let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{}", "f 1 2 3 1 2 3\n".repeat(1000));
    let error = read_within(&[("s.obj", text.as_bytes())], "s.obj", 100_000).unwrap_err();
    assert!(matches!(error, SurfaceError::TooLarge { .. }), "{error}");
}

#[test]
fn an_empty_file_has_no_parts() {
    assert!(read(&[("s.obj", b"# nothing\n")], "s.obj").unwrap().parts.is_empty());
}

#[test]
fn every_truncation() {
    for end in 0..OBJ.len() {
        survive(&[("a/shapes.obj", &OBJ.as_bytes()[..end]), FILES[1]], "a/shapes.obj");
    }
    for end in 0..MTL.len() {
        survive(&[FILES[0], ("a/shapes.mtl", &MTL.as_bytes()[..end])], "a/shapes.obj");
    }
}

proptest! {
    #![proptest_config(damaged_cases())]

    #[test]
    fn damaged(which in 0..2usize, damage in damage()) {
        let mut bytes = FILES[which].1.to_vec();
        apply(&mut bytes, &damage);
        let mut files = FILES;
        files[which].1 = &bytes;
        survive(&files, "a/shapes.obj");
    }
}

/// Spot is a closed surface of 3 k faces more or less, and its fronts are outside.
#[test]
fn spot() {
    let Some(bytes) = data("spot_low.obj") else { return };
    let model = read(&[("spot.obj", &bytes)], "spot.obj").unwrap();
    let [part] = &model.parts[..] else { panic!("{} parts", model.parts.len()) };
    assert_valid(&part.mesh);
    // Euler's formula for 829 vertices; every face has a normal of its own, and so its own corners.
    assert_eq!(part.mesh.triangles.len(), 2 * 829 - 4);
    assert_eq!(part.mesh.positions.len(), 3 * part.mesh.triangles.len());
    let volume: f32 = part
        .mesh
        .triangles
        .iter()
        .map(|triangle| {
            let [a, b, c] = triangle.map(|i| part.mesh.positions[i as usize]);
            a.dot(b.cross(c)) / 6.0
        })
        .sum();
    assert!(volume > 0.1, "{volume} m³");
    let behind = part.mesh.triangles.iter().filter(|triangle| {
        let [a, b, c] = triangle.map(|i| part.mesh.positions[i as usize]);
        part.mesh.normals[triangle[0] as usize].dot((b - a).cross(c - a)) <= 0.0
    });
    assert!(behind.count() * 50 < part.mesh.triangles.len(), "normals are on the front side");
}
