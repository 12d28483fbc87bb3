//! An unstructured mesh: a field on tetrahedra, without resampling.

mod adjacency;
mod locator;
mod split;
#[cfg(test)]
mod tests;

use glam::{DMat3, DVec3, Mat4, Vec3};

pub use split::Cell;

use super::{Budget, VolumeError};
use locator::Locator;

/// Tetrahedra that meet face to face, and a scalar field on them. Outside of them there is nothing.
///
/// The field is linear in each tetrahedron between the values at its vertices, or constant where values belong to
/// cells. Hexahedra, wedges and pyramids are divided into tetrahedra ([`Cell`]), so that on them, too, the field is
/// piecewise linear, where their own interpolation would be multilinear.
///
/// Vertices are kept in the unit cube of the mesh's bounding box, so that 32 bits resolve a small mesh far from the
/// origin as well as any other. Overlapping cells are noticed where they share a face, elsewhere not.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// The bounding box's lowest and highest corner [m].
    bounds: [DVec3; 2],
    /// In the unit cube.
    vertices: Vec<Vec3>,
    /// Vertex indices, positively oriented: det(b − a, c − a, d − a) > 0.
    tetrahedra: Vec<[u32; 4]>,
    /// Of each tetrahedron, what lies across the face opposite to each of its vertices; [`NONE`] where nothing does.
    neighbours: Vec<[u32; 4]>,
    values: Values,
    locator: Locator,
}

/// The values of a mesh's field.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// One at each vertex.
    Vertices(Vec<f32>),
    /// One in each cell.
    Cells(Vec<f32>),
}

/// No neighbour.
const NONE: u32 = u32::MAX;

/// The most tetrahedra: the number of a face, four to each, must fit 32 bits.
const MOST: usize = 1 << 30;

impl Mesh {
    /// A mesh of cells over vertices [m]. Cells without volume (flatter than single precision resolves within the
    /// bounding box) hold nothing and are dropped.
    ///
    /// # Errors
    /// [`VolumeError::Mesh`] for a vertex or value that is not finite, an index of no vertex, a number of values that is
    /// not that of vertices or cells, a face of more than two cells, two cells on the same side of their common face,
    /// and a mesh without volume; [`VolumeError::MeshTooLarge`] beyond the budget.
    pub fn new(vertices: &[DVec3], cells: &[Cell], values: Values, budget: Budget) -> Result<Self, VolumeError> {
        let count = cells.iter().map(|cell| cell.tetrahedra().count()).sum::<usize>();
        Self::check_size(vertices.len(), cells.len(), count, budget)?;
        check_values(&values, vertices.len(), cells.len())?;
        if let Some(i) = vertices.iter().position(|vertex| !vertex.is_finite()) {
            return Err(malformed(format!("vertex {i} is {}; it must be finite", vertices[i])));
        }
        let bounds = bounds(vertices, cells)?;
        let vertices: Vec<_> =
            vertices.iter().map(|vertex| ((vertex - bounds[0]) / (bounds[1] - bounds[0])).as_vec3()).collect();

        let mut tetrahedra = Vec::with_capacity(count);
        let mut cell_of = Vec::with_capacity(count);
        for (number, cell) in cells.iter().enumerate() {
            for tetrahedron in cell.tetrahedra() {
                if let Some(oriented) = oriented(&vertices, tetrahedron) {
                    tetrahedra.push(oriented);
                    cell_of.push(number as u32);
                }
            }
        }
        if tetrahedra.is_empty() {
            return Err(malformed(format!("none of its {} cells has a volume", cells.len())));
        }
        let neighbours = adjacency::neighbours(&tetrahedra, &cell_of)?;
        let values = match values {
            Values::Vertices(values) => Values::Vertices(values),
            Values::Cells(values) => Values::Cells(cell_of.iter().map(|&cell| values[cell as usize]).collect()),
        };
        let locator = Locator::new(&vertices, &tetrahedra, bounds[1] - bounds[0]);
        Ok(Self { bounds, vertices, tetrahedra, neighbours, values, locator })
    }

    /// Errors: more tetrahedra than can be numbered, or than the budget has room for while the mesh is made.
    pub(super) fn check_size(
        vertices: usize,
        cells: usize,
        tetrahedra: usize,
        budget: Budget,
    ) -> Result<(), VolumeError> {
        // A vertex as read and as kept with its value; a cell; a tetrahedron with neighbours, value and cell, and its
        // faces while they are sorted (later the locator's entries, which are fewer).
        const VERTEX: u64 = (size_of::<DVec3>() + size_of::<Vec3>() + size_of::<f32>()) as u64;
        const CELL: u64 = size_of::<Cell>() as u64;
        const TETRAHEDRON: u64 = 16 + 16 + 4 + 4 + 4 * adjacency::FACE as u64;
        let part = |count: usize, size: u64| (count as u64).saturating_mul(size);
        let bytes =
            part(vertices, VERTEX).saturating_add(part(cells, CELL)).saturating_add(part(tetrahedra, TETRAHEDRON));
        if tetrahedra >= MOST || bytes > budget.0 {
            return Err(VolumeError::MeshTooLarge { vertices, tetrahedra, bytes, budget: budget.0 });
        }
        Ok(())
    }

    /// How many tetrahedra there are.
    pub fn count(&self) -> usize {
        self.tetrahedra.len()
    }

    /// Size in memory [bytes].
    pub fn bytes(&self) -> u64 {
        let values = match &self.values {
            Values::Vertices(values) | Values::Cells(values) => size_of_val(values.as_slice()),
        };
        let vertices = size_of_val(self.vertices.as_slice());
        let tetrahedra = size_of_val(self.tetrahedra.as_slice()) + size_of_val(self.neighbours.as_slice());
        (values + vertices + tetrahedra + self.locator.bytes()) as u64
    }

    /// A tetrahedron's vertices in the unit cube, positively oriented.
    pub fn corners(&self, tetrahedron: usize) -> [Vec3; 4] {
        self.tetrahedra[tetrahedron].map(|vertex| self.vertices[vertex as usize])
    }

    /// The field at a tetrahedron's vertices, as seen from within it.
    pub fn corner_values(&self, tetrahedron: usize) -> [f32; 4] {
        match &self.values {
            Values::Vertices(values) => self.tetrahedra[tetrahedron].map(|vertex| values[vertex as usize]),
            Values::Cells(values) => [values[tetrahedron]; 4],
        }
    }

    /// The tetrahedra across the faces opposite to each vertex of one.
    pub fn neighbours(&self, tetrahedron: usize) -> [Option<u32>; 4] {
        self.neighbours[tetrahedron].map(|other| (other != NONE).then_some(other))
    }

    /// The map from the unit cube to the file's space [m].
    pub fn world_from_unit(&self) -> Mat4 {
        let [min, max] = self.bounds;
        Mat4::from_translation(min.as_vec3()) * Mat4::from_scale((max - min).as_vec3())
    }

    /// The field at a position in the unit cube, `None` outside of every cell.
    pub fn value(&self, unit: Vec3) -> Option<f32> {
        // How far outside a cell rounding may put what lies on its face, in barycentric coordinates.
        const TOLERANCE: f64 = 1e-6;
        let mut inside = None;
        let mut best = -TOLERANCE;
        for &tetrahedron in self.locator.candidates(unit) {
            let coordinates = barycentric(self.corners(tetrahedron as usize), unit);
            let least = coordinates.into_iter().fold(f64::INFINITY, f64::min);
            if least >= best {
                (inside, best) = (Some((tetrahedron, coordinates)), least);
            }
            if least >= 0.0 {
                break;
            }
        }
        let (tetrahedron, coordinates) = inside?;
        let values = self.corner_values(tetrahedron as usize);
        let weights = coordinates.map(|weight| weight.max(0.0));
        let sum: f64 = weights.iter().zip(values).map(|(weight, value)| weight * f64::from(value)).sum();
        Some((sum / weights.iter().sum::<f64>()) as f32)
    }
}

/// The barycentric coordinates of a point in a positively oriented tetrahedron.
fn barycentric(corners: [Vec3; 4], point: Vec3) -> [f64; 4] {
    let [a, b, c, d] = corners.map(|corner| (corner - point).as_dvec3());
    let parts = [
        DMat3::from_cols(b, c, d).determinant(),
        -DMat3::from_cols(a, c, d).determinant(),
        DMat3::from_cols(a, b, d).determinant(),
        -DMat3::from_cols(a, b, c).determinant(),
    ];
    let whole = parts.iter().sum::<f64>();
    parts.map(|part| part / whole)
}

/// The tetrahedron with positive orientation, `None` where it has no volume: where it is flatter than the rounding of
/// its vertices.
fn oriented(vertices: &[Vec3], tetrahedron: [u32; 4]) -> Option<[u32; 4]> {
    const FLAT: f64 = 4.0 * f32::EPSILON as f64;
    let [a, b, c, d] = tetrahedron;
    let corner = |vertex: u32| vertices[vertex as usize].as_dvec3();
    let edges = [b, c, d].map(|vertex| corner(vertex) - corner(a));
    let volume = DMat3::from_cols(edges[0], edges[1], edges[2]).determinant();
    let longest = edges.iter().map(|edge| edge.length_squared()).fold(0.0, f64::max);
    match volume {
        _ if volume.abs() <= FLAT * longest => None,
        _ if volume > 0.0 => Some([a, b, c, d]),
        _ => Some([b, a, c, d]),
    }
}

fn check_values(values: &Values, vertices: usize, cells: usize) -> Result<(), VolumeError> {
    let (values, expected, what) = match values {
        Values::Vertices(values) => (values, vertices, "vertices"),
        Values::Cells(values) => (values, cells, "cells"),
    };
    if values.len() != expected {
        return Err(malformed(format!("it has {} values for {expected} {what}", values.len())));
    }
    match values.iter().position(|value| !value.is_finite()) {
        Some(i) => Err(malformed(format!("value {i} of its {what} is {}; it must be finite", values[i]))),
        None => Ok(()),
    }
}

/// The box around the vertices that cells use.
fn bounds(vertices: &[DVec3], cells: &[Cell]) -> Result<[DVec3; 2], VolumeError> {
    let mut bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    for (number, cell) in cells.iter().enumerate() {
        for &index in cell.vertices() {
            let Some(&vertex) = vertices.get(index as usize) else {
                let count = vertices.len();
                return Err(malformed(format!("cell {number} names vertex {index}; there are {count} vertices")));
            };
            bounds = [bounds[0].min(vertex), bounds[1].max(vertex)];
        }
    }
    let extent = bounds[1] - bounds[0];
    if !(extent.min_element() > 0.0 && extent.as_vec3().is_finite() && extent.as_vec3().min_element() > 0.0) {
        return Err(malformed(format!("its cells extend over {extent} m; they must fill a volume of finite size")));
    }
    Ok(bounds)
}

fn malformed(what: String) -> VolumeError {
    VolumeError::Mesh { what }
}
