//! Bounds of a medium's strength on a coarse grid over its unit cube, for tracking to step through.

use glam::Vec3;
use rayon::prelude::*;
use tyndall_scene::Field;
use tyndall_scene::description::Optics;
use tyndall_scene::volume::{BRICK_CELLS, Grid, Mesh};

use crate::medium::strength;

/// The lowest and highest strength within each cell of a grid over the unit cube.
pub(crate) struct Bounds {
    /// Cells along x, y, z.
    pub cells: [usize; 3],
    /// `[lowest, highest]`, x fastest.
    ranges: Vec<[f32; 2]>,
}

/// Voxels along a cell's side, where that does not make too many cells.
const VOXELS: usize = 4;

/// Tetrahedra for each cell, on average.
const PER_CELL: u32 = 4;

/// The most cells along an axis.
const MOST_CELLS: usize = 64;

/// Cells along a ball's diameter.
const BALL_CELLS: usize = 32;

/// Cells along the largest feature of noise.
const FEATURE_CELLS: f32 = 8.0;

impl Bounds {
    pub fn new(field: &Field, optics: &Optics) -> Self {
        let knots = match optics {
            Optics::Transfer(transfer) => transfer.knots(),
            Optics::Coefficients { .. } => Vec::new(),
        };
        let strengths = |low, high| strengths(optics, &knots, low, high);
        match field {
            Field::Homogeneous => Self { cells: [1; 3], ranges: vec![strengths(1.0, 1.0)] },
            Field::Exponential { base, scale } => {
                let value = |i: usize| (-(i as f32 / MOST_CELLS as f32 - base) / scale).exp();
                let ranges = (0..MOST_CELLS).map(|i| strengths(value(i + 1), value(i))).collect();
                Self { cells: [1, MOST_CELLS, 1], ranges }
            }
            Field::Grid(grid) => {
                let cells = grid.dims.map(|n| (n as usize).div_ceil(VOXELS).min(MOST_CELLS));
                let ranges = (0..cells[0] * cells[1] * cells[2])
                    .into_par_iter()
                    .map(|i| {
                        let cell = [i % cells[0], i / cells[0] % cells[1], i / (cells[0] * cells[1])];
                        let [low, high] = values(grid, cells, cell);
                        strengths(low, high)
                    })
                    .collect();
                Self { cells, ranges }
            }
            Field::Mesh(mesh) => {
                let side = (mesh.count() as f64 / f64::from(PER_CELL)).cbrt().ceil() as usize;
                let cells = [side.min(MOST_CELLS); 3];
                let ranges = mesh_values(mesh, cells).into_iter().map(|[low, high]| match low <= high {
                    true => strengths(low, high),
                    false => [0.0; 2],
                });
                // Part of a cell may lie outside the mesh, where there is nothing.
                Self { cells, ranges: ranges.map(|[_, high]| [0.0, high]).collect() }
            }
            Field::Sphere(sphere) => Self::over([BALL_CELLS; 3], strengths, |low, high| sphere.range(low, high)),
            Field::Noise(noise) => {
                let cells = (noise.extent * FEATURE_CELLS).ceil().clamp(Vec3::ONE, Vec3::splat(MOST_CELLS as f32));
                Self::over(cells.to_array().map(|n| n as usize), strengths, |low, high| noise.range(low, high))
            }
            // Collisions with them are found without bounds.
            Field::Particles(_) | Field::Strands(_) => Self { cells: [1; 3], ranges: vec![[0.0; 2]] },
            Field::Expression(expression) => Self { cells: [1; 3], ranges: vec![strengths(0.0, expression.highest)] },
        }
    }

    /// Bounds from those of a field over any box of the unit cube.
    fn over(
        cells: [usize; 3],
        strengths: impl Fn(f32, f32) -> [f32; 2] + Sync,
        range: impl Fn(Vec3, Vec3) -> [f32; 2] + Sync,
    ) -> Self {
        // Wider by this much, lest rounding put a point into the neighbouring cell.
        const MARGIN: f32 = 1e-6;
        let size = Vec3::from(cells.map(|n| 1.0 / n as f32));
        let ranges = (0..cells[0] * cells[1] * cells[2])
            .into_par_iter()
            .map(|i| {
                let cell =
                    Vec3::from([i % cells[0], i / cells[0] % cells[1], i / (cells[0] * cells[1])].map(|n| n as f32));
                let (low, high) = (cell * size - MARGIN, (cell + 1.0) * size + MARGIN);
                let [low, high] = range(low.max(Vec3::ZERO), high.min(Vec3::ONE));
                strengths(low, high)
            })
            .collect();
        Self { cells, ranges }
    }

    /// The highest strength anywhere.
    pub fn highest(&self) -> f32 {
        self.ranges.iter().fold(0.0, |highest, range| if range[1] <= highest { highest } else { range[1] })
    }

    /// The lowest and highest strength in a cell, by its number: x + cells[0]·(y + cells[1]·z).
    #[inline]
    pub fn range(&self, cell: usize) -> [f32; 2] {
        self.ranges[cell]
    }
}

/// The lowest and highest value that trilinear interpolation takes within a cell: the extremes of the voxels whose
/// centres surround it. Of bricks that cannot widen them, or lie within, no voxel is read.
fn values(grid: &Grid, cells: [usize; 3], cell: [usize; 3]) -> [f32; 2] {
    // Wider by this many voxels, lest rounding put a point into the neighbouring cell.
    const MARGIN: f64 = 1e-3;
    let span = |axis: usize| {
        let n = f64::from(grid.dims[axis]);
        let at = |cell: usize| cell as f64 / cells[axis] as f64 * n - 0.5;
        let first = (at(cell[axis]) - MARGIN).floor().clamp(0.0, n - 1.0);
        let last = (at(cell[axis] + 1) + MARGIN).ceil().clamp(0.0, n - 1.0);
        [first as u32, last as u32]
    };
    let (spans, counts) = ([0, 1, 2].map(span), grid.brick_counts());
    let bricks = |axis: usize| {
        let [first, last] = spans[axis].map(|voxel| (voxel / BRICK_CELLS).min(counts[axis] - 1));
        first..=last
    };
    let mut range = [f32::INFINITY, f32::NEG_INFINITY];
    let widen = |range: [f32; 2], low: f32, high: f32| [range[0].min(low), range[1].max(high)];
    for z in bricks(2) {
        for y in bricks(1) {
            for x in bricks(0) {
                let brick = grid.bricks()[((z * counts[1] + y) * counts[0] + x) as usize];
                if range[0] <= brick.low && brick.high <= range[1] {
                    continue;
                }
                // The brick's voxels of the cell.
                let first = [x, y, z].map(|at| at * BRICK_CELLS);
                let last = [0, 1, 2].map(|axis| (first[axis] + BRICK_CELLS).min(grid.dims[axis] - 1));
                let within = [0, 1, 2].map(|axis| [first[axis].max(spans[axis][0]), last[axis].min(spans[axis][1])]);
                if brick.is_uniform() || (0..3).all(|axis| within[axis] == [first[axis], last[axis]]) {
                    range = widen(range, brick.low, brick.high);
                    continue;
                }
                let along = |axis: usize| within[axis][0]..=within[axis][1];
                for k in along(2) {
                    for j in along(1) {
                        for i in along(0) {
                            let value = grid.value(i, j, k);
                            range = widen(range, value, value);
                        }
                    }
                }
            }
        }
    }
    range
}

/// The lowest and highest value that the tetrahedra which touch a cell take; empty where none does.
fn mesh_values(mesh: &Mesh, cells: [usize; 3]) -> Vec<[f32; 2]> {
    // What a tetrahedron's box is widened by, lest rounding put a point of it into the neighbouring cell.
    const MARGIN: f32 = 1e-5;
    let mut ranges = vec![[f32::INFINITY, f32::NEG_INFINITY]; cells.iter().product()];
    for tetrahedron in 0..mesh.count() {
        let values = mesh.corner_values(tetrahedron);
        let [low, high] =
            [values.into_iter().fold(f32::INFINITY, f32::min), values.into_iter().fold(f32::NEG_INFINITY, f32::max)];
        let corners = mesh.corners(tetrahedron).map(|corner| corner.to_array());
        let span = |axis: usize| {
            let n = cells[axis];
            let at = |place: f32| ((place * n as f32) as usize).min(n - 1);
            let places = corners.map(|corner| corner[axis]);
            let first = places.into_iter().fold(1.0, f32::min) - MARGIN;
            let last = places.into_iter().fold(0.0, f32::max) + MARGIN;
            at(first)..=at(last)
        };
        for k in span(2) {
            for j in span(1) {
                for i in span(0) {
                    let range = &mut ranges[i + cells[0] * (j + cells[1] * k)];
                    *range = [range[0].min(low), range[1].max(high)];
                }
            }
        }
    }
    ranges
}

/// The lowest and highest strength over an interval of values; it is monotonic between the knots.
fn strengths(optics: &Optics, knots: &[f32], low: f32, high: f32) -> [f32; 2] {
    let within = knots.iter().copied().filter(|knot| (low..=high).contains(knot));
    let strengths = within.chain([low, high]).map(|value| strength(optics, value));
    strengths.fold([f32::INFINITY, f32::NEG_INFINITY], |[least, most], here| [least.min(here), most.max(here)])
}

#[cfg(test)]
mod test {
    use std::sync::Arc;

    use glam::Mat4;
    use tyndall_scene::description::Phase;
    use tyndall_scene::field::{Expression, Formula, Fractal, Noise, Sphere};
    use tyndall_scene::volume::Voxels;

    use super::*;
    use crate::Random;

    /// At every point of a cell the field is within the cell's bounds, and somewhere it comes near them.
    #[test]
    fn bounds_hold_and_are_tight() {
        let mut rng = Random::new(1, 0, 0);
        let one = Vec3::ONE;
        let optics = Optics::Coefficients { sigma_s: one, sigma_a: one, emission: one, phase: Phase::Isotropic };
        for dims in [[1, 1, 1], [5, 3, 2], [17, 8, 9], [300, 2, 1]] {
            let voxels = (0..dims.iter().product()).map(|_: u32| rng.uniform() as f32).collect();
            let grid = Grid::dense(dims, Voxels::F32(voxels), Mat4::IDENTITY);
            check(&Field::Grid(Arc::new(grid)), &optics, 0.35, &mut rng);
        }
        check(&Field::Sphere(Sphere { falloff: 0.4 }), &optics, 0.1, &mut rng);
        let fractal = Fractal { octaves: 2, gain: 0.5, lacunarity: 2.0, seed: 1 };
        let noise = Noise { fractal, threshold: -0.1, origin: Vec3::splat(-3.7), extent: Vec3::new(2.0, 1.0, 0.3) };
        check(&Field::Noise(noise), &optics, 0.5, &mut rng);
        let formula = Formula::parse("p.x").unwrap();
        let expression = Expression { formula, min: Vec3::ZERO, size: Vec3::ONE, highest: 0.7 };
        check(&Field::Expression(Arc::new(expression)), &optics, 0.1, &mut rng);
    }

    /// They are the extremes of the voxels whose centres surround a cell, where bricks are skipped, too.
    #[test]
    fn bounds_are_those_of_voxels() {
        let mut rng = Random::new(2, 0, 0);
        for (dims, cells) in [([40, 33, 9], [10, 9, 3]), ([70, 20, 41], [4, 2, 5]), ([1, 90, 3], [1, 5, 1])] {
            let count: u32 = dims.iter().product();
            let voxels = (0..count).map(|i| if i / 977 % 3 == 0 { rng.uniform() as f32 } else { 0.25 }).collect();
            let grid = Grid::dense(dims, Voxels::F32(voxels), Mat4::IDENTITY);
            for i in 0..cells.iter().product::<usize>() {
                let cell = [i % cells[0], i / cells[0] % cells[1], i / (cells[0] * cells[1])];
                let span = |axis: usize| {
                    let edge = |cell: usize| cell as f64 / cells[axis] as f64 * f64::from(dims[axis]) - 0.5;
                    let [low, high] = [edge(cell[axis]) - 1e-3, edge(cell[axis] + 1) + 1e-3];
                    (0..dims[axis]).filter(move |&n| f64::from(n) > low - 1.0 && f64::from(n) < high + 1.0)
                };
                let all = span(2).flat_map(|k| span(1).flat_map(move |j| span(0).map(move |i| [i, j, k])));
                let extremes = all
                    .map(|[i, j, k]| grid.value(i, j, k))
                    .fold([f32::INFINITY, f32::NEG_INFINITY], |r, v| [r[0].min(v), r[1].max(v)]);
                assert_eq!(values(&grid, cells, cell), extremes, "cell {cell:?} of {dims:?}");
            }
        }
    }

    fn check(field: &Field, optics: &Optics, most_slack: f32, rng: &mut Random) {
        let bounds = Bounds::new(field, optics);
        let mut seen = vec![[f32::INFINITY, f32::NEG_INFINITY]; bounds.ranges.len()];
        for _ in 0..400_000 {
            let unit = [0; 3].map(|_| rng.uniform());
            let cell = [0, 1, 2].map(|axis| (unit[axis] * bounds.cells[axis] as f64) as usize);
            let cell = cell[0] + bounds.cells[0] * (cell[1] + bounds.cells[1] * cell[2]);
            let value = field.value(Vec3::from_array(unit.map(|x| x as f32)));
            seen[cell] = [seen[cell][0].min(value), seen[cell][1].max(value)];
        }
        let mut slack = 0.0;
        for (seen, range) in seen.iter().zip(&bounds.ranges) {
            assert!(range[0] <= seen[0] + 1e-6 && seen[1] <= range[1] + 1e-6, "{seen:?} is not in {range:?}");
            slack += (range[1] - seen[1] + seen[0] - range[0]) / bounds.ranges.len() as f32;
        }
        assert!(slack < most_slack, "{field:?}: bounds are {slack} too wide on average");
    }
}
