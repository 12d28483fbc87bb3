//! A frame is a list of passes, recorded once and executed as often as one likes.
//!
//! A pass names its resources as its shader does:
//! `graph.compute("march", &MARCH).read("view", &view).write("film", &film).over_film(1).await?`.
//! The names are checked against the shader's own reflection, so a pass that forgets, invents or confuses a binding is
//! an error that names pass and binding. Recording makes pipelines and bind groups; executing allocates nothing.
//!
//! What a pass runs over is said last: `over_film`, an invocation a pixel; `over_queue`, as many workgroups as an earlier pass has
//! found; `dispatch`, so many workgroups, once a frame; `draw` and `draw_layers`, triangles into a target; `draw_in_turns`, some of them
//! before each round of the pass that comes next.

mod bindings;
mod raster;
mod shader;

pub use bindings::{BindingError, Bindings, Resource};
pub use raster::{Draw, Layers, Region, Target, Turns};
pub(crate) use shader::shader;
pub use shader::{BindingKind, Reflected, Reflection, Shader};

use std::marker::PhantomData;

use encase::ShaderSize;
use tyndall_scene::surface::Surface;

use crate::gpu::bytes_of;
use crate::resident::Resident;
use crate::shadows::Shadows;
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

impl Tile {
    /// The tiles that make up a film, of at most `side` pixels a side, row by row.
    pub(crate) fn cover([width, height]: [u32; 2], side: u32, frame: u32) -> impl Iterator<Item = Self> {
        let rows = (0..height).step_by(side as usize);
        rows.flat_map(move |y| (0..width).step_by(side as usize).map(move |x| (x, y))).map(move |(x, y)| Self {
            origin: glam::uvec2(x, y),
            size: glam::uvec2(side.min(width - x), side.min(height - y)),
            round: 0,
            frame,
        })
    }
}

/// A list of passes.
#[derive(Debug)]
pub struct Graph<'a> {
    gpu: &'a Gpu,
    passes: Vec<Pass>,
    tile: wgpu::Buffer,
    followers: Vec<Follower>,
}

/// What a buffer holds where surfaces are now.
type Bytes = dyn Fn(&Resident, &[Surface]) -> Vec<u8> + Send + Sync;

/// A buffer whose bytes change when surfaces have moved.
struct Follower {
    buffer: wgpu::Buffer,
    bytes: Box<Bytes>,
}

impl std::fmt::Debug for Follower {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Follower").field("buffer", &self.buffer).finish_non_exhaustive()
    }
}

#[derive(Debug)]
struct Pass {
    name: &'static str,
    bind_group: wgpu::BindGroup,
    rounds: u32,
    work: Work,
}

#[derive(Debug)]
enum Work {
    /// An invocation a square of so many pixels a side, in workgroups of this size.
    OverFilm(wgpu::ComputePipeline, [u32; 3], u32),
    /// As many workgroups a tile as a buffer says.
    Queued(wgpu::ComputePipeline, wgpu::Buffer),
    /// So many workgroups, once a frame.
    Dispatch(wgpu::ComputePipeline, [u32; 3]),
    /// Triangles, a batch of instances a round.
    Draw(Box<raster::Drawing>),
}

impl Work {
    /// Whether it runs once a frame, not once a tile.
    fn once(&self) -> bool {
        match self {
            Work::OverFilm(..) | Work::Queued(..) => false,
            Work::Dispatch(..) => true,
            Work::Draw(drawing) => drawing.once(),
        }
    }

    /// Whether its rounds and those of the next pass take turns.
    fn in_turns(&self) -> bool {
        matches!(self, Work::Draw(drawing) if drawing.in_turns())
    }
}

impl<'a> Graph<'a> {
    /// An empty list.
    pub fn new(gpu: &'a Gpu) -> Self {
        Self { gpu, passes: Vec::new(), tile: gpu.buffer("tile", &Tile::default()), followers: Vec::new() }
    }

    /// The device that the passes run on.
    pub fn gpu(&self) -> &'a Gpu {
        self.gpu
    }

    /// The buffer that tells a pass over the film which part of it a dispatch covers.
    pub fn tile(&self) -> wgpu::Buffer {
        self.tile.clone()
    }

    /// A buffer of what passes need to know of where surfaces are: `value` says it anew when they have moved.
    pub(crate) fn follow<T>(
        &mut self,
        buffer: &wgpu::Buffer,
        value: impl Fn(&Resident, &[Surface]) -> T + Send + Sync + 'static,
    ) where
        T: encase::ShaderType + encase::internal::WriteInto,
    {
        let bytes = Box::new(move |resident: &Resident, surfaces: &[Surface]| bytes_of(&value(resident, surfaces)));
        self.followers.push(Follower { buffer: buffer.clone(), bytes });
    }

    /// Tells the passes that surfaces have moved.
    pub(crate) fn moved(&self, resident: &Resident, surfaces: &[Surface]) {
        for Follower { buffer, bytes } in &self.followers {
            self.gpu.queue.write_buffer(buffer, 0, &bytes(resident, surfaces));
        }
    }

    /// Begins to declare a compute pass.
    pub fn compute<'g>(&'g mut self, name: &'static str, shader: &'static Shader) -> Declaration<'g, 'a, Compute> {
        Declaration::new(self, name, shader)
    }

    /// Begins to declare a pass that draws.
    pub fn raster<'g>(&'g mut self, name: &'static str, shader: &'static Shader) -> Declaration<'g, 'a, Raster> {
        Declaration::new(self, name, shader)
    }

    /// Runs every pass that runs once a frame: what is made before there is one.
    ///
    /// # Errors
    /// Settings that the profiler refuses.
    pub fn run_once(&self) -> Result<(), RenderError> {
        let settings = wgpu_profiler::GpuProfilerSettings { enable_timer_queries: false, ..Default::default() };
        let mut profiler = wgpu_profiler::GpuProfiler::new(&self.gpu.device, settings)
            .map_err(|error| RenderError::Pass { pass: "profiler".into(), message: error.to_string() })?;
        self.submit(Tile::default(), &mut profiler);
        Ok(())
    }

    /// Submits every pass for one tile of the film, a submission a round, each with its GPU time. A pass that runs once a
    /// frame does so with the first tile.
    pub fn submit(&self, tile: Tile, profiler: &mut wgpu_profiler::GpuProfiler) {
        let first = tile.origin == glam::UVec2::ZERO;
        for together in self.passes.chunk_by(|pass, _| pass.work.in_turns()) {
            let rounds = together.iter().map(|pass| pass.rounds).max().unwrap_or(0);
            for round in 0..rounds {
                let wanted = |pass: &&Pass| round < pass.rounds && (first || !pass.work.once());
                for pass in together.iter().filter(wanted) {
                    self.submit_pass(pass, Tile { round, ..tile }, profiler);
                }
            }
        }
    }

    fn submit_pass(&self, pass: &Pass, tile: Tile, profiler: &mut wgpu_profiler::GpuProfiler) {
        let mut bytes = encase::StorageBuffer::new([0u8; Tile::SHADER_SIZE.get() as usize]);
        bytes.write(&tile).expect("the array has the tile's size");
        self.gpu.queue.write_buffer(&self.tile, 0, &bytes.into_inner());
        let label = wgpu::CommandEncoderDescriptor { label: Some(pass.name) };
        let mut encoder = self.gpu.device.create_command_encoder(&label);
        let mut scope = profiler.scope("frame", &mut encoder);
        pass.record(tile, &mut scope);
        drop(scope);
        profiler.resolve_queries(&mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
    }
}

impl Pass {
    fn record(&self, tile: Tile, scope: &mut wgpu_profiler::Scope<'_, wgpu::CommandEncoder>) {
        let (pipeline, workgroups) = match &self.work {
            Work::Draw(drawing) => return drawing.record(self.name, &self.bind_group, tile, scope),
            Work::Dispatch(pipeline, workgroups) => (pipeline, *workgroups),
            Work::Queued(pipeline, _) => (pipeline, [0; 3]),
            Work::OverFilm(pipeline, [x, y, _], scale) => {
                let [width, height] = tile.size.to_array().map(|side| squares(side, *scale));
                (pipeline, [width.div_ceil(*x), height.div_ceil(*y), 1])
            }
        };
        let mut recorded = scope.scoped_compute_pass(self.name);
        recorded.set_pipeline(pipeline);
        recorded.set_bind_group(0, &self.bind_group, &[]);
        let Work::Queued(_, queued) = &self.work else {
            let [x, y, z] = workgroups;
            recorded.dispatch_workgroups(x, y, z);
            return;
        };
        recorded.dispatch_workgroups_indirect(queued, 0);
        drop(recorded);
        if tile.round + 1 == self.rounds {
            scope.clear_buffer(queued, 0, None);
        }
    }
}

/// How many squares of `scale` pixels a side a pass runs over, along a side of a tile: where they are larger than a pixel, three
/// beyond it, between whose corners a later pass interpolates.
pub(crate) fn squares(side: u32, scale: u32) -> u32 {
    side.div_ceil(scale) + if scale > 1 { 3 } else { 0 }
}

/// A pass that computes.
#[derive(Debug)]
pub enum Compute {}

/// A pass that draws.
#[derive(Debug)]
pub enum Raster {}

/// A pass being declared.
#[must_use = "a pass is recorded by what it runs over: `over_film`, `dispatch` or `draw`"]
pub struct Declaration<'g, 'a, Kind> {
    graph: &'g mut Graph<'a>,
    name: &'static str,
    shader: Shader,
    bindings: Bindings,
    constants: Vec<(&'static str, f64)>,
    kind: PhantomData<Kind>,
}

impl<'g, 'a, Kind> Declaration<'g, 'a, Kind> {
    fn new(graph: &'g mut Graph<'a>, name: &'static str, shader: &'static Shader) -> Self {
        Self {
            graph,
            name,
            shader: shader.clone(),
            bindings: Bindings::default(),
            constants: Vec::new(),
            kind: PhantomData,
        }
    }

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

    /// The world: of what `resident/volume.wesl`, `surface.wesl`, `bodies.wesl`, `transmittance.wesl` and `sky.wesl` bind and are specialised for, as much as the shader uses.
    pub fn world(mut self, resident: &Resident) -> Self {
        if let Some(source) = resident.expressions.as_ref().and_then(|text| text.splice(&self.shader.source)) {
            self.shader.source = source.into();
        }
        // A shader that cannot be reflected is an error when the pass is recorded.
        let Ok(reflection) = self.shader.reflect() else { return self };
        let traits = &resident.traits;
        let constants = [
            ("VOLUMES", f64::from(traits.count)),
            ("GRIDS", f64::from(traits.grids)),
            ("EXPONENTIALS", f64::from(traits.exponentials)),
            ("SPHERES", f64::from(traits.spheres)),
            ("NOISES", f64::from(traits.noises)),
            ("EXPRESSIONS", f64::from(traits.expressions)),
            ("TINTED", f64::from(traits.tinted)),
            ("GREY", f64::from(traits.grey)),
            ("PHASE_TABLES", f64::from(traits.phase_tables)),
            ("SKY", f64::from(resident.map.is_some())),
            ("TRANSFERS", f64::from(traits.transfers)),
            ("PLANES", f64::from(traits.planes)),
            ("SHADED", f64::from(traits.shaded)),
            ("SURFACES", f64::from(traits.surfaces)),
            ("GRADIENTS", f64::from(resident.has_gradients())),
            ("VALUED", f64::from(resident.has_valued_gradients())),
            ("FLAT", f64::from(resident.flat)),
            ("CUTOUTS", f64::from(resident.surfaces.cutouts)),
            ("PICTURES", f64::from(resident.surfaces.pictures)),
        ];
        for (name, value) in constants.into_iter().chain(resident.transmittance.constants()) {
            if reflection.overrides.iter().any(|used| used == name) {
                self = self.constant(name, value);
            }
        }
        let resources: [(_, Resource); 18] = [
            ("volumes", (&resident.volumes).into()),
            ("bricks", (&resident.bricks).into()),
            ("atlas", (&resident.atlas).into()),
            ("gradients", (&resident.gradients).into()),
            ("transfers", (&resident.transfers).into()),
            ("phases", (&resident.phases).into()),
            ("sky", (&resident.sky).into()),
            ("linear", (&resident.linear).into()),
            ("vertices", (&resident.surfaces.vertices).into()),
            ("triangles", (&resident.surfaces.triangles).into()),
            ("materials", (&resident.surfaces.materials).into()),
            ("texels", (&resident.surfaces.texels).into()),
            ("transmittance_maps", (&resident.transmittance.maps).into()),
            ("transmittances", (&resident.transmittance.texels).into()),
            ("transmittance_events", (&resident.transmittance.events).into()),
            ("balls", (&resident.bodies.balls).into()),
            ("segments", (&resident.bodies.segments).into()),
            ("bodies", (&resident.bodies.info).into()),
        ];
        for (name, resource) in resources {
            if reflection.bindings.iter().any(|used| used.name == name) {
                self = self.read(name, resource);
            }
        }
        self
    }

    /// Shadow maps, for `shadows/lookup.wesl`.
    pub fn shadows(self, shadows: &Shadows) -> Self {
        self.constant("SHADOWS", shadows.any).read("shadow_maps", &shadows.maps).read("shadow_atlas", &shadows.atlas)
    }

    /// Makes what the pass works with and its bind group, and appends it to the list.
    async fn record(
        self,
        reflection: &Reflection,
        rounds: u32,
        make: impl FnOnce(&Gpu, &[(&'static str, f64)]) -> (Work, wgpu::BindGroupLayout),
    ) -> Result<(), RenderError> {
        let Self { graph, name, bindings, constants, .. } = self;
        bindings.check(name, reflection)?;
        let gpu = graph.gpu;
        let scope = gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let (work, layout) = make(gpu, &constants);
        let bind_group = bindings.group(gpu, name, &layout, reflection);
        if let Some(error) = scope.pop().await {
            return Err(RenderError::Pass { pass: name.into(), message: error.to_string() });
        }
        graph.passes.push(Pass { name, bind_group, rounds, work });
        Ok(())
    }
}

impl Declaration<'_, '_, Compute> {
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
        self.over_coarse_film(rounds, 1).await
    }

    /// As [`over_film`](Self::over_film), an invocation a square of `scale` pixels a side, of as many `squares` a side of the
    /// tile.
    ///
    /// # Errors
    /// As [`over_film`](Self::over_film).
    pub async fn over_coarse_film(self, rounds: u32, scale: u32) -> Result<(), RenderError> {
        self.compute(rounds, |pipeline, workgroup| Work::OverFilm(pipeline, workgroup, scale)).await
    }

    /// Records the pass: for each tile as many workgroups along x, y, z as the first three numbers of a buffer say, in so many
    /// rounds. An earlier pass over the tile adds to them; afterwards they are 0 again.
    ///
    /// # Errors
    /// As [`over_film`](Self::over_film).
    pub async fn over_queue(self, rounds: u32, workgroups: &wgpu::Buffer) -> Result<(), RenderError> {
        self.compute(rounds, |pipeline, _| Work::Queued(pipeline, workgroups.clone())).await
    }

    /// Records the pass: so many workgroups along x, y, z, once a frame, in so many rounds, one after the other.
    ///
    /// # Errors
    /// As [`over_film`](Self::over_film).
    pub async fn dispatch(self, workgroups: [u32; 3], rounds: u32) -> Result<(), RenderError> {
        self.compute(rounds, |pipeline, _| Work::Dispatch(pipeline, workgroups)).await
    }

    async fn compute(
        self,
        rounds: u32,
        work: impl FnOnce(wgpu::ComputePipeline, [u32; 3]) -> Work,
    ) -> Result<(), RenderError> {
        let (name, shader) = (self.name, self.shader.clone());
        let reflection = shader.reflect()?;
        let workgroup = reflection.workgroup.ok_or(BindingError::NoEntryPoint { pass: name, shader: shader.name })?;
        let make = |gpu: &Gpu, constants: &[_]| {
            let pipeline = compute_pipeline(gpu, name, &shader, constants);
            let layout = pipeline.get_bind_group_layout(0);
            (work(pipeline, workgroup), layout)
        };
        self.record(&reflection, rounds, make).await
    }
}

/// The pipeline of a shader with these constants, from the device's cache or made now.
fn compute_pipeline(
    gpu: &Gpu,
    pass: &str,
    shader: &Shader,
    constants: &[(&'static str, f64)],
) -> wgpu::ComputePipeline {
    let key = format!("{} {constants:?}{}", shader.name, shader.own());
    let mut cache = gpu.pipelines.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let made = cache.entry(key).or_insert_with(|| {
        tracing::debug!(pass, shader = shader.name, ?constants, "compiling a pipeline");
        let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(shader.name),
            source: wgpu::ShaderSource::Wgsl(shader.source.clone()),
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
