//! Passes that draw: triangles without vertex buffers, blended into a texture of the film's size.

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
    /// A texture of the film's size. All of it is cleared to 0 before the first instance of each tile: later passes over the
    /// film find in it what belongs to their tile.
    pub target: &'t wgpu::Texture,
    /// How a fragment goes together with what is there.
    pub blend: wgpu::BlendState,
}

impl Declaration<'_, '_, Raster> {
    /// Records the pass; of each tile, what falls into it is drawn.
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
            let target = draw.target.create_view(&Default::default());
            let Draw { vertices, instances, batch, .. } = draw;
            (Work::Draw(Drawing { pipeline, target, vertices, instances, batch }), layout)
        };
        self.record(&reflection, rounds, make).await
    }
}

/// A [`Draw`] with its pipeline.
#[derive(Debug)]
pub(super) struct Drawing {
    pipeline: wgpu::RenderPipeline,
    target: wgpu::TextureView,
    vertices: u32,
    instances: u32,
    batch: u32,
}

impl Drawing {
    /// Appends the batch of the tile's round, cut to the tile.
    pub(super) fn record(
        &self,
        name: &'static str,
        bind_group: &wgpu::BindGroup,
        tile: Tile,
        scope: &mut wgpu_profiler::Scope<'_, wgpu::CommandEncoder>,
    ) {
        let load = if tile.round == 0 { wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT) } else { wgpu::LoadOp::Load };
        let attachment = wgpu::RenderPassColorAttachment {
            view: &self.target,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
        };
        let descriptor = wgpu::RenderPassDescriptor { color_attachments: &[Some(attachment)], ..Default::default() };
        let mut recorded = scope.scoped_render_pass(name, descriptor);
        recorded.set_pipeline(&self.pipeline);
        recorded.set_bind_group(0, bind_group, &[]);
        recorded.set_scissor_rect(tile.origin.x, tile.origin.y, tile.size.x, tile.size.y);
        let begin = tile.round * self.batch;
        recorded.draw(0..self.vertices, begin..self.instances.min(begin.saturating_add(self.batch)));
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
    let target = wgpu::ColorTargetState {
        format: draw.target.format(),
        blend: Some(draw.blend),
        write_mask: wgpu::ColorWrites::ALL,
    };
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
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: None,
            compilation_options,
            targets: &[Some(target)],
        }),
        multiview_mask: None,
        cache: None,
    })
}
