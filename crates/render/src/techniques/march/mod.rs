//! Ray marching: the emission–absorption integral, and single scattering by an inner march to every light.
//!
//! Along a camera ray, with transmittance T(t) = exp(−∫₀ᵗ σ_t) [lecture]:
//!
//! L = ∫ T(t) [k_e(t) + Σ_lights E(t)·T_light(t)·Σ_media σ_s(t)·p(cosθ)] dt + T·L_environment
//!
//! The step rule, stated here and written once in `march.wesl` (`next_segment`): between two boundaries of volumes a ray is
//! cut into equal segments of at most `step` voxels of the finest volume there (a volume without voxels counts as 64 to
//! its shortest edge). Each is sampled in its middle and integrated in closed form, (1−e^{−σ_tΔ})/σ_t. Rays to the lights
//! follow the same rule with `light_step`; there, and wherever no light is scattered, homogeneous volumes take one step,
//! which is exact. No jitter: the error is a smooth bias, second order in the step.
//!
//! Not in the model: light scattered more than once, and scattered emission. The constant environment scatters once, as
//! parallel lights from `environment_directions` directions.

#[cfg(test)]
mod test;

use glam::Vec3;
use tyndall_scene::parameter::{Kind, Parameter};

use super::{Recording, Technique, without_meshes};
use crate::graph::{Shader, shader};
use crate::resident::{Light, Resident};
use crate::{Gpu, RenderError};

/// Ray marching's declaration.
pub const TECHNIQUE: Technique = Technique {
    name: "march",
    summary: "Ray marching: absorption, emission, and single scattering by an inner march to every light",
    parameters: &[
        Parameter {
            name: "model",
            help: "What is computed: single scattering, or emission and absorption alone, or absorption alone",
            unit: "",
            kind: Kind::Choice(&["single_scattering", "emission", "absorption"]),
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
        Parameter {
            name: "termination",
            help: "Transmittance at which a camera ray ends",
            unit: "",
            kind: Kind::Number { min: 0.0, max: 0.5, default: 0.001 },
        },
        Parameter {
            name: "samples",
            help: "Rays per pixel; one runs through the pixel's centre",
            unit: "",
            kind: Kind::Count { min: 1, max: 1024, default: 1 },
        },
        Parameter {
            name: "environment_directions",
            help: "Directions from which the constant environment is scattered (0: it is only seen behind the media)",
            unit: "",
            kind: Kind::Count { min: 0, max: 1024, default: 16 },
        },
    ],
    record: |recording| Box::pin(record(recording)),
};

static MARCH: Shader = shader!("techniques/march/march");

/// The buffer `march`.
#[derive(Clone, Copy, Debug, encase::ShaderType)]
pub(crate) struct March {
    step: f32,
    light_step: f32,
    epsilon: f32,
    termination: f32,
    lights: u32,
    rounds: u32,
    steps_per_round: u32,
    samples: u32,
}

/// Bytes of a `Path` in `march.wesl`.
pub(crate) const PATH_BYTES: u64 = 48;

/// The buffer `lights`.
#[derive(Debug, encase::ShaderType)]
struct Lights {
    #[shader(size(runtime))]
    lights: Vec<Light>,
}

async fn record(Recording { graph, resident, settings, film, world }: Recording<'_, '_>) -> Result<(), RenderError> {
    without_meshes(world, TECHNIQUE.name)?;
    let gpu = graph.gpu();
    let model = settings.choice("model");
    let scattering = model == "single_scattering";
    let mut lights = resident.lights.clone();
    lights.extend(environment_lights(resident.environment, settings.number("environment_directions") as u32));
    let (step, light_step) = (settings.number("step"), settings.number("light_step"));
    let light_count = if scattering { lights.len() as u32 } else { 0 };
    let samples = settings.number("samples") as u32;
    let (rounds, steps_per_round) = rounds(gpu, resident, [step, light_step], light_count, samples)?;
    let march = March {
        step,
        light_step,
        epsilon: 1e-3 * resident.traits.voxel,
        termination: settings.number("termination"),
        lights: light_count,
        rounds,
        steps_per_round,
        samples,
    };
    let march = gpu.buffer("march", &march);
    let lights = gpu.buffer("lights", &Lights { lights });
    let several = rounds * samples > 1;
    let side = u64::from(gpu.tile_side());
    let paths = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("paths"),
        size: if several { side * side * PATH_BYTES } else { PATH_BYTES },
        usage: wgpu::BufferUsages::STORAGE,
        mapped_at_creation: false,
    });
    let tile = graph.tile();
    let traits = &resident.traits;
    let mut pass = graph
        .compute("march", &MARCH)
        .constant("VOLUMES", traits.count)
        .constant("GRIDS", traits.grids)
        .constant("EXPONENTIALS", traits.exponentials)
        .constant("TRANSFERS", traits.transfers)
        .constant("EMISSION", model != "absorption")
        .constant("SCATTERING", scattering)
        .constant("ROUNDS", several)
        .read("view", &resident.view)
        .read("tile", &tile)
        .read("march", &march)
        .read("volumes", &resident.volumes)
        .read("lights", &lights)
        .read("transfers", &resident.transfers)
        .read("linear", &resident.linear)
        .write("film", film)
        .write("paths", &paths);
    let names = ["grid0", "grid1", "grid2", "grid3", "grid4", "grid5", "grid6", "grid7"];
    for (name, grid) in names.into_iter().zip(&resident.grids) {
        pass = pass.read(name, grid);
    }
    pass.over_film(rounds * samples).await
}

/// Into how many rounds, of how many steps, a camera ray is cut so that no invocation makes more loop iterations than the
/// device stands. Every loop of `march.wesl` counts, also those that a compiler would unroll.
fn rounds(
    gpu: &Gpu,
    resident: &Resident,
    [step, light_step]: [f32; 2],
    lights: u32,
    samples: u32,
) -> Result<(u32, u32), RenderError> {
    // A ray steps through each volume, and once more at each of its boundaries. A volume may be absurdly long.
    let count = |step: f32| {
        let steps = resident.traits.diagonals.iter().map(|voxels| ((voxels / step).ceil() as u64).saturating_add(2));
        steps.fold(1u64, u64::saturating_add)
    };
    let (steps, light_steps) = (count(step), count(light_step));
    let per_segment = 1 + 2 * u64::from(resident.traits.count);
    let per_light = light_steps.saturating_add(1).saturating_mul(per_segment);
    let per_step = u64::from(lights).saturating_mul(per_light).saturating_add(per_segment);
    let limit = u64::from(gpu.iterations());
    if per_step > limit {
        return Err(RenderError::Limit {
            what: "lights, or techniques.march.light_step".into(),
            found: format!("{lights} lights (the environment's directions among them) of {light_steps} steps"),
            limit: format!("{} such lights", limit / per_light),
            advice: "Use fewer lights or environment_directions, or a longer light_step.".into(),
        });
    }
    let steps_per_round = (limit / per_step).min(steps);
    let rounds = steps.div_ceil(steps_per_round);
    if rounds.saturating_mul(samples.into()) > u32::MAX.into() {
        return Err(RenderError::Limit {
            what: "techniques.march.step".into(),
            found: format!("{steps} steps along a ray"),
            limit: format!("{} steps", steps_per_round.saturating_mul(u64::from(u32::MAX / samples))),
            advice: "Use a longer step, or fewer samples.".into(),
        });
    }
    Ok((rounds as u32, steps_per_round as u32))
}

/// A constant environment as `count` parallel lights, spread evenly over the sphere on a Fibonacci spiral.
fn environment_lights(radiance: Vec3, count: u32) -> impl Iterator<Item = Light> {
    let golden_angle = std::f32::consts::PI * (3.0 - 5f32.sqrt());
    let count = if radiance == Vec3::ZERO { 0 } else { count };
    (0..count).map(move |i| {
        let y = 1.0 - (2.0 * i as f32 + 1.0) / count as f32;
        let (sin, cos) = (golden_angle * i as f32).sin_cos();
        let ring = (1.0 - y * y).sqrt();
        let direction = Vec3::new(ring * cos, y, ring * sin);
        Light::directional(direction, radiance * (4.0 * std::f32::consts::PI / count as f32))
    })
}
