//! Passes that draw: triangles without vertex buffers, into textures of the film's size, into parts of a texture, or into layers of
//! one.

use std::ops::Range;

use super::{Declaration, Raster, Shader, Tile, Work};
use crate::{Gpu, RenderError};

/// What a raster pass draws, and where.
#[derive(Clone, Copy, Debug)]
pub struct Draw<'t> {
    /// Vertices of an instance, three a triangle.
    pub vertices: u32,
    /// Instances, drawn in their order.
    pub instances: u32,
    /// Instances a submission at most: drivers end those that take too long.
    pub batch: u32,
    /// What fragments are written to; `None`: only depths are.
    pub target: Option<Target<'t>>,
    /// Depths, of which the greatest is kept and seen: cleared to 0, infinitely far away.
    pub depth: Option<&'t wgpu::Texture>,
    /// `None`: of each tile of the film, what falls into it is drawn, and all of the target is cleared to 0 before the first
    /// instance: later passes over the film find in it what belongs to their tile. Else, once a frame, instance i is drawn into
    /// region i.
    pub regions: Option<&'t [Region]>,
}

/// A texture that is drawn to.
#[derive(Clone, Copy, Debug)]
pub struct Target<'t> {
    /// It is cleared to 0.
    pub texture: &'t wgpu::Texture,
    /// How a fragment goes together with what is there; `None`: it takes its place.
    pub blend: Option<wgpu::BlendState>,
}

/// What a raster pass draws once a frame into all of some layers of a texture.
#[derive(Clone, Debug)]
pub struct Layers<'t> {
    /// Vertices of an instance, three a triangle.
    pub vertices: u32,
    /// Instances, drawn in their order.
    pub instances: u32,
    /// Instances a submission at most: drivers end those that take too long.
    pub batch: u32,
    /// A texture of two layers or more.
    pub texture: &'t wgpu::Texture,
    /// Its layers, one for each of the first outputs of the fragment shader.
    pub layers: Range<u32>,
    /// How a fragment goes together with what is there.
    pub blend: wgpu::BlendState,
    /// Whether they are cleared to 0 before.
    pub clear: bool,
}

/// What a raster pass draws into regions of a texture that are used again and again: its depths alone. It takes turns with the pass
/// that is recorded next, a round each, tile by tile.
#[derive(Clone, Copy, Debug)]
pub struct Turns<'t> {
    /// Vertices of an instance, three a triangle.
    pub vertices: u32,
    /// Depths, of which the greatest is kept; cleared to 0 before each turn that draws.
    pub depth: &'t wgpu::Texture,
    /// Instance i is drawn into region i.
    pub regions: &'t [Region],
    /// Which instances each round draws. Where there are none, what is there stays.
    pub turns: &'t [Range<u32>],
}

/// A rectangle of a texture [texels].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Region {
    /// Its top left texel.
    pub origin: glam::UVec2,
    /// Its width and height.
    pub size: glam::UVec2,
}

impl Declaration<'_, '_, Raster> {
    /// Records the pass.
    ///
    /// # Errors
    /// Names that do not match the shader's, and whatever the device refuses.
    pub async fn draw(self, draw: Draw<'_>) -> Result<(), RenderError> {
        let Draw { vertices, instances, batch, target, depth, regions } = draw;
        let attachment = |target: Target<'_>| Attachment {
            view: target.texture.create_view(&Default::default()),
            state: state(target.texture, target.blend),
        };
        let regions = regions.map_or(Over::Film, |regions| Over::Regions(regions.to_vec()));
        let drawn = Drawn { attachments: target.map(attachment).into_iter().collect(), depth, regions, clear: true };
        self.record_drawing(drawn, [vertices, instances, batch]).await
    }

    /// Records the pass, once a frame, into layers.
    ///
    /// # Errors
    /// As [`draw`](Self::draw).
    pub async fn draw_layers(self, draw: Layers<'_>) -> Result<(), RenderError> {
        let Layers { vertices, instances, batch, texture, layers, blend, clear } = draw;
        let attachment = |layer| Attachment {
            view: texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2),
                base_array_layer: layer,
                array_layer_count: Some(1),
                ..Default::default()
            }),
            state: state(texture, Some(blend)),
        };
        let attachments = layers.map(attachment).collect();
        let drawn = Drawn { attachments, depth: None, regions: Over::Whole, clear };
        self.record_drawing(drawn, [vertices, instances, batch]).await
    }

    /// Records the pass, in turns with the one recorded next.
    ///
    /// # Errors
    /// As [`draw`](Self::draw).
    pub async fn draw_in_turns(self, draw: Turns<'_>) -> Result<(), RenderError> {
        let Turns { vertices, depth, regions, turns } = draw;
        let over = Over::Turns(regions.to_vec(), turns.to_vec());
        let drawn = Drawn { attachments: Vec::new(), depth: Some(depth), regions: over, clear: true };
        self.record_drawing(drawn, [vertices, regions.len() as u32, 1]).await
    }

    async fn record_drawing(self, drawn: Drawn<'_>, counts: [u32; 3]) -> Result<(), RenderError> {
        let (name, shader) = (self.name, self.shader.clone());
        let reflection = shader.reflect()?;
        let [vertices, instances, batch] = counts;
        let rounds = match &drawn.regions {
            Over::Turns(_, turns) => turns.len() as u32,
            _ => instances.div_ceil(batch).max(1),
        };
        let make = |gpu: &Gpu, constants: &[_]| {
            let pipeline = pipeline(gpu, name, &shader, constants, &drawn);
            let layout = pipeline.get_bind_group_layout(0);
            let Drawn { attachments, depth, regions, clear } = drawn;
            let targets = attachments.into_iter().map(|attachment| attachment.view).collect();
            let depth = depth.map(|texture| texture.create_view(&Default::default()));
            let drawing = Drawing { pipeline, targets, depth, regions, clear, vertices, instances, batch };
            (Work::Draw(Box::new(drawing)), layout)
        };
        self.record(&reflection, rounds, make).await
    }
}

/// A colour that is drawn to.
struct Attachment {
    view: wgpu::TextureView,
    state: wgpu::ColorTargetState,
}

fn state(texture: &wgpu::Texture, blend: Option<wgpu::BlendState>) -> wgpu::ColorTargetState {
    wgpu::ColorTargetState { format: texture.format(), blend, write_mask: wgpu::ColorWrites::ALL }
}

/// What is drawn to.
struct Drawn<'t> {
    attachments: Vec<Attachment>,
    depth: Option<&'t wgpu::Texture>,
    regions: Over,
    clear: bool,
}

/// Which part of what is drawn to.
#[derive(Debug)]
enum Over {
    /// Each tile of the film.
    Film,
    /// All of it, once a frame.
    Whole,
    /// Once a frame, an instance a region.
    Regions(Vec<Region>),
    /// Each round its instances, into their regions; once a tile.
    Turns(Vec<Region>, Vec<Range<u32>>),
}

/// A [`Draw`] with its pipeline.
#[derive(Debug)]
pub(super) struct Drawing {
    pipeline: wgpu::RenderPipeline,
    targets: Vec<wgpu::TextureView>,
    depth: Option<wgpu::TextureView>,
    regions: Over,
    /// Whether what is drawn to is cleared before the first instance.
    clear: bool,
    vertices: u32,
    instances: u32,
    batch: u32,
}

impl Drawing {
    /// Whether it is drawn once a frame, not once a tile.
    pub(super) fn once(&self) -> bool {
        !matches!(self.regions, Over::Film | Over::Turns(..))
    }

    /// Whether its rounds and those of the next pass take turns.
    pub(super) fn in_turns(&self) -> bool {
        matches!(self.regions, Over::Turns(..))
    }

    /// The instances of a round.
    fn instances_of(&self, round: u32) -> Range<u32> {
        if let Over::Turns(_, turns) = &self.regions {
            return turns[round as usize].clone();
        }
        let begin = round * self.batch;
        begin..self.instances.min(begin.saturating_add(self.batch))
    }

    /// Appends the batch of the tile's round, cut to the tile or its regions.
    pub(super) fn record(
        &self,
        name: &'static str,
        bind_group: &wgpu::BindGroup,
        tile: Tile,
        scope: &mut wgpu_profiler::Scope<'_, wgpu::CommandEncoder>,
    ) {
        let drawn = self.instances_of(tile.round);
        if self.in_turns() && drawn.is_empty() {
            return;
        }
        let first = self.clear && (tile.round == 0 || self.in_turns());
        let attachment = |view| {
            let load = if first { wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT) } else { wgpu::LoadOp::Load };
            let ops = wgpu::Operations { load, store: wgpu::StoreOp::Store };
            Some(wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops })
        };
        let depth = self.depth.as_ref().map(|view| {
            let load = if first { wgpu::LoadOp::Clear(0.0) } else { wgpu::LoadOp::Load };
            let depth_ops = Some(wgpu::Operations { load, store: wgpu::StoreOp::Store });
            wgpu::RenderPassDepthStencilAttachment { view, depth_ops, stencil_ops: None }
        });
        let color_attachments: Vec<_> = self.targets.iter().map(attachment).collect();
        let descriptor = wgpu::RenderPassDescriptor {
            color_attachments: &color_attachments,
            depth_stencil_attachment: depth,
            ..Default::default()
        };
        let mut recorded = scope.scoped_render_pass(name, descriptor);
        recorded.set_pipeline(&self.pipeline);
        recorded.set_bind_group(0, bind_group, &[]);
        match &self.regions {
            Over::Film => {
                recorded.set_scissor_rect(tile.origin.x, tile.origin.y, tile.size.x, tile.size.y);
                recorded.draw(0..self.vertices, drawn);
            }
            Over::Whole => recorded.draw(0..self.vertices, drawn),
            Over::Regions(regions) | Over::Turns(regions, _) => {
                let first = drawn.start as usize;
                for (i, region) in drawn.zip(&regions[first..]) {
                    let [x, y, width, height] = [region.origin.x, region.origin.y, region.size.x, region.size.y];
                    recorded.set_viewport(x as f32, y as f32, width as f32, height as f32, 0.0, 1.0);
                    recorded.set_scissor_rect(x, y, width, height);
                    recorded.draw(0..self.vertices, i..i + 1);
                }
            }
        }
    }
}

/// The pipeline of a shader with these constants for what is drawn to, from the device's cache or made now.
fn pipeline(
    gpu: &Gpu,
    pass: &str,
    shader: &Shader,
    constants: &[(&'static str, f64)],
    drawn: &Drawn<'_>,
) -> wgpu::RenderPipeline {
    let targets: Vec<_> = drawn.attachments.iter().map(|attachment| Some(attachment.state.clone())).collect();
    let depth = drawn.depth.map(wgpu::Texture::format);
    let key = format!("{} {constants:?} {targets:?} {depth:?}{}", shader.name, shader.own());
    let mut cache = gpu.drawings.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let made = cache.entry(key).or_insert_with(|| {
        let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(shader.name),
            source: wgpu::ShaderSource::Wgsl(shader.source.clone()),
        });
        let compilation_options = wgpu::PipelineCompilationOptions { constants, ..Default::default() };
        gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(pass),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: None,
                compilation_options: compilation_options.clone(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: depth.map(|format| wgpu::DepthStencilState {
                format,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: None,
                compilation_options,
                targets: &targets,
            }),
            multiview_mask: None,
            cache: None,
        })
    });
    made.clone()
}
