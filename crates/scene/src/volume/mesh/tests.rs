use glam::{DVec3, Vec3};
use proptest::prelude::*;

use super::*;
use crate::volume::tests::BUDGET;

/// A lattice of n³ boxes over the unit cube, its vertices renumbered by a stride so that diagonals go every way, moved
/// off the lattice within, and each box left whole or cut into wedges or pyramids.
fn lattice(n: u32, stride: u32, jitter: f64, kind: impl Fn(u32) -> u32) -> (Vec<DVec3>, Vec<Cell>) {
    let side = n + 1;
    let corners = side.pow(3);
    let number = |i: u32, j: u32, k: u32| (i + side * (j + side * k)) * stride % corners;
    let mut vertices = vec![DVec3::ZERO; corners as usize];
    let mut cells = Vec::new();
    for k in 0..side {
        for j in 0..side {
            for i in 0..side {
                let inner = [i, j, k].iter().all(|&x| x > 0 && x < n);
                let index = number(i, j, k);
                let wobble = |axis: u32| ((index * (axis + 3)) as f64 * 0.61803).fract() - 0.5;
                let offset = if inner { DVec3::new(wobble(0), wobble(1), wobble(2)) * jitter } else { DVec3::ZERO };
                vertices[index as usize] = (DVec3::new(i.into(), j.into(), k.into()) + offset) / f64::from(n);
            }
        }
    }
    for cell in 0..n.pow(3) {
        let (i, j, k) = (cell % n, cell / n % n, cell / (n * n));
        let at = |x: u32, y: u32, z: u32| number(i + x, j + y, k + z);
        let [a, b, c, d] = [at(0, 0, 0), at(1, 0, 0), at(1, 1, 0), at(0, 1, 0)];
        let [e, f, g, h] = [at(0, 0, 1), at(1, 0, 1), at(1, 1, 1), at(0, 1, 1)];
        if kind(cell) == 0 {
            cells.push(Cell::Hexahedron([a, b, c, d, e, f, g, h]));
        } else {
            let middle = vertices.len() as u32;
            let sum: DVec3 = [a, b, c, d, e, f, g, h].iter().map(|&v| vertices[v as usize]).sum();
            vertices.push(sum / 8.0);
            for [p, q, r, s] in [[a, b, c, d], [e, f, g, h], [a, b, f, e], [b, c, g, f], [c, d, h, g], [d, a, e, h]] {
                cells.push(Cell::Pyramid([p, q, r, s, middle]));
            }
        }
    }
    (vertices, cells)
}

fn linear(vertices: &[DVec3], slope: DVec3, offset: f64) -> Values {
    Values::Vertices(vertices.iter().map(|vertex| (slope.dot(*vertex) + offset) as f32).collect())
}

fn volume(mesh: &Mesh) -> f64 {
    let of = |i: usize| {
        let [a, b, c, d] = mesh.corners(i).map(|corner| corner.as_dvec3());
        (b - a).cross(c - a).dot(d - a) / 6.0
    };
    (0..mesh.count()).map(of).sum()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    /// Hexahedra and pyramids whose diagonals could disagree: the tetrahedra fill the cube once, each face has a
    /// neighbour but for the two triangles of each square on the cube's faces, neighbours know each other, and a linear
    /// field is reproduced at every point.
    #[test]
    fn divided_cells_agree(n in 1u32..5, odd in 0u32..30, mask in any::<u32>(), points in prop::collection::vec([0.0f32..1.0, 0.0f32..1.0, 0.0f32..1.0], 40)) {
        let corners = (n + 1).pow(3);
        let stride = (2 * odd + 1..).find(|&s| gcd(s, corners) == 1).unwrap();
        let (vertices, cells) = lattice(n, stride, 0.3, |cell| mask >> (cell % 32) & 1);
        let (slope, offset) = (DVec3::new(1.0, -2.0, 3.0), 0.5);
        let mesh = Mesh::new(&vertices, &cells, linear(&vertices, slope, offset), BUDGET).unwrap();
        prop_assert!((volume(&mesh) - 1.0).abs() < 1e-5, "{}", volume(&mesh));
        let mut boundary = 0;
        for i in 0..mesh.count() {
            for neighbour in mesh.neighbours(i) {
                match neighbour {
                    Some(other) => prop_assert!(mesh.neighbours(other as usize).contains(&Some(i as u32))),
                    None => boundary += 1,
                }
            }
        }
        prop_assert_eq!(boundary, 2 * 6 * n * n);
        for point in points.into_iter().map(Vec3::from) {
            let expected = slope.dot(point.as_dvec3()) + offset;
            let value = f64::from(mesh.value(point).unwrap());
            prop_assert!((value - expected).abs() < 1e-5, "{value} for {expected}");
        }
    }
}

fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}

const CORNERS: [DVec3; 6] = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE, DVec3::splat(0.8)];

fn mesh(cells: &[[u32; 4]]) -> Result<Mesh, VolumeError> {
    let cells: Vec<_> = cells.iter().map(|&cell| Cell::Tetrahedron(cell)).collect();
    Mesh::new(&CORNERS, &cells, Values::Cells((0..cells.len()).map(|i| i as f32).collect()), BUDGET)
}

/// Orientation does not matter; collapsed cells hold nothing; values belong to the cells that stay.
#[test]
fn orientation_and_collapsed_cells() {
    let two = mesh(&[[1, 2, 3, 3], [0, 1, 2, 3], [4, 2, 1, 3]]).unwrap();
    assert_eq!(two.count(), 2);
    assert_eq!(two.corner_values(0), [1.0; 4]);
    assert_eq!((two.neighbours(0).iter().flatten().count(), two.neighbours(1).iter().flatten().count()), (1, 1));
    assert!((volume(&two) - 0.5).abs() < 1e-6);
    assert_eq!((two.value(Vec3::splat(0.1)), two.value(Vec3::splat(0.5))), (Some(1.0), Some(2.0)));
    assert_eq!(two.value(Vec3::new(0.9, 0.9, 0.1)), None);
}

#[test]
fn what_is_no_mesh() {
    let message = |cells: &[[u32; 4]]| mesh(cells).unwrap_err().to_string();
    assert_eq!(message(&[[0, 1, 2, 6]]), "the mesh is malformed: cell 0 names vertex 6; there are 6 vertices");
    assert_eq!(message(&[[0, 1, 2, 2], [1, 1, 3, 4]]), "the mesh is malformed: none of its 2 cells has a volume");
    assert_eq!(
        message(&[[0, 1, 2, 3], [3, 2, 1, 0]]),
        "the mesh is malformed: cells 0 and 1 overlap: they lie on the same side of a face that they share"
    );
    assert_eq!(
        message(&[[0, 1, 2, 3], [4, 1, 2, 3], [1, 2, 3, 5]]),
        "the mesh is malformed: cells 0, 1, 2 share a face; a face belongs to one cell or two"
    );
    let flat = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::ONE.with_z(0.0)];
    let cells = [Cell::Tetrahedron([0, 1, 2, 3])];
    let error = Mesh::new(&flat, &cells, Values::Cells(vec![1.0]), BUDGET).unwrap_err().to_string();
    assert_eq!(
        error,
        "the mesh is malformed: its cells extend over [1, 1, 0] m; they must fill a volume of finite size"
    );
    let error = Mesh::new(&flat, &cells, Values::Vertices(vec![1.0]), BUDGET).unwrap_err().to_string();
    assert_eq!(error, "the mesh is malformed: it has 1 values for 4 vertices");
    let error = Mesh::new(&flat, &cells, Values::Cells(vec![1.0]), Budget(100)).unwrap_err().to_string();
    assert!(error.ends_with("while it is made; the budget is 100"), "{error}");
    let error = Mesh::new(&[DVec3::NAN; 4], &cells, Values::Cells(vec![1.0]), BUDGET).unwrap_err().to_string();
    assert!(error.starts_with("the mesh is malformed: vertex 0 is [NaN"), "{error}");
}
