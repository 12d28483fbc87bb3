//! The film on a screen: exposure and AgX into a texture of the caller's.
//!
//! This one pass over the whole picture is rasterised: a swap chain's textures can be drawn to but, by WebGPU's default
//! features, not written from compute.

use crate::graph::{Bindings, Shader, shader};
use crate::{Gpu, RenderError};

static DISPLAY: Shader = shader!("display/display");

/// The buffer `display`.
#[derive(Clone, Copy, Debug, encase::ShaderType)]
pub(crate) struct Parameters {
    /// 2^exposure.
    pub(crate) scale: f32,
    /// 1 where the target takes sRGB-encoded values, 0 where its format encodes by itself.
    pub(crate) encode: u32,
}

/// A pass that draws a film.
#[derive(Debug)]
pub struct Display {
    pipeline: wgpu::RenderPipeline,
    bind_group: wgpu::BindGroup,
}

impl Display {
    /// A pass from `film` to targets of `format`, with an exposure in stops (EV).
    ///
    /// # Errors
    /// A format that cannot be drawn to.
    pub async fn new(
        gpu: &Gpu,
        film: &wgpu::Texture,
        format: wgpu::TextureFormat,
        exposure: f32,
    ) -> Result<Self, RenderError> {
        let parameters = Parameters { scale: exposure.exp2(), encode: u32::from(!format.is_srgb()) };
        let parameters = gpu.buffer("display", &parameters);
        let mut bindings = Bindings::default();
        bindings.read("display", (&parameters).into());
        bindings.read("film", film.into());
        let reflection = DISPLAY.reflect()?;
        bindings.check("display", &reflection)?;
        let scope = gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(DISPLAY.name),
            source: wgpu::ShaderSource::Wgsl(DISPLAY.source.clone()),
        });
        let pipeline = gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("display"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: None,
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: None,
                compilation_options: Default::default(),
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let bind_group = bindings.group(gpu, "display", &pipeline.get_bind_group_layout(0), &reflection);
        match scope.pop().await {
            Some(error) => Err(RenderError::Pass { pass: "display".into(), message: error.to_string() }),
            None => Ok(Self { pipeline, bind_group }),
        }
    }

    /// Appends the pass to the encoder's commands.
    pub fn draw(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        profiler: &wgpu_profiler::GpuProfiler,
    ) {
        let mut scope = profiler.scope("display", encoder);
        let attachment = wgpu::RenderPassColorAttachment {
            view: target,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
        };
        let mut pass = scope.scoped_render_pass(
            "display",
            wgpu::RenderPassDescriptor { color_attachments: &[Some(attachment)], ..Default::default() },
        );
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bind_group, &[]);
        pass.draw(0..3, 0..1);
    }
}
