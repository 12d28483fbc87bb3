//! Reading a grid between its voxels.

use glam::{Mat4, UVec3, Vec3};

use super::{Grid, Voxels};

impl Grid {
    /// The map from the unit cube, whose faces are the outer faces of the outermost voxels, to the file's space [m].
    pub fn world_from_unit(&self) -> Mat4 {
        let dims = UVec3::from(self.dims).as_vec3();
        self.world_from_index * Mat4::from_translation(Vec3::splat(-0.5)) * Mat4::from_scale(dims)
    }

    /// Trilinear interpolation at a position in the unit cube, constant beyond the outermost voxel centres.
    pub fn trilinear(&self, unit: Vec3) -> f32 {
        let dims = UVec3::from(self.dims);
        let p = (unit * dims.as_vec3() - 0.5).clamp(Vec3::ZERO, dims.as_vec3() - 1.0);
        let low = p.floor();
        let t = p - low;
        let a = low.as_uvec3();
        let b = (a + 1).min(dims - 1);
        let [nx, ny] = [self.dims[0] as usize, self.dims[1] as usize];
        let rows = [
            (a.z as usize * ny + a.y as usize) * nx,
            (a.z as usize * ny + b.y as usize) * nx,
            (b.z as usize * ny + a.y as usize) * nx,
            (b.z as usize * ny + b.y as usize) * nx,
        ];
        let along_x = |row: usize| {
            let (left, right) = match &self.voxels {
                Voxels::F16(v) => (v[row + a.x as usize].to_f32(), v[row + b.x as usize].to_f32()),
                Voxels::F32(v) => (v[row + a.x as usize], v[row + b.x as usize]),
            };
            left + t.x * (right - left)
        };
        let [x0, x1, x2, x3] = rows.map(along_x);
        let (y0, y1) = (x0 + t.y * (x1 - x0), x2 + t.y * (x3 - x2));
        y0 + t.z * (y1 - y0)
    }
}

impl Voxels {
    /// Size in memory [bytes].
    pub fn bytes(&self) -> u64 {
        match self {
            Voxels::F16(values) => size_of_val(values.as_slice()) as u64,
            Voxels::F32(values) => size_of_val(values.as_slice()) as u64,
        }
    }
}
