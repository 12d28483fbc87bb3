//! Particles and strands, drawn one by one: balls as billboards, strands as ribbons, in the order of their distances.
//!
//! A pixel's ray passes a ball of radius r, whose optical depth through the centre is τ₀, at a distance b from the centre. It has
//! there the optical depth τ₀·(1 − b²/r²)^(5/2), or, from the eye on and up to a surface, the part of it that a polynomial
//! gives (docs/particles.md). A layer of opacity α = 1 − e^{−τ} and radiance L·α, L = (k_e + Σ_lights E·T·σ_s·p)/σ_t, is laid over
//! those behind it. So the transmittance of the whole ray is exact; of light from within overlapping balls it is the order that is
//! wrong, and where it is sampled.
//!
//! Strands are ribbons as wide as the fibre and a pixel more: α is averaged over a pixel's width across the fibre, which at
//! any width leaves the share of light that gets past.
//!
//! What arrives of a light is looked up in maps of transmittance (technique `transmittance`, which scenes of bodies have by
//! default) and multiplied with opaque surfaces' shadows; by default at six points of a ball, from which it goes linearly over its
//! pixels (`lit.wesl`). The sort is done by the device every frame.
//!
//! Unsorted, absorbance goes into Fourier's coefficients of each camera ray [Jansen10], as that of light rays does, and a body's
//! light is weighted by the transmittance up to its middle and added up; the sum is scaled so that the opacity of the whole is
//! exact [Munstermann18].
//!
//! Not in the model: light scattered more than once, an extinction that differs among channels, and media that are not bodies.

mod coefficients;
#[cfg(test)]
mod motion;
#[cfg(test)]
mod test;

use tyndall_scene::parameter::{Kind, Parameter, Settings};
use tyndall_scene::{Field, FieldError, World};

use super::{AREA_POINTS, ENVIRONMENT_DIRECTIONS, MODEL, Recording, Role, Technique};
use crate::graph::{Declaration, Draw, Raster, Shader, Target, shader};
use crate::resident::surfaces::emitters;
use crate::resident::{Light, Resident, environment};
use crate::shadows::{self, Options, Shadows};
use crate::sorting::Order;
use crate::{Gpu, RenderError, layers};

/// The declaration of drawn bodies.
pub const TECHNIQUE: Technique = Technique {
    name: "particles",
    summary: "Particles and strands, sorted and blended: absorption, emission, and single scattering",
    role: Role::Media,
    parameters: &[
        MODEL,
        Parameter {
            name: "order",
            help: "Bodies sorted by their distance, or unsorted, by coefficients of what hides what",
            unit: "",
            kind: Kind::Choice(&["sorted", "coefficients"]),
        },
        Parameter {
            name: "coefficients",
            help: "Numbers of Fourier's series a pixel, where bodies are not sorted (an even number counts as one less)",
            unit: "",
            kind: Kind::Count { min: 3, max: 15, default: 7 },
        },
        Parameter {
            name: "lighting",
            help: "Light each body as a whole, linearly over a ball, or each of its pixels",
            unit: "",
            kind: Kind::Choice(&["body", "pixel"]),
        },
        ENVIRONMENT_DIRECTIONS,
        AREA_POINTS,
        shadows::RESOLUTION,
    ],
    record: |recording| Box::pin(record(recording)),
};

static LIT: Shader = shader!("techniques/particles/lit");
static SORTED: Shader = shader!("techniques/particles/sorted");

/// Bodies a submission.
const BATCH: u32 = 1 << 18;

/// Vertices of what is drawn for a body: two triangles.
const VERTICES: u32 = 6;

/// What all passes share.
struct Shared<'a> {
    resident: &'a Resident,
    lit: wgpu::Buffer,
    behind: Option<&'a wgpu::Texture>,
}

async fn record(recording: Recording<'_, '_>) -> Result<(), RenderError> {
    let Recording { graph, world, resident, settings, film, behind, .. } = recording;
    check(world, settings)?;
    let gpu = graph.gpu();
    let resident = &*resident;
    let count = resident.bodies.ball_count + resident.bodies.segment_count;
    let limits = gpu.device.limits();
    let bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    let most = Order::most(gpu).min((bytes / 64) as u32);
    if count > most {
        return Err(RenderError::Limit {
            what: "media".into(),
            found: format!("{count} particles and segments of strands"),
            limit: format!("{most}"),
            advice: "Render fewer.".into(),
        });
    }
    let model = settings.choice("model");
    let whole = settings.choice("lighting") == "body";
    let scattering = model == "single_scattering";
    let mut lights = lights(resident, world, settings);
    if scattering {
        warn(resident, world, settings);
    }
    let options = Options::of_media(settings);
    let casts = if scattering { Shadows::plan(gpu, resident, &mut lights, &options)? } else { Vec::new() };
    let lit_by = lights.len() as u32;
    within_iterations(gpu, resident, if scattering { lit_by } else { 0 })?;
    // A buffer is never empty.
    lights.extend(lights.is_empty().then(|| Light::directional(glam::Vec3::X, glam::Vec3::ZERO)));
    let lights = emitters::buffer(graph, lights, &world.surfaces, settings.number("area_points") as u32);
    let shadows = Shadows::record(graph, resident, &resident.view, &lights, casts, &options).await?;
    let shared = Shared { resident, lit: gpu.scratch("lit", lit_bytes(resident)), behind };
    let order = Order::new(gpu, count);
    let lighting = Lighting { whole, scattering, emission: model != "absorption", count: lit_by, lights, shadows };
    let declared = lighting.on(graph.compute("lit", &LIT), resident);
    shared
        .bodies(declared)
        .write("lit", &shared.lit)
        .write("order", &order.buffer)
        .dispatch(order.workgroups(), 1)
        .await?;
    let target = layers::texture(gpu, resident.film).await?;
    if settings.choice("order") == "sorted" {
        order.record(graph).await?;
        let declared = lighting.on(graph.raster("particles", &SORTED), resident).read("order", &order.buffer);
        shared.on(declared).draw(shared.all(&target, layers::OVER)).await?;
        return layers::before(graph, resident, &target, behind, film).await;
    }
    let coefficients = settings.number("coefficients") as u32;
    coefficients::record(graph, &shared, coefficients, &target, film).await
}

/// What lights bodies, as a whole or pixel by pixel.
struct Lighting {
    whole: bool,
    scattering: bool,
    emission: bool,
    /// How many lights there are.
    count: u32,
    lights: wgpu::Buffer,
    shadows: Shadows,
}

impl Lighting {
    /// What `lighting.wesl` needs.
    fn on<'g, 'a, Kind>(&self, declared: Declaration<'g, 'a, Kind>, resident: &Resident) -> Declaration<'g, 'a, Kind> {
        declared
            .constant("WHOLE", self.whole)
            .constant("LIGHTS", self.count)
            .constant("SCATTERING", self.scattering)
            .constant("EMISSION", self.emission)
            .world(resident)
            .shadows(&self.shadows)
            .read("lights", &self.lights)
    }
}

impl Shared<'_> {
    /// What all passes over bodies need.
    fn bodies<'g, 'a, Kind>(&self, declared: Declaration<'g, 'a, Kind>) -> Declaration<'g, 'a, Kind> {
        declared
            .constant("BALLS", self.resident.bodies.ball_count)
            .constant("SEGMENTS", self.resident.bodies.segment_count)
            .read("view", &self.resident.view)
    }

    /// What `footprint.wesl` needs, and surfaces; where there are none, a texture that is not drawn to is bound.
    fn on<'g, 'a>(&self, declared: Declaration<'g, 'a, Raster>) -> Declaration<'g, 'a, Raster> {
        self.bodies(declared)
            .constant("BEHIND", self.behind.is_some())
            .read("lit", &self.lit)
            .read("behind", self.behind.unwrap_or(&self.resident.transmittance.maps))
    }

    /// Draws all bodies.
    fn all<'t>(&self, texture: &'t wgpu::Texture, blend: wgpu::BlendState) -> Draw<'t> {
        Draw {
            vertices: VERTICES,
            instances: self.resident.bodies.ball_count + self.resident.bodies.segment_count,
            batch: BATCH,
            target: Some(Target { texture, blend: Some(blend) }),
            depth: None,
            regions: None,
        }
    }
}

/// All lights, those with maps first.
fn lights(resident: &Resident, world: &World, settings: &Settings) -> Vec<Light> {
    let mut lights = resident.lights.clone();
    if let Some(found) = &resident.virtual_lights {
        lights.extend_from_slice(found);
    } else {
        lights.extend(environment::lights(resident, settings.number("environment_directions") as u32));
        lights.extend(emitters::lights(&world.surfaces, settings.number("area_points") as u32));
    }
    lights
}

/// Says which light bodies do not keep from each other.
fn warn(resident: &Resident, world: &World, settings: &Settings) {
    if resident.virtual_lights.is_some() {
        tracing::warn!(
            "techniques.instant_radiosity: its virtual lights have no maps of transmittance: bodies cast no shadows of them on each other"
        );
    } else if settings.number("area_points") > 0.0 {
        for surface in world.surfaces.iter().filter(|surface| surface.material.emission != glam::Vec3::ZERO) {
            tracing::warn!(
                "surfaces.{}: what it emits has no maps of transmittance: bodies cast no shadows of it on each other",
                surface.name
            );
        }
    }
}

/// Refuses what layers of bodies cannot show.
fn check(world: &World, settings: &Settings) -> Result<(), RenderError> {
    let refused = |path: String, found: String, accepted: &str| {
        Err(RenderError::Setting(FieldError { path, found, accepted: accepted.into() }))
    };
    for volume in &world.volumes {
        let medium = format!("media.{}", volume.name);
        if !matches!(volume.field, Field::Particles(_) | Field::Strands(_)) {
            return refused(
                format!("{medium}.density"),
                "a medium that is not made of particles or strands, with techniques.particles".into(),
                "media of density.particles, emitter, strands and head alone; beside others they are rendered by `tyndall reference`",
            );
        }
        if volume.temperature.is_some() {
            return refused(
                format!("{medium}.temperature"),
                "it with techniques.particles".into(),
                "particles and strands without it, or `tyndall reference`",
            );
        }
    }
    layers::one_extinction(world, "`tyndall reference`")?;
    if settings.choice("order") == "coefficients" && settings.choice("lighting") == "pixel" {
        return refused(
            "techniques.particles.lighting".into(),
            "\"pixel\" with order = \"coefficients\"".into(),
            "\"body\", or order = \"sorted\"",
        );
    }
    Ok(())
}

/// Bytes of what bodies send: a vector for each, and three more for each ball; at least one.
fn lit_bytes(resident: &Resident) -> u64 {
    16 * (4 * u64::from(resident.bodies.ball_count) + u64::from(resident.bodies.segment_count)).max(1)
}

/// Refuses more lights than the device has loop iterations for.
fn within_iterations(gpu: &Gpu, resident: &Resident, lights: u32) -> Result<(), RenderError> {
    // At six points of a ball.
    let per_light = 6 * (1 + resident.transmittance.iterations() + shadows::ITERATIONS);
    let most = u64::from(gpu.iterations()) / per_light;
    if u64::from(lights) <= most {
        return Ok(());
    }
    Err(RenderError::Limit {
        what: "lights".into(),
        found: format!("{lights} (the environment's directions and points of surfaces that emit among them)"),
        limit: format!("{most}"),
        advice: "Use fewer environment_directions or area_points.".into(),
    })
}
