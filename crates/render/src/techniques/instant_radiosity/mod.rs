//! Instant radiosity: global illumination by virtual point lights [Keller97].
//!
//! L = L_e + T L is a walk of particles from the lights: where one is reflected it leaves a virtual point light (`walk.rs`, where
//! all of the energy's bookkeeping stands), and a picture is the sum of what these light:
//!
//! L(x) = L_e(x) + Σ_vpl f(x)·I_vpl(ω)·min(cosθ_x·cosθ_vpl/r², b)·V
//!
//! The bound b keeps single lights from being seen as spots in corners. What it takes away is found again, without bias, along a
//! short ray to what is near: there G = cosθ_x·cosθ_y/r² > b, and L(y) counts (G − b)/G of its share [Kollig06]. Such rays, longer ones,
//! also find what surfaces reflect through glass, which lets no virtual light through.
//!
//! More particles walk than there are virtual lights: these stand for what all leave (`representatives.rs`), by what it counts for the
//! picture (`eye.rs`).
//!
//! Visibility is by shadow maps or rays (`visibility`); rays through a hierarchy of boxes (`resident/bvh.wesl`) also find mirrors and
//! glass on the way from the eye. Media dim light on its way (`media.rs`, on the host), and scatter none onto surfaces. Planar mirrors
//! also show the virtual lights: each has an image that shines through the mirror's outline. Each camera ray of a pixel gathers its own
//! part of the paths, so anti-aliasing takes no more lights.
//!
//! Not in the model: what curved mirrors throw onto what the eye sees, what glass throws there straight from a light (caustics), and
//! light that meets two mirrors in a row on its way from a virtual light; all are where a particle was reflected by them and met
//! something else before.

pub mod bake;
mod batches;
mod eye;
mod gathering;
pub(crate) mod geometry;
mod media;
pub(crate) mod points;
mod punctual;
mod representatives;
pub mod sequence;
pub(crate) mod sources;
#[cfg(test)]
pub(crate) mod test;
pub(crate) mod visibility;
pub(crate) mod vpl;
pub mod walk;
pub(crate) mod walkthrough;

pub use punctual::punctual;
pub use walkthrough::Walkthrough;

use tyndall_scene::World;
use tyndall_scene::parameter::{Kind, Parameter, Settings};

use super::{Recording, Role, Technique};
use crate::resident::{Light, Resident, Stride, is_bodies};
use crate::{Gpu, RenderError};
use batches::{batches, grouped};
use gathering::{Gather, Gathering, gather_pass};
use geometry::{Geometry, Mirror};
use media::Media;
use representatives::{Likeness, representatives};
use sequence::Sequence;
use sources::Sources;
use visibility::{Casters, Maps, Plan};
use vpl::Vpl;

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
            name: "walks",
            help: "Particles that walk for each path; the virtual lights of the paths stand for what all of them leave (1: no others)",
            unit: "",
            kind: Kind::Count { min: 1, max: 256, default: 32 },
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
            kind: Kind::Count { min: 1, max: 1024, default: 64 },
        },
        Parameter {
            name: "interleaving",
            help: "Side of the squares of pixels that share out the virtual lights, and their light (1: each pixel gathers all)",
            unit: "",
            kind: Kind::Count { min: 1, max: 8, default: 1 },
        },
        Parameter {
            name: "sequence",
            help: "Points of the walk: Halton's, jittered or not, jittered Hammersley's, N-rooks, or random",
            unit: "",
            kind: Kind::Choice(&["jittered", "halton", "hammersley", "rooks", "random"]),
        },
        Parameter {
            name: "media_paths",
            help: "Particles whose virtual lights media scatter (0: they scatter the light of lamps, surfaces and sky alone)",
            unit: "",
            kind: Kind::Count { min: 0, max: 4096, default: 16 },
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
            kind: Kind::Number { min: 0.0, max: 1.0, default: 0.3 },
        },
        Parameter {
            name: "compensation",
            help: "Find the light that clamping takes away along short rays",
            unit: "",
            kind: Kind::Choice(&["on", "off"]),
        },
        visibility::VISIBILITY,
        visibility::RESOLUTION,
        LIGHT_STEP,
    ],
    record: |recording| Box::pin(record(recording)),
};

/// How finely media are looked at on light's way.
const LIGHT_STEP: Parameter = Parameter {
    name: "light_step",
    help: "Longest step in media along rays from virtual lights to surfaces",
    unit: "voxels",
    kind: Kind::Number { min: 0.01, max: 64.0, default: 4.0 },
};

/// How often clamped light is sought from one point to the next, at most: of light that is clamped at each of four such points
/// nothing is left to see.
const COMPENSATIONS: u32 = 4;

/// Lights of a lamp are clamped within so many times their distance from each other.
const APART: f32 = 2.0;

/// Planes of a surface that is a mirror, at most; what has more is not flat.
const MOST_PLANES: usize = 8;

/// A walk by a technique's settings.
pub(crate) struct Walk {
    pub geometry: Geometry,
    pub sources: Sources,
    pub sequence: Sequence,
    /// How many particles are left after each reflection.
    pub counts: Vec<u32>,
    pub mirrors: Vec<Mirror>,
}

impl Walk {
    /// The walk of a world.
    ///
    /// # Errors
    /// Settings that do not go together.
    pub fn new(world: &World, settings: &Settings) -> Result<Self, RenderError> {
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
        let mut geometry = Geometry::new(&world.surfaces);
        geometry.media = Media::new(world, settings.number(LIGHT_STEP.name));
        let sources = Sources::new(world, &geometry);
        Ok(Self {
            counts: walk::survivors(paths, geometry.mean_reflectivity(), bounces),
            sequence: Sequence::new(kind, paths, seed),
            mirrors: geometry.mirrors(MOST_PLANES),
            geometry,
            sources,
        })
    }

    /// The virtual lights of all paths.
    pub fn lights(&self) -> Vec<Vpl> {
        walk::walk(&self.geometry, &self.sources, &self.sequence, &self.counts)
    }

    /// The virtual lights of a picture: as many as of all paths, which stand for those of `walks` times as many.
    fn chosen(&self, world: &World, settings: &Settings) -> Vec<Vpl> {
        let [paths, walks, bounces, seed] =
            ["paths", "walks", "bounces", "seed"].map(|name| settings.number(name) as u32);
        if walks == 1 {
            return self.lights();
        }
        let counts = walk::survivors(paths * walks, self.geometry.mean_reflectivity(), bounces);
        let sequence = self.sequence.clone().of(paths * walks);
        let all = walk::walk(&self.geometry, &self.sources, &sequence, &counts);
        let (mut list, all): (Vec<_>, Vec<_>) = all.into_iter().partition(Vpl::is_lamp);
        let weights = eye::contributions(world, self, &all, self.bounds(settings).map(f64::from));
        let count = self.counts.iter().sum::<u32>() as usize;
        let likeness = Likeness {
            length: 0.5 * self.geometry.sphere().1 as f32,
            // Of what is followed but a few times it matters how often, as clamped light is sought one reflection farther.
            bounces: if bounces <= COMPENSATIONS { bounces } else { 1 },
        };
        list.extend(representatives(&all, &weights, count, &likeness, seed));
        list
    }

    /// In which of so many groups each path is, by its number.
    fn groups(&self, lights: &[Vpl], settings: &Settings, groups: u32) -> Vec<u32> {
        let [paths, walks] = ["paths", "walks"].map(|name| settings.number(name) as u32);
        if walks == 1 {
            return walk::groups(paths, groups.min(paths));
        }
        let count = lights.iter().filter(|vpl| !vpl.is_lamp()).count().max(1) as u32;
        // Where lamps alone shine, all groups have their share of them.
        walk::groups_in_turn(count.max(groups), groups)
    }

    /// The greatest cosθ·cosθ/r² [m⁻²] that is not clamped: of light that is reflected, and of light that surfaces emit. The lights of
    /// lamps lie so close to each other that from a few times their distance none of them is seen.
    fn bounds(&self, settings: &Settings) -> [f32; 2] {
        let distance = settings.number("clamp") * 2.0 * self.geometry.sphere().1 as f32;
        let apart = (self.sources.emitting_area() / f64::from(self.counts[0])).sqrt() as f32;
        [distance, distance.min(APART * apart)].map(|d| if d > 0.0 { 1.0 / (d * d) } else { f32::MAX })
    }

    /// The virtual lights of `media_paths` paths but for the lamps, for media. What is clamped is softened there: they shine like discs
    /// whose radius is the clamped distance.
    fn for_media(&self, settings: &Settings, bound: f32) -> Vec<Light> {
        let paths = settings.number("media_paths") as u32;
        let counts = walk::survivors(paths, self.geometry.mean_reflectivity(), settings.number("bounces") as u32);
        let sequence = self.sequence.clone().of(paths);
        let vpls = walk::walk(&self.geometry, &self.sources, &sequence, &counts);
        vpls.iter().filter(|vpl| !vpl.is_lamp()).map(|vpl| vpl.softened(1.0 / bound)).collect()
    }

    /// What the shader is told: rounds and lights are to be filled in.
    fn gather(&self, resident: &Resident, settings: &Settings) -> Gather {
        let (radius, bounds) = (self.geometry.sphere().1 as f32, self.bounds(settings));
        let compensation = settings.choice("compensation") == "on" && settings.number("clamp") > 0.0;
        Gather {
            bound: bounds[0],
            emitted_bound: bounds[1],
            bounces: settings.number("bounces") as u32,
            compensation: if compensation { COMPENSATIONS } else { 0 },
            epsilon: 2e-5 * radius,
            seed: settings.number("seed") as u32,
            rounds: 0,
            casters: Casters::of(&self.geometry),
            stride: stride(resident, settings),
            vpls: Vec::new(),
        }
    }
}

/// How many virtual lights a scene's settings of the technique give, without images in mirrors.
///
/// # Errors
/// Settings that are not accepted.
pub fn count(world: &World) -> Result<u32, RenderError> {
    let given = world.scene.techniques.get(TECHNIQUE.name);
    let settings = Settings::new(TECHNIQUE.name, TECHNIQUE.parameters, given)?;
    Ok(Walk::new(world, &settings)?.chosen(world, &settings).len() as u32)
}

async fn record(
    Recording { graph, resident, settings, film, world, .. }: Recording<'_, '_>,
) -> Result<(), RenderError> {
    let gpu = graph.gpu();
    let walk = Walk::new(world, settings)?;
    let lights = walk.chosen(world, settings);
    let groups = walk.groups(&lights, settings, settings.number("samples") as u32);
    let (vpls, ranges) = grouped(&lights, &groups, &walk.mirrors);
    check_size(gpu, vpls.len())?;
    let mut gather = walk.gather(resident, settings);
    let side = visibility::side(gpu, settings, resident, vpls.len())?;
    let at_once = per_round(gpu, resident, &walk, &vpls, &gather)?;
    let mut batches = batches(&ranges, side.map_or(at_once, |side| at_once.min(Plan::capacity(gpu, side))));
    let plan = side.map_or(Plan::none(), |side| Plan::new(gpu, side, &vpls, &mut batches));
    gather.rounds = batches.len() as u32;
    tracing::info!(vpls = vpls.len(), rounds = gather.rounds, maps = side.is_some(), "instant radiosity");
    if world.volumes.iter().any(is_bodies) {
        tracing::warn!("media: particles and strands dim no virtual light on its way to surfaces");
    }
    if settings.number("media_paths") > 0.0 && !world.volumes.is_empty() {
        resident.virtual_lights = Some(walk.for_media(settings, gather.bound));
        // They take the place of the environment's directions, which may have maps.
        resident.transmittance.mapped = resident.transmittance.mapped.min(resident.lights.len() as u32);
        resident.transmittance.directions = 0;
    }
    gather.vpls = if vpls.is_empty() { vec![Vpl::BLACK] } else { vpls };
    let mut gathering = Gathering::by_rays(gpu, walk.geometry.bvh.textures(gpu).await?, &gather, &batches).await?;
    if side.is_some() {
        gathering.maps = Maps::record(graph, resident, &gathering.gather, &plan).await?;
    }
    let (cells, interleaving) = (points::cells(gpu), settings.number("interleaving") as u32);
    if interleaving > 1 {
        points::points_pass(graph, resident, &walk, settings, &lights, &gathering.hierarchy, &cells).await?;
    }
    gather_pass(graph, resident, &walk.geometry, &gathering, &cells, interleaving, film).await
}

/// How light is marched through media.
fn stride(resident: &Resident, settings: &Settings) -> Stride {
    Stride {
        step: settings.number(LIGHT_STEP.name),
        least: Stride::least(&resident.traits),
        offset: 0.5,
        tolerance: 0.0,
        skip: 1,
        lit: 0,
    }
}

/// How many virtual lights an invocation gathers in a round, by the nodes and triangles that rays to them meet, and the steps through
/// media. A CPU driver's invocations go together: the loops of eight rays last as long as the longest.
fn per_round(gpu: &Gpu, resident: &Resident, walk: &Walk, vpls: &[Vpl], gather: &Gather) -> Result<u32, RenderError> {
    const TRIES: usize = 512;
    let ray = |i: usize| {
        let [from, to] = [&vpls[(i * 7919) % vpls.len()], &vpls[(i * 104_729 + 1) % vpls.len()]];
        walk.geometry.bvh.effort(from.position, to.position - from.position, 1.0)
    };
    let most = if vpls.is_empty() { 1 } else { (0..TRIES).map(ray).max().unwrap_or(1).max(1) };
    let legs = if walk.mirrors.is_empty() { 1 } else { 2 };
    let march = if resident.traits.count > 0 { resident.traits.iterations(gather.stride.step) } else { 0 };
    let per_light = u64::from(legs * (1 + gather.compensation)) * march.saturating_add(4 * u64::from(most));
    let limit = u64::from(gpu.iterations());
    if march > 0 && per_light > limit {
        return Err(RenderError::Limit {
            what: "techniques.instant_radiosity.light_step".into(),
            found: format!("{per_light} loop iterations towards a virtual light"),
            limit: format!("{limit}"),
            advice: "Use a longer light_step, or compensation = \"off\".".into(),
        });
    }
    Ok((limit / per_light).max(1) as u32)
}

/// Refuses more virtual lights than a buffer holds.
fn check_size(gpu: &Gpu, count: usize) -> Result<(), RenderError> {
    let limits = gpu.device.limits();
    let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) / VPL_BYTES - 1;
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
pub(crate) const VPL_BYTES: u64 = 112;
