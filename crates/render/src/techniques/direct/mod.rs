//! Direct light: what surfaces emit, and what they reflect of light that comes to them straight from lights.
//!
//! L = L_e + Σ_lights f(l, v)·(n·l)·E·V·T, with the BRDF f, the irradiance E on a plane perpendicular to the light, the share V
//! that comes past surfaces (shadow maps, `shadows`), and the transmittance T of media, by a march from the surface to the
//! light, by the same rule as that of light scattered in media.
//!
//! Lights at points and from one direction are exact but for their shadows. Surfaces that emit shine as `area_points` parts of
//! equal area, each as a disc on its axis would, L·cosθ·A/(r² + A/π), which bounds it near the surface; the environment shines as
//! `environment_directions` parallel lights, by median cut [Debevec05] where it is a map.
//!
//! Of several rays a pixel each is seen, lit and added up by itself, under the same shadow maps.
//!
//! Not in the model: light that has been reflected before, and so all that a mirror or a dielectric shows, which stay black.

#[cfg(test)]
mod test;

use glam::Vec2;
use tyndall_scene::parameter::{Kind, Parameter, Settings};
use tyndall_scene::surface::Bsdf;
use tyndall_scene::{FieldError, World};

use super::{AREA_POINTS, ENVIRONMENT_DIRECTIONS, Recording, Role, SAMPLES, Technique};
use crate::graph::{Shader, shader};
use crate::resident::surfaces::emitters;
use crate::resident::{Light, Resident, Stride, environment};
use crate::shadows::{self, Options, Shadows};
use crate::surfaces::{self, GBuffer};
use crate::{Gpu, RenderError};

/// The declaration of direct light.
pub const TECHNIQUE: Technique = Technique {
    name: "direct",
    summary: "Direct light on surfaces, with shadow maps",
    role: Role::Surfaces,
    parameters: &[
        SAMPLES,
        shadows::RESOLUTION,
        shadows::CASCADES,
        shadows::RADIUS,
        AREA_POINTS,
        ENVIRONMENT_DIRECTIONS,
        Parameter {
            name: "light_step",
            help: "Longest step in media along rays to the lights",
            unit: "voxels",
            kind: Kind::Number { min: 0.01, max: 64.0, default: 2.0 },
        },
    ],
    record: |recording| Box::pin(record(recording)),
};

static DIRECT: Shader = shader!("techniques/direct/direct");

/// The buffer `direct`.
#[derive(Clone, Copy, Debug, encase::ShaderType)]
pub(crate) struct Direct {
    stride: Stride,
    lights: u32,
    rounds: u32,
    lights_per_round: u32,
    radius: f32,
    sample: u32,
    samples: u32,
}

async fn record(recording: Recording<'_, '_>) -> Result<(), RenderError> {
    let Recording { graph, resident, settings, film, world, gbuffer, .. } = recording;
    let Some(gbuffer) = gbuffer else { return Ok(()) };
    warn(world);
    let gpu = graph.gpu();
    let options = Options {
        resolution: settings.number("shadow_resolution") as u32,
        cascades: settings.number("cascades") as u32,
        radius: settings.number("shadow_radius"),
    };
    same_directions(resident, settings)?;
    let mut lights = Vec::new();
    // Where light maps are, nothing reflects, and no light needs a shadow map.
    if world.surfaces.iter().any(|surface| reflects(&surface.material.bsdf)) {
        lights.extend(resident.lights.iter().copied());
        lights.extend(environment::lights(resident, settings.number("environment_directions") as u32));
        lights.extend(emitters::lights(&world.surfaces, settings.number("area_points") as u32));
    }
    let casts = Shadows::plan(gpu, resident, &mut lights, &options)?;
    let stride = Stride {
        step: settings.number("light_step"),
        least: Stride::least(&resident.traits),
        offset: 0.5,
        tolerance: 0.0,
        skip: 1,
        lit: 0,
    };
    let count = lights.len() as u32;
    let lights_per_round = lights_per_round(gpu, resident, &stride, &options)?.min(count.max(1));
    let rounds = count.div_ceil(lights_per_round).max(1);
    // A buffer is never empty.
    lights.extend(lights.is_empty().then(|| Light::directional(glam::Vec3::X, glam::Vec3::ZERO)));
    let lights = emitters::buffer(graph, lights, &world.surfaces, settings.number("area_points") as u32);
    let shadows = Shadows::record(graph, resident, &resident.view, &lights, casts, &options).await?;
    let side = u64::from(gpu.tile_side());
    let samples = settings.number("samples") as u32;
    let kept = rounds > 1 || samples > 1;
    let sums = gpu.scratch("sums", if kept { side * side * 16 } else { 16 });
    // Rays through other points than the middle of pixels fill a G-buffer of their own, one after the other.
    let other = if samples > 1 { Some(GBuffer::new(gpu, resident).await?) } else { None };
    for sample in 0..samples {
        let (mut view, mut seen) = (resident.view.clone(), gbuffer);
        if let Some(other) = &other {
            view = surfaces::aside(graph, &resident.view, offset(sample, samples)).await?;
            other.fill(graph, resident, &view, &resident.previous, (samples as f32).sqrt().recip()).await?;
            seen = other;
        }
        let radius = options.radius;
        let direct = Direct { stride, lights: count, rounds, lights_per_round, radius, sample, samples };
        let direct = gpu.buffer("direct", &direct);
        let tile = graph.tile();
        graph
            .compute("direct", &DIRECT)
            .constant("KEPT", kept)
            .constant("AVERAGED", resident.surfaces.pictures)
            .constant("MARCHED", count > resident.transmittance.mapped)
            .world(resident)
            .shadows(&shadows)
            .read("view", &view)
            .read("tile", &tile)
            .read("direct", &direct)
            .read("lights", &lights)
            .read("middle_place", &gbuffer.place)
            .read("surface_place", &seen.place)
            .read("surface_facing", &seen.facing)
            .read("surface_mapping", &seen.mapping)
            .write("sums", &sums)
            .write("film", film)
            .over_film(rounds)
            .await?;
    }
    Ok(())
}

/// The point of a sample in the pixel, from its middle: Hammersley's, but by the golden ratio, as `march` has them.
fn offset(sample: u32, samples: u32) -> Vec2 {
    let down = 0.5 + f64::from(sample) * 0.618_033_988_7;
    Vec2::new((sample as f32 + 0.5) / samples as f32, down.fract() as f32) - 0.5
}

/// Whether a surface reflects light of lights at points.
fn reflects(bsdf: &Bsdf) -> bool {
    match bsdf {
        Bsdf::Lambert { reflectance, .. } => *reflectance != glam::Vec3::ZERO,
        Bsdf::MetallicRoughness { .. } => true,
        Bsdf::Mirror { .. } | Bsdf::Dielectric { .. } => false,
    }
}

/// Refuses other directions of the environment than those that have maps of transmittance.
fn same_directions(resident: &Resident, settings: &Settings) -> Result<(), RenderError> {
    let (found, mapped) = (settings.number("environment_directions") as u32, resident.transmittance.directions);
    if mapped == 0 || found == mapped {
        return Ok(());
    }
    Err(FieldError {
        path: "techniques.direct.environment_directions".into(),
        found: format!("{found} directions, beside maps of transmittance for {mapped}"),
        accepted: format!("{mapped}, as many as the technique of media has"),
    }
    .into())
}

/// Says what stays black.
fn warn(world: &World) {
    for surface in &world.surfaces {
        if matches!(surface.material.bsdf, Bsdf::Mirror { .. } | Bsdf::Dielectric { .. }) {
            tracing::warn!(
                "surfaces.{}: what it mirrors or lets through is left out by techniques.direct",
                surface.name
            );
        }
    }
}

/// How many lights a pixel can be lit by in a round, so that no invocation makes more loop iterations than the device stands.
fn lights_per_round(gpu: &Gpu, resident: &Resident, stride: &Stride, options: &Options) -> Result<u32, RenderError> {
    let across = 2 * options.radius.ceil() as u64 + 1;
    let shadow = u64::from(options.cascades) + across * (across + 1);
    let volumes = u64::from(resident.traits.count);
    let per_light = resident.traits.iterations(stride.step).saturating_add(shadow + 1);
    let limit = u64::from(gpu.iterations()).saturating_sub(volumes);
    if per_light > limit {
        return Err(RenderError::Limit {
            what: "techniques.direct.light_step".into(),
            found: format!("{per_light} loop iterations towards a light"),
            limit: format!("{limit}"),
            advice: "Use a longer light_step, or a smaller shadow_radius.".into(),
        });
    }
    Ok((limit / per_light) as u32)
}
