//! The light that pixels share: in squares of pixels each gathers another part of the virtual lights, where its middle sees a surface, and
//! takes the rest from neighbours that see the same [KellerHeidrich01]. They share out camera rays, too; but what is on an edge is seen by
//! all of them.

use tyndall_scene::parameter::Settings;

use super::batches::{Batch, batches, grouped};
use super::gathering::Gathering;
use super::vpl::Vpl;
use super::{Walk, check_size, per_round};
use crate::graph::{Graph, Shader, shader};
use crate::resident::Resident;
use crate::{Gpu, RenderError};

static POINTS: Shader = shader!("techniques/instant_radiosity/points");

/// Bytes of a `Cell` in `reuse.wesl`.
pub(crate) const CELL_BYTES: u64 = 80;

/// The cells of a tile.
pub(super) fn cells(gpu: &Gpu) -> wgpu::Buffer {
    gpu.scratch("cells", u64::from(gpu.tile_side()).pow(2) * CELL_BYTES)
}

/// Records the pass in which the cells of a tile gather `lights`, in squares of `interleaving` pixels a side.
pub(super) async fn points_pass(
    graph: &mut Graph<'_>,
    resident: &Resident,
    walk: &Walk,
    settings: &Settings,
    lights: &[Vpl],
    hierarchy: &[wgpu::Texture; 2],
    cells: &wgpu::Buffer,
) -> Result<(), RenderError> {
    let (gpu, tile) = (graph.gpu(), graph.tile());
    let [interleaving, samples] = ["interleaving", "samples"].map(|name| settings.number(name) as usize);
    let parts = interleaving * interleaving;
    let rays = samples.div_ceil(parts);
    let groups = walk.groups(lights, settings, (parts * rays) as u32);
    let (vpls, mut ranges) = grouped(lights, &groups, &walk.mirrors);
    check_size(gpu, vpls.len())?;
    ranges.resize(parts * rays, [vpls.len() as u32; 2]);
    let mut gather = walk.gather(resident, settings);
    let at_once = per_round(gpu, resident, walk, &vpls, &gather)?;
    // Neighbouring groups in one part are as different as all of them are.
    let parts: Vec<_> = ranges.chunks(rays).map(|ranges| batches(ranges, at_once)).collect();
    let rounds = parts.iter().map(Vec::len).max().unwrap_or(0);
    let share = 1.0 / parts.len() as f32;
    let mut all = Vec::new();
    for round in 0..rounds {
        for (number, part) in (0..).zip(&parts) {
            let batch = part.get(round).copied().unwrap_or_default();
            let ray = number * rays as u32 + batch.ray;
            all.push(Batch { emission: share * batch.emission, ray, ..batch });
        }
    }
    gather.rounds = rounds as u32;
    gather.vpls = if vpls.is_empty() { vec![Vpl::BLACK] } else { vpls };
    Gathering::by_rays(gpu, hierarchy.clone(), &gather, &all)
        .await?
        .read_by(graph.compute("points", &POINTS), gpu, &walk.geometry)
        .constant("INTERLEAVING", interleaving as u32)
        .world(resident)
        .read("view", &resident.view)
        .read("tile", &tile)
        .write("cells", cells)
        .over_film(rounds as u32)
        .await
}
