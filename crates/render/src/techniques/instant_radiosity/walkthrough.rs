//! Walking through a scene: the last N images, one a path, of which each frame replaces the oldest [Keller97].

use tyndall_scene::World;
use tyndall_scene::description::Camera;
use tyndall_scene::image::Image;
use tyndall_scene::surface::Surface;

use super::batches::{Batch, batch_texels, pixel_offset};
use super::gathering::{Gather, Gathering, gather_pass};
use super::sources::Sources;
use super::vpl::Vpl;
use super::{TECHNIQUE, Walk, per_round, points, walk};
use crate::frame::film_texture;
use crate::graph::{Graph, Shader, Tile, shader};
use crate::renderer::read_film;
use crate::resident::surfaces::set_transform;
use crate::resident::{Resident, View, bvh};
use crate::techniques::chosen;
use crate::{Gpu, RenderError};

static RING: Shader = shader!("techniques/instant_radiosity/ring");

/// The buffer `ring`.
#[derive(Clone, Copy, Debug, encase::ShaderType)]
pub(crate) struct Ring {
    scale: f32,
}

/// Instant radiosity over many frames. A frame renders the light of one path alone, as the camera and the surfaces are then;
/// the film shows the last `paths` of them together. So what moves is smeared over so many frames, and a still scene's film
/// becomes that of a [`Frame`](crate::Frame) with as many samples as paths.
pub struct Walkthrough<'a> {
    world: World,
    walk: Walk,
    resident: Resident,
    graph: Graph<'a>,
    profiler: wgpu_profiler::GpuProfiler,
    film: wgpu::Texture,
    gathering: Gathering,
    scale: wgpu::Buffer,
    slot: wgpu::Buffer,
    /// An image a path, in half floats.
    images: Vec<wgpu::Buffer>,
    /// In which part of the pixel each path's camera ray is.
    groups: Vec<u32>,
    gather: Gather,
    /// Virtual lights of a frame, at most, and of a round.
    capacity: usize,
    at_once: u32,
    frames: u64,
}

/// Virtual lights of a path at most, lamps among them and without images in mirrors: paths are cut there.
const LONGEST: usize = 16;

impl<'a> Walkthrough<'a> {
    /// Begins with a world without media, by the settings of `techniques.instant_radiosity`.
    ///
    /// # Errors
    /// What does not fit the device, settings that are not accepted, and passes that the device refuses.
    pub async fn new(gpu: &'a Gpu, world: &World) -> Result<Self, RenderError> {
        let techniques = chosen(&world.scene)?;
        let own = techniques.into_iter().find(|(technique, _)| technique.name == TECHNIQUE.name);
        let settings = match own {
            Some((_, settings)) => settings,
            None => tyndall_scene::parameter::Settings::new(TECHNIQUE.name, TECHNIQUE.parameters, None)?,
        };
        // What is kept is what lights and is lit.
        let world = World {
            scene: world.scene.clone(),
            surfaces: world.surfaces.clone(),
            lights: world.lights.clone(),
            environment: world.environment.clone(),
            ..World::default()
        };
        let resident = Resident::new(gpu, &world).await?;
        let walk = Walk::new(&world, &settings)?;
        let mut gather = walk.gather(&resident, &settings);
        let capacity = LONGEST * (1 + walk.mirrors.len());
        let at_once = per_round(gpu, &resident, &walk, &walk.lights(), &gather)?.min(capacity as u32);
        gather.rounds = (capacity as u32).div_ceil(at_once);
        gather.vpls = vec![Vpl::BLACK; capacity];
        let [width, height] = resident.film.map(u64::from);
        let buffer = |label, size, more| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC | more,
                mapped_at_creation: false,
            })
        };
        let storage = wgpu::BufferUsages::STORAGE;
        let paths = walk.counts[0];
        let images = (0..paths).map(|_| buffer("image", 8 * width * height, wgpu::BufferUsages::empty())).collect();
        let [slot, sums] =
            [("slot", 8), ("sums", 16)].map(|(label, size)| buffer(label, size * width * height, storage));
        let (film, image) =
            (film_texture(gpu, resident.film, "film").await?, film_texture(gpu, resident.film, "image").await?);
        let batches = vec![Batch::default(); gather.rounds as usize];
        let gathering = Gathering::by_rays(gpu, walk.geometry.bvh.textures(gpu).await?, &gather, &batches).await?;
        let scale = gpu.buffer("ring", &Ring { scale: 1.0 });
        let mut graph = Graph::new(gpu);
        gather_pass(&mut graph, &resident, &walk.geometry, &gathering, &points::cells(gpu), 1, &image).await?;
        let tile = graph.tile();
        graph
            .compute("ring", &RING)
            .read("view", &resident.view)
            .read("tile", &tile)
            .read("ring", &scale)
            .read("image", &image)
            .write("slot", &slot)
            .write("sums", &sums)
            .write("film", &film)
            .over_film(1)
            .await?;
        let profiler = wgpu_profiler::GpuProfiler::new(&gpu.device, wgpu_profiler::GpuProfilerSettings::default())
            .map_err(|error| RenderError::Pass { pass: "profiler".into(), message: error.to_string() })?;
        let groups = walk::groups(paths, paths);
        Ok(Self {
            world,
            walk,
            resident,
            graph,
            profiler,
            film,
            gathering,
            scale,
            slot,
            images,
            groups,
            gather,
            capacity,
            at_once,
            frames: 0,
        })
    }

    /// Radiance (rgb) and opacity (a) as last rendered, `Rgba32Float`, linear Rec. 709.
    pub fn film(&self) -> &wgpu::Texture {
        &self.film
    }

    /// The film, read back; the host waits for it.
    ///
    /// # Errors
    /// A device that is lost, or out of memory.
    pub async fn image(&self) -> Result<Image, RenderError> {
        let [width, height] = self.resident.film;
        let pixels = read_film(self.graph.gpu(), &self.film).await?;
        Ok(Image { width, height, pixels, ..Image::default() })
    }

    /// Moves the camera; frames from now on are seen from there.
    pub fn set_camera(&mut self, camera: &Camera) {
        let view = View::new(camera, self.resident.film, self.resident.environment, self.resident.sky_rotation());
        self.graph.gpu().write(&self.resident.view, &view);
    }

    /// Moves the surface of a name; frames from now on have it there. The hierarchy is fitted anew, not built.
    ///
    /// # Errors
    /// A name that there is not, and a transform that has no inverse.
    pub fn set_transform(&mut self, name: &str, world_from_object: glam::Mat4) -> Result<(), RenderError> {
        set_transform(&mut self.world.surfaces, name, world_from_object)?;
        self.moved();
        Ok(())
    }

    fn moved(&mut self) {
        let gpu = self.graph.gpu();
        let surfaces: &[Surface] = &self.world.surfaces;
        self.walk.geometry.moved(surfaces);
        self.walk.sources = Sources::new(&self.world, &self.walk.geometry);
        self.walk.geometry.bvh.update(gpu, &self.gathering.hierarchy);
        self.resident.surfaces.moved(gpu, surfaces);
        let most = self.walk.mirrors.len();
        self.walk.mirrors = self.walk.geometry.mirrors(super::MOST_PLANES);
        self.walk.mirrors.truncate(most);
    }

    /// Submits the next frame: the light of one path takes the place of the oldest. Gives how many virtual lights that were.
    pub fn render(&mut self) -> usize {
        let gpu = self.graph.gpu();
        let paths = self.walk.counts[0];
        let path = (self.frames % u64::from(paths)) as u32;
        let list = self.lights(path);
        let shown = list.len();
        self.frames += 1;
        let offset = pixel_offset(self.groups[path as usize], paths);
        let batch = |number: u32| {
            let [begin, end] = [number, number + 1].map(|n| (n * self.at_once).min(shown as u32));
            let emission = if number == 0 { 1.0 / paths as f32 } else { 0.0 };
            Batch { offset, begin, end, emission, ray: self.groups[path as usize], first_map: 0 }
        };
        let batches: Vec<_> = (0..self.gather.rounds).map(batch).collect();
        bvh::write(gpu, &self.gathering.batches, batch_texels(&batches));
        if !list.is_empty() {
            self.gather.vpls = list;
            gpu.write(&self.gathering.gather, &self.gather);
        }
        let there = self.frames.min(u64::from(paths));
        gpu.write(&self.scale, &Ring { scale: paths as f32 / there as f32 });
        let image = &self.images[path as usize];
        copy(gpu, image, &self.slot);
        let [width, height] = self.resident.film;
        let side = gpu.tile_side();
        for y in (0..height).step_by(side as usize) {
            for x in (0..width).step_by(side as usize) {
                let size = glam::uvec2(side.min(width - x), side.min(height - y));
                self.graph.submit(Tile { origin: glam::uvec2(x, y), size, ..Tile::default() }, &mut self.profiler);
            }
        }
        copy(gpu, &self.slot, image);
        if let Err(error) = self.profiler.end_frame() {
            tracing::debug!("no pass times: {error}");
        }
        shown
    }

    /// The virtual lights of a path, with its share of the lamps, and their images.
    fn lights(&self, path: u32) -> Vec<Vpl> {
        let Walk { geometry, sources, sequence, counts, mirrors } = &self.walk;
        let paths = counts[0];
        let lamps = sources.lamps().into_iter().map(|lamp| Vpl { power: lamp.power / paths as f32, ..lamp });
        let mut list: Vec<Vpl> = lamps.collect();
        let length = counts.iter().take_while(|&&count| path < count).count();
        list.extend(walk::path(geometry, sources, sequence, path, &counts[..length]));
        list.truncate(LONGEST);
        list.extend(walk::mirrored(&list, mirrors));
        list.truncate(self.capacity);
        list
    }
}

fn copy(gpu: &Gpu, from: &wgpu::Buffer, to: &wgpu::Buffer) {
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(from, 0, to, 0, from.size());
    gpu.queue.submit([encoder.finish()]);
}
