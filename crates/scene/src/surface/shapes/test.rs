use std::f32::consts::PI;

use super::*;
use crate::surface::tests::{area, assert_valid, fronts_face};

fn quad(corner: [f32; 3], u: [f32; 3], v: [f32; 3]) -> Shape {
    Shape::Quad { corner: corner.into(), edges: [Edge(u.into()), Edge(v.into())] }
}

#[test]
fn a_quad_is_two_triangles_whose_front_is_where_its_edges_turn_counter_clockwise() {
    let mesh = TriangleMesh::of(&quad([1.0, 2.0, 3.0], [2.0, 0.0, 0.0], [0.0, 0.0, -3.0]));
    assert_valid(&mesh);
    assert_eq!((mesh.triangles.len(), area(&mesh)), (2, 6.0));
    assert_eq!(mesh.normals, [Vec3::Y; 4]);
    // Upright in a picture: v goes up along the second edge, (0, 0) is the picture's top left.
    assert_eq!([mesh.texcoords[0], mesh.texcoords[2]], [Vec2::new(0.0, 1.0), Vec2::new(1.0, 0.0)]);
    assert_eq!(mesh.positions[3], Vec3::new(1.0, 2.0, 0.0));
}

#[test]
fn small_and_large_quads_have_normals() {
    for size in [1e-9, 1e9] {
        let mesh = TriangleMesh::of(&quad([0.0; 3], [size, 0.0, 0.0], [0.0, size, 0.0]));
        assert_eq!(mesh.normals, [Vec3::Z; 4], "{size}");
    }
}

#[test]
fn a_box_faces_outside() {
    let (min, max) = (Vec3::new(-1.0, 0.0, 2.0), Vec3::new(1.0, 3.0, 6.0));
    let mesh = TriangleMesh::of(&Shape::Box { min, max });
    assert_valid(&mesh);
    assert_eq!(area(&mesh), 2.0 * (2.0 * 3.0 + 3.0 * 4.0 + 4.0 * 2.0));
    fronts_face(&mesh, |center| center - (min + max) / 2.0);
    assert_eq!(mesh.positions.iter().copied().reduce(Vec3::min), Some(min));
    assert_eq!(mesh.positions.iter().copied().reduce(Vec3::max), Some(max));
}

#[test]
fn a_sphere_faces_outside() {
    let center = Vec3::new(3.0, -2.0, 1.0);
    let mesh = TriangleMesh::of(&Shape::Sphere { center, radius: 2.0 });
    assert_valid(&mesh);
    fronts_face(&mesh, |at| at - center);
    for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
        assert!(((position - center) / 2.0).abs_diff_eq(*normal, 1e-6), "{position} has {normal}");
    }
    // A latitude–longitude mesh of n × n/2 quads lacks about 3.3/n² of the area… of 64 columns 0.2 %.
    let whole = 4.0 * PI * 4.0;
    assert!((1.0 - area(&mesh) / whole - 0.002).abs() < 0.0005, "{} of {whole}", area(&mesh));
}

#[test]
fn a_disc_faces_its_normal() {
    let normal = Vec3::new(1.0, -2.0, 2.0);
    let mesh = TriangleMesh::of(&Shape::Disc { center: Vec3::X, normal, radius: 0.5 });
    assert_valid(&mesh);
    fronts_face(&mesh, |_| normal);
    // A polygon of n corners has n/2π sin(2π/n) of a circle's area.
    let share = AROUND as f32 / (2.0 * PI) * (2.0 * PI / AROUND as f32).sin();
    assert!((area(&mesh) / (PI * 0.25) / share - 1.0).abs() < 1e-5);
}

#[test]
fn polygons_are_fans() {
    let vertices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 1.0, 0.0], [1.0, 2.0, 0.0], [0.0, 2.0, 0.0]];
    let vertices = vertices.map(|v| Edge(v.into())).to_vec();
    let faces =
        [&[0, 1, 2, 3, 4][..], &[2, 1, 0]].map(|face| face.iter().map(|&index| Corner(index)).collect()).to_vec();
    let mesh = TriangleMesh::of(&Shape::Polygons { vertices, faces });
    assert_valid(&mesh);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4], [5, 6, 7]]);
    assert_eq!((mesh.normals[0], mesh.normals[5]), (Vec3::Z, Vec3::NEG_Z));
    assert_eq!(area(&mesh), 3.0 + 0.5);
}
