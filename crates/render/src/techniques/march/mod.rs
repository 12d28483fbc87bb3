//! Ray marching: the emission–absorption integral, and single scattering by an inner march to every light.
//!
//! Along a camera ray, with transmittance T(t) = exp(−∫₀ᵗ σ_t) [lecture]:
//!
//! L = ∫ T(t) [k_e(t) + Σ_lights E(t)·T_light(t)·Σ_media σ_s(t)·p(cosθ)] dt + T·L_environment
//!
//! Where a ray is sampled, the step rule, stands once in `resident/walk.wesl`. Each segment is integrated in closed form,
//! (1−e^{−σ_tΔ})/σ_t. Rays to the lights follow the same rule with `light_step`; there, and wherever no light is scattered,
//! homogeneous volumes take one step, which is exact. Without jitter the error is a smooth bias, second order in the step.
//!
//! Light scattered more than once is approximated by octaves [Wrenninge13 (3)]: order n is single scattering with the
//! strength aⁿ, the optical depth bⁿ·τ and the mean cosine cⁿ·g. The environment scatters as parallel lights from
//! `environment_directions` directions. Not in the model: scattered emission.

mod blue_noise;
#[cfg(test)]
mod lattice;
#[cfg(test)]
mod looks;
#[cfg(test)]
mod test;

use glam::{Vec2, Vec3};
use tyndall_scene::FieldError;
use tyndall_scene::parameter::{Kind, Parameter};
use tyndall_scene::volume::BRICK_CELLS;

use super::{
    AREA_POINTS, ENVIRONMENT_DIRECTIONS, MODEL, Recording, Role, SAMPLES, TERMINATION, Technique, without_bodies,
    without_meshes,
};
use crate::graph::{Shader, shader, squares};
use crate::resident::surfaces::emitters;
use crate::resident::{Resident, Stride, environment};
use crate::shadows::{self, Options, Shadows};
use crate::{Gpu, RenderError};

/// Ray marching's declaration.
pub const TECHNIQUE: Technique = Technique {
    name: "march",
    summary: "Ray marching: absorption, emission, and single scattering by an inner march to every light",
    role: Role::Media,
    parameters: &[
        MODEL,
        Parameter {
            name: "order",
            help: "March from the eye, and end where nothing comes through, or towards it: the picture is the same",
            unit: "",
            kind: Kind::Choice(&["front_to_back", "back_to_front"]),
        },
        Parameter {
            name: "step",
            help: "Longest step along camera rays",
            unit: "voxels",
            kind: Kind::Number { min: 0.01, max: 64.0, default: 1.0 },
        },
        Parameter {
            name: "light_step",
            help: "Longest step along rays to the lights",
            unit: "voxels",
            kind: Kind::Number { min: 0.01, max: 64.0, default: 2.0 },
        },
        TERMINATION,
        Parameter {
            name: "tolerance",
            help: "Optical depth within which steps are taken together: thin parts take longer steps (0: never)",
            unit: "",
            kind: Kind::Number { min: 0.0, max: 1.0, default: 0.0 },
        },
        Parameter {
            name: "empty_space_skipping",
            help: "Pass over bricks of 8 voxels a side of which nothing is seen; the picture does not change",
            unit: "",
            kind: Kind::Choice(&["on", "off"]),
        },
        Parameter {
            name: "preintegration",
            help: "Integrate transfer functions over the values between a step's ends, not at its middle alone",
            unit: "",
            kind: Kind::Choice(&["off", "on"]),
        },
        SAMPLES,
        Parameter {
            name: "jitter",
            help: "Where in its step a ray is sampled: in the middle, or by blue noise, of which frames add up",
            unit: "",
            kind: Kind::Choice(&["off", "blue_noise"]),
        },
        Parameter {
            name: "resolution",
            help: "March every pixel, or one in 2 x 2 or 4 x 4 first, and those between where they cannot be interpolated",
            unit: "",
            kind: Kind::Choice(&["full", "half", "quarter"]),
        },
        Parameter {
            name: "resolution_tolerance",
            help: "Error of interpolated radiance, times the film's exposure, or opacity above which a pixel is marched",
            unit: "W/sr/m^2",
            kind: Kind::Number { min: 0.0, max: 1.0, default: 0.02 },
        },
        ENVIRONMENT_DIRECTIONS,
        AREA_POINTS,
        shadows::RESOLUTION,
        Parameter {
            name: "octaves",
            help: "Orders that approximate light scattered more than once, beside the first",
            unit: "",
            kind: Kind::Count { min: 0, max: 16, default: 0 },
        },
        Parameter {
            name: "octave_strength",
            help: "Strength of an octave relative to the one before",
            unit: "",
            kind: Kind::Number { min: 0.0, max: 1.0, default: 0.5 },
        },
        Parameter {
            name: "octave_attenuation",
            help: "Optical depth that an octave meets, relative to the one before",
            unit: "",
            kind: Kind::Number { min: 0.01, max: 1.0, default: 0.5 },
        },
        Parameter {
            name: "octave_anisotropy",
            help: "Mean cosine of an octave's phase function, relative to the one before",
            unit: "",
            kind: Kind::Number { min: 0.0, max: 1.0, default: 0.5 },
        },
    ],
    record: |recording| Box::pin(record(recording)),
};

static MARCH: Shader = shader!("techniques/march/march");
static REFINE: Shader = shader!("techniques/march/refine");

/// How light is scattered (`scattering.wesl`).
#[derive(Clone, Copy, Debug, encase::ShaderType)]
pub(crate) struct Scattering {
    stride: Stride,
    lights: u32,
    octaves: u32,
    octave: Vec3,
}

/// The buffer `march`.
#[derive(Clone, Copy, Debug, encase::ShaderType)]
pub(crate) struct March {
    stride: Stride,
    scattering: Scattering,
    termination: f32,
    suns: u32,
    rounds: u32,
    samples_per_round: u32,
    rays: u32,
    scale: u32,
    lattice_reach: i32,
    reach: Vec2,
}

/// The buffer `refine`.
#[derive(Clone, Copy, Debug, encase::ShaderType)]
pub(crate) struct Refine {
    reach: i32,
    tolerance: f32,
    alike: f32,
}

/// Bytes of a `Path` in `march.wesl`.
pub(crate) const PATH_BYTES: u64 = 48;

/// Pixels that a workgroup of `refine.wesl` queues at most, three a cell, and of how many workgroups' a row of the queue is.
const QUEUED: u32 = 192;
const QUEUE_ROW: u32 = 16;

/// A reach beyond all media: FAR in math/ray.wesl.
const BEYOND: Vec2 = Vec2::new(1e30, 0.0);

async fn record(recording: Recording<'_, '_>) -> Result<(), RenderError> {
    record_up_to(recording, BEYOND).await
}

/// As [`record`], with rays integrated no further than `reach` (`march.wesl`).
pub(crate) async fn record_up_to(
    Recording { graph, resident, settings, film, world, behind, .. }: Recording<'_, '_>,
    reach: Vec2,
) -> Result<(), RenderError> {
    if resident.transmittance.mapped > 0 && !resident.bodies.is_empty() {
        without_meshes(world, TECHNIQUE.name)?;
        tracing::warn!(
            "techniques.march: of particles and strands only shadows are seen, by the maps of transmittance"
        );
    } else {
        without_bodies(world, TECHNIQUE.name)?;
    }
    let gpu = graph.gpu();
    let model = settings.choice("model");
    let scattering = model == "single_scattering";
    let traits = &resident.traits;
    let mut lights = resident.lights.clone();
    // Those that shade surfaces come first.
    let suns = lights.iter().filter(|light| light.local == 0).count() as u32;
    if let Some(found) = &resident.virtual_lights {
        lights.extend_from_slice(found);
    } else {
        lights.extend(environment::lights(resident, settings.number("environment_directions") as u32));
        lights.extend(emitters::lights(&world.surfaces, settings.number("area_points") as u32));
    }
    let options = Options::of_media(settings);
    let casts = if scattering { Shadows::plan(gpu, resident, &mut lights, &options)? } else { Vec::new() };
    let stride = Stride {
        step: settings.number("step"),
        least: Stride::least(traits),
        offset: 0.5,
        tolerance: settings.number("tolerance"),
        skip: u32::from(settings.choice("empty_space_skipping") == "on"),
        lit: u32::from(scattering),
    };
    let octaves = ["octave_strength", "octave_attenuation", "octave_anisotropy"].map(|name| settings.number(name));
    let scattered = Scattering {
        stride: Stride { step: settings.number("light_step"), lit: 0, ..stride },
        lights: if scattering { lights.len() as u32 } else { 0 },
        octaves: settings.number("octaves") as u32,
        octave: Vec3::from(octaves),
    };
    // Lights without a map need an inner march.
    let marched = scattered.lights > resident.transmittance.mapped;
    let rays = settings.number("samples") as u32;
    let (rounds, samples_per_round) = rounds(gpu, resident, &stride, &scattered, rays)?;
    let scale = match settings.choice("resolution") {
        "half" => 2,
        "quarter" => 4,
        _ => 1,
    };
    if scale > 1 && behind.is_some() && !traits.grey {
        return Err(FieldError {
            path: "techniques.march.resolution".into(),
            found:
                "a march at a lower resolution, before surfaces, through media whose extinction differs among channels"
                    .into(),
            accepted: "\"full\", or media of one extinction".into(),
        }
        .into());
    }
    let termination = settings.number("termination");
    let march = March {
        stride,
        scattering: scattered,
        termination,
        suns,
        rounds,
        samples_per_round,
        rays,
        scale,
        lattice_reach: beyond(scale as i32),
        reach,
    };
    let jitter = settings.choice("jitter") == "blue_noise";
    let storage = wgpu::TextureUsages::STORAGE_BINDING;
    // How many invocations march what is queued at most.
    let most = squares(gpu.tile_side(), 2).div_ceil(8).pow(2) * QUEUED;
    let queue_size = if scale > 1 { [64 * QUEUE_ROW, most.div_ceil(64 * QUEUE_ROW)] } else { [1; 2] };
    let queue = gpu.texture_2d("queue", queue_size, wgpu::TextureFormat::R32Uint, storage).await?;
    let workgroups = gpu.workgroups("workgroups");
    let mean = jitter || rays > 1;
    let back_to_front = settings.choice("order") == "back_to_front";
    let preintegrated = settings.choice("preintegration") == "on";
    // As many as along.wesl has room for.
    let along = scattering
        && !marched
        && (1..=32).contains(&lights.len())
        && resident.transmittance.parallel
        && scattered.octaves == 0
        && casts.is_empty();
    let plain =
        (!scattering || along) && !preintegrated && !back_to_front && stride.tolerance == 0.0 && reach == BEYOND;
    let [width, height] = resident.film.map(u64::from);
    let slots = u64::from(if scale > 1 { most } else { gpu.tile_side().pow(2) });
    let paths = gpu.scratch("paths", if rounds > 1 { slots * PATH_BYTES } else { PATH_BYTES });
    let values = gpu.scratch("values", if mean || scale > 1 { width * height * 16 } else { 16 });
    let noise = blue_noise::texture(gpu, jitter).await?;
    let parameters = gpu.buffer("march", &march);
    let lights = emitters::buffer(graph, lights, &world.surfaces, settings.number("area_points") as u32);
    let shadows = Shadows::record(graph, resident, &resident.view, &lights, casts, &options).await?;
    let tile = graph.tile();
    // A lattice, and then what is half-way between its pixels, until that is every pixel.
    let apart = scale > 1 && traits.grey;
    let exposure = world.scene.film.exposure.exp2();
    let halved = std::iter::successors((scale > 1).then_some(scale), |&scale| (scale > 2).then_some(scale / 2));
    for lattice in std::iter::once(None).chain(halved.map(Some)) {
        if let Some(scale) = lattice {
            let refine = Refine {
                reach: beyond(scale as i32 / 2),
                tolerance: settings.number("resolution_tolerance") / exposure,
                alike: 8.0 * traits.voxel,
            };
            let refine = gpu.buffer("refine", &refine);
            graph
                .compute("refine", &REFINE)
                .constant("BEHIND", behind.is_some())
                .constant("SEPARATE", apart)
                .constant("SCALE", scale)
                .world(resident)
                .read("behind", behind.unwrap_or(&noise))
                .read("view", &resident.view)
                .read("tile", &tile)
                .read("refine", &refine)
                .write("values", &values)
                .write("queue", &queue)
                .write("workgroups", &workgroups)
                .write("film", film)
                .over_coarse_film(1, scale)
                .await?;
        }
        let pass = graph
            .compute("march", &MARCH)
            .constant("EMISSION", model != "absorption")
            .constant("SCATTERING", scattering)
            .constant("PREINTEGRATED", preintegrated)
            .constant("BACK_TO_FRONT", back_to_front)
            .constant("ONE_GRID", plain && traits.one_grid())
            .constant("ALONG", along && plain && traits.one_grid())
            .constant("RUN", if scale > 1 { 4.0 } else { 1e9 })
            .constant("SUNS", suns > 0)
            .constant("MARCHED", marched)
            .constant("LIGHTS", scattered.lights)
            .constant("OCTAVES", scattered.octaves)
            .constant("BUSY", marched || traits.shaded || traits.surfaces)
            .constant("ROUNDS", rounds > 1)
            .constant("MEAN", mean)
            .constant("JITTER", jitter)
            .constant("BEHIND", behind.is_some())
            .constant("SEPARATE", apart)
            .constant("LATTICE", scale > 1 && lattice.is_none())
            .constant("QUEUED", lattice.is_some())
            .world(resident)
            .shadows(&shadows)
            .read("view", &resident.view)
            .read("tile", &tile)
            .read("march", &parameters)
            .read("lights", &lights)
            .read("blue_noise", &noise)
            .read("behind", behind.unwrap_or(&noise))
            .read("queue", &queue)
            .write("film", film)
            .write("paths", &paths)
            .write("values", &values);
        match lattice {
            None => pass.over_coarse_film(rounds * rays, scale).await?,
            Some(_) => pass.over_queue(rounds * rays, &workgroups).await?,
        }
    }
    Ok(())
}

/// How far beyond a tile pixels of a lattice of every `scale`-th are found, as finding those half-way between needs them: two of the
/// lattice from the last that is found there. Of a lattice of all pixels the last is in the tile.
fn beyond(scale: i32) -> i32 {
    if scale == 1 { -1 } else { (beyond(scale / 2).div_euclid(scale) + 2) * scale }
}

/// Into how many rounds, of how many samples, a camera ray is cut so that no invocation makes more loop iterations than
/// the device stands. Every loop counts, also those that a compiler would unroll.
fn rounds(
    gpu: &Gpu,
    resident: &Resident,
    stride: &Stride,
    scattering: &Scattering,
    rays: u32,
) -> Result<(u32, u32), RenderError> {
    // A ray steps through each volume, and once more at each of its boundaries. A volume may be absurdly long.
    let count = |step: f32| {
        let steps = resident.traits.diagonals.iter().map(|voxels| ((voxels / step).ceil() as u64).saturating_add(2));
        steps.fold(1u64, u64::saturating_add)
    };
    let (steps, light_steps) = (count(stride.step), count(scattering.stride.step));
    // Bricks on the way, each of which may be passed over in an iteration; or a step, if that is longer.
    let bricks = |step: f32| count(step.max(BRICK_CELLS as f32 / 3.0));
    let volumes = u64::from(resident.traits.count);
    let (lights, octaves) = (u64::from(scattering.lights), u64::from(scattering.octaves) + 1);
    let looks = u64::from(resident.traits.loops);
    let per_step = 2 + 3 * volumes + looks;
    let arrives = octaves * (volumes + 1) + volumes + shadows::ITERATIONS;
    let per_light =
        light_steps.saturating_add(bricks(scattering.stride.step)).saturating_mul(per_step).saturating_add(arrives);
    let mapped = lights.min(resident.transmittance.mapped.into());
    let looked_up = mapped * (resident.transmittance.iterations() + arrives);
    // Gradients and the search for surfaces have loops of their own.
    let details = if resident.traits.shaded || resident.traits.surfaces { (64 + 64 * looks) * volumes } else { 0 };
    let per_sample =
        (lights - mapped).saturating_mul(per_light).saturating_add(looked_up + per_step + volumes + details);
    let passed = bricks(stride.step).saturating_mul(per_step).saturating_add(2 * volumes);
    let limit = u64::from(gpu.iterations()).saturating_sub(passed);
    if per_sample > limit {
        return Err(RenderError::Limit {
            what: "lights, or techniques.march.light_step".into(),
            found: format!("{lights} lights (the environment's directions among them) of {light_steps} steps"),
            limit: format!("{} such lights", limit / per_light),
            advice: "Use fewer lights or environment_directions, or a longer light_step.".into(),
        });
    }
    let samples_per_round = (limit / per_sample).min(steps);
    let rounds = steps.div_ceil(samples_per_round);
    if rounds.saturating_mul(rays.into()) > u32::MAX.into() {
        return Err(RenderError::Limit {
            what: "techniques.march.step".into(),
            found: format!("{steps} steps along a ray"),
            limit: format!("{} steps", samples_per_round.saturating_mul(u64::from(u32::MAX / rays))),
            advice: "Use a longer step, or fewer samples.".into(),
        });
    }
    Ok((rounds as u32, samples_per_round as u32))
}
