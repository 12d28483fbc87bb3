//! Particles and strands as the device holds them (`bodies.wesl`): all balls, and all segments of strands, of all media, in the
//! order that they have in the world, each with the number of its medium.

#[cfg(test)]
mod test;

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use tyndall_scene::strands::Segment;
use tyndall_scene::{Field, Volume};

use crate::{Gpu, RenderError};

/// A particle (`bodies.wesl`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct PackedBall {
    pub position: [f32; 3],
    pub radius: f32,
    pub depth: f32,
    pub medium: u32,
    pub color: [u32; 2],
}

/// A segment of a strand (`bodies.wesl`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct PackedSegment {
    pub begin: [f32; 3],
    pub radius: f32,
    pub end: [f32; 3],
    pub depth: f32,
    pub color: [u32; 2],
    pub medium: u32,
    pub padding: u32,
}

/// The buffer `bodies`.
#[derive(Clone, Copy, Debug, encase::ShaderType)]
pub(crate) struct Info {
    pub low: Vec3,
    pub balls: u32,
    pub high: Vec3,
    pub segments: u32,
}

/// The particles and strands of a world. Passes that use `bodies.wesl` bind them by `.world(resident)`.
#[derive(Clone, Debug)]
pub struct Bodies {
    /// 32 bytes a particle; it may be longer than there are particles.
    pub balls: wgpu::Buffer,
    /// 48 bytes a segment; it may be longer than there are segments.
    pub segments: wgpu::Buffer,
    /// The box around them and how many there are.
    pub info: wgpu::Buffer,
    /// How many balls there are.
    pub ball_count: u32,
    /// How many segments there are.
    pub segment_count: u32,
    /// The lowest and highest corner of the box around all bodies [m]; `None` where there are none.
    pub bounds: Option<[Vec3; 2]>,
}

impl Bodies {
    /// Room for the bodies of `volumes`, in the buffers of `previous` where they are long enough.
    /// [`upload`](Self::upload) fills it.
    ///
    /// # Errors
    /// More bodies than a buffer holds, and memory that runs out.
    pub(super) async fn new(gpu: &Gpu, volumes: &[Volume], previous: Option<&Self>) -> Result<Self, RenderError> {
        let (mut balls, mut segments, mut bounds) = (0, 0, None);
        for volume in volumes {
            let found = match &volume.field {
                Field::Particles(particles) => {
                    balls += particles.list().len() as u64;
                    particles.bounds()
                }
                Field::Strands(strands) => {
                    segments += strands.count() as u64;
                    strands.bounds()
                }
                _ => None,
            };
            bounds = [bounds, found].into_iter().flatten().reduce(|[a, b]: [Vec3; 2], [c, d]| [a.min(c), b.max(d)]);
        }
        let kept = |buffer: fn(&Self) -> &wgpu::Buffer| previous.map(buffer);
        let ball = size_of::<PackedBall>() as u64;
        let segment = size_of::<PackedSegment>() as u64;
        Ok(Self {
            balls: room(gpu, "balls", "particles", balls, ball, kept(|bodies| &bodies.balls)).await?,
            segments: room(gpu, "segments", "segments of strands", segments, segment, kept(|b| &b.segments)).await?,
            info: match previous {
                Some(bodies) => bodies.info.clone(),
                None => gpu.buffer("bodies", &info(None, 0, 0)),
            },
            ball_count: balls as u32,
            segment_count: segments as u32,
            bounds,
        })
    }

    /// Writes the bodies of `volumes`, for which there is room. What reads the buffers sees them from the next submission on.
    pub(super) fn upload(&self, gpu: &Gpu, volumes: &[Volume]) {
        let (mut balls, mut segments) = (Vec::new(), Vec::new());
        for (medium, volume) in volumes.iter().enumerate() {
            let medium = medium as u32;
            match &volume.field {
                Field::Particles(particles) => balls.extend(particles.list().iter().map(|particle| PackedBall {
                    position: particle.position.into(),
                    radius: particle.radius,
                    depth: particle.depth,
                    medium,
                    color: packed_color(particle.color),
                })),
                Field::Strands(strands) => segments.extend((0..strands.count()).map(|index| {
                    let Segment { ends: [begin, end], radius, color, depth } = strands.segment(index);
                    let [begin, end] = [begin, end].map(Into::into);
                    PackedSegment { begin, radius, end, depth, color: packed_color(color), medium, padding: 0 }
                })),
                _ => {}
            }
        }
        gpu.queue.write_buffer(&self.balls, 0, bytemuck::cast_slice(&balls));
        gpu.queue.write_buffer(&self.segments, 0, bytemuck::cast_slice(&segments));
        gpu.write(&self.info, &info(self.bounds, self.ball_count, self.segment_count));
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.ball_count == 0 && self.segment_count == 0
    }
}

/// Whether a medium is made of particles or strands.
pub(crate) fn is_bodies(volume: &Volume) -> bool {
    matches!(volume.field, Field::Particles(_) | Field::Strands(_))
}

/// Three channels from 0 to 1 in 16 bits each.
fn packed_color(color: Vec3) -> [u32; 2] {
    let [r, g, b] = (color * 65535.0).round().as_uvec3().to_array();
    [r | g << 16, b]
}

fn info(bounds: Option<[Vec3; 2]>, balls: u32, segments: u32) -> Info {
    let [low, high] = bounds.unwrap_or([Vec3::ONE, Vec3::NEG_ONE]);
    Info { low, balls, high, segments }
}

/// A buffer for so many bodies of this size [bytes]: the one given, if it is long enough.
async fn room(
    gpu: &Gpu,
    label: &str,
    what: &str,
    count: u64,
    size: u64,
    given: Option<&wgpu::Buffer>,
) -> Result<wgpu::Buffer, RenderError> {
    let limits = gpu.device.limits();
    let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) / size;
    if count > most {
        return Err(RenderError::Limit {
            what: "media".into(),
            found: format!("{count} {what}"),
            limit: format!("{most}, {size} bytes each"),
            advice: "Render fewer.".into(),
        });
    }
    // A buffer is never empty.
    let bytes = count.max(1) * size;
    if let Some(given) = given.filter(|given| given.size() >= bytes) {
        return Ok(given.clone());
    }
    let scope = gpu.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: bytes,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    match scope.pop().await {
        None => Ok(buffer),
        Some(error) => Err(RenderError::OutOfMemory { what: what.into(), bytes, reason: error.to_string() }),
    }
}
