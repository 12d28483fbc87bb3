//! Which tetrahedra may contain a point: a uniform grid of lists.

use glam::{DVec3, UVec3, Vec3};

/// A uniform grid over the unit cube; each of its cells lists the tetrahedra whose boxes touch it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Locator {
    dims: UVec3,
    /// Where each cell's list begins in `entries`, x fastest, and where the last ends.
    starts: Vec<u32>,
    entries: Vec<u32>,
}

/// Entries for each tetrahedron, at most; the grid is made coarser until they suffice.
const MOST_ENTRIES: u64 = 12;

/// Cells along an axis, at most.
const MOST_CELLS: f64 = 256.0;

/// How far a tetrahedron's box is widened, lest rounding miss a point on its face.
const MARGIN: f32 = 1e-6;

impl Locator {
    /// Lists tetrahedra over vertices in the unit cube of a box that extends so far [m].
    pub fn new(vertices: &[Vec3], tetrahedra: &[[u32; 4]], extent: DVec3) -> Self {
        // About as many cells as tetrahedra, and about cubes.
        let mut side = (extent.element_product() / tetrahedra.len() as f64).cbrt();
        loop {
            let dims = (extent / side).clamp(DVec3::ONE, DVec3::splat(MOST_CELLS)).as_uvec3();
            if let Some(locator) = Self::with_dims(vertices, tetrahedra, dims) {
                return locator;
            }
            side *= 1.5;
        }
    }

    /// `None` where that takes too many entries; a single cell never does.
    fn with_dims(vertices: &[Vec3], tetrahedra: &[[u32; 4]], dims: UVec3) -> Option<Self> {
        let mut locator = Self { dims, starts: Vec::new(), entries: Vec::new() };
        let span = |tetrahedron: &[u32; 4]| {
            let corners = tetrahedron.map(|vertex| vertices[vertex as usize]);
            let low = corners.into_iter().fold(Vec3::INFINITY, Vec3::min) - MARGIN;
            let high = corners.into_iter().fold(Vec3::NEG_INFINITY, Vec3::max) + MARGIN;
            (locator.cell(low), locator.cell(high))
        };
        let touched = |tetrahedron: &[u32; 4]| {
            let (low, high) = span(tetrahedron);
            let rows = (low.z..=high.z).flat_map(move |z| (low.y..=high.y).map(move |y| (y, z)));
            rows.flat_map(move |(y, z)| (low.x..=high.x).map(move |x| (x + dims.x * (y + dims.y * z)) as usize))
        };
        let size = |tetrahedron: &[u32; 4]| {
            let (low, high) = span(tetrahedron);
            (high - low + 1).as_u64vec3().element_product()
        };
        let total = tetrahedra.iter().map(size).sum::<u64>();
        if total > MOST_ENTRIES * tetrahedra.len() as u64 {
            return None;
        }
        // Counted, summed up to where each list ends, and filled from its end.
        let mut starts = vec![0u32; dims.element_product() as usize + 1];
        tetrahedra.iter().flat_map(touched).for_each(|cell| starts[cell] += 1);
        let mut end = 0;
        for start in &mut starts {
            end += *start;
            *start = end;
        }
        let mut entries = vec![0; total as usize];
        for (number, tetrahedron) in tetrahedra.iter().enumerate() {
            for cell in touched(tetrahedron) {
                starts[cell] -= 1;
                entries[starts[cell] as usize] = number as u32;
            }
        }
        locator.starts = starts;
        locator.entries = entries;
        Some(locator)
    }

    /// The tetrahedra that may contain a point of the unit cube.
    pub fn candidates(&self, unit: Vec3) -> &[u32] {
        let cell = self.cell(unit);
        let cell = (cell.x + self.dims.x * (cell.y + self.dims.y * cell.z)) as usize;
        &self.entries[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    /// Size in memory [bytes].
    pub fn bytes(&self) -> usize {
        size_of_val(self.starts.as_slice()) + size_of_val(self.entries.as_slice())
    }

    fn cell(&self, unit: Vec3) -> UVec3 {
        (unit * self.dims.as_vec3()).clamp(Vec3::ZERO, (self.dims - 1).as_vec3()).as_uvec3()
    }
}
