//! A frame is a list of passes, recorded once and executed as often as one likes.
//!
//! A pass names its resources as its shader does:
//! `graph.compute("march", &MARCH).read("view", &view).write("film", &film).over_film(1).await?`.
//! The names are checked against the shader's own reflection, so a pass that forgets, invents or confuses a binding is
//! an error that names pass and binding. Recording makes pipelines and bind groups; executing allocates nothing.

mod bindings;
mod shader;

pub use bindings::{BindingError, Bindings, Resource};
pub(crate) use shader::shader;
pub use shader::{BindingKind, Reflected, Reflection, Shader};

use encase::ShaderSize;

use crate::resident::Resident;
use crate::{Gpu, RenderError};

/// A rectangle of the film, in pixels, and which of a pass's rounds over it, and of the frames since the picture last
/// changed, a dispatch is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, encase::ShaderType)]
pub struct Tile {
    /// Its top left pixel.
    pub origin: glam::UVec2,
    /// Its width and height.
    pub size: glam::UVec2,
    /// From 0.
    pub round: u32,
    /// From 0.
    pub frame: u32,
}

/// A list of passes.
#[derive(Debug)]
pub struct Graph<'a> {
    gpu: &'a Gpu,
    passes: Vec<Pass>,
    tile: wgpu::Buffer,
}

#[derive(Debug)]
struct Pass {
    name: &'static str,
    pipeline: wgpu::ComputePipeline,
    bind_group: wgpu::BindGroup,
    workgroup: [u32; 3],
    rounds: u32,
}

impl<'a> Graph<'a> {
    /// An empty list.
    pub fn new(gpu: &'a Gpu) -> Self {
        Self { gpu, passes: Vec::new(), tile: gpu.buffer("tile", &Tile::default()) }
    }

    /// The device that the passes run on.
    pub fn gpu(&self) -> &'a Gpu {
        self.gpu
    }

    /// The buffer that tells a pass over the film which part of it a dispatch covers.
    pub fn tile(&self) -> wgpu::Buffer {
        self.tile.clone()
    }

    /// Begins to declare a compute pass.
    pub fn compute<'g>(&'g mut self, name: &'static str, shader: &'static Shader) -> ComputePass<'g, 'a> {
        ComputePass { graph: self, name, shader, bindings: Bindings::default(), constants: Vec::new() }
    }

    /// Submits every pass for one tile of the film, a submission a round, each with its GPU time.
    pub fn submit(&self, tile: Tile, profiler: &mut wgpu_profiler::GpuProfiler) {
        for pass in &self.passes {
            for round in 0..pass.rounds {
                let mut bytes = encase::StorageBuffer::new([0u8; Tile::SHADER_SIZE.get() as usize]);
                bytes.write(&Tile { round, ..tile }).expect("the array has the tile's size");
                self.gpu.queue.write_buffer(&self.tile, 0, &bytes.into_inner());
                let label = wgpu::CommandEncoderDescriptor { label: Some(pass.name) };
                let mut encoder = self.gpu.device.create_command_encoder(&label);
                let mut scope = profiler.scope("frame", &mut encoder);
                let mut recorded = scope.scoped_compute_pass(pass.name);
                recorded.set_pipeline(&pass.pipeline);
                recorded.set_bind_group(0, &pass.bind_group, &[]);
                let [x, y, _] = pass.workgroup;
                recorded.dispatch_workgroups(tile.size.x.div_ceil(x), tile.size.y.div_ceil(y), 1);
                drop(recorded);
                drop(scope);
                profiler.resolve_queries(&mut encoder);
                self.gpu.queue.submit([encoder.finish()]);
            }
        }
    }
}

/// A compute pass being declared.
#[must_use = "a pass is recorded by `over_film`"]
pub struct ComputePass<'g, 'a> {
    graph: &'g mut Graph<'a>,
    name: &'static str,
    shader: &'static Shader,
    bindings: Bindings,
    constants: Vec<(&'static str, f64)>,
}

impl ComputePass<'_, '_> {
    /// Specialises the shader: the value of one of its `override`s.
    pub fn constant(mut self, name: &'static str, value: impl Into<f64>) -> Self {
        self.constants.push((name, value.into()));
        self
    }

    /// A buffer, texture or sampler that the pass reads.
    pub fn read<'r>(mut self, name: &'static str, resource: impl Into<Resource<'r>>) -> Self {
        self.bindings.read(name, resource.into());
        self
    }

    /// The media, and what a shader that imports `resident/volume.wesl` is specialised for.
    pub fn volumes(mut self, resident: &Resident) -> Self {
        let traits = &resident.traits;
        self = self
            .constant("VOLUMES", traits.count)
            .constant("GRIDS", traits.grids)
            .constant("EXPONENTIALS", traits.exponentials)
            .constant("TRANSFERS", traits.transfers)
            .constant("PLANES", traits.planes);
        self.read("volumes", &resident.volumes)
            .read("extras", &resident.extras)
            .read("bricks", &resident.bricks)
            .read("atlas", &resident.atlas)
            .read("transfers", &resident.transfers)
            .read("linear", &resident.linear)
    }

    /// A buffer or texture that the pass writes.
    pub fn write<'r>(mut self, name: &'static str, resource: impl Into<Resource<'r>>) -> Self {
        self.bindings.write(name, resource.into());
        self
    }

    /// Records the pass: one invocation a pixel of each tile, in so many rounds, one after the other. Rounds keep an
    /// invocation short where its work has no bound: drivers end those that take too long.
    ///
    /// # Errors
    /// Names that do not match the shader's, and whatever the device refuses.
    pub async fn over_film(self, rounds: u32) -> Result<(), RenderError> {
        let Self { graph, name, shader, bindings, constants } = self;
        let reflection = shader.reflect()?;
        bindings.check(name, &reflection)?;
        let workgroup = reflection.workgroup.ok_or(BindingError::NoEntryPoint { pass: name, shader: shader.name })?;
        let gpu = graph.gpu;
        let scope = gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let pipeline = compute_pipeline(gpu, name, shader, &constants);
        let bind_group = bindings.group(gpu, name, &pipeline.get_bind_group_layout(0), &reflection);
        if let Some(error) = scope.pop().await {
            return Err(RenderError::Pass { pass: name.into(), message: error.to_string() });
        }
        graph.passes.push(Pass { name, pipeline, bind_group, workgroup, rounds });
        Ok(())
    }
}

/// The pipeline of a shader with these constants, from the device's cache or made now.
fn compute_pipeline(
    gpu: &Gpu,
    pass: &str,
    shader: &Shader,
    constants: &[(&'static str, f64)],
) -> wgpu::ComputePipeline {
    let key = format!("{} {constants:?}", shader.name);
    let mut cache = gpu.pipelines.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let made = cache.entry(key).or_insert_with(|| {
        tracing::debug!(pass, shader = shader.name, ?constants, "compiling a pipeline");
        let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(shader.name),
            source: wgpu::ShaderSource::Wgsl(shader.source.into()),
        });
        gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(pass),
            layout: None,
            module: &module,
            entry_point: None,
            compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
            cache: None,
        })
    });
    made.clone()
}
