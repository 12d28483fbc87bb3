use glam::Quat;

use super::*;
use crate::surface::Texture;
use crate::surface::tests::{area, assert_valid, fronts_face, warnings};

/// A cube of side 2 about the origin, each corner once.
fn cube() -> Triangles {
    let corner = |i: u32| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * 2.0 - 1.0;
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    Triangles {
        positions: (0..8).map(corner).collect(),
        triangles: quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        ..Triangles::default()
    }
}

fn normals() -> Map {
    Map::new(Texture { width: 1, height: 1, texels: vec![[128, 128, 255, 255]], srgb: false })
}

fn quad() -> Triangles {
    Triangles {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y],
        texcoords: [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]].map(Vec2::from_array).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Triangles::default()
    }
}

/// However its squares are cut, a cube's corners point along its diagonals.
#[test]
fn smooth_normals_are_weighted_by_angles() {
    let mesh = cube().finish("cube", Missing::Smooth, None);
    assert_valid(&mesh);
    assert_eq!((mesh.positions.len(), area(&mesh)), (8, 24.0));
    fronts_face(&mesh, |center| center);
    for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
        assert!(normal.abs_diff_eq(position.normalize(), 1e-6), "{normal} at {position}");
    }
}

#[test]
fn flat_normals_are_those_of_triangles() {
    let mesh = cube().finish("cube", Missing::Flat, None);
    assert_valid(&mesh);
    assert_eq!(mesh.positions.len(), 36);
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|i| mesh.positions[i as usize]);
        let normal = (b - a).cross(c - a).normalize();
        assert!(triangle.iter().all(|&i| mesh.normals[i as usize].abs_diff_eq(normal, 1e-6)));
    }
}

#[test]
fn what_is_no_triangle_is_dropped_with_a_warning() {
    let mut broken = cube();
    broken.positions.extend([Vec3::splat(f32::NAN), Vec3::new(f32::INFINITY, 0.0, 0.0), Vec3::splat(9.0)]);
    broken.triangles.extend([[0, 1, 8], [0, 9, 1], [2, 2, 3], [4, 4, 4]]);
    broken.positions.push(Vec3::new(0.0, -1.0, -1.0));
    broken.triangles.push([0, 11, 1]);
    let (mesh, warned) = warnings(|| broken.finish("lamp/bulb", Missing::Smooth, None));
    assert_valid(&mesh);
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (8, 12));
    let expected = "lamp/bulb: 5 of 17 triangles have no area or no finite corners; they are dropped";
    assert!(warned.contains(expected), "{warned}");
    let (_, warned) = warnings(|| cube().finish("cube", Missing::Smooth, None));
    assert_eq!(warned, "");
}

#[test]
fn what_is_no_normal_is_computed_with_a_warning() {
    let mut broken = quad();
    broken.normals = vec![Vec3::Z * 7.0, Vec3::splat(f32::NAN), Vec3::ZERO, Vec3::new(0.0, 1e-30, 0.0)];
    broken.texcoords[1] = Vec2::new(f32::NAN, 0.0);
    broken.colors = vec![Vec4::ONE, Vec4::splat(-1.0), Vec4::ONE, Vec4::splat(f32::NAN)];
    let (mesh, warned) = warnings(|| broken.finish("quad", Missing::Flat, None));
    assert_valid(&mesh);
    assert_eq!(mesh.normals, [Vec3::Z, Vec3::Z, Vec3::Z, Vec3::Y]);
    assert_eq!((mesh.texcoords[1], mesh.colors), (Vec2::ZERO, vec![Vec4::ONE; 4]));
    for expected in ["normals of 2 vertices", "coordinates of 1 vertices", "colours of 2 vertices"] {
        assert!(warned.contains(expected), "{warned}");
    }
}

#[test]
fn two_sides_of_a_sheet_have_some_normal() {
    let mut sheet = quad();
    sheet.triangles.extend([[0, 2, 1], [0, 3, 2]]);
    assert_valid(&sheet.finish("sheet", Missing::Smooth, None));
}

/// The tangent is along the first texture coordinate, the bitangent w·(n × t) up in the picture, on both sides.
#[test]
fn tangents_go_along_the_picture() {
    let turned = Quat::from_rotation_y(1.0);
    for mirrored in [false, true] {
        let mut quad = quad();
        if mirrored {
            quad.texcoords.iter_mut().for_each(|uv| uv.x = 1.0 - uv.x);
        }
        quad.positions.iter_mut().for_each(|p| *p = turned * *p);
        let mesh = quad.finish("quad", Missing::Smooth, Some(&normals()));
        assert_valid(&mesh);
        for (tangent, normal) in mesh.tangents.iter().zip(&mesh.normals) {
            let right = turned * if mirrored { Vec3::NEG_X } else { Vec3::X };
            assert!(tangent.truncate().abs_diff_eq(right, 1e-6), "{tangent}");
            assert!((tangent.w * normal.cross(tangent.truncate())).abs_diff_eq(Vec3::Y, 1e-6), "{tangent}");
        }
    }
}

/// A map of normals that is turned by a quarter, in the second set: its tangents go along the picture there.
#[test]
fn tangents_go_along_the_picture_where_it_lies() {
    let mut quad = quad();
    quad.second_texcoords = std::mem::replace(&mut quad.texcoords, vec![Vec2::ZERO; 4]);
    let transform = glam::Affine2::from_mat2(glam::Mat2::from_cols(Vec2::NEG_Y, Vec2::X));
    let map = Map { second: true, transform, ..normals() };
    let mesh = quad.finish("quad", Missing::Smooth, Some(&map));
    assert_valid(&mesh);
    for (tangent, normal) in mesh.tangents.iter().zip(&mesh.normals) {
        // The picture's u is v, which goes down; its v is -u.
        assert!(tangent.truncate().abs_diff_eq(Vec3::NEG_Y, 1e-6), "{tangent}");
        assert!((tangent.w * normal.cross(tangent.truncate())).abs_diff_eq(Vec3::X, 1e-6), "{tangent}");
    }
}

#[test]
fn vertices_with_two_tangents_become_two() {
    // A second quad beside the first, its picture mirrored at the edge between them.
    let mut pair = quad();
    pair.positions.extend([Vec3::new(2.0, 0.0, 0.0), Vec3::new(2.0, 1.0, 0.0)]);
    pair.texcoords.extend([[0.0, 1.0], [0.0, 0.0]].map(Vec2::from_array));
    pair.triangles.extend([[1, 4, 5], [1, 5, 2]]);
    let mesh = pair.finish("pair", Missing::Smooth, Some(&normals()));
    assert_valid(&mesh);
    assert_eq!((mesh.positions.len(), mesh.triangles.len(), area(&mesh)), (8, 4, 2.0));
    for triangle in &mesh.triangles {
        let side = triangle.map(|i| mesh.tangents[i as usize].x);
        assert!(side.iter().all(|x| *x == side[0]), "{side:?}");
    }
}

#[test]
fn tangents_without_texture_coordinates_are_any() {
    let mut bare = cube();
    bare.texcoords.clear();
    let (mesh, warned) = warnings(|| bare.finish("cube", Missing::Flat, Some(&normals())));
    assert_valid(&mesh);
    assert!(!mesh.tangents.is_empty() && warned.contains("no texture coordinates"), "{warned}");
    // Coordinates too large for the algorithm's numbers.
    let mut huge = quad();
    huge.texcoords.iter_mut().for_each(|uv| *uv *= 1e38);
    huge.positions.iter_mut().for_each(|p| *p *= 1e9);
    assert_valid(&huge.finish("huge", Missing::Smooth, Some(&normals())));
}
