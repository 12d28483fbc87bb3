//! Media as shaders see them.

use glam::{Mat4, UVec2, UVec3, Vec2, Vec3, Vec4};
use tyndall_scene::Field;
use tyndall_scene::description::{Isosurface, Optics, Plane};
use tyndall_scene::volume::{BRICK_CELLS, Brick, Grid};

use super::bricks::Bricks;
use super::tables::{self, TRANSFER_ENTRIES};
use crate::RenderError;
use crate::math::phase;

/// How many volumes a scene may have.
pub const MAX_VOLUMES: usize = 8;

/// A volume as shaders see it (`volume.wesl`).
#[derive(Clone, Copy, Debug, Default, PartialEq, encase::ShaderType)]
pub struct Volume {
    /// Maps world positions to the unit cube.
    pub unit_from_world: Mat4,
    /// Scattering coefficient [m⁻¹ per unit density].
    pub sigma_s: Vec3,
    /// Phase function, as [`phase::encode`] numbers them.
    pub phase: u32,
    /// Absorption coefficient [m⁻¹ per unit density]; 1 with a transfer function, whose density is the extinction.
    pub sigma_a: Vec3,
    /// Which field, as `volume.wesl` numbers them.
    pub field: u32,
    /// Emitted radiance per length [W·sr⁻¹·m⁻³ per unit density].
    pub emission: Vec3,
    /// The shortest edge of a voxel [m], or of a 64th of a volume without voxels.
    pub voxel: f32,
    /// What the field's formula needs: an exponential's base and scale in unit-cube heights; a ball's falloff as a share of
    /// its radius; noise's threshold, gain and lacunarity.
    pub field_parameters: Vec4,
    /// Of noise, where the box begins [features] and its octaves; of an expression where it begins [m].
    pub field_origin: Vec3,
    /// See `field_origin`.
    pub octaves: u32,
    /// How far the box goes on from there.
    pub field_extent: Vec3,
    /// Noise's seed.
    pub seed: u32,
    /// A transfer function's first value and its table entries per value; (0, 0) without one.
    pub transfer: Vec2,
    /// Bricks along x, y, z.
    pub bricks: UVec3,
    /// The number of the first.
    pub first_brick: u32,
    /// A position in bricks is `unit * brick_scale + brick_offset`.
    pub brick_scale: Vec3,
    /// See `brick_scale`.
    pub brick_offset: Vec3,
    /// The outermost voxel centres, in bricks.
    pub brick_limit: Vec3,
    /// The phase function's parameters, as [`phase::encode`] orders them.
    pub phase_parameters: Vec4,
    /// The first of its isosurfaces among the extras, and how many.
    pub surfaces: UVec2,
    /// The first of its clip planes among the extras, and how many.
    pub planes: UVec2,
    /// The vectors among the extras that place its temperature and its three colour grids, each from the first on, or none.
    pub tints: UVec2,
    /// A temperature's kelvin per value and offset, and the black body's table: entries per kelvin and the first kelvin.
    pub heat: Vec4,
    /// Ambient, diffuse, specular, shininess; 0 where it is not shaded.
    pub shading: Vec4,
    /// Entries of the gradient's opacity table per value and metre; 0 without one.
    pub gradient_scale: f32,
    /// The last entry of that table.
    pub gradient_last: f32,
    /// How much a metre of it can change a ray, at most [m⁻¹]; of a volume without voxels.
    pub majorant: f32,
    /// The highest value of its voxels less the lowest; 1 where they are alike.
    pub value_range: f32,
}

/// The buffer `volumes`.
#[derive(Clone, Debug, encase::ShaderType)]
pub struct Volumes {
    list: [Volume; MAX_VOLUMES],
    /// What only some volumes need.
    #[shader(size(runtime))]
    extras: Vec<Vec4>,
}

/// No such vectors among the extras.
const NONE: u32 = u32::MAX;

/// Encodes at most [`MAX_VOLUMES`] volumes, with their bricks.
pub(super) fn encode(volumes: &[tyndall_scene::Volume], bricks: &mut Bricks) -> Volumes {
    let mut list = [Volume::default(); MAX_VOLUMES];
    let mut extras = Vec::new();
    for (slot, volume) in list.iter_mut().zip(volumes) {
        *slot = encode_volume(volume);
        if let Field::Grid(grid) = &volume.field {
            slot.first_brick = bricks.append(grid, tables::majorant(&volume.optics));
        }
        slot.planes = UVec2::new(extras.len() as u32, volume.clip.len() as u32);
        extras.extend(volume.clip.iter().map(|Plane { normal, distance }| normal.extend(*distance)));
        if let Optics::Transfer(transfer) = &volume.optics {
            slot.surfaces = UVec2::new(extras.len() as u32, transfer.isosurfaces.len() as u32);
            for Isosurface { value, color, opacity } in &transfer.isosurfaces {
                extras.extend([Vec4::new(*value, 0.0, 0.0, 0.0), (*color * transfer.radiance).extend(*opacity)]);
            }
        }
        slot.tints = UVec2::splat(NONE);
        if let Some(temperature) = &volume.temperature {
            slot.tints.x = extras.len() as u32;
            extras.extend(place(&temperature.grid, bricks));
            let [coldest, hottest] = tables::temperatures(temperature);
            let per_kelvin = (TRANSFER_ENTRIES - 1) as f32 / (hottest - coldest);
            slot.heat = Vec4::new(temperature.kelvin, temperature.offset, per_kelvin, coldest);
        }
        if let Some(color) = &volume.color {
            slot.tints.y = extras.len() as u32;
            for grid in &color.grids {
                extras.extend(place(grid, bricks));
            }
        }
    }
    // An array is never empty.
    extras.push(Vec4::ZERO);
    Volumes { list, extras }
}

/// A grid beside a volume's own, for `placed_value`: the rows of the map from the world to bricks, the bricks and the first
/// of them, and the outermost voxel centres.
fn place(placed: &tyndall_scene::PlacedGrid, bricks: &mut Bricks) -> [Vec4; 5] {
    let first = bricks.append(&placed.grid, |_, _| 0.0);
    let (counts, scale, offset, limit) = brick_map(&placed.grid);
    let map = Mat4::from_translation(offset) * Mat4::from_scale(scale) * placed.unit_from_world;
    let rows = map.transpose();
    [rows.x_axis, rows.y_axis, rows.z_axis, counts.as_vec3().extend(first as f32), limit.extend(0.0)]
}

/// Bricks along x, y, z; what maps the unit cube to them: scale and offset; and the outermost voxel centres.
fn brick_map(grid: &Grid) -> (UVec3, Vec3, Vec3, Vec3) {
    let dims = UVec3::from(grid.dims).as_vec3();
    let cells = BRICK_CELLS as f32;
    (UVec3::from(grid.brick_counts()), dims / cells, Vec3::splat(-0.5 / cells), (dims - 1.0) / cells)
}

fn encode_volume(volume: &tyndall_scene::Volume) -> Volume {
    let (phase, phase_parameters) = phase::encode(&volume.phase);
    let mut encoded = Volume {
        unit_from_world: volume.unit_from_world,
        phase,
        phase_parameters,
        voxel: voxel(volume),
        ..Default::default()
    };
    // The highest value there is, of fields without bricks.
    let mut highest = 1.0;
    match &volume.field {
        Field::Homogeneous => encoded.field = 0,
        Field::Exponential { base, scale } => {
            encoded.field = 1;
            encoded.field_parameters = Vec4::new(*base, *scale, 0.0, 0.0);
            highest = volume.field.value(Vec3::ZERO);
        }
        Field::Grid(grid) => {
            encoded.field = 2;
            (encoded.bricks, encoded.brick_scale, encoded.brick_offset, encoded.brick_limit) = brick_map(grid);
            let range = |[low, high]: [f32; 2], brick: &Brick| [low.min(brick.low), high.max(brick.high)];
            let [low, high] = grid.bricks().iter().fold([f32::MAX, f32::MIN], range);
            encoded.value_range = if high > low { high - low } else { 1.0 };
        }
        Field::Sphere(sphere) => {
            encoded.field = 3;
            encoded.field_parameters.x = sphere.falloff;
        }
        Field::Noise(noise) => {
            encoded.field = 4;
            let fractal = &noise.fractal;
            encoded.field_parameters = Vec4::new(noise.threshold, fractal.gain, fractal.lacunarity, 0.0);
            (encoded.field_origin, encoded.field_extent) = (noise.origin, noise.extent);
            (encoded.octaves, encoded.seed) = (fractal.octaves, fractal.seed);
            highest = noise.range(Vec3::ZERO, Vec3::ONE)[1];
        }
        Field::Expression(expression) => {
            encoded.field = 5;
            (encoded.field_origin, encoded.field_extent) = (expression.min, expression.size);
            highest = expression.highest;
        }
        // Techniques of their own render them, which know what they are.
        Field::Mesh(_) | Field::Particles(_) | Field::Strands(_) => {}
    }
    encoded.majorant = tables::majorant(&volume.optics)(0.0, highest);
    match &volume.optics {
        Optics::Coefficients { sigma_s, sigma_a, emission, .. } => {
            Volume { sigma_s: *sigma_s, sigma_a: *sigma_a, emission: *emission, ..encoded }
        }
        Optics::Transfer(transfer) => {
            let (low, high) = tables::domain(transfer);
            let per_value = (TRANSFER_ENTRIES - 1) as f32 / (high - low);
            let shading = transfer.shading.as_ref();
            let steepest = tables::steepest(transfer);
            Volume {
                sigma_a: Vec3::ONE,
                transfer: Vec2::new(low, per_value),
                shading: shading.map_or(Vec4::ZERO, |s| Vec4::new(s.ambient, s.diffuse, s.specular, s.shininess)),
                gradient_scale: steepest.map_or(0.0, |steepest| (TRANSFER_ENTRIES - 1) as f32 / steepest),
                gradient_last: (TRANSFER_ENTRIES - 1) as f32,
                ..encoded
            }
        }
    }
}

/// The shortest edge of a volume's voxels in the world [m], or of its 64th where it has none.
pub(crate) fn voxel(volume: &tyndall_scene::Volume) -> f32 {
    let m = volume.world_from_unit;
    let edges = Vec3::from([m.x_axis, m.y_axis, m.z_axis].map(|axis| axis.truncate().length()));
    let divisions = match &volume.field {
        Field::Grid(grid) => UVec3::from(grid.dims).as_vec3(),
        // An eighth of the finest feature, but no less than a 512th of the box.
        Field::Noise(noise) => {
            let finest = noise.fractal.lacunarity.powi(noise.fractal.octaves as i32 - 1);
            (noise.extent * finest * 8.0).clamp(Vec3::splat(64.0), Vec3::splat(512.0))
        }
        _ => Vec3::splat(64.0),
    };
    (edges / divisions).min_element()
}

/// The longest way through a volume [voxels].
pub(super) fn diagonal(volume: &tyndall_scene::Volume) -> f32 {
    let m = volume.world_from_unit;
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(|axis| axis.truncate());
    let diagonals = [x + y + z, x + y - z, x - y + z, x - y - z];
    diagonals.map(Vec3::length).into_iter().fold(0.0, f32::max) / voxel(volume)
}

/// Refuses more volumes than shaders have room for.
pub(super) fn check(volumes: &[tyndall_scene::Volume]) -> Result<(), RenderError> {
    if volumes.len() <= MAX_VOLUMES {
        return Ok(());
    }
    Err(RenderError::Limit {
        what: "media".into(),
        found: format!("{} media", volumes.len()),
        limit: format!("{MAX_VOLUMES} media"),
        advice: "Merge media, or render them in groups.".into(),
    })
}
