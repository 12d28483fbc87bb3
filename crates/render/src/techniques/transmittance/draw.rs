//! Particles and strands, drawn from the lights: a quad each, whose fragments add to the numbers of a basis by blending [Jansen10].
//!
//! Two sets of four numbers are drawn at once, into layers that the pass of media then starts from. A ball deposits the optical
//! depth that a ray finds in all of it, τ₀·(1 − b²/r²)^{5/2}, at its centre's depth; a segment of a strand its own where the ray is in
//! its middle. What is smaller than texels is drawn larger, with as much in all: numbers are means over texels, not samples.
//!
//! A quad covers at least what the ball covers of the map, and each fragment asks its own ray. So it does no harm that quads are
//! too large where the octahedron of a point light has edges, nor that they are drawn again, turned about the middle of
//! an edge of its square, where they reach beyond it; what two of these have in common is left to the first.

use crate::graph::{Graph, Layers, Shader, shader};
use crate::resident::{Light, Resident};
use crate::{Gpu, RenderError};

static BALLS: Shader = shader!("techniques/transmittance/balls");
static STRANDS: Shader = shader!("techniques/transmittance/strands");

/// Bodies a submission.
const BATCH: u32 = 1 << 16;

/// Sets of four numbers that are drawn at once: 32 bytes of 32-bit floats, as many as WebGPU promises.
const AT_ONCE: u32 = 2;

/// The buffer `drawing`.
#[derive(Clone, Copy, Debug, encase::ShaderType)]
pub(crate) struct Drawing {
    pub light: u32,
    pub channel: u32,
    pub first: u32,
}

const ADD: wgpu::BlendState = {
    let component = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    };
    wgpu::BlendState { color: component, alpha: component }
};

/// How many layers a channel has.
pub(super) fn layers(sets: u32) -> u32 {
    sets.next_multiple_of(AT_ONCE)
}

/// The layers that bodies are drawn into, for one light at a time; of two texels where there are no bodies.
///
/// # Errors
/// A lack of memory.
pub(super) async fn texture(gpu: &Gpu, resident: &Resident, single: bool) -> Result<wgpu::Texture, RenderError> {
    let made = &resident.transmittance;
    let drawn = !resident.bodies.is_empty();
    let blendable = gpu.device.features().contains(wgpu::Features::FLOAT32_BLENDABLE);
    if drawn && single && !blendable {
        tracing::warn!("this device does not blend 32-bit floats: transmittance of particles and strands has 16 bits");
    }
    let format = if single && blendable { wgpu::TextureFormat::Rgba32Float } else { wgpu::TextureFormat::Rgba16Float };
    let channels = if resident.traits.grey { 1 } else { 3 };
    let (side, count) = if drawn { (made.resolution, channels * layers(made.sets)) } else { (1, AT_ONCE) };
    gpu.texture_layers("drawn", [side; 2], count, format, wgpu::TextureUsages::RENDER_ATTACHMENT).await
}

/// Records the passes that draw all bodies as light number `light` sees them.
///
/// # Errors
/// Whatever the device refuses.
pub(super) async fn record(
    graph: &mut Graph<'_>,
    resident: &Resident,
    light: &Light,
    number: u32,
    texture: &wgpu::Texture,
) -> Result<(), RenderError> {
    let sets = resident.transmittance.sets;
    let channels = if resident.traits.grey { 1 } else { 3 };
    let parallel = light.local == Light::DIRECTIONAL;
    // The octahedron's square goes on beyond its edges.
    let copies = if parallel || light.scale > 0.0 { 1 } else { 4 };
    for channel in 0..channels {
        for first in (0..sets).step_by(AT_ONCE as usize) {
            let drawing = graph.gpu().buffer("drawing", &Drawing { light: number, channel, first });
            let layer = channel * layers(sets) + first;
            let bodies = [(&BALLS, resident.bodies.ball_count), (&STRANDS, resident.bodies.segment_count)];
            for (i, (shader, instances)) in bodies.into_iter().enumerate() {
                // The first clears the layers.
                if i > 0 && instances == 0 {
                    continue;
                }
                graph
                    .raster("transmittance.bodies", shader)
                    .constant("PARALLEL_LIGHT", parallel)
                    .world(resident)
                    .read("drawing", &drawing)
                    .draw_layers(Layers {
                        vertices: 6 * copies,
                        instances,
                        batch: BATCH,
                        texture,
                        layers: layer..layer + AT_ONCE,
                        blend: ADD,
                        clear: i == 0,
                    })
                    .await?;
            }
        }
    }
    Ok(())
}
