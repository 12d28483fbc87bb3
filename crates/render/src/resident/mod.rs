//! A world as the GPU holds it: textures and buffers that techniques read.

mod atlas;
pub mod expression;
mod light;
mod view;
mod volume;

use tyndall_scene::World;

pub use light::Light;
pub use view::View;
pub use volume::{MAX_VOLUMES, Volume};

use atlas::Atlas;
use volume::VolumeArray;

use crate::{Gpu, RenderError};

/// A world on the device. It keeps no voxels on the host: the [`World`] may be dropped.
#[derive(Debug)]
pub struct Resident {
    /// The camera and the film, as a buffer.
    pub view: wgpu::Buffer,
    /// [`MAX_VOLUMES`] of [`Volume`], as a buffer.
    pub volumes: wgpu::Buffer,
    /// The bricks of all volumes, as a texture of bits.
    pub bricks: wgpu::Texture,
    /// Clip planes and isosurfaces, as a buffer of vectors.
    pub extras: wgpu::Buffer,
    /// The voxels of all bricks, a 3D texture.
    pub atlas: wgpu::Texture,
    /// Transfer functions, a row a volume: colour (radiance of an opaque body) and extinction [m⁻¹].
    pub transfers: wgpu::Texture,
    /// Trilinear, clamped to the edge.
    pub linear: wgpu::Sampler,
    /// What pipelines can be specialised for.
    pub traits: volume::Traits,
    /// Lights but the environment, for techniques to extend and upload.
    pub lights: Vec<Light>,
    /// Radiance of the constant environment [W·sr⁻¹·m⁻²].
    pub environment: glam::Vec3,
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
        volume::check(&world.volumes)?;
        let (lights, environment) = light::encode(&world.scene.lights)?;
        let view = View::new(&world.scene.camera, film, environment);
        let atlas = Atlas::new(gpu, &world.volumes).await?;
        let (volumes, bricks) = VolumeArray::new(&world.volumes, &atlas);
        Ok(Self {
            view: gpu.buffer("view", &view),
            volumes: gpu.buffer("volumes", &volumes),
            bricks: volume::brick_texture(gpu, bricks).await?,
            extras: gpu.buffer("extras", &vec![glam::Vec4::ZERO]),
            atlas: atlas.texture,
            transfers: volume::transfers(gpu, &world.volumes).await?,
            linear: gpu.device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("linear"),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                ..Default::default()
            }),
            traits: volume::Traits::of(&world.volumes),
            lights,
            environment,
            film,
        })
    }
}
