//! A world as the GPU holds it: textures and buffers that techniques read.

mod atlas;
pub mod bodies;
mod bricks;
pub mod bvh;
pub(crate) mod environment;
pub mod expression;
mod gradients;
mod light;
mod sky;
pub mod surfaces;
mod tables;
mod traits;
pub mod transmittance;
mod view;
mod volume;
mod walk;

use std::sync::Arc;

use tyndall_scene::description::Camera;
use tyndall_scene::surface::Surface;
use tyndall_scene::{EnvironmentMap, World};

pub use bodies::Bodies;
pub(crate) use bodies::is_bodies;
pub use light::{Light, Lights};
pub use surfaces::Surfaces;
pub use transmittance::Transmittance;
pub use view::View;
pub(crate) use volume::voxel;
pub use volume::{MAX_VOLUMES, Volume};
pub(crate) use walk::Stride;

use atlas::Atlas;
use bricks::Bricks;
use expression::Expressions;
use traits::Traits;

use crate::{Gpu, RenderError};

/// A world on the device. It keeps no voxels on the host: the [`World`] may be dropped. A clone shares what is on the device.
#[derive(Clone, Debug)]
pub struct Resident {
    /// The camera and the film, as a buffer.
    pub view: wgpu::Buffer,
    /// The camera of the frame before, as a buffer.
    pub previous: wgpu::Buffer,
    /// [`MAX_VOLUMES`] of [`Volume`], as a buffer: fields, in the order of their names, then media that are made of bodies; and, after them,
    /// clip planes, isosurfaces, grids of temperature and colour, as vectors.
    pub volumes: wgpu::Buffer,
    /// The bricks of all volumes, as a texture of bits.
    pub bricks: wgpu::Texture,
    /// The voxels of all bricks, a 3D texture.
    pub atlas: wgpu::Texture,
    /// The gradients at them, where they are looked at and there is room; else of one texel.
    pub gradients: wgpu::Texture,
    /// Whether something is seen of bricks whose values are all alike, which have none there.
    pub flat: bool,
    /// Where in it the bricks of grids lie.
    places: Atlas,
    /// Transfer functions and black bodies, three rows a volume.
    pub transfers: wgpu::Texture,
    /// Phase functions that are tables, a row a volume.
    pub phases: wgpu::Texture,
    /// Densities that are expressions, which become part of shaders.
    pub expressions: Option<Expressions>,
    /// Trilinear, clamped to the edge.
    pub linear: wgpu::Sampler,
    /// What pipelines can be specialised for.
    pub traits: Traits,
    /// The lowest and the highest corner of a box around all surfaces and media [m].
    pub bounds: Option<[glam::Vec3; 2]>,
    /// Of one around all media.
    media_bounds: Option<[glam::Vec3; 2]>,
    /// The surfaces.
    pub surfaces: Surfaces,
    /// Particles and strands.
    pub bodies: Bodies,
    /// Maps of the transmittance from the first lights, where a technique makes them.
    pub transmittance: Transmittance,
    /// Lights but the environment, the directional ones first, for techniques to extend and upload.
    pub lights: Vec<Light>,
    /// Virtual lights that a technique of surfaces has found, for those of media: they stand for all light of surfaces and the
    /// environment, and for what of the lamps' light surfaces reflect.
    pub virtual_lights: Option<Vec<Light>>,
    /// Radiance of the constant environment [W·sr⁻¹·m⁻²].
    pub environment: glam::Vec3,
    /// The environment map, if there is one.
    pub map: Option<Arc<EnvironmentMap>>,
    /// The same as a texture; of one texel without.
    pub sky: wgpu::Texture,
    /// The film's size in pixels.
    pub film: [u32; 2],
}

impl Resident {
    /// Uploads a world, after checking that it fits.
    ///
    /// # Errors
    /// More volumes, larger volumes or a larger film than the device can hold, an environment map, and memory that runs out.
    pub async fn new(gpu: &Gpu, world: &World) -> Result<Self, RenderError> {
        let film = world.scene.film.size;
        let limits = gpu.device.limits();
        let side = film[0].max(film[1]);
        if side > limits.max_texture_dimension_2d {
            return Err(RenderError::Limit {
                what: "film.size".into(),
                found: format!("{} x {}", film[0], film[1]),
                limit: format!("{} pixels a side", limits.max_texture_dimension_2d),
                advice: "Render a smaller picture.".into(),
            });
        }
        let volumes = ordered(world);
        volume::check(&volumes)?;
        let (lights, environment) = light::encode(&world.lights);
        let view = View::new(&world.scene.camera, film, environment, rotation(world.environment.as_deref()));
        let surfaces = Surfaces::new(gpu, &world.surfaces).await?;
        let atlas = Atlas::new(gpu, &volumes).await?;
        let media = Media::new(gpu, &atlas, &volumes).await?;
        let bodies = Bodies::new(gpu, &volumes, None).await?;
        bodies.upload(gpu, &volumes);
        let resident = Self {
            atlas: atlas.texture.clone(),
            gradients: gradients::none(gpu).await?,
            places: atlas,
            view: gpu.buffer("view", &view),
            previous: gpu.buffer("previous", &view),
            volumes: media.volumes,
            flat: media.flat,
            bricks: media.bricks,
            transfers: media.transfers,
            phases: media.phases,
            expressions: Expressions::new(&volumes),
            linear: gpu.device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("linear"),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                ..Default::default()
            }),
            traits: Traits::of(&volumes),
            transmittance: Transmittance::none(gpu).await?,
            bounds: union(surfaces.bounds, media_bounds(world)),
            media_bounds: media_bounds(world),
            surfaces,
            bodies,
            lights,
            virtual_lights: None,
            environment,
            sky: sky::texture(gpu, world.environment.as_deref()).await?,
            map: world.environment.clone(),
            film,
        };
        resident.with_gradients(gpu).await
    }

    /// The same with the media of `world`, whose grids are on the device already: no voxel is uploaded. Nor are bodies yet, as
    /// they may go into the same buffers: see [`upload_bodies`](Self::upload_bodies).
    ///
    /// # Errors
    /// Grids that are not there, more volumes than shaders hold, and memory that runs out.
    pub(crate) async fn with_media(&self, gpu: &Gpu, world: &World) -> Result<Self, RenderError> {
        let volumes = ordered(world);
        volume::check(&volumes)?;
        self.places.check(&volumes)?;
        let media = Media::new(gpu, &self.places, &volumes).await?;
        let resident = Self {
            volumes: media.volumes,
            flat: media.flat,
            bricks: media.bricks,
            transfers: media.transfers,
            phases: media.phases,
            expressions: Expressions::new(&volumes),
            traits: Traits::of(&volumes),
            bounds: union(self.surfaces.bounds, media_bounds(world)),
            media_bounds: media_bounds(world),
            bodies: Bodies::new(gpu, &volumes, Some(&self.bodies)).await?,
            // Techniques make them anew, or no more.
            transmittance: Transmittance::none(gpu).await?,
            virtual_lights: None,
            ..self.clone()
        };
        resident.with_gradients(gpu).await
    }

    /// Takes the same surfaces with other transforms; before, in the last frame, they had these.
    pub(crate) fn moved(&mut self, gpu: &Gpu, surfaces: &[Surface], before: &[glam::Mat4]) {
        self.surfaces.moved(gpu, surfaces);
        self.surfaces.moved_from(gpu, surfaces, before);
        self.bounds = union(self.surfaces.bounds, self.media_bounds);
    }

    /// The same with gradients, if they are looked at now and have not been made before.
    async fn with_gradients(self, gpu: &Gpu) -> Result<Self, RenderError> {
        if self.has_gradients() {
            return Ok(self);
        }
        match gradients::make(gpu, &self).await? {
            Some(gradients) => Ok(Self { gradients, ..self }),
            None => Ok(self),
        }
    }

    /// The same without them, as on a device that has no room.
    #[cfg(test)]
    pub(crate) async fn without_gradients(self, gpu: &Gpu) -> Result<Self, RenderError> {
        Ok(Self { gradients: gradients::none(gpu).await?, ..self })
    }

    /// Whether there is a texture of gradients.
    pub(crate) fn has_gradients(&self) -> bool {
        self.gradients.size() == self.atlas.size()
    }

    /// Whether what is beside gradients, in half floats, are the values as the atlas has them.
    pub(crate) fn has_valued_gradients(&self) -> bool {
        self.has_gradients() && self.atlas.format() == wgpu::TextureFormat::R16Float
    }

    /// Writes the bodies of the world that [`with_media`](Self::with_media) was given.
    pub(crate) fn upload_bodies(&self, gpu: &Gpu, world: &World) {
        self.bodies.upload(gpu, &ordered(world));
    }

    /// Makes the environment map unseen; it still lights media.
    ///
    /// # Errors
    /// A lack of memory.
    pub(crate) async fn hide_sky(&mut self, gpu: &Gpu) -> Result<(), RenderError> {
        self.sky = sky::texture(gpu, None).await?;
        Ok(())
    }

    /// A camera's view of the film and the environment.
    pub(crate) fn view_of(&self, camera: &Camera) -> View {
        View::new(camera, self.film, self.environment, self.sky_rotation())
    }

    /// How far the environment map is turned [rad].
    pub fn sky_rotation(&self) -> f32 {
        rotation(self.map.as_deref())
    }
}

/// What the device has of media beside their voxels.
struct Media {
    flat: bool,
    volumes: wgpu::Buffer,
    bricks: wgpu::Texture,
    transfers: wgpu::Texture,
    phases: wgpu::Texture,
}

impl Media {
    async fn new(gpu: &Gpu, atlas: &Atlas, media: &[tyndall_scene::Volume]) -> Result<Self, RenderError> {
        let mut bricks = Bricks::new(atlas);
        let volumes = volume::encode(media, &mut bricks);
        Ok(Self {
            flat: bricks.flat(),
            volumes: gpu.buffer("volumes", &volumes),
            bricks: bricks.texture(gpu).await?,
            transfers: tables::transfers(gpu, media).await?,
            phases: tables::phases(gpu, media).await?,
        })
    }
}

/// The media of a world as shaders number them: those that rays are marched through, then those that are made of bodies.
fn ordered(world: &World) -> Vec<tyndall_scene::Volume> {
    let (bodies, mut volumes): (Vec<_>, Vec<_>) = world.volumes.iter().cloned().partition(bodies::is_bodies);
    volumes.extend(bodies);
    volumes
}

/// A box around all media.
fn media_bounds(world: &World) -> Option<[glam::Vec3; 2]> {
    let corners = world.volumes.iter().flat_map(|volume| {
        let unit = (0..8u32).map(|k| glam::uvec3(k & 1, k >> 1 & 1, k >> 2).as_vec3());
        unit.map(|corner| volume.world_from_unit.transform_point3(corner))
    });
    corners.map(|corner| [corner; 2]).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
}

/// A box around two.
fn union(a: Option<[glam::Vec3; 2]>, b: Option<[glam::Vec3; 2]>) -> Option<[glam::Vec3; 2]> {
    a.into_iter().chain(b).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
}

fn rotation(map: Option<&EnvironmentMap>) -> f32 {
    map.map_or(0.0, |map| map.rotation)
}
