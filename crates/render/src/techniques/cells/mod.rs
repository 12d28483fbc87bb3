//! An unstructured mesh marched from cell to cell, without resampling.
//!
//! A ray enters through the nearest face of the mesh's boundary (a hierarchy of boxes over its faces), and goes from
//! tetrahedron to tetrahedron by adjacency [Garrity90]; where it leaves, the next face ahead is sought, so that meshes
//! need not be convex, nor in one piece. Within a cell the density ρ is linear along the ray, and σ_t, σ_s and emission
//! are in proportion to it. So, with D = ∫ρ dt over a piece of the ray, which is (a + b)/2·Δ,
//!
//! ∫ T(t) ρ(t) s dt = T·s·(1 − e^{−σ_t D})/σ_t
//!
//! is exact for a source s per unit of density that is constant there: emission is exact, and so is the optical depth
//! towards the lights, which are marched to in the same way. Only how their light varies along a piece is not: it is
//! sampled in the middle of pieces of at most `depth_step` of optical depth, at least one in each cell. A transfer
//! function is not in proportion to anything: its cells are cut so that the value changes by at most `value_step` in each
//! piece, and looked up in its middle. A cell is cut into 64 pieces at most.
//!
//! Not in the model: light scattered more than once, and that of the environment and of surfaces that emit, which are only seen
//! behind the mesh.

mod boundary;
#[cfg(test)]
mod test;

use glam::{UVec4, Vec4};
use tyndall_scene::description::Optics;
use tyndall_scene::parameter::{Kind, Parameter};
use tyndall_scene::volume::Mesh;
use tyndall_scene::{Field, FieldError, Volume, World};

use super::{MODEL, Recording, Role, SAMPLES, TERMINATION, Technique, plain};
use crate::graph::{Shader, shader};
use crate::resident::Lights;
use crate::shadows::{self, Options, Shadows};
use crate::{Gpu, RenderError};
use boundary::NOWHERE;
pub(crate) use boundary::Node;

/// The declaration of marching from cell to cell.
pub const TECHNIQUE: Technique = Technique {
    name: "cells",
    summary: "Unstructured meshes, from cell to cell: absorption, emission, and single scattering",
    role: Role::Media,
    parameters: &[
        MODEL,
        Parameter {
            name: "depth_step",
            help: "Most optical depth between samples of the light, of which each cell has one at least",
            unit: "",
            kind: Kind::Number { min: 0.001, max: 10.0, default: 0.1 },
        },
        Parameter {
            name: "value_step",
            help: "Most change of the value between samples of a transfer function, relative to the function's range",
            unit: "",
            kind: Kind::Number { min: 0.0001, max: 1.0, default: 0.02 },
        },
        TERMINATION,
        SAMPLES,
        shadows::RESOLUTION,
    ],
    record: |recording| Box::pin(record(recording)),
};

static CELLS: Shader = shader!("techniques/cells/cells");

/// Pieces of a cell, at most.
const MOST_STEPS: f32 = 64.0;

/// The buffer `cells`.
#[derive(Clone, Copy, Debug, encase::ShaderType)]
pub(crate) struct Cells {
    depth_step: f32,
    value_step: f32,
    termination: f32,
    lights: u32,
    rounds: u32,
    steps_per_round: u32,
    samples: u32,
    nodes: u32,
    visits: u32,
    light_cells: u32,
    unfinished: f32,
}

/// A tetrahedron as the shader sees it.
#[derive(Clone, Copy, Debug, encase::ShaderType)]
pub(crate) struct Tetrahedron {
    corners: [Vec4; 4],
    neighbours: UVec4,
}

/// Bytes of a `Path` in `cells.wesl`.
pub(crate) const PATH_BYTES: u64 = 64;

/// The buffer `tetrahedra`.
#[derive(Debug, encase::ShaderType)]
struct Tetrahedra {
    #[shader(size(runtime))]
    tetrahedra: Vec<Tetrahedron>,
}

/// The buffer `nodes`.
#[derive(Debug, encase::ShaderType)]
struct Nodes {
    #[shader(size(runtime))]
    nodes: Vec<Node>,
}

async fn record(
    Recording { graph, resident, settings, film, world, behind, .. }: Recording<'_, '_>,
) -> Result<(), RenderError> {
    plain(world, TECHNIQUE.name)?;
    let gpu = graph.gpu();
    let (volume, mesh) = only_mesh(world)?;
    check_size(gpu, volume, mesh)?;
    let model = settings.choice("model");
    let mut lights = if model == "single_scattering" { resident.lights.clone() } else { Vec::new() };
    let options = Options::of_media(settings);
    let casts = Shadows::plan(gpu, resident, &mut lights, &options)?;
    let nodes = boundary::hierarchy(mesh);
    let entries = resident.transfers.width() - 1;
    let mut cells = Cells {
        depth_step: settings.number("depth_step"),
        value_step: settings.number("value_step") * entries as f32,
        termination: settings.number("termination"),
        lights: if transfers(volume) { 0 } else { lights.len() as u32 },
        rounds: 0,
        steps_per_round: 0,
        samples: settings.number("samples") as u32,
        nodes: nodes.len() as u32,
        visits: 512 + 64 * (nodes.len() as f32).sqrt() as u32,
        light_cells: most_crossed(volume, mesh),
        unfinished: f32::NAN,
    };
    let steps = most_steps(volume, mesh, &cells, settings.number("value_step"));
    (cells.rounds, cells.steps_per_round) = rounds(gpu, &cells, steps)?;
    let rounds = cells.rounds * cells.samples;
    let several = rounds > 1;
    let side = u64::from(gpu.tile_side());
    let paths = gpu.scratch("paths", if several { side * side * PATH_BYTES } else { PATH_BYTES });
    let tetrahedra = (0..mesh.count()).map(|cell| {
        let (corners, values) = (mesh.corners(cell), mesh.corner_values(cell));
        let neighbours = mesh.neighbours(cell).map(|neighbour| neighbour.unwrap_or(NOWHERE));
        Tetrahedron { corners: [0, 1, 2, 3].map(|i| corners[i].extend(values[i])), neighbours: neighbours.into() }
    });
    let tetrahedra = gpu.buffer("tetrahedra", &Tetrahedra { tetrahedra: tetrahedra.collect() });
    let nodes = gpu.buffer("nodes", &Nodes { nodes });
    let lights = gpu.buffer("lights", &Lights { lights });
    let cells = gpu.buffer("cells", &cells);
    let shadows = Shadows::record(graph, resident, &resident.view, &lights, casts, &options).await?;
    let tile = graph.tile();
    graph
        .compute("cells", &CELLS)
        .constant("BEHIND", behind.is_some())
        .shadows(&shadows)
        .read("behind", behind.unwrap_or(&resident.transfers))
        .constant("TRANSFER", transfers(volume))
        .constant("EMISSION", model != "absorption")
        .constant("ROUNDS", several)
        .world(resident)
        .read("view", &resident.view)
        .read("tile", &tile)
        .read("cells", &cells)
        .read("lights", &lights)
        .read("tetrahedra", &tetrahedra)
        .read("nodes", &nodes)
        .write("film", film)
        .write("paths", &paths)
        .over_film(rounds)
        .await
}

fn transfers(volume: &Volume) -> bool {
    matches!(volume.optics, Optics::Transfer(_))
}

/// The medium, where there is one and it is a mesh.
fn only_mesh(world: &World) -> Result<(&Volume, &Mesh), RenderError> {
    let found = match &world.volumes[..] {
        [volume] => match &volume.field {
            Field::Mesh(mesh) => return Ok((volume, mesh)),
            _ => format!("media.{}, which is no mesh", volume.name),
        },
        several => format!("{} media", several.len()),
    };
    let accepted = "one medium with a density.mesh".into();
    Err(FieldError { path: "techniques.cells".into(), found, accepted }.into())
}

fn check_size(gpu: &Gpu, volume: &Volume, mesh: &Mesh) -> Result<(), RenderError> {
    let limits = gpu.device.limits();
    let limit = limits.max_buffer_size.min(limits.max_storage_buffer_binding_size) / size_of::<Tetrahedron>() as u64;
    if mesh.count() as u64 <= limit {
        return Ok(());
    }
    Err(RenderError::Limit {
        what: format!("media.{}: its mesh", volume.name),
        found: format!("{} tetrahedra", mesh.count()),
        limit: format!("{limit} tetrahedra"),
        advice: "Coarsen the mesh, or resample it into a grid.".into(),
    })
}

/// How many cells a ray may cross. By Cauchy's formula a line meets half the faces' area per volume and length; four times
/// that along the box's diagonal, and some more. A ray that meets more is not finished, and shows it.
fn most_crossed(volume: &Volume, mesh: &Mesh) -> u32 {
    const LEAST: f64 = 64.0;
    let m = volume.world_from_unit.as_dmat4();
    let (mut area, mut space) = (0.0, 0.0);
    for cell in 0..mesh.count() {
        let [a, b, c, d] = mesh.corners(cell).map(|corner| m.transform_point3(corner.as_dvec3()));
        let triangles = [[b, c, d], [a, c, d], [a, b, d], [a, b, c]];
        // Nearly every face belongs to two cells.
        area += triangles.map(|[p, q, r]| 0.25 * (q - p).cross(r - p).length()).iter().sum::<f64>();
        space += (b - a).cross(c - a).dot(d - a).abs() / 6.0;
    }
    let mean = 0.5 * area / space * diagonal(volume);
    (LEAST + 4.0 * mean).min(mesh.count() as f64 + 1.0) as u32
}

/// The longest way through the mesh's box [m].
fn diagonal(volume: &Volume) -> f64 {
    let m = volume.world_from_unit.as_dmat4();
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis].map(|axis| axis.truncate());
    [x + y + z, x + y - z, x - y + z, x - y - z].map(|d| d.length()).into_iter().fold(0.0, f64::max)
}

/// How many steps a camera ray may take: one a cell, and what its pieces add, of which `step_on` says how many they are.
fn most_steps(volume: &Volume, mesh: &Mesh, cells: &Cells, value_step: f32) -> u64 {
    let values = || (0..mesh.count()).map(|cell| mesh.corner_values(cell));
    let highest = values().flatten().fold(0.0, f32::max);
    let crossed = f64::from(cells.light_cells);
    let more = match &volume.optics {
        Optics::Transfer(transfer) => {
            let ends = [transfer.stops.first(), transfer.stops.last()].map(|stop| stop.map_or(0.0, |s| s.value));
            let range = if ends[0] < ends[1] { ends[1] - ends[0] } else { 1.0 };
            let span = |values: [f32; 4]| {
                values.into_iter().fold(f32::NEG_INFINITY, f32::max) - values.into_iter().fold(f32::INFINITY, f32::min)
            };
            crossed * f64::from(values().map(span).fold(0.0, f32::max) / (range * value_step))
        }
        Optics::Coefficients { sigma_s, sigma_a, .. } if cells.lights > 0 => {
            let sigma_t = (sigma_s + sigma_a).as_dvec3();
            let terminated = -f64::from(cells.termination).ln() / sigma_t.min_element();
            let density = terminated.min(f64::from(highest) * diagonal(volume));
            density * sigma_t.max_element() / f64::from(cells.depth_step)
        }
        Optics::Coefficients { .. } => 0.0,
    };
    (crossed + more).min(crossed * f64::from(MOST_STEPS)).ceil() as u64
}

/// Into how many rounds, of how many steps, a camera ray is cut so that no invocation makes more loop iterations than the
/// device stands. Every loop of the shader counts, also those that a compiler would unroll.
fn rounds(gpu: &Gpu, cells: &Cells, steps: u64) -> Result<(u32, u32), RenderError> {
    /// The faces of a cell, and the loop around them.
    const CROSSING: u64 = 5;
    let [lights, visits] = [cells.lights, cells.visits].map(u64::from);
    let per_light = 1 + CROSSING * u64::from(cells.light_cells) + visits + shadows::ITERATIONS;
    let per_step = lights.saturating_mul(per_light).saturating_add(CROSSING + visits);
    let limit = u64::from(gpu.iterations());
    if per_step > limit {
        return Err(RenderError::Limit {
            what: "lights".into(),
            found: format!("{lights} lights, each behind up to {} cells", cells.light_cells),
            limit: format!("{} such lights", limit.saturating_sub(CROSSING + visits) / per_light),
            advice: "Use fewer lights, or a coarser mesh.".into(),
        });
    }
    let steps_per_round = (limit / per_step).min(steps.max(1));
    let rounds = steps.div_ceil(steps_per_round).max(1);
    if rounds.saturating_mul(cells.samples.into()) > u32::MAX.into() {
        return Err(RenderError::Limit {
            what: "techniques.cells: its steps".into(),
            found: format!("{steps} steps along a ray"),
            limit: format!("{} steps", steps_per_round.saturating_mul(u64::from(u32::MAX / cells.samples))),
            advice: "Use a larger depth_step or value_step, or fewer samples.".into(),
        });
    }
    Ok((rounds as u32, steps_per_round as u32))
}
