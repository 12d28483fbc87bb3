//! Voxels that are seen, as splats.

use glam::{UVec3, Vec3};
use tyndall_scene::{Field, Volume};

/// A splat as the shader sees it.
#[derive(Clone, Copy, Debug, Default, PartialEq, encase::ShaderType)]
pub(crate) struct Splat {
    /// Its centre in the world [m].
    pub(super) center: Vec3,
    /// The sum of the extinctions of its voxels [m⁻¹].
    pub(super) extinction: f32,
    /// The sum of the emissions of its voxels [W·sr⁻¹·m⁻³].
    pub(super) emission: Vec3,
    /// The number of its medium.
    pub(super) medium: u32,
}

/// Voxels along an edge of a brick that are its own.
const EDGE: u32 = tyndall_scene::volume::BRICK_CELLS;

/// Voxels along x, y, z; where a volume has none, cubes of a 64th of its shortest edge.
pub(super) fn dims(volume: &Volume) -> UVec3 {
    if let Field::Grid(grid) = &volume.field {
        return UVec3::from(grid.dims);
    }
    let m = volume.world_from_unit;
    let edges = Vec3::from([m.x_axis, m.y_axis, m.z_axis].map(|axis| axis.truncate().length()));
    (edges * (64.0 / edges.min_element())).round().as_uvec3()
}

/// Appends the splats of one volume: a splat for the visible voxels of each block of `stride` along each axis. `None` where there are more than `most`.
pub(super) fn append(splats: &mut Vec<Splat>, volume: &Volume, medium: u32, stride: u32, most: usize) -> Option<()> {
    let dims = dims(volume);
    if !matches!(volume.field, Field::Grid(_)) {
        // All of it is seen; and its size is only claimed.
        let blocks: f64 = dims.to_array().iter().map(|&n| f64::from(n.div_ceil(stride))).product();
        if blocks > most as f64 {
            return None;
        }
    }
    // Whole bricks and whole blocks.
    for low in boxes(UVec3::ZERO, dims, EDGE * stride) {
        let end = (low + EDGE * stride).min(dims);
        if boxes(low, end, EDGE).all(|voxel| is_empty(volume, voxel / EDGE)) {
            continue;
        }
        for corner in boxes(low, end, stride) {
            let splat = sum(volume, dims, medium, corner, (corner + stride).min(end));
            if splat.extinction > 0.0 || splat.emission != Vec3::ZERO {
                if splats.len() == most {
                    return None;
                }
                splats.push(splat);
            }
        }
    }
    Some(())
}

/// Whether nothing is seen of a brick without voxels of its own.
fn is_empty(volume: &Volume, brick: UVec3) -> bool {
    let Field::Grid(grid) = &volume.field else { return false };
    let counts = UVec3::from(grid.brick_counts());
    let at = brick.min(counts - 1);
    let number = at.x as usize + counts.x as usize * (at.y as usize + counts.y as usize * at.z as usize);
    let Some(brick) = grid.bricks().get(number) else { return false };
    let here = volume.optics.at(brick.low);
    brick.is_uniform() && here.sigma_t() == Vec3::ZERO && here.emission == Vec3::ZERO
}

/// One splat for the voxels of a box.
fn sum(volume: &Volume, dims: UVec3, medium: u32, low: UVec3, end: UVec3) -> Splat {
    let unit = (low + end).as_vec3() * 0.5 / dims.as_vec3();
    let mut splat = Splat { center: volume.world_from_unit.transform_point3(unit), medium, ..Default::default() };
    for voxel in boxes(low, end, 1) {
        let value = match &volume.field {
            Field::Grid(grid) => grid.value(voxel.x, voxel.y, voxel.z),
            field => field.value((voxel.as_vec3() + 0.5) / dims.as_vec3()),
        };
        let here = volume.optics.at(value);
        splat.extinction += here.sigma_t().x;
        splat.emission += here.emission;
    }
    splat
}

/// The low corners of the boxes of `edge` that make up another, x fastest.
fn boxes(low: UVec3, end: UVec3, edge: u32) -> impl Iterator<Item = UVec3> {
    let along = move |a: u32, b: u32| (a..b).step_by(edge as usize);
    along(low.z, end.z)
        .flat_map(move |z| along(low.y, end.y).flat_map(move |y| along(low.x, end.x).map(move |x| UVec3::new(x, y, z))))
}
