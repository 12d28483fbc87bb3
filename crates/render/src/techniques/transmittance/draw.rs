//! Particles and strands, drawn from the lights: a quad each, whose fragments add to the numbers of a basis by blending [Jansen10].
//!
//! Two sets of four numbers are drawn at once, into layers that the pass of media then starts from. A ball deposits the optical
//! depth that a ray finds in all of it, τ₀·(1 − b²/r²)^{5/2}, at its centre's depth; a segment of a strand its own where the ray is in
//! its middle. What is smaller than texels is drawn larger, with as much in all: numbers are means over texels, not samples.
//!
//! With ranges of depths for each texel they are drawn twice: first over all depths of the light, and, with blending that keeps what
//! is greatest, where the first and the last of them lie; from there a range runs to where those numbers let no light through.
//!
//! A quad covers at least what the ball covers of the map, and each fragment asks its own ray. So it does no harm that quads are
//! too large where the octahedron of a point light has edges, nor that they are drawn again, turned about the middle of
//! an edge of its square, where they reach beyond it; what two of these have in common is left to the first.

use wgpu::TextureUsages;

use crate::graph::{Graph, Layers, Shader, shader};
use crate::resident::{Light, Resident};
use crate::{Gpu, RenderError};

static BALLS: Shader = shader!("techniques/transmittance/balls");
static STRANDS: Shader = shader!("techniques/transmittance/strands");
static RANGE: Shader = shader!("techniques/transmittance/range");

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

/// What keeps the sum, or the greatest.
const fn blend(operation: wgpu::BlendOperation) -> wgpu::BlendState {
    let one = wgpu::BlendFactor::One;
    let component = wgpu::BlendComponent { src_factor: one, dst_factor: one, operation };
    wgpu::BlendState { color: component, alpha: component }
}

/// How many layers a channel has.
fn layers(sets: u32) -> u32 {
    sets.next_multiple_of(AT_ONCE)
}

/// What is drawn for one light at a time.
pub(super) struct Drawn {
    /// The layers that bodies are drawn into; of two texels where there are no bodies. Behind the sets of all channels are the depths
    /// at which there are any.
    pub layers: wgpu::Texture,
    /// The ranges of depths that texels have; one texel where there are none.
    pub ranges: wgpu::Texture,
}

/// What a pass draws of bodies.
#[derive(Clone, Copy, PartialEq)]
enum What {
    /// At which depths there are any.
    Reach,
    /// Sets of numbers over the light's depths.
    Sets,
    /// Sets of numbers over the texels' own.
    Own,
}

impl Drawn {
    /// Room for the bodies of a world.
    ///
    /// # Errors
    /// A lack of memory.
    pub async fn new(gpu: &Gpu, resident: &Resident, single: bool) -> Result<Self, RenderError> {
        let made = &resident.transmittance;
        let drawn = !resident.bodies.is_empty();
        let blendable = gpu.device.features().contains(wgpu::Features::FLOAT32_BLENDABLE);
        if drawn && single && !blendable {
            tracing::warn!("this device does not blend 32-bit floats: transmittance of bodies has 16 bits");
        }
        let format =
            if single && blendable { wgpu::TextureFormat::Rgba32Float } else { wgpu::TextureFormat::Rgba16Float };
        let ranges = drawn && made.ranges;
        let (side, count) = match drawn {
            true => (made.resolution, channels(resident) * layers(made.sets) + if ranges { AT_ONCE } else { 0 }),
            false => (1, AT_ONCE),
        };
        let layers = gpu.texture_layers("drawn", [side; 2], count, format, TextureUsages::RENDER_ATTACHMENT).await?;
        let side = if ranges { side } else { 1 };
        let format = wgpu::TextureFormat::Rgba32Float;
        let ranges = gpu.texture_2d("ranges", [side; 2], format, TextureUsages::STORAGE_BINDING).await?;
        Ok(Self { layers, ranges })
    }

    /// Records the passes that draw all bodies as light number `number` sees them; `deposit` says how far light rays go.
    ///
    /// # Errors
    /// Whatever the device refuses.
    pub async fn record(
        &self,
        graph: &mut Graph<'_>,
        resident: &Resident,
        light: &Light,
        number: u32,
        deposit: &wgpu::Buffer,
    ) -> Result<(), RenderError> {
        self.sets(graph, resident, light, number, What::Sets).await?;
        if !resident.transmittance.ranges {
            return Ok(());
        }
        let layer = channels(resident) * layers(resident.transmittance.sets);
        self.draw(graph, resident, light, What::Reach, Drawing { light: number, channel: 0, first: 0 }, layer).await?;
        let groups = resident.transmittance.resolution.div_ceil(8);
        graph
            .compute("transmittance.range", &RANGE)
            .constant("ONE_GRID", resident.traits.one_grid())
            .world(resident)
            .read("deposit", deposit)
            .read("drawn", &self.layers)
            .write("written", &self.ranges)
            .dispatch([groups, groups, 1], 1)
            .await?;
        self.sets(graph, resident, light, number, What::Own).await
    }

    /// All sets of all channels.
    async fn sets(
        &self,
        graph: &mut Graph<'_>,
        resident: &Resident,
        light: &Light,
        number: u32,
        what: What,
    ) -> Result<(), RenderError> {
        let sets = resident.transmittance.sets;
        for channel in 0..channels(resident) {
            for first in (0..sets).step_by(AT_ONCE as usize) {
                let drawing = Drawing { light: number, channel, first };
                self.draw(graph, resident, light, what, drawing, channel * layers(sets) + first).await?;
            }
        }
        Ok(())
    }

    /// All bodies into the layers from `layer` on.
    async fn draw(
        &self,
        graph: &mut Graph<'_>,
        resident: &Resident,
        light: &Light,
        what: What,
        drawing: Drawing,
        layer: u32,
    ) -> Result<(), RenderError> {
        let drawing = graph.gpu().buffer("drawing", &drawing);
        let parallel = light.local == Light::DIRECTIONAL;
        // The octahedron's square goes on beyond its edges.
        let copies = if parallel || light.scale > 0.0 { 1 } else { 4 };
        let operation = if what == What::Reach { wgpu::BlendOperation::Max } else { wgpu::BlendOperation::Add };
        let bodies = [(&BALLS, resident.bodies.ball_count), (&STRANDS, resident.bodies.segment_count)];
        for (i, (shader, instances)) in bodies.into_iter().enumerate() {
            // The first clears the layers.
            if i > 0 && instances == 0 {
                continue;
            }
            graph
                .raster("transmittance.bodies", shader)
                .constant("PARALLEL_LIGHT", parallel)
                .constant("OWN", what == What::Own)
                .constant("REACH", what == What::Reach)
                .world(resident)
                .read("drawing", &drawing)
                .read("ranges", &self.ranges)
                .draw_layers(Layers {
                    vertices: 6 * copies,
                    instances,
                    batch: BATCH,
                    texture: &self.layers,
                    layers: layer..layer + AT_ONCE,
                    blend: blend(operation),
                    clear: i == 0,
                })
                .await?;
        }
        Ok(())
    }
}

fn channels(resident: &Resident) -> u32 {
    if resident.traits.grey { 1 } else { 3 }
}
