//! Instant radiosity: global illumination by virtual point lights [Keller97].
//!
//! L = L_e + T L is a walk of particles from the lights: where one is reflected it leaves a virtual point light (`walk.rs`, where
//! all of the energy's bookkeeping stands), and a picture is the sum of what these light:
//!
//! L(x) = L_e(x) + Σ_vpl f(x)·I_vpl(ω)·min(cosθ_x·cosθ_vpl/r², b)·V
//!
//! The bound b keeps single lights from being seen as spots in corners. What it takes away is found again, without bias, along a
//! short ray to what is near: there G = cosθ_x·cosθ_y/r² > b, and L(y) counts (G − b)/G of its share [Kollig06].
//!
//! Visibility is by rays through a hierarchy of boxes (`resident/bvh.wesl`), and so are mirrors and glass on the way from the
//! eye. Planar mirrors also show the virtual lights: each has an image that shines through the mirror's outline. Each camera ray
//! of a pixel gathers its own part of the paths, so anti-aliasing takes no more lights.
//!
//! Not in the model: what curved mirrors and glass throw onto other surfaces straight from a light or another surface
//! (caustics), and light that meets two mirrors in a row on its way from a virtual light; both are where a particle was
//! reflected by them and met something else before.

pub(crate) mod geometry;
pub mod sequence;
pub(crate) mod sources;
pub(crate) mod vpl;
pub mod walk;
#[cfg(test)]
mod test;

use glam::Vec2;
use tyndall_scene::World;
use tyndall_scene::parameter::{Kind, Parameter, Settings};

use super::{Recording, Role, Technique};
use crate::graph::{Shader, shader};
use crate::{Gpu, RenderError};
use geometry::Geometry;
use sequence::{Sequence, radical_inverse};
use sources::Sources;
use vpl::{Vpl, Vpls};

/// Instant radiosity's declaration.
pub const TECHNIQUE: Technique = Technique {
    name: "instant_radiosity",
    summary: "Global illumination by virtual point lights",
    role: Role::Surfaces,
    parameters: &[
        Parameter {
            name: "paths",
            help: "Particles that start from the lights; with mean reflectivity r there are up to paths/(1 - r) virtual lights",
            unit: "",
            kind: Kind::Count { min: 1, max: 65536, default: 64 },
        },
        Parameter {
            name: "bounces",
            help: "Reflections of a particle, at most (0: direct light alone)",
            unit: "",
            kind: Kind::Count { min: 0, max: 64, default: 64 },
        },
        Parameter {
            name: "samples",
            help: "Camera rays per pixel, among which the paths are shared out",
            unit: "",
            kind: Kind::Count { min: 1, max: 1024, default: 16 },
        },
        Parameter {
            name: "sequence",
            help: "Points of the walk: Halton's, jittered or not, jittered Hammersley's, N-rooks, or random",
            unit: "",
            kind: Kind::Choice(&["jittered", "halton", "hammersley", "rooks", "random"]),
        },
        Parameter {
            name: "seed",
            help: "Another seed gives another set of virtual lights",
            unit: "",
            kind: Kind::Count { min: 0, max: 1_000_000, default: 0 },
        },
        Parameter {
            name: "clamp",
            help: "Distance below which a virtual light's 1/r^2 rises no more, relative to the scene's size (0: it does)",
            unit: "",
            kind: Kind::Number { min: 0.0, max: 1.0, default: 0.05 },
        },
        Parameter {
            name: "compensation",
            help: "Find the light that clamping takes away along short rays",
            unit: "",
            kind: Kind::Choice(&["on", "off"]),
        },
    ],
    record: |recording| Box::pin(record(recording)),
};

static GATHER: Shader = shader!("techniques/instant_radiosity/gather");

/// How often clamped light is sought from one point to the next, at most: of light that is clamped at each of four such points
/// nothing is left to see.
const COMPENSATIONS: u32 = 4;

/// Planes of a surface that is a mirror, at most; what has more is not flat.
const MOST_PLANES: usize = 8;

/// What a camera ray gathers in one round.
#[derive(Clone, Copy, Debug, PartialEq, encase::ShaderType)]
pub(crate) struct Batch {
    offset: Vec2,
    begin: u32,
    end: u32,
    emission: f32,
}

/// The buffer `gather`.
#[derive(Debug, encase::ShaderType)]
pub(crate) struct Gather {
    bound: f32,
    compensation: u32,
    epsilon: f32,
    seed: u32,
    rounds: u32,
    #[shader(size(runtime))]
    batches: Vec<Batch>,
}

/// The virtual lights of a world by a technique's settings, in the order of their paths.
///
/// # Errors
/// Settings that do not go together.
pub(crate) fn lights(world: &World, geometry: &Geometry, settings: &Settings) -> Result<Vec<Vpl>, RenderError> {
    let kind = match settings.choice("sequence") {
        "halton" => sequence::Kind::Halton,
        "hammersley" => sequence::Kind::JitteredHammersley,
        "rooks" => sequence::Kind::Rooks,
        "random" => sequence::Kind::Random,
        _ => sequence::Kind::Jittered,
    };
    let [paths, bounces, seed] = ["paths", "bounces", "seed"].map(|name| settings.number(name) as u32);
    if kind == sequence::Kind::JitteredHammersley && bounces > 0 {
        return Err(tyndall_scene::FieldError {
            path: "techniques.instant_radiosity.sequence".into(),
            found: format!("\"hammersley\", with {bounces} bounces"),
            accepted: "\"hammersley\" with bounces = 0: the first of its points are not evenly spread".into(),
        }
        .into());
    }
    let sources = Sources::new(world, geometry);
    if sources.dark() {
        tracing::warn!("lights: there are none, and no surface emits: the picture is black");
    }
    let counts = walk::survivors(paths, geometry.mean_reflectivity(), bounces);
    Ok(walk::walk(geometry, &sources, &Sequence::new(kind, paths, seed), &counts))
}

async fn record(Recording { graph, resident, settings, film, world }: Recording<'_, '_>) -> Result<(), RenderError> {
    let gpu = graph.gpu();
    let geometry = Geometry::new(&world.surfaces);
    let vpls = lights(world, &geometry, settings)?;
    let mirrors = geometry.mirrors(MOST_PLANES);
    let groups = (settings.number("samples") as u32).min(settings.number("paths") as u32);
    let (vpls, groups) = grouped(vpls, groups, &mirrors);
    let compensation = if settings.choice("compensation") == "on" { COMPENSATIONS } else { 0 };
    let radius = geometry.sphere().1 as f32;
    let shortest = settings.number("clamp") * 2.0 * radius;
    let clamped = shortest > 0.0;
    let at_once = per_round(gpu, &geometry, &vpls, if clamped { compensation } else { 0 }, !mirrors.is_empty());
    let batches = batches(&groups, at_once);
    tracing::info!(vpls = vpls.len(), rounds = batches.len(), "instant radiosity");
    let gather = Gather {
        bound: if clamped { 1.0 / (shortest * shortest) } else { f32::MAX },
        compensation: if clamped { compensation } else { 0 },
        epsilon: 2e-5 * radius,
        seed: settings.number("seed") as u32,
        rounds: batches.len() as u32,
        batches,
    };
    let side = u64::from(gpu.tile_side());
    let sums = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("sums"),
        size: side * side * 16,
        usage: wgpu::BufferUsages::STORAGE,
        mapped_at_creation: false,
    });
    check_size(gpu, vpls.len())?;
    let [nodes, corners] = geometry.bvh.textures(gpu).await?;
    let list = if vpls.is_empty() { vec![Vpl::BLACK] } else { vpls };
    let vpls = gpu.buffer("vpls", &Vpls { list });
    let (rounds, parameters, tile) = (gather.rounds, gpu.buffer("gather", &gather), graph.tile());
    graph
        .compute("gather", &GATHER)
        .constant("NODES", geometry.bvh.nodes())
        .constant("VISITS", most_visits(gpu, &geometry))
        .world(resident)
        .read("view", &resident.view)
        .read("tile", &tile)
        .read("gather", &parameters)
        .read("vpls", &vpls)
        .read("nodes", &nodes)
        .read("corners", &corners)
        .write("sums", &sums)
        .write("film", film)
        .over_film(rounds)
        .await
}

/// Virtual lights in the groups that camera rays gather, with their images in mirrors; and where each group begins and ends.
/// Lamps, of which there is one each, are shared by all groups.
fn grouped(vpls: Vec<Vpl>, groups: u32, mirrors: &[(glam::DVec3, f64, u32, glam::DVec3)]) -> (Vec<Vpl>, Vec<[u32; 2]>) {
    let mut list: Vec<Vec<Vpl>> = vec![Vec::new(); groups as usize];
    for vpl in vpls {
        if vpl.is_lamp() {
            let share = Vpl { power: vpl.power / groups as f32, ..vpl };
            list.iter_mut().for_each(|group| group.push(share));
        } else {
            list[walk::group(vpl.path, groups) as usize].push(vpl);
        }
    }
    let (mut all, mut ranges) = (Vec::new(), Vec::new());
    for group in list {
        let begin = all.len() as u32;
        let images = walk::mirrored(&group, mirrors);
        all.extend(group);
        all.extend(images);
        ranges.push([begin, all.len() as u32]);
    }
    (all, ranges)
}

/// The rounds of all groups, of so many virtual lights each.
fn batches(groups: &[[u32; 2]], at_once: u32) -> Vec<Batch> {
    let count = groups.len() as u32;
    let mut batches = Vec::new();
    for (number, &[begin, end]) in (0..).zip(groups) {
        // Hammersley's points, one alone in the middle.
        let middle = 0.5 / f64::from(count);
        let y = (radical_inverse(2, number) + middle).fract();
        let offset = Vec2::new((f64::from(number) / f64::from(count) + middle) as f32, y as f32);
        let mut next = begin;
        loop {
            let stop = end.min(next + at_once);
            let emission = if next == begin { 1.0 / count as f32 } else { 0.0 };
            batches.push(Batch { offset, begin: next, end: stop, emission });
            next = stop;
            if next >= end {
                break;
            }
        }
    }
    batches
}

/// How many nodes a ray may visit: all, but no more than the device stands.
fn most_visits(gpu: &Gpu, geometry: &Geometry) -> u32 {
    geometry.bvh.nodes().min(gpu.iterations() / 4)
}

/// How many virtual lights an invocation gathers in a round, by the nodes and triangles that rays to them meet. A CPU driver's
/// invocations go together: the loops of eight rays last as long as the longest.
fn per_round(gpu: &Gpu, geometry: &Geometry, vpls: &[Vpl], compensation: u32, mirrors: bool) -> u32 {
    const TRIES: usize = 512;
    let ray = |i: usize| {
        let [from, to] = [&vpls[(i * 7919) % vpls.len()], &vpls[(i * 104_729 + 1) % vpls.len()]];
        geometry.bvh.effort(from.position, to.position - from.position, 1.0)
    };
    let most = if vpls.is_empty() { 1 } else { (0..TRIES).map(ray).max().unwrap_or(1).max(1) };
    let rays = (1 + compensation) * if mirrors { 2 } else { 1 };
    (gpu.iterations() / 4 / (most * rays)).max(1)
}

/// Refuses more virtual lights than a buffer holds.
fn check_size(gpu: &Gpu, count: usize) -> Result<(), RenderError> {
    let limits = gpu.device.limits();
    let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) / VPL_BYTES;
    if count as u64 <= most {
        return Ok(());
    }
    Err(RenderError::Limit {
        what: "techniques.instant_radiosity.paths".into(),
        found: format!("{count} virtual lights"),
        limit: format!("{most} virtual lights"),
        advice: "Use fewer paths.".into(),
    })
}

/// Bytes of a `Vpl` in `vpl.wesl`.
const VPL_BYTES: u64 = 112;
