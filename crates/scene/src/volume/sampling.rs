//! Reading a grid between its voxels.

use glam::{Mat4, UVec3, Vec3};
use half::f16;

use super::bricks::{BRICK_CELLS, BRICK_EDGE, BRICK_VOXELS};
use super::{Grid, Voxels};

impl Grid {
    /// The map from the unit cube, whose faces are the outer faces of the outermost voxels, to the file's space [m].
    pub fn world_from_unit(&self) -> Mat4 {
        let dims = UVec3::from(self.dims).as_vec3();
        self.world_from_index * Mat4::from_translation(Vec3::splat(-0.5)) * Mat4::from_scale(dims)
    }

    /// Trilinear interpolation at a position in the unit cube, constant beyond the outermost voxel centres.
    #[inline]
    pub fn trilinear(&self, unit: Vec3) -> f32 {
        let dims = UVec3::from(self.dims);
        let p = (unit * dims.as_vec3() - 0.5).clamp(Vec3::ZERO, dims.as_vec3() - 1.0);
        // The cell between voxel centres; the last has its far face, too.
        let cell = p.as_uvec3().min(dims.saturating_sub(UVec3::splat(2)));
        let t = p - cell.as_vec3();
        let counts = UVec3::from(self.brick_counts());
        let place = cell / BRICK_CELLS;
        let brick = self.bricks()[((place.z * counts.y + place.y) * counts.x + place.x) as usize];
        if brick.is_uniform() {
            return brick.low;
        }
        const EDGE: usize = BRICK_EDGE as usize;
        let local = (cell % BRICK_CELLS).to_array().map(|n| n as usize);
        let start = brick.slot as usize * BRICK_VOXELS + (local[2] * EDGE + local[1]) * EDGE + local[0];
        let corners = match self.voxels() {
            Voxels::F16(voxels) => corners(&voxels[start..]).map(f16::to_f32),
            Voxels::F32(voxels) => corners(&voxels[start..]),
        };
        let [x0, x1, x2, x3] = [0, 2, 4, 6].map(|i| corners[i] + t.x * (corners[i + 1] - corners[i]));
        let (y0, y1) = (x0 + t.y * (x1 - x0), x2 + t.y * (x3 - x2));
        return y0 + t.z * (y1 - y0);

        /// The cell's corners, x fastest, of voxels from its first on.
        fn corners<T: Copy>(voxels: &[T]) -> [T; 8] {
            [0, 1, EDGE, EDGE + 1, EDGE * EDGE, EDGE * EDGE + 1, EDGE * EDGE + EDGE, EDGE * EDGE + EDGE + 1]
                .map(|offset| voxels[offset])
        }
    }
}
