//! Volumes on the device: limits, textures, parameters.

use std::borrow::Cow;

use glam::{Mat4, Vec2, Vec3, Vec4};
use half::f16;
use tyndall_scene::Field;
use tyndall_scene::description::{Optics, Transfer};
use tyndall_scene::phase::PhaseFunction;
use tyndall_scene::volume::{Grid, Voxels};

use crate::math::phase;
use crate::{Gpu, RenderError};

/// How many volumes a scene may have: WebGPU's default limits allow 16 textures in a shader, and other passes need some.
pub const MAX_VOLUMES: usize = 8;

/// Entries of a transfer function's table; between them colour and extinction are linear.
const TRANSFER_ENTRIES: u32 = 4096;

/// How much is uploaded at a time [bytes], so that staging memory stays small beside the volume.
const UPLOAD: u64 = 32 << 20;

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
    /// Emitted radiance per length [W·sr⁻¹·m⁻³ per unit density].
    pub emission: Vec3,
    /// 0 homogeneous, 1 exponential, 2 voxels.
    pub field: u32,
    /// An exponential field's base and scale, in unit-cube heights.
    pub exponential: Vec2,
    /// The shortest edge of a voxel [m], or of a 64th of a volume without voxels.
    pub voxel: f32,
    /// A transfer function's first value and its table entries per value; (0, 0) without one.
    pub transfer: Vec2,
    /// Parameters of the phase function, as [`phase::encode`] gives them.
    pub phase_parameters: Vec4,
}

/// The buffer `volumes`.
#[derive(Clone, Copy, Debug, encase::ShaderType)]
pub struct VolumeArray {
    volumes: [Volume; MAX_VOLUMES],
}

impl VolumeArray {
    /// The parameters of at most [`MAX_VOLUMES`] volumes.
    pub fn new(volumes: &[tyndall_scene::Volume]) -> Self {
        let mut array = [Volume::default(); MAX_VOLUMES];
        for (slot, volume) in array.iter_mut().zip(volumes) {
            *slot = encode(volume);
        }
        Self { volumes: array }
    }
}

fn encode(volume: &tyndall_scene::Volume) -> Volume {
    let (phase, phase_parameters) = phase::encode(&volume.phase);
    let (field, exponential) = match volume.field {
        Field::Homogeneous => (0, Vec2::ZERO),
        Field::Exponential { base, scale } => (1, Vec2::new(base, scale)),
        Field::Grid(_) => (2, Vec2::ZERO),
    };
    let common = Volume {
        unit_from_world: volume.unit_from_world,
        phase,
        phase_parameters,
        field,
        exponential,
        voxel: voxel(volume),
        ..Default::default()
    };
    match &volume.optics {
        Optics::Coefficients { sigma_s, sigma_a, emission, .. } => {
            Volume { sigma_s: *sigma_s, sigma_a: *sigma_a, emission: *emission, ..common }
        }
        Optics::Transfer(transfer) => {
            let (low, high) = domain(transfer);
            let per_value = (TRANSFER_ENTRIES - 1) as f32 / (high - low);
            Volume { sigma_a: Vec3::ONE, transfer: Vec2::new(low, per_value), ..common }
        }
    }
}

/// The values between which a transfer function changes; never empty.
fn domain(transfer: &Transfer) -> (f32, f32) {
    match (transfer.stops.first(), transfer.stops.last()) {
        (Some(first), Some(last)) if first.value < last.value => (first.value, last.value),
        (Some(only), _) => (only.value, only.value + 1.0),
        _ => (0.0, 1.0),
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
        Field::Grid(grid) => glam::UVec3::from(grid.dims).as_vec3(),
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
pub(super) fn check(gpu: &Gpu, volumes: &[tyndall_scene::Volume]) -> Result<(), RenderError> {
    if volumes.len() > MAX_VOLUMES {
        return Err(RenderError::Limit {
            what: "media".into(),
            found: format!("{} media", volumes.len()),
            limit: format!("{MAX_VOLUMES} media"),
            advice: "Merge media, or render them in groups.".into(),
        });
    }
    let limit = gpu.device.limits().max_texture_dimension_3d;
    for volume in volumes {
        if let PhaseFunction::Table(_) = volume.phase {
            return Err(RenderError::PhaseTable { medium: volume.name.clone() });
        }
        let Field::Grid(grid) = &volume.field else { continue };
        let [x, y, z] = grid.dims;
        let longest = x.max(y).max(z);
        if longest > limit {
            return Err(RenderError::Limit {
                what: format!("media.{}: its grid", volume.name),
                found: format!("{x} x {y} x {z} voxels"),
                limit: format!("{limit} voxels a side"),
                advice: format!("Resampled by a factor of {} it would fit.", longest.div_ceil(limit)),
            });
        }
    }
    Ok(())
}

/// What [`upload`] makes.
pub(super) struct Uploaded {
    pub grids: Vec<wgpu::Texture>,
    pub transfers: wgpu::Texture,
}

/// Makes and fills the textures of checked volumes.
pub(super) async fn upload(gpu: &Gpu, volumes: &[tyndall_scene::Volume]) -> Result<Uploaded, RenderError> {
    let empty = Grid::dense([1; 3], Voxels::F16(vec![f16::ZERO]), Mat4::IDENTITY);
    let mut grids = Vec::new();
    for slot in 0..MAX_VOLUMES {
        let grid = match volumes.get(slot).map(|volume| &volume.field) {
            Some(Field::Grid(grid)) => grid.as_ref(),
            _ => &empty,
        };
        grids.push(upload_grid(gpu, grid).await?);
    }
    let size =
        wgpu::Extent3d { width: TRANSFER_ENTRIES, height: volumes.len().max(1) as u32, depth_or_array_layers: 1 };
    let transfers = gpu
        .texture(&descriptor("transfers", size, wgpu::TextureDimension::D2, wgpu::TextureFormat::Rgba32Float))
        .await?;
    for (row, volume) in volumes.iter().enumerate() {
        if let Optics::Transfer(transfer) = &volume.optics {
            write_rows(gpu, &transfers, row as u32, 1, bytemuck::cast_slice(&transfer_table(transfer)));
        }
    }
    Ok(Uploaded { grids, transfers })
}

/// Colour (radiance of an opaque body) and extinction [m⁻¹] at equal distances over the function's domain.
fn transfer_table(transfer: &Transfer) -> Vec<[f32; 4]> {
    let (low, high) = domain(transfer);
    let optics = Optics::Transfer(transfer.clone());
    (0..TRANSFER_ENTRIES)
        .map(|i| {
            let value = low + (high - low) * i as f32 / (TRANSFER_ENTRIES - 1) as f32;
            let extinction = optics.at(value).sigma_a.x;
            (transfer.stop(value).color * transfer.radiance).extend(extinction).to_array()
        })
        .collect()
}

async fn upload_grid(gpu: &Gpu, grid: &Grid) -> Result<wgpu::Texture, RenderError> {
    let [width, height, depth] = grid.dims;
    let filterable = gpu.device.features().contains(wgpu::Features::FLOAT32_FILTERABLE);
    let format = match &grid.voxels {
        Voxels::F32(_) if filterable => wgpu::TextureFormat::R32Float,
        Voxels::F32(_) => {
            tracing::warn!("this device does not interpolate 32-bit floats: voxels are rounded to 16 bits");
            wgpu::TextureFormat::R16Float
        }
        Voxels::F16(_) => wgpu::TextureFormat::R16Float,
    };
    let size = wgpu::Extent3d { width, height, depth_or_array_layers: depth };
    let texture = gpu.texture(&descriptor("grid", size, wgpu::TextureDimension::D3, format)).await?;
    let slice = width as usize * height as usize;
    let bytes_per_slice = slice as u64 * 4;
    let slices = (UPLOAD / bytes_per_slice.max(1)).clamp(1, depth.into()) as u32;
    for first in (0..depth).step_by(slices as usize) {
        let count = slices.min(depth - first);
        let range = first as usize * slice..(first + count) as usize * slice;
        let bytes: Cow<[u8]> = match &grid.voxels {
            Voxels::F16(voxels) => Cow::Borrowed(bytemuck::cast_slice(&voxels[range])),
            Voxels::F32(voxels) if filterable => Cow::Borrowed(bytemuck::cast_slice(&voxels[range])),
            Voxels::F32(voxels) => {
                let rounded: Vec<f16> = voxels[range].iter().map(|&v| f16::from_f32(v)).collect();
                Cow::Owned(bytemuck::cast_slice(&rounded).to_vec())
            }
        };
        write_rows(gpu, &texture, first, count, &bytes);
        if slices < depth {
            // Frees the staging memory of this part before the next.
            gpu.queue.submit([]);
            gpu.wait()?;
        }
    }
    Ok(texture)
}

fn descriptor<'a>(
    label: &'a str,
    size: wgpu::Extent3d,
    dimension: wgpu::TextureDimension,
    format: wgpu::TextureFormat,
) -> wgpu::TextureDescriptor<'a> {
    wgpu::TextureDescriptor {
        label: Some(label),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    }
}

/// Writes `count` rows of a 2D texture, or slices of a 3D one, from `first` on.
fn write_rows(gpu: &Gpu, texture: &wgpu::Texture, first: u32, count: u32, bytes: &[u8]) {
    let texel = texture.format().block_copy_size(None).unwrap_or(4);
    let mut origin = wgpu::Origin3d::ZERO;
    let mut size = texture.size();
    if texture.dimension() == wgpu::TextureDimension::D3 {
        origin.z = first;
        size.depth_or_array_layers = count;
    } else {
        origin.y = first;
        size.height = count;
    }
    gpu.queue.write_texture(
        wgpu::TexelCopyTextureInfo { texture, mip_level: 0, origin, aspect: wgpu::TextureAspect::All },
        bytes,
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(size.width * texel),
            rows_per_image: Some(size.height),
        },
        size,
    );
}
