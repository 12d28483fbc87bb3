//! The order of a frame, readable as a recipe.

use glam::Mat4;
use tyndall_scene::description::Camera;
use tyndall_scene::parameter::Settings;
use tyndall_scene::surface::Surface;
use tyndall_scene::{FieldError, World};

use crate::display::Display;
use crate::graph::{Graph, Tile};
use crate::resident::{Resident, View, surfaces};
use crate::surfaces::GBuffer;
use crate::techniques::{Chosen, Recorded, Recording, Role, chosen, direct};
use crate::{Gpu, RenderError};

/// A frame of one world: passes recorded once, rendered as often as one likes. Rendering allocates nothing on the device.
pub struct Frame<'a> {
    resident: Resident,
    graph: Graph<'a>,
    film: wgpu::Texture,
    gbuffer: Option<GBuffer>,
    /// The camera of the next frame.
    view: View,
    /// The surfaces of the next frame, and the transforms that they had in the last.
    surfaces: Vec<Surface>,
    transforms: Vec<Mat4>,
    /// The technique whose light stays as surfaces were, if there is one.
    still: Option<&'static str>,
    profiler: wgpu_profiler::GpuProfiler,
    exposure: f32,
    /// Frames rendered since the picture last changed; those with jitter add up.
    frames: u32,
    display: Option<(wgpu::TextureFormat, Display)>,
}

impl<'a> Frame<'a> {
    /// Uploads the world and records the passes of the techniques that its scene asks for: what is seen of
    /// surfaces, their light, and the media before them.
    ///
    /// # Errors
    /// What does not fit the device, settings that are not accepted, and passes that the device refuses.
    pub async fn new(gpu: &'a Gpu, world: &World) -> Result<Self, RenderError> {
        // Settings that are not accepted are found before anything is uploaded.
        let techniques = chosen(&world.scene)?;
        let mut resident = Resident::new(gpu, world).await?;
        let film = film_texture(gpu, resident.film, "film").await?;
        let (graph, gbuffer) = Self::passes(gpu, world, &techniques, &mut resident, &film).await?;
        let still = still(&techniques);
        let (surfaces, frame) = (world.surfaces.clone(), Self::of(graph, world, resident, film, gbuffer)?);
        Ok(Self { transforms: transforms(&surfaces).collect(), surfaces, still, ..frame })
    }

    /// The passes of a world's techniques, and what they see of surfaces.
    async fn passes(
        gpu: &'a Gpu,
        world: &World,
        techniques: &[Chosen],
        resident: &mut Resident,
        film: &wgpu::Texture,
    ) -> Result<(Graph<'a>, Option<GBuffer>), RenderError> {
        let mut graph = Graph::new(gpu);
        let (mut gbuffer, mut behind) = (None, None);
        if resident.surfaces.count > 0 {
            let seen = GBuffer::new(gpu, resident).await?;
            seen.fill(&mut graph, resident, &resident.view, &resident.previous, 1.0).await?;
            gbuffer = Some(seen);
            behind = Some(film_texture(gpu, resident.film, "behind").await?);
        }
        for (technique, settings) in techniques {
            let (film, behind) = match technique.role {
                Role::Surfaces => (behind.as_ref(), None),
                _ => (Some(film), behind.as_ref()),
            };
            let Some(film) = film else { continue };
            let recording =
                Recording { graph: &mut graph, resident, settings, film, world, gbuffer: gbuffer.as_ref(), behind };
            (technique.record)(recording).await?;
        }
        Ok((graph, gbuffer))
    }

    /// As [`new`](Self::new), of the media of a world that is on the device alone, with the passes that `record` records.
    pub(crate) async fn record(
        gpu: &'a Gpu,
        world: &World,
        mut resident: Resident,
        settings: &Settings,
        record: impl for<'r> FnOnce(Recording<'r, 'a>) -> Recorded<'r>,
    ) -> Result<Self, RenderError> {
        let film = film_texture(gpu, resident.film, "film").await?;
        let mut graph = Graph::new(gpu);
        let recording = Recording {
            graph: &mut graph,
            resident: &mut resident,
            settings,
            film: &film,
            world,
            gbuffer: None,
            behind: None,
        };
        record(recording).await?;
        Self::of(graph, world, resident, film, None)
    }

    fn of(
        graph: Graph<'a>,
        world: &World,
        resident: Resident,
        film: wgpu::Texture,
        gbuffer: Option<GBuffer>,
    ) -> Result<Self, RenderError> {
        let profiler =
            wgpu_profiler::GpuProfiler::new(&graph.gpu().device, wgpu_profiler::GpuProfilerSettings::default())
                .map_err(|error| RenderError::Pass { pass: "profiler".into(), message: error.to_string() })?;
        let view = resident.view_of(&world.scene.camera);
        let exposure = world.scene.film.exposure;
        Ok(Self {
            resident,
            graph,
            film,
            gbuffer,
            view,
            surfaces: Vec::new(),
            transforms: Vec::new(),
            still: None,
            profiler,
            exposure,
            frames: 0,
            display: None,
        })
    }

    /// Radiance (rgb) and opacity (a) as last rendered, `Rgba32Float`, linear Rec. 709.
    pub fn film(&self) -> &wgpu::Texture {
        &self.film
    }

    /// The world as the device has it.
    #[cfg(test)]
    pub(crate) fn resident(&self) -> &Resident {
        &self.resident
    }

    /// What was seen of surfaces as last rendered, motion since the frame before among it; `None` where there are none.
    pub fn gbuffer(&self) -> Option<&GBuffer> {
        self.gbuffer.as_ref()
    }

    /// Moves the camera; the next rendering shows it.
    pub fn set_camera(&mut self, camera: &Camera) {
        self.frames = 0;
        self.view = self.resident.view_of(camera);
        self.graph.gpu().write(&self.resident.view, &self.view);
    }

    /// Moves the surface of a name; the next rendering shows it, with its light and all shadows, as a new frame would. Nothing is recorded anew. Motion in [`gbuffer`](Self::gbuffer) is from where it was in the last rendering.
    ///
    /// # Errors
    /// A name that there is not, a transform that has no inverse, and a technique whose light does not move with surfaces: instant
    /// radiosity has [`Walkthrough`](crate::techniques::instant_radiosity::Walkthrough) for it.
    pub fn set_transform(&mut self, name: &str, world_from_object: Mat4) -> Result<(), RenderError> {
        if let Some(technique) = self.still {
            return Err(FieldError {
                path: format!("techniques.{technique}"),
                found: format!("it, with surfaces.{name} that moves"),
                accepted: format!("techniques.{}, or a Walkthrough", direct::TECHNIQUE.name),
            }
            .into());
        }
        surfaces::set_transform(&mut self.surfaces, name, world_from_object)?;
        self.frames = 0;
        Ok(())
    }

    /// Shows media as `world` has them now: what they do to light (see [`World::set_optics`]), where they are and where they
    /// are cut, other particles and strands (see [`Volume::set_bodies`](tyndall_scene::Volume::set_bodies)), and how techniques are
    /// set. The next rendering shows it, on the same film, as a new frame would; whatever
    /// the change, from coefficients to a transfer function among them. No voxel is uploaded: tables and the bounds of bricks
    /// are made anew and the passes recorded again, and pipelines that were needed before are there. The camera, lights,
    /// surfaces and the film's size stay as this frame has them. The textures of [`gbuffer`](Self::gbuffer) are others afterwards.
    ///
    /// # Errors
    /// Grids that are not those of the world that the frame was made of, and those of [`new`](Self::new); the frame then goes
    /// on as before.
    pub async fn set_media(&mut self, world: &World) -> Result<(), RenderError> {
        let gpu = self.graph.gpu();
        let techniques = chosen(&world.scene)?;
        let world = World { surfaces: self.surfaces.clone(), ..world.clone() };
        let mut resident = self.resident.with_media(gpu, &world).await?;
        let (graph, gbuffer) = Self::passes(gpu, &world, &techniques, &mut resident, &self.film).await?;
        resident.upload_bodies(gpu, &world);
        (self.resident, self.graph, self.gbuffer, self.frames) = (resident, graph, gbuffer, 0);
        self.still = still(&techniques);
        Ok(())
    }

    /// Submits the passes that fill the film. Where a technique jitters its samples, the film holds the mean of the frames
    /// since the picture last changed.
    pub fn render(&mut self) {
        let gpu = self.graph.gpu();
        let moved = !transforms(&self.surfaces).eq(self.transforms.iter().copied());
        if moved {
            self.resident.moved(gpu, &self.surfaces, &self.transforms);
            self.graph.moved(&self.resident, &self.surfaces);
        }
        for tile in self.tiles() {
            self.render_tile(tile);
        }
        gpu.write(&self.resident.previous, &self.view);
        if moved {
            self.transforms.clear();
            self.transforms.extend(transforms(&self.surfaces));
            self.resident.surfaces.moved_from(gpu, &self.surfaces, &self.transforms);
        }
        self.frames += 1;
    }

    /// The tiles that make up the film.
    pub(crate) fn tiles(&self) -> impl Iterator<Item = Tile> + use<> {
        Tile::cover(self.resident.film, self.graph.gpu().tile_side(), self.frames)
    }

    /// As [`render`](Self::render), for a part of the film.
    pub(crate) fn render_tile(&mut self, tile: Tile) {
        self.graph.submit(tile, &mut self.profiler);
        self.end_profile();
    }

    /// Submits a pass that shows the film, tone-mapped, on a texture of the caller's: of the film's size, and of any
    /// format that can be drawn to.
    ///
    /// # Errors
    /// A format that cannot be drawn to.
    pub async fn show(&mut self, target: &wgpu::Texture) -> Result<(), RenderError> {
        let format = target.format();
        let display = match self.display.take() {
            Some((same, display)) if same == format => display,
            _ => Display::new(self.graph.gpu(), &self.film, format, self.exposure).await?,
        };
        let gpu = self.graph.gpu();
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        display.draw(&mut encoder, &target.create_view(&Default::default()), &self.profiler);
        self.profiler.resolve_queries(&mut encoder);
        gpu.queue.submit([encoder.finish()]);
        self.end_profile();
        self.display = Some((format, display));
        Ok(())
    }

    fn end_profile(&mut self) {
        if let Err(error) = self.profiler.end_frame() {
            tracing::debug!("no pass times: {error}");
        }
    }

    /// GPU times [s] of passes that the device has finished since the last call, by label. Empty on a device without
    /// timestamps.
    pub fn timings(&mut self) -> Vec<(String, f64)> {
        let mut times = Vec::new();
        let period = self.graph.gpu().queue.get_timestamp_period();
        while let Some(queries) = self.profiler.process_finished_frame(period) {
            collect(&queries, &mut times);
        }
        times
    }
}

fn transforms(surfaces: &[Surface]) -> impl Iterator<Item = Mat4> + '_ {
    surfaces.iter().map(|surface| surface.world_from_object)
}

/// The technique, if any, whose light of surfaces is found as passes are recorded.
fn still(techniques: &[Chosen]) -> Option<&'static str> {
    let names = techniques.iter().map(|(technique, _)| (technique.role, technique.name));
    names.filter(|(role, name)| *role == Role::Surfaces && *name != direct::TECHNIQUE.name).map(|(_, name)| name).next()
}

fn collect(queries: &[wgpu_profiler::GpuTimerQueryResult], times: &mut Vec<(String, f64)>) {
    for query in queries {
        if query.nested_queries.is_empty()
            && let Some(time) = &query.time
        {
            times.push((query.label.clone(), time.end - time.start));
        }
        collect(&query.nested_queries, times);
    }
}

/// A texture to render a film of this size into.
pub(crate) async fn film_texture(gpu: &Gpu, film: [u32; 2], label: &str) -> Result<wgpu::Texture, RenderError> {
    let usage = wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_SRC;
    gpu.texture_2d(label, film, wgpu::TextureFormat::Rgba32Float, usage).await
}
