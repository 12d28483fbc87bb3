//! Blending: layers of radiance and opacity, laid one over the other, before surfaces and the environment.
//!
//! A layer has the premultiplied colour (L, α). Fixed-function blending lays it over what is behind it, or under what is
//! before it [PorterDuff84]; both give L_front + (1 − α_front)·L_back. There is one α for all three channels.

use glam::Vec3;
use tyndall_scene::description::Optics;
use tyndall_scene::{FieldError, World};
use wgpu::{BlendComponent, BlendFactor, BlendOperation, BlendState};

use crate::graph::{Graph, Shader, shader};
use crate::resident::Resident;
use crate::{Gpu, RenderError};

/// Lays a layer over those drawn before it: for layers that come back to front.
pub const OVER: BlendState = BlendState::PREMULTIPLIED_ALPHA_BLENDING;

/// Lays a layer under those drawn before it: for layers that come front to back.
pub const UNDER: BlendState = {
    let component = BlendComponent {
        src_factor: BlendFactor::OneMinusDstAlpha,
        dst_factor: BlendFactor::One,
        operation: BlendOperation::Add,
    };
    BlendState { color: component, alpha: component }
};

static LAYERS: Shader = shader!("layers/layers");

/// Adds up, in any order.
pub const SUM: BlendState = {
    let component =
        BlendComponent { src_factor: BlendFactor::One, dst_factor: BlendFactor::One, operation: BlendOperation::Add };
    BlendState { color: component, alpha: component }
};

/// A texture that layers are blended into: of 32-bit floats, or of 16-bit ones where the device blends no others.
pub async fn texture(gpu: &Gpu, film: [u32; 2]) -> Result<wgpu::Texture, RenderError> {
    let wide = gpu.device.features().contains(wgpu::Features::FLOAT32_BLENDABLE);
    if !wide {
        tracing::warn!("this device does not blend 32-bit floats: layers are blended in 16 bits");
    }
    let format = if wide { wgpu::TextureFormat::Rgba32Float } else { wgpu::TextureFormat::Rgba16Float };
    gpu.texture_2d("layers", film, format, wgpu::TextureUsages::RENDER_ATTACHMENT).await
}

/// Records the pass that fills the film: the layers before what the technique of surfaces has filled `behind` with, where there
/// is any, and the environment.
///
/// # Errors
/// Whatever the device refuses.
pub async fn before(
    graph: &mut Graph<'_>,
    resident: &Resident,
    layers: &wgpu::Texture,
    behind: Option<&wgpu::Texture>,
    film: &wgpu::Texture,
) -> Result<(), RenderError> {
    let tile = graph.tile();
    graph
        .compute("layers", &LAYERS)
        .constant("BEHIND", behind.is_some())
        .world(resident)
        .read("view", &resident.view)
        .read("tile", &tile)
        .read("layers", layers)
        .read("behind", behind.unwrap_or(layers))
        .write("film", film)
        .over_film(1)
        .await
}

/// Holds a world against what layers of emission and absorption can show.
///
/// # Errors
/// A medium whose extinction is coloured: a layer has one opacity.
pub fn check(world: &World) -> Result<(), RenderError> {
    for volume in &world.volumes {
        if volume.optics.at(1.0).sigma_s != Vec3::ZERO {
            tracing::warn!("media.{}: what it scatters is left out here; technique march has it", volume.name);
        }
    }
    one_extinction(world, "technique march")
}

/// Holds a world against the one opacity of a layer; `other` is where there are three.
///
/// # Errors
/// A medium whose extinction is coloured.
pub fn one_extinction(world: &World, other: &str) -> Result<(), RenderError> {
    for volume in &world.volumes {
        let Optics::Coefficients { sigma_s, sigma_a, .. } = &volume.optics else { continue };
        let sigma_t = *sigma_s + *sigma_a;
        if sigma_t.max_element() - sigma_t.min_element() > 1e-5 * sigma_t.max_element() {
            return Err(RenderError::Setting(FieldError {
                path: format!("media.{}.optics.coefficients", volume.name),
                found: format!("an extinction sigma_s + sigma_a that differs among channels, {sigma_t}"),
                accepted: format!("one extinction for all channels (layers have one opacity; {other} has three)"),
            }));
        }
    }
    Ok(())
}
