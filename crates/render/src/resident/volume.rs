//! Media on the device: their parameters, bricks, and transfer functions.

use glam::{Mat4, UVec2, UVec3, Vec2, Vec3, Vec4};
use tyndall_scene::description::{Optics, Transfer};
use tyndall_scene::phase::PhaseFunction;
use tyndall_scene::volume::BRICK_CELLS;
use tyndall_scene::{Field, FieldError};

use super::atlas::{Atlas, UNIFORM};
use crate::math::phase;
use crate::{Gpu, RenderError};

/// How many volumes a scene may have.
pub const MAX_VOLUMES: usize = 8;

/// Texels in a row of the texture of bricks.
const BRICK_ROW: u32 = 2048;

/// Entries of a transfer function's table; a value takes the nearest one.
pub(super) const TRANSFER_ENTRIES: u32 = 4096;

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
    /// 0 homogeneous, 1 exponential, 2 voxels.
    pub field: u32,
    /// Emitted radiance per length [W·sr⁻¹·m⁻³ per unit density].
    pub emission: Vec3,
    /// The shortest edge of a voxel [m], or of a 64th of a volume without voxels.
    pub voxel: f32,
    /// An exponential field's base and scale, in unit-cube heights.
    pub exponential: Vec2,
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
    /// Ambient, diffuse, specular, shininess; 0 where it is not shaded.
    pub shading: Vec4,
    /// Entries of the gradient's opacity table per value and metre; 0 without one.
    pub gradient_scale: f32,
    /// The last entry of that table.
    pub gradient_last: f32,
    /// How much a metre of it can change a ray, at most [m⁻¹]; of a volume without voxels.
    pub majorant: f32,
}

/// The buffer `volumes`.
#[derive(Clone, Copy, Debug, encase::ShaderType)]
pub struct VolumeArray {
    volumes: [Volume; MAX_VOLUMES],
}

/// A texel of `bricks`: place in the atlas, majorant, lowest and highest value, as bits.
pub(super) type Brick = [u32; 4];

impl VolumeArray {
    /// The parameters of at most [`MAX_VOLUMES`] volumes, and their bricks, which lie in this atlas.
    pub fn new(volumes: &[tyndall_scene::Volume], atlas: &Atlas) -> (Self, Vec<Brick>) {
        let mut array = [Volume::default(); MAX_VOLUMES];
        let mut bricks = Vec::new();
        for (slot, volume) in array.iter_mut().zip(volumes) {
            *slot = encode(volume);
            if let Field::Grid(grid) = &volume.field {
                slot.first_brick = bricks.len() as u32;
                bricks.extend(grid.bricks().iter().map(|brick| {
                    let place = if brick.is_uniform() { UNIFORM } else { atlas.place(grid, brick.slot) };
                    let majorant = majorant(&volume.optics, brick.low, brick.high);
                    [place, majorant.to_bits(), brick.low.to_bits(), brick.high.to_bits()]
                }));
            }
        }
        (Self { volumes: array }, bricks)
    }
}

/// How much a metre of a medium can change a ray, at most, where its values lie between two [m⁻¹]: its extinction, and its
/// emission for those that do not absorb.
fn majorant(optics: &Optics, low: f32, high: f32) -> f32 {
    let Optics::Transfer(transfer) = optics else {
        let most = optics.at(high);
        return most.sigma_t().max_element() + most.emission.max_element();
    };
    // As shaders look it up: at the nearest entry.
    let (first, last) = domain(transfer);
    let entry = (last - first) / (TRANSFER_ENTRIES - 1) as f32;
    let (low, high) = (low - entry, high + entry);
    let within = transfer.knots().into_iter().filter(|value| (low..=high).contains(value));
    within.chain([low, high]).map(|value| transfer.sigma_a(value)).fold(0.0, f32::max)
}

fn encode(volume: &tyndall_scene::Volume) -> Volume {
    let (phase, phase_parameters) = phase::encode(&volume.phase);
    let mut encoded = Volume {
        unit_from_world: volume.unit_from_world,
        phase,
        phase_parameters,
        voxel: voxel(volume),
        ..Default::default()
    };
    match &volume.field {
        Field::Homogeneous => {
            encoded.field = 0;
            encoded.majorant = majorant(&volume.optics, 1.0, 1.0);
        }
        Field::Exponential { base, scale } => {
            encoded.field = 1;
            let ends = [0.0, 1.0].map(|y: f32| volume.field.value(Vec3::new(0.0, y, 0.0)));
            encoded.majorant = majorant(&volume.optics, ends[1], ends[0]);
            encoded.exponential = Vec2::new(*base, *scale);
        }
        Field::Grid(grid) => {
            encoded.field = 2;
            let dims = UVec3::from(grid.dims).as_vec3();
            let cells = BRICK_CELLS as f32;
            encoded.bricks = UVec3::from(grid.brick_counts());
            encoded.brick_scale = dims / cells;
            encoded.brick_offset = Vec3::splat(-0.5 / cells);
            encoded.brick_limit = (dims - 1.0) / cells;
        }
        // Refused by `check`.
        Field::Mesh(_) | Field::Sphere(_) | Field::Noise(_) | Field::Expression(_) => {}
    }
    match &volume.optics {
        Optics::Coefficients { sigma_s, sigma_a, emission, .. } => {
            Volume { sigma_s: *sigma_s, sigma_a: *sigma_a, emission: *emission, ..encoded }
        }
        Optics::Transfer(transfer) => {
            let (low, high) = domain(transfer);
            let per_value = (TRANSFER_ENTRIES - 1) as f32 / (high - low);
            Volume { sigma_a: Vec3::ONE, transfer: Vec2::new(low, per_value), ..encoded }
        }
    }
}

/// The values between which a transfer function changes; never empty.
fn domain(transfer: &Transfer) -> (f32, f32) {
    match transfer.knots().as_slice() {
        [first, .., last] if first < last => (*first, *last),
        [only, ..] => (*only, *only + 1.0),
        [] => (0.0, 1.0),
    }
}

/// What the volumes of a world make use of, so that shaders can be specialised for it.
#[derive(Clone, Debug)]
pub struct Traits {
    /// How many volumes there are.
    pub count: u32,
    /// Some have voxels.
    pub grids: bool,
    /// Some thin out exponentially.
    pub exponentials: bool,
    /// Some have transfer functions.
    pub transfers: bool,
    /// Some are shaded by their gradients.
    pub shaded: bool,
    /// Some show isosurfaces.
    pub surfaces: bool,
    /// Some are cut by planes.
    pub planes: bool,
    /// The longest way through each volume [voxels].
    pub diagonals: Vec<f32>,
    /// The shortest voxel edge [m]; 1 where there is no volume.
    pub voxel: f32,
}

impl Traits {
    pub(super) fn of(volumes: &[tyndall_scene::Volume]) -> Self {
        Self {
            count: volumes.len() as u32,
            grids: volumes.iter().any(|v| matches!(v.field, Field::Grid(_))),
            exponentials: volumes.iter().any(|v| matches!(v.field, Field::Exponential { .. })),
            transfers: volumes.iter().any(|v| matches!(v.optics, Optics::Transfer(_))),
            shaded: false,
            surfaces: false,
            planes: false,
            diagonals: volumes.iter().map(diagonal).collect(),
            voxel: volumes.iter().map(voxel).reduce(f32::min).unwrap_or(1.0),
        }
    }
}

/// The shortest edge of a volume's voxels in the world [m], or of its 64th where it has none.
fn voxel(volume: &tyndall_scene::Volume) -> f32 {
    let m = volume.world_from_unit;
    let edges = Vec3::from([m.x_axis, m.y_axis, m.z_axis].map(|axis| axis.truncate().length()));
    let divisions = match &volume.field {
        Field::Grid(grid) => UVec3::from(grid.dims).as_vec3(),
        _ => Vec3::splat(64.0),
    };
    (edges / divisions).min_element()
}

/// The longest way through a volume [voxels].
fn diagonal(volume: &tyndall_scene::Volume) -> f32 {
    let m = volume.world_from_unit;
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(|axis| axis.truncate());
    let diagonals = [x + y + z, x + y - z, x - y + z, x - y - z];
    diagonals.map(Vec3::length).into_iter().fold(0.0, f32::max) / voxel(volume)
}

/// Holds the volumes against the device's limits, before anything is allocated.
pub(super) fn check(volumes: &[tyndall_scene::Volume]) -> Result<(), RenderError> {
    if volumes.len() > MAX_VOLUMES {
        return Err(RenderError::Limit {
            what: "media".into(),
            found: format!("{} media", volumes.len()),
            limit: format!("{MAX_VOLUMES} media"),
            advice: "Merge media, or render them in groups.".into(),
        });
    }
    for volume in volumes {
        if let PhaseFunction::Table(_) = volume.phase {
            return Err(RenderError::PhaseTable { medium: volume.name.clone() });
        }
        if matches!(volume.field, Field::Mesh(_) | Field::Sphere(_) | Field::Noise(_) | Field::Expression(_)) {
            return Err(RenderError::Setting(FieldError {
                path: format!("media.{}.density", volume.name),
                found: "a density that is not yet marched".into(),
                accepted: "homogeneous, exponential or grid; `tyndall reference` takes all".into(),
            }));
        }
    }
    Ok(())
}

/// The table of transfer functions, a row a volume.
pub(super) async fn transfers(gpu: &Gpu, volumes: &[tyndall_scene::Volume]) -> Result<wgpu::Texture, RenderError> {
    let size =
        wgpu::Extent3d { width: TRANSFER_ENTRIES, height: 3 * volumes.len().max(1) as u32, depth_or_array_layers: 1 };
    let texture = gpu
        .texture(&wgpu::TextureDescriptor {
            label: Some("transfers"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        })
        .await?;
    for (i, volume) in volumes.iter().enumerate() {
        if let Optics::Transfer(transfer) = &volume.optics {
            let response = transfer_table(transfer);
            let rows = [&integrals(&response), &response];
            for (row, table) in [1, 0].into_iter().zip(rows) {
                write_row(gpu, &texture, 3 * i as u32 + row, table);
            }
        }
    }
    Ok(texture)
}

fn write_row(gpu: &Gpu, texture: &wgpu::Texture, row: u32, texels: &[[f32; 4]]) {
    gpu.queue.write_texture(
        wgpu::TexelCopyTextureInfo {
            texture,
            mip_level: 0,
            origin: wgpu::Origin3d { x: 0, y: row, z: 0 },
            aspect: wgpu::TextureAspect::All,
        },
        bytemuck::cast_slice(texels),
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: None, rows_per_image: None },
        wgpu::Extent3d { width: texels.len() as u32, height: 1, depth_or_array_layers: 1 },
    );
}

/// The bricks of all volumes as a texture, in rows of [`BRICK_ROW`].
pub(super) async fn brick_texture(gpu: &Gpu, mut bricks: Vec<Brick>) -> Result<wgpu::Texture, RenderError> {
    bricks.resize(bricks.len().max(1).next_multiple_of(BRICK_ROW as usize), [UNIFORM, 0, 0, 0]);
    let height = (bricks.len() / BRICK_ROW as usize) as u32;
    let limit = gpu.device.limits().max_texture_dimension_2d;
    if height > limit {
        return Err(RenderError::Limit {
            what: "media: their grids".into(),
            found: format!("{} bricks of 8 x 8 x 8 voxels", bricks.len()),
            limit: format!("{} bricks", u64::from(limit) * u64::from(BRICK_ROW)),
            advice: "Resample the largest grid.".into(),
        });
    }
    let size = wgpu::Extent3d { width: BRICK_ROW, height, depth_or_array_layers: 1 };
    let texture = gpu
        .texture(&wgpu::TextureDescriptor {
            label: Some("bricks"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Uint,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        })
        .await?;
    gpu.queue.write_texture(
        texture.as_image_copy(),
        bytemuck::cast_slice(&bricks),
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(BRICK_ROW * 16), rows_per_image: None },
        size,
    );
    Ok(texture)
}

/// The running integral of a table over its entries, the radiance multiplied by the extinction.
fn integrals(response: &[[f32; 4]]) -> Vec<[f32; 4]> {
    let emission = |[r, g, b, sigma]: [f32; 4]| [r * sigma, g * sigma, b * sigma, sigma].map(f64::from);
    let mut sum = [0.0; 4];
    let mut before = emission(response[0]);
    let step = |texel: &[f32; 4]| {
        let here = emission(*texel);
        for c in 0..4 {
            sum[c] += 0.5 * (before[c] + here[c]);
        }
        before = here;
        sum.map(|sum| sum as f32)
    };
    std::iter::once([0.0; 4]).chain(response[1..].iter().map(step)).collect()
}

/// Colour (radiance of an opaque body) and extinction [m⁻¹] at equal distances over the function's domain.
fn transfer_table(transfer: &Transfer) -> Vec<[f32; 4]> {
    let (low, high) = domain(transfer);
    (0..TRANSFER_ENTRIES)
        .map(|i| {
            let value = low + (high - low) * i as f32 / (TRANSFER_ENTRIES - 1) as f32;
            (transfer.color(value) * transfer.radiance).extend(transfer.sigma_a(value)).to_array()
        })
        .collect()
}
