//! Passes that draw: triangles without vertex buffers, into textures of the film's size or into parts of a texture.

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
        let (name, shader) = (self.name, self.shader.clone());
        let reflection = shader.reflect()?;
        let rounds = draw.instances.div_ceil(draw.batch).max(1);
        let make = |gpu: &Gpu, constants: &[_]| {
            let pipeline = pipeline(gpu, name, &shader, constants, &draw);
            let layout = pipeline.get_bind_group_layout(0);
            let Draw { vertices, instances, batch, target, depth, regions } = draw;
            let target = target.map(|target| target.texture.create_view(&Default::default()));
            let depth = depth.map(|texture| texture.create_view(&Default::default()));
            let regions = regions.map(<[_]>::to_vec);
            let drawing = Drawing { pipeline, target, depth, regions, vertices, instances, batch };
            (Work::Draw(Box::new(drawing)), layout)
        };
        self.record(&reflection, rounds, make).await
    }
}

/// A [`Draw`] with its pipeline.
#[derive(Debug)]
pub(super) struct Drawing {
    pipeline: wgpu::RenderPipeline,
    target: Option<wgpu::TextureView>,
    depth: Option<wgpu::TextureView>,
    regions: Option<Vec<Region>>,
    vertices: u32,
    instances: u32,
    batch: u32,
}

impl Drawing {
    /// Whether it is drawn once a frame, not once a tile.
    pub(super) fn once(&self) -> bool {
        self.regions.is_some()
    }

    /// Appends the batch of the tile's round, cut to the tile or its regions.
    pub(super) fn record(
        &self,
        name: &'static str,
        bind_group: &wgpu::BindGroup,
        tile: Tile,
        scope: &mut wgpu_profiler::Scope<'_, wgpu::CommandEncoder>,
    ) {
        let first = tile.round == 0;
        let attachment = self.target.as_ref().map(|view| {
            let load = if first { wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT) } else { wgpu::LoadOp::Load };
            let ops = wgpu::Operations { load, store: wgpu::StoreOp::Store };
            wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops }
        });
        let depth = self.depth.as_ref().map(|view| {
            let load = if first { wgpu::LoadOp::Clear(0.0) } else { wgpu::LoadOp::Load };
            let depth_ops = Some(wgpu::Operations { load, store: wgpu::StoreOp::Store });
            wgpu::RenderPassDepthStencilAttachment { view, depth_ops, stencil_ops: None }
        });
        let color_attachments = [attachment];
        let descriptor = wgpu::RenderPassDescriptor {
            color_attachments: if self.target.is_some() { &color_attachments } else { &[] },
            depth_stencil_attachment: depth,
            ..Default::default()
        };
        let mut recorded = scope.scoped_render_pass(name, descriptor);
        recorded.set_pipeline(&self.pipeline);
        recorded.set_bind_group(0, bind_group, &[]);
        let begin = tile.round * self.batch;
        let end = self.instances.min(begin.saturating_add(self.batch));
        match &self.regions {
            None => {
                recorded.set_scissor_rect(tile.origin.x, tile.origin.y, tile.size.x, tile.size.y);
                recorded.draw(0..self.vertices, begin..end);
            }
            Some(regions) => {
                for (i, region) in (begin..end).zip(&regions[begin as usize..]) {
                    let [x, y, width, height] = [region.origin.x, region.origin.y, region.size.x, region.size.y];
                    recorded.set_viewport(x as f32, y as f32, width as f32, height as f32, 0.0, 1.0);
                    recorded.set_scissor_rect(x, y, width, height);
                    recorded.draw(0..self.vertices, i..i + 1);
                }
            }
        }
    }
}

fn pipeline(
    gpu: &Gpu,
    pass: &str,
    shader: &Shader,
    constants: &[(&'static str, f64)],
    draw: &Draw,
) -> wgpu::RenderPipeline {
    let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(shader.name),
        source: wgpu::ShaderSource::Wgsl(shader.source.clone()),
    });
    let compilation_options = wgpu::PipelineCompilationOptions { constants, ..Default::default() };
    let target = draw.target.map(|target| wgpu::ColorTargetState {
        format: target.texture.format(),
        blend: target.blend,
        write_mask: wgpu::ColorWrites::ALL,
    });
    let targets = [target];
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
        depth_stencil: draw.depth.map(|texture| wgpu::DepthStencilState {
            format: texture.format(),
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
            targets: if draw.target.is_some() { &targets } else { &[] },
        }),
        multiview_mask: None,
        cache: None,
    })
}
