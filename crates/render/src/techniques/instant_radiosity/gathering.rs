//! The pass that gathers, and what it shares with others that do.

use tyndall_scene::surface::Bsdf;

use super::batches::{Batch, batch_texels};
use super::geometry::Geometry;
use super::visibility::{Casters, Maps};
use super::vpl::Vpl;
use crate::graph::{Compute, Declaration, Graph, Shader, shader};
use crate::resident::bvh::table;
use crate::resident::{Resident, Stride};
use crate::{Gpu, RenderError};

static GATHER: Shader = shader!("techniques/instant_radiosity/gather");

/// The buffer `gather`.
#[derive(Debug, encase::ShaderType)]
pub(super) struct Gather {
    pub(super) bound: f32,
    pub(super) emitted_bound: f32,
    pub(super) compensation: u32,
    pub(super) bounces: u32,
    pub(super) epsilon: f32,
    pub(super) seed: u32,
    pub(super) rounds: u32,
    pub(super) casters: Casters,
    pub(super) stride: Stride,
    #[shader(size(runtime))]
    pub(super) vpls: Vec<Vpl>,
}

/// What passes that gather read.
#[derive(Debug)]
pub(super) struct Gathering {
    /// Of [`Gather`].
    pub(super) gather: wgpu::Buffer,
    pub(super) batches: wgpu::Texture,
    pub(super) rounds: u32,
    pub(super) hierarchy: [wgpu::Texture; 2],
    pub(super) maps: Maps,
}

impl Gathering {
    /// By rays alone, through a hierarchy that lies on the device.
    pub(super) async fn by_rays(
        gpu: &Gpu,
        hierarchy: [wgpu::Texture; 2],
        gather: &Gather,
        batches: &[Batch],
    ) -> Result<Self, RenderError> {
        Ok(Self {
            gather: gpu.buffer("gather", gather),
            batches: table(gpu, "batches", batch_texels(batches)).await?,
            rounds: batches.len() as u32,
            hierarchy,
            maps: Maps::none(gpu).await?,
        })
    }

    /// Binds it to a pass that gathers, which is specialised for the surfaces that there are.
    pub(super) fn read_by<'g, 'a>(
        &self,
        declaration: Declaration<'g, 'a, Compute>,
        gpu: &Gpu,
        geometry: &Geometry,
    ) -> Declaration<'g, 'a, Compute> {
        declaration
            .constant("NODES", geometry.bvh.nodes())
            .constant("VISITS", most_visits(gpu, geometry))
            .constant("LOBES", geometry.any(|bsdf| matches!(bsdf, Bsdf::MetallicRoughness { .. })))
            .constant("IMAGES", geometry.any(|bsdf| matches!(bsdf, Bsdf::Mirror { .. })))
            .constant("GLASS", geometry.any(|bsdf| matches!(bsdf, Bsdf::Dielectric { .. })))
            .constant("MAPS", self.maps.side > 1)
            .constant("MAP_SIDE", self.maps.side)
            .constant("MAP_COLUMNS", self.maps.columns)
            .read("gather", &self.gather)
            .read("batches", &self.batches)
            .read("nodes", &self.hierarchy[0])
            .read("corners", &self.hierarchy[1])
            .read("map_depths", &self.maps.atlas)
    }
}

/// How many nodes a ray may visit: all, but no more than the device stands.
fn most_visits(gpu: &Gpu, geometry: &Geometry) -> u32 {
    geometry.bvh.nodes().min(gpu.iterations() / 4)
}

/// Records the pass that gathers: what squares of `interleaving` pixels a side have not shared out among their `cells`.
pub(super) async fn gather_pass(
    graph: &mut Graph<'_>,
    resident: &Resident,
    geometry: &Geometry,
    gathering: &Gathering,
    cells: &wgpu::Buffer,
    interleaving: u32,
    film: &wgpu::Texture,
) -> Result<(), RenderError> {
    let (gpu, tile) = (graph.gpu(), graph.tile());
    gathering
        .read_by(graph.compute("gather", &GATHER), gpu, geometry)
        .constant("INTERLEAVING", interleaving)
        .world(resident)
        .read("view", &resident.view)
        .read("tile", &tile)
        .write("cells", cells)
        .write("film", film)
        .over_film(gathering.rounds)
        .await
}
