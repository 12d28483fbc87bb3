//! What the camera sees of surfaces: a G-buffer.
//!
//! Rasterising says only which triangle the middle of each pixel sees [Burns13]; compute intersects the same ray that media are
//! marched along with it. So distances, and all that depends on them, agree with those of rays, wherever a surface meets a
//! medium. Depths are reversed, without a far plane.

#[cfg(test)]
pub mod test;

use glam::Vec2;
use wgpu::TextureFormat::{Depth32Float, R32Uint, Rg32Float, Rgba32Float, Rgba32Uint};
use wgpu::TextureUsages;

use crate::graph::{Draw, Graph, Region, Shader, Target, shader};
use crate::resident::Resident;
use crate::{Gpu, RenderError};

static ASIDE: Shader = shader!("surfaces/aside");
static VISIBILITY: Shader = shader!("surfaces/visibility");
static RESOLVE: Shader = shader!("surfaces/resolve");

/// The nearest depth at which something is seen, relative to the size of the scene.
const NEAREST: f32 = 1e-6;

/// What a camera sees of surfaces in the middle of each pixel; `surfaces/gbuffer.wesl` reads it.
#[derive(Clone, Debug)]
pub struct GBuffer {
    /// `Rgba32Float`: the distance along the camera ray [m], 1e30 where there is no surface; texture coordinates u, v;
    /// the vertices' colour, 8 bits a channel, as `surfaces/gbuffer.wesl` packs it.
    pub place: wgpu::Texture,
    /// `Rgba32Uint`: the triangle's normal and that for shading, on the front side, as `math/octahedral.wesl` packs them; the
    /// number of the surface; that of the triangle, from 1, or 0 where there is none.
    pub facing: wgpu::Texture,
    /// `Rg32Float`: from where in the film it was in the frame before to where it is, x to the right, y down [pixel].
    pub motion: wgpu::Texture,
    /// `Rgba32Uint`: the bits of the second set of texture coordinates; how far the first set reaches over a pixel along u and v, and
    /// how far the second, each two half floats. One texel where there are no pictures.
    pub mapping: wgpu::Texture,
    /// Numbers of triangles from 1 on, and depths: used while it is filled.
    visibility: wgpu::Texture,
    depth: wgpu::Texture,
}

impl GBuffer {
    /// One that is still to be filled.
    ///
    /// # Errors
    /// A lack of memory.
    pub async fn new(gpu: &Gpu, resident: &Resident) -> Result<Self, RenderError> {
        let film = resident.film;
        let mapping = if resident.surfaces.pictures { film } else { [1; 2] };
        let written = TextureUsages::STORAGE_BINDING | TextureUsages::COPY_SRC;
        Ok(Self {
            place: gpu.texture_2d("place", film, Rgba32Float, written).await?,
            facing: gpu.texture_2d("facing", film, Rgba32Uint, written).await?,
            motion: gpu.texture_2d("motion", film, Rg32Float, written).await?,
            mapping: gpu.texture_2d("mapping", mapping, Rgba32Uint, written).await?,
            visibility: gpu.texture_2d("visibility", film, R32Uint, TextureUsages::RENDER_ATTACHMENT).await?,
            depth: gpu.texture_2d("depth", film, Depth32Float, TextureUsages::RENDER_ATTACHMENT).await?,
        })
    }

    /// Records the passes that fill it, as seen with the [`View`](crate::resident::View) in `view`, coming from that in
    /// `previous` and from where surfaces were. A view's `forward` need not be perpendicular to the film: moved by a part of
    /// `right` and `up`, it looks through another point of the pixels. A ray stands for a square of so many pixels a side.
    ///
    /// # Errors
    /// A lack of memory, and whatever the device refuses.
    pub async fn fill(
        &self,
        graph: &mut Graph<'_>,
        resident: &Resident,
        view: &wgpu::Buffer,
        previous: &wgpu::Buffer,
        side: f32,
    ) -> Result<(), RenderError> {
        let film = resident.film;
        let surfaces = &resident.surfaces;
        let extent = surfaces.bounds.map_or(1.0, |[low, high]| (high - low).length()).max(f32::MIN_POSITIVE / NEAREST);
        graph
            .raster("visibility", &VISIBILITY)
            .constant("NEAREST", NEAREST * extent)
            .world(resident)
            .read("view", view)
            .draw(Draw {
                vertices: 3 * surfaces.count,
                instances: 1,
                batch: 1,
                target: Some(Target { texture: &self.visibility, blend: None }),
                depth: Some(&self.depth),
                regions: Some(&[Region { origin: glam::UVec2::ZERO, size: film.into() }]),
            })
            .await?;
        let tile = graph.tile();
        graph
            .compute("resolve", &RESOLVE)
            .constant("SIDE", side)
            .constant("AVERAGED", surfaces.pictures)
            .world(resident)
            .read("view", view)
            .read("tile", &tile)
            .read("previous", previous)
            .read("motions", &surfaces.motions)
            .read("visibility", &self.visibility)
            .write("surface_place", &self.place)
            .write("surface_facing", &self.facing)
            .write("surface_motion", &self.motion)
            .write("surface_mapping", &self.mapping)
            .over_film(1)
            .await
    }
}

/// Records a pass that writes what is seen through another point of the pixels, so far from their middle [pixel], as a
/// [`View`](crate::resident::View).
///
/// # Errors
/// Whatever the device refuses.
pub(crate) async fn aside(
    graph: &mut Graph<'_>,
    view: &wgpu::Buffer,
    offset: Vec2,
) -> Result<wgpu::Buffer, RenderError> {
    let gpu = graph.gpu();
    let (moved, offset) = (gpu.scratch("moved view", view.size()), gpu.buffer("offset", &offset));
    graph
        .compute("aside", &ASIDE)
        .read("view", view)
        .read("offset", &offset)
        .write("moved", &moved)
        .dispatch([1; 3], 1)
        .await?;
    Ok(moved)
}
