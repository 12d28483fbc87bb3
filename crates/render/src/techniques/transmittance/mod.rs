//! Maps of the transmittance from lights: what of a light arrives at a position is looked up, not marched to [Jansen10].
//!
//! From every light, and from as many directions of the environment as `march` has, rays go through the texels of a square: parallel ones around what is seen of media, those of a
//! spot light by the stereographic projection of its cone, those of a point light by the octahedron. On each, depths from 0 to 1 are as
//! tight around the media as their bricks and bodies. The ray is marched once, with `light_step`, and of each segment the integral is
//! deposited in the numbers of a basis (`math/transmittance`): no sample of it is lost, whatever lies between two slices.
//! Interpolating numbers between texels, or filtering them, filters the extinction itself.
//!
//! Particles and strands are drawn into the same numbers (`draw`). Deep maps keep all that a ray meets instead (`deep`).
//!
//! τ(d) = Σ_k A_k G_k(d), T = e^{−max(τ, 0)}. Every receiver reads them by `resident/transmittance.wesl`; of the techniques, `march`
//! does.
//!
//! Passes, once a frame: `transmittance.bounds`, a workgroup a light; `transmittance.bodies`, a quad a body, and
//! `transmittance.range`, where there are any; `transmittance.deposit`, an invocation a texel;
//! `transmittance.filter`, twice, or `transmittance.mip`, once a level, where the maps are filtered.

#[cfg(test)]
mod bodies_test;
mod deep;
mod draw;
mod prefilter;
#[cfg(test)]
mod test;

use tyndall_scene::parameter::{Kind, Parameter, Settings};
use tyndall_scene::{FieldError, World};

#[cfg(test)]
pub(crate) use deep::LIST;
#[cfg(test)]
pub(crate) use draw::Drawing;

use draw::Drawn;

use super::{Recording, Role, Technique, chosen, without_meshes};
use crate::graph::{Graph, Shader, shader};
use crate::resident::transmittance::DEEP;
use crate::resident::{Lights, Resident, Stride, Transmittance, environment};
use crate::{Gpu, RenderError};

/// The declaration of maps of transmittance.
pub const TECHNIQUE: Technique = Technique {
    name: "transmittance",
    summary: "Maps of the transmittance from lights: media look up what arrives, instead of an inner march",
    role: Role::Shadows,
    parameters: &[
        Parameter {
            name: "basis",
            help: "What a light ray's extinction is kept in; deep keeps all of it",
            unit: "",
            kind: Kind::Choice(&BASES),
        },
        Parameter {
            name: "coefficients",
            help: "Numbers a texel and channel (of moments 5, 7 or 9: the power moments 0 to 4, 6 or 8, or the trigonometric ones 0 to 2, 3 or 4)",
            unit: "",
            kind: Kind::Count { min: 1, max: MOST_COEFFICIENTS, default: 7 },
        },
        Parameter {
            name: "resolution",
            help: "Texels along a side of a light's map",
            unit: "texels",
            kind: Kind::Count { min: 8, max: 4096, default: 256 },
        },
        Parameter {
            name: "precision",
            help: "Bits of a number: 32 where the device interpolates them, or 16",
            unit: "",
            kind: Kind::Choice(&["single", "half"]),
        },
        Parameter {
            name: "window",
            help: "Factors of harmonics (fourier, cosine) against ringing, for blur",
            unit: "",
            kind: Kind::Choice(&["off", "fejer", "lanczos"]),
        },
        Parameter {
            name: "depths",
            help: "Where depths run: from where each texel's ray meets media to `deepest`, or around all that the light sees",
            unit: "",
            kind: Kind::Choice(&["texel", "light"]),
        },
        Parameter {
            name: "prefilter",
            help: "How far the extinction is averaged across light rays, for soft shadows (0: not; needs `depths` of the light)",
            unit: "texels",
            kind: Kind::Count { min: 0, max: 64, default: 0 },
        },
        Parameter {
            name: "prefilter_kind",
            help: "How: all alike, by Gauss' function, of which `prefilter` is two standard deviations, or by a mip level of texels as wide",
            unit: "",
            kind: Kind::Choice(&["box", "gaussian", "mips"]),
        },
        Parameter {
            name: "light_step",
            help: "Longest step along light rays",
            unit: "voxels",
            kind: Kind::Number { min: 0.01, max: 64.0, default: 1.0 },
        },
        Parameter {
            name: "deepest",
            help: "Optical depth at which a light ray ends: what lies behind counts as if nothing were there",
            unit: "",
            kind: Kind::Number { min: 0.5, max: 1e6, default: 6.0 },
        },
    ],
    record: |recording| Box::pin(record(recording)),
};

/// The bases, as `math/transmittance/basis.wesl` numbers them.
const BASES: [&str; 8] = ["fourier", "slices", "haar", "cosine", "legendre", "moments", "trigonometric", "deep"];

/// Eight sets of four.
const MOST_COEFFICIENTS: u32 = 32;

static BOUNDS: Shader = shader!("techniques/transmittance/bounds");
static HALF: Shader = shader!("techniques/transmittance/half");
static SINGLE: Shader = shader!("techniques/transmittance/single");

/// The buffer `deposit`.
#[derive(Clone, Copy, Debug, encase::ShaderType)]
pub(crate) struct Deposit {
    stride: Stride,
    deepest: f32,
    light: u32,
}

async fn record(Recording { graph, resident, settings, world, .. }: Recording<'_, '_>) -> Result<(), RenderError> {
    without_meshes(world, TECHNIQUE.name)?;
    let gpu = graph.gpu();
    let asked = directions(world)?;
    let directions = environment::lights(resident, asked);
    let lights = [resident.lights.as_slice(), &directions].concat();
    let mapped = lights.len() as u32;
    if mapped == 0 {
        return Ok(());
    }
    let light_step = settings.number("light_step");
    within_iterations(gpu, resident, light_step)?;
    let mut made = textures(gpu, resident, settings, mapped).await?;
    made.directions = if directions.is_empty() { 0 } else { asked };
    resident.transmittance = made.clone();
    let buffer = gpu.buffer("lights", &Lights { lights: lights.clone() });
    let bounds = async |graph: &mut Graph<'_>, resident: &Resident| {
        graph
            .compute("transmittance.bounds", &BOUNDS)
            .world(resident)
            .read("lights", &buffer)
            .write("written", &resident.transmittance.maps)
            .dispatch([mapped, 1, 1], 1)
            .await
    };
    bounds(graph, resident).await?;
    let least = Stride::least(&resident.traits);
    let stride = Stride { step: light_step, least, offset: 0.5, tolerance: 0.0, skip: 1, lit: 0 };
    let mut deposit = Deposit { stride, deepest: settings.number("deepest"), light: 0 };
    if made.basis == DEEP {
        return deep::record(graph, resident, settings, deposit, bounds).await;
    }
    let window = ["off", "fejer", "lanczos"].iter().position(|&name| name == settings.choice("window"));
    let single = made.texels.format() == wgpu::TextureFormat::Rgba32Float;
    let groups = made.resolution.div_ceil(8);
    let bodies = !resident.bodies.is_empty();
    let drawn = Drawn::new(gpu, resident, single).await?;
    // Bodies are drawn for one light after the other, without them all lights are alike.
    let at_once = if bodies { 1 } else { mapped };
    for first in (0..mapped).step_by(at_once as usize) {
        deposit.light = first;
        let deposit = gpu.buffer("deposit", &deposit);
        if bodies {
            drawn.record(graph, resident, &lights[first as usize], first, &deposit).await?;
        }
        graph
            .compute("transmittance.deposit", if single { &SINGLE } else { &HALF })
            .constant("WINDOW", window.unwrap_or(0) as u32)
            .constant("DRAWN", bodies)
            .constant("ONE_GRID", resident.traits.one_grid())
            .world(resident)
            .read("deposit", &deposit)
            .read("drawn", &drawn.layers)
            .read("ranges", &drawn.ranges)
            .write("written", (&made.texels, 0))
            .dispatch([groups, groups, at_once], 1)
            .await?;
    }
    prefilter::record(graph, resident, settings).await
}

/// From how many directions the scene's technique of media scatters the environment.
fn directions(world: &World) -> Result<u32, RenderError> {
    let name = "environment_directions";
    let techniques = chosen(&world.scene)?;
    let media = techniques.iter().find(|(technique, _)| technique.role == Role::Media);
    let declared = media.filter(|(technique, _)| technique.parameters.iter().any(|parameter| parameter.name == name));
    Ok(declared.map_or(0, |(_, settings)| settings.number(name) as u32))
}

/// The textures of the maps, empty, and how they are to be read.
async fn textures(
    gpu: &Gpu,
    resident: &Resident,
    settings: &Settings,
    mapped: u32,
) -> Result<Transmittance, RenderError> {
    let name = settings.choice("basis");
    let deep = name == "deep";
    let basis = BASES.iter().position(|&basis| basis == name).unwrap_or(0) as u32;
    let given = settings.number("coefficients") as u32;
    let (count, bias) = numbers(name, given);
    // Constants with pairs behind them begin at the second number of the first set.
    let sets = (count + u32::from(["fourier", "trigonometric"].contains(&name))).div_ceil(4);
    // Moments say too little of how far light gets past bodies.
    let unknown = bias > 0.0 && !resident.bodies.is_empty();
    let ranges = settings.choice("depths") == "texel" && !unknown && !deep;
    let channels = if resident.traits.grey { 1 } else { 3 };
    let resolution = settings.number("resolution") as u32;
    let limit = gpu.device.limits().max_texture_dimension_2d;
    let tiles = mapped * channels * (sets + u32::from(ranges));
    let columns = (limit / resolution).min(tiles);
    let rows = tiles.div_ceil(columns.max(1));
    if columns == 0 || rows * resolution > limit {
        let fitting = (1..=resolution).rev().find(|side| (limit / side).pow(2) >= tiles).unwrap_or(0);
        return Err(RenderError::Limit {
            what: "techniques.transmittance.resolution".into(),
            found: format!("{tiles} tiles of {resolution} texels a side"),
            limit: format!("{fitting} texels a side"),
            advice: "Use a lower resolution or fewer coefficients.".into(),
        });
    }
    let filterable = gpu.device.features().contains(wgpu::Features::FLOAT32_FILTERABLE);
    let single = (settings.choice("precision") == "single" || deep) && filterable;
    if settings.choice("precision") == "single" && !filterable {
        tracing::debug!("this device does not interpolate 32-bit floats: transmittance has 16 bits");
    }
    if deep && !single {
        return Err(FieldError {
            path: "techniques.transmittance.basis".into(),
            found: "deep maps on a device that does not interpolate 32-bit floats".into(),
            accepted: "another basis".into(),
        }
        .into());
    }
    if bias > 0.0 && !single {
        return Err(FieldError {
            path: "techniques.transmittance.basis".into(),
            found: "moments in 16-bit numbers, which round them away".into(),
            accepted: "another basis, or precision = \"single\" on a device that interpolates 32-bit floats".into(),
        }
        .into());
    }
    let level = prefilter::level(settings, !ranges && bias == 0.0 && !deep, resolution)?;
    let format = if single { wgpu::TextureFormat::Rgba32Float } else { wgpu::TextureFormat::Rgba16Float };
    Ok(Transmittance {
        maps: gpu
            .texture_2d(
                "transmittance maps",
                [4, mapped],
                wgpu::TextureFormat::Rgba32Float,
                wgpu::TextureUsages::STORAGE_BINDING,
            )
            .await?,
        texels: gpu
            .texture(&wgpu::TextureDescriptor {
                label: Some("transmittance"),
                size: wgpu::Extent3d {
                    width: columns * resolution,
                    height: rows * resolution,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1 + level.ceil() as u32,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            })
            .await?,
        events: resident.transmittance.events.clone(),
        mapped,
        parallel: resident.lights.iter().all(|light| light.local == 0),
        directions: 0,
        resolution,
        ranges,
        apart: ranges && !resident.bodies.is_empty(),
        columns,
        level,
        basis,
        count,
        sets,
        bias,
    })
}

/// How many numbers a basis has for so many asked for, and the bias of moments.
fn numbers(basis: &str, given: u32) -> (u32, f32) {
    match basis {
        // Where a list is, and how long.
        "deep" => (4, 0.0),
        // A constant and pairs.
        "fourier" => (2 * (given.min(MOST_COEFFICIENTS - 1) / 2) + 1, 0.0),
        // Twice as many moments as layers, and the zeroth. The bias is for 32-bit floats [Munstermann18].
        "moments" if given >= 9 => (9, 5e-5),
        "moments" if given >= 7 => (7, 5e-6),
        "moments" => (5, 5e-7),
        "trigonometric" if given >= 9 => (9, 1.5e-6),
        "trigonometric" if given >= 7 => (7, 8e-7),
        "trigonometric" => (5, 4e-7),
        _ => (given, 0.0),
    }
}

/// Refuses light rays that take more loop iterations than the device stands.
fn within_iterations(gpu: &Gpu, resident: &Resident, light_step: f32) -> Result<(), RenderError> {
    let traits = &resident.traits;
    let steps: f32 = traits.diagonals.iter().map(|voxels| (voxels / light_step).ceil() + 2.0).sum();
    let per_step = 2 + 3 * traits.count + traits.loops + 8;
    let most = gpu.iterations() / per_step;
    if steps <= most as f32 {
        return Ok(());
    }
    Err(RenderError::Limit {
        what: "techniques.transmittance.light_step".into(),
        found: format!("{steps} steps along a light ray"),
        limit: format!("{most} steps"),
        advice: "Use a longer light_step.".into(),
    })
}
