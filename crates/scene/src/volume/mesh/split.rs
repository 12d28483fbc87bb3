//! Cells as files have them, and their division into tetrahedra.

/// A cell by the indices of its vertices, in VTK's order; of either orientation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cell {
    /// Four vertices.
    Tetrahedron([u32; 4]),
    /// A quadrilateral base, then the apex.
    Pyramid([u32; 5]),
    /// A triangle, then the one opposite to it.
    Wedge([u32; 6]),
    /// A quadrilateral around, then the one opposite to it.
    Hexahedron([u32; 8]),
}

/// The faces of a cell, as places in its list of vertices, in order around each.
type Faces = &'static [&'static [usize]];

const TETRAHEDRON: Faces = &[&[0, 1, 2], &[0, 1, 3], &[0, 2, 3], &[1, 2, 3]];
const PYRAMID: Faces = &[&[0, 1, 2, 3], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]];
const WEDGE: Faces = &[&[0, 1, 2], &[3, 4, 5], &[0, 1, 4, 3], &[1, 2, 5, 4], &[2, 0, 3, 5]];
const HEXAHEDRON: Faces = &[&[0, 1, 2, 3], &[4, 5, 6, 7], &[0, 1, 5, 4], &[1, 2, 6, 5], &[2, 3, 7, 6], &[3, 0, 4, 7]];

impl Cell {
    /// Its vertices.
    pub fn vertices(&self) -> &[u32] {
        match self {
            Cell::Tetrahedron(vertices) => vertices,
            Cell::Pyramid(vertices) => vertices,
            Cell::Wedge(vertices) => vertices,
            Cell::Hexahedron(vertices) => vertices,
        }
    }

    fn faces(&self) -> Faces {
        match self {
            Cell::Tetrahedron(_) => TETRAHEDRON,
            Cell::Pyramid(_) => PYRAMID,
            Cell::Wedge(_) => WEDGE,
            Cell::Hexahedron(_) => HEXAHEDRON,
        }
    }

    /// The tetrahedra that make it up: 1, 2, 3 or 6.
    ///
    /// A quadrilateral face is halved by the diagonal through its vertex of the smallest index, which the cell on its
    /// other side does too, so that tetrahedra meet face to face [Dompierre99]. The cell's own smallest vertex is joined
    /// to the triangles of all faces that it is not on; those it is on are halved as they should be by that. Of a cell
    /// that names a vertex twice, the parts that would are left out.
    pub(super) fn tetrahedra(&self) -> impl Iterator<Item = [u32; 4]> {
        let vertices = self.vertices();
        let smallest = vertices.iter().copied().min().unwrap_or(0);
        let triangles = self.faces().iter().flat_map(move |face| {
            let n = face.len();
            let first = (0..n).min_by_key(|&i| vertices[face[i]]).unwrap_or(0);
            let at = move |i: usize| vertices[face[(first + i) % n]];
            (1..n - 1).map(move |i| [at(0), at(i), at(i + 1)])
        });
        let whole = triangles.filter(move |[a, b, c]| a != b && b != c && c != a);
        whole.filter(move |triangle| !triangle.contains(&smallest)).map(move |[a, b, c]| [smallest, a, b, c])
    }
}
