//! Splatting: a Gaussian for every voxel that is seen, sorted by the GPU and blended [lecture; Zwicker01].
//!
//! The medium is taken as Σ_v σ_v V G_v(x), with V the volume of a voxel and G_v a normalised Gaussian around its centre,
//! of `sigma` voxels. Its integral along a ray that passes the centre at r standard deviations is known in closed form, so
//! that a fragment needs no approximation of the perspective:
//!
//! τ = σ_v V ∫G = σ_v e^{−r²/2} / (2π s³ |d|), with s = `sigma` and d the ray's direction in standard deviations,
//!
//! α = 1 − e^{−τ}, L = k_e/σ_t · α. Gaussians end at 3 standard deviations, and are divided by the part 1 − e^{−9/2} that is left,
//! so that the optical depth integrated over the footprint is the voxel's. In total depth, ∏(1 − α) = e^{−Στ} is right however splats
//! overlap; it is emission from within the overlap that is seen in the wrong order.
//!
//! With `stride`, one splat stands for the sum of so many voxels along each axis, with a kernel as much wider.
//!
//! Not in the model: scattered light (scattering counts as extinction), an extinction that differs among channels, and the
//! splats that the eye is in.

mod gather;
#[cfg(test)]
mod test;

use glam::Mat3;
use tyndall_scene::World;
use tyndall_scene::parameter::{Kind, Parameter};

use super::{LAYERED_MODEL, Recording, Role, Technique, plain, without_bodies, without_surfaces};
use crate::graph::{Draw, Shader, Target, shader};
use crate::resident::MAX_VOLUMES;
use crate::sorting::Order;
use crate::{Gpu, RenderError, layers};

pub(crate) use gather::Splat;

/// Splatting's declaration.
pub const TECHNIQUE: Technique = Technique {
    name: "splatting",
    summary: "A Gaussian for every voxel, sorted and blended: emission and absorption",
    role: Role::Media,
    parameters: &[
        LAYERED_MODEL,
        Parameter {
            name: "sigma",
            help: "Standard deviation of the Gaussians; in voxels times `stride`",
            unit: "voxels",
            kind: Kind::Number { min: 0.3, max: 4.0, default: 0.5 },
        },
        Parameter {
            name: "stride",
            help: "Voxels along an axis that one splat stands for",
            unit: "voxels",
            kind: Kind::Count { min: 1, max: 8, default: 1 },
        },
    ],
    record: |recording| Box::pin(record(recording)),
};

static KEYS: Shader = shader!("techniques/splatting/keys");
static SPLATS: Shader = shader!("techniques/splatting/splats");

/// Where a Gaussian ends [standard deviations].
const CUTOFF: f32 = 3.0;

/// Splats a submission.
const BATCH: u32 = 1 << 18;

/// A volume's kernel as the shader sees it.
#[derive(Clone, Copy, Debug, Default, encase::ShaderType)]
pub(crate) struct Kernel {
    deviations_from_world: Mat3,
    radius: f32,
}

/// The buffer `kernels`.
#[derive(Debug, encase::ShaderType)]
struct Kernels {
    kernels: [Kernel; MAX_VOLUMES],
}

/// The buffer `splats`.
#[derive(Debug, encase::ShaderType)]
struct Splats {
    #[shader(size(runtime))]
    splats: Vec<Splat>,
}

async fn record(recording: Recording<'_, '_>) -> Result<(), RenderError> {
    let Recording { graph, world, resident, settings, film, .. } = recording;
    without_bodies(world, TECHNIQUE.name)?;
    without_surfaces(world, TECHNIQUE.name)?;
    plain(world, TECHNIQUE.name)?;
    layers::check(world)?;
    let gpu = graph.gpu();
    let (sigma, stride) = (settings.number("sigma"), settings.number("stride") as u32);
    let emission = settings.choice("model") == "emission";
    // A stride makes the kernel wider.
    let deviation = sigma * stride as f32;
    let mut kernels = [Kernel::default(); MAX_VOLUMES];
    for (kernel, volume) in kernels.iter_mut().zip(&world.volumes) {
        *kernel = kernel_of(volume, deviation);
    }
    let mut splats = gather(gpu, world, stride)?;
    let left = 1.0 - (-0.5 * CUTOFF * CUTOFF).exp();
    let scale = (2.0 * std::f32::consts::PI * deviation.powi(3) * left).recip();
    for splat in &mut splats {
        splat.extinction *= scale;
        splat.emission *= if emission { scale } else { 0.0 };
    }
    let count = splats.len() as u32;
    // A buffer is never empty.
    splats.resize(splats.len().max(1), Splat::default());
    let splats = gpu.buffer("splats", &Splats { splats });
    let kernels = gpu.buffer("kernels", &Kernels { kernels });
    let order = Order::new(gpu, count);
    let target = layers::texture(gpu, resident.film).await?;
    graph
        .compute("keys", &KEYS)
        .constant("COUNT", count)
        .read("view", &resident.view)
        .read("splats", &splats)
        .write("order", &order.buffer)
        .dispatch(order.workgroups(), 1)
        .await?;
    order.record(graph).await?;
    graph
        .raster("splats", &SPLATS)
        .constant("CUTOFF", CUTOFF)
        .read("view", &resident.view)
        .read("splats", &splats)
        .read("kernels", &kernels)
        .read("order", &order.buffer)
        .draw(Draw {
            vertices: 6,
            instances: count,
            batch: BATCH,
            target: Some(Target { texture: &target, blend: Some(layers::OVER) }),
            depth: None,
            regions: None,
        })
        .await?;
    layers::before(graph, resident, &target, None, film).await
}

/// The splats of all media, or why there are too many.
fn gather(gpu: &Gpu, world: &World, stride: u32) -> Result<Vec<Splat>, RenderError> {
    let limits = gpu.device.limits();
    let bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    let size = <Splat as encase::ShaderSize>::SHADER_SIZE.get();
    let most = (bytes / size).min(Order::most(gpu).into()) as usize;
    let mut splats = Vec::new();
    for (medium, volume) in world.volumes.iter().enumerate() {
        gather::append(&mut splats, volume, medium as u32, stride, most).ok_or_else(|| RenderError::Limit {
            what: format!("media.{}", volume.name),
            found: format!("more than {most} splats"),
            limit: format!("{most} splats, {size} bytes each"),
            advice: "Use a larger techniques.splatting.stride, or technique march or slicing.".into(),
        })?;
    }
    Ok(splats)
}

/// A volume's kernel, with a standard deviation of so many voxels.
fn kernel_of(volume: &tyndall_scene::Volume, deviation: f32) -> Kernel {
    let world_from_unit = Mat3::from_mat4(volume.world_from_unit);
    let world_from_deviations = world_from_unit * Mat3::from_diagonal(deviation / gather::dims(volume).as_vec3());
    // The largest singular value of A is at most the root of the largest sum along a row of |AᵀA|; and equal to it where the
    // columns of A are at right angles.
    let squared = world_from_deviations.transpose() * world_from_deviations;
    let rows = [squared.x_axis, squared.y_axis, squared.z_axis].map(|row| row.abs().element_sum());
    let largest = rows.into_iter().fold(0.0, f32::max).sqrt();
    Kernel { deviations_from_world: world_from_deviations.inverse(), radius: CUTOFF * largest }
}
