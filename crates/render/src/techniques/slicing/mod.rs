//! Slicing: planes perpendicular to the view through the media, blended [lecture; RezkSalama05].
//!
//! A plane stands for a slab of thickness Δ, of which a ray at the angle θ to the view's axis passes l = Δ/cosθ, less where
//! a medium ends within the slab. With σ_t and k_e in the middle of that length, a fragment has
//!
//! α = 1 − e^{−σ_t l}, L = k_e (1 − e^{−σ_t l})/σ_t,
//!
//! which is the lecture's correction of opacity for the distance of slices, α' = 1 − (1 − α)^{Δx/Δx₀}, for α = 1 − e^{−σ_tΔx₀}.
//! Where media overlap, a fragment adds up their k_e·l and σ_t·l. Slabs are blended over or under each other, and lie
//! before the constant environment.
//!
//! The vertex shader cuts the planes with a box around all media; the CPU has no part in a frame.
//!
//! Not in the model: scattered light (scattering counts as extinction), and an extinction that differs among channels.

#[cfg(test)]
mod test;

use glam::{Mat4, Vec3};
use tyndall_scene::World;
use tyndall_scene::parameter::{Kind, Parameter};

use super::{LAYERED_MODEL, Recording, Role, Technique, plain, without_bodies, without_surfaces};
use crate::graph::{Draw, Shader, Target, shader};
use crate::{RenderError, layers};

/// Slicing's declaration.
pub const TECHNIQUE: Technique = Technique {
    name: "slicing",
    summary: "Slices perpendicular to the view, blended: emission and absorption",
    role: Role::Media,
    parameters: &[
        LAYERED_MODEL,
        Parameter {
            name: "order",
            help: "The order of drawing",
            unit: "",
            kind: Kind::Choice(&["back_to_front", "front_to_back"]),
        },
        Parameter {
            name: "slices",
            help: "Distance of the slices",
            unit: "voxels",
            kind: Kind::Number { min: 0.01, max: 64.0, default: 1.0 },
        },
    ],
    record: |recording| Box::pin(record(recording)),
};

static SLICING: Shader = shader!("techniques/slicing/slicing");

/// Slices at most: from there on their distance is lost in the rounding of depths.
const MOST_SLICES: f32 = 65536.0;

/// Slices a submission: some hundred million fragments on a GPU's tile.
const BATCH: u32 = 256;

/// The buffer `slicing`.
#[derive(Clone, Copy, Debug, encase::ShaderType)]
pub(crate) struct Slicing {
    world_from_box: Mat4,
    thickness: Vec3,
    distance: f32,
}

async fn record(recording: Recording<'_, '_>) -> Result<(), RenderError> {
    let Recording { graph, world, resident, settings, film, .. } = recording;
    without_bodies(world, TECHNIQUE.name)?;
    without_surfaces(world, TECHNIQUE.name)?;
    plain(world, TECHNIQUE.name)?;
    layers::check(world)?;
    let gpu = graph.gpu();
    let world_from_box = bounds(world);
    let [x, y, z] = [world_from_box.x_axis, world_from_box.y_axis, world_from_box.z_axis].map(|axis| axis.truncate());
    let inverse = world_from_box.inverse().transpose();
    let thickness = [inverse.x_axis, inverse.y_axis, inverse.z_axis].map(|row| row.truncate().length().recip());
    let distance = settings.number("slices") * resident.traits.voxel;
    let longest = [x + y + z, x + y - z, x - y + z, x - y - z].map(Vec3::length).into_iter().fold(0.0, f32::max);
    let most = (longest / distance).ceil();
    if most.is_nan() || most > MOST_SLICES {
        return Err(RenderError::Limit {
            what: "techniques.slicing.slices".into(),
            found: format!("{most} slices"),
            limit: format!("{MOST_SLICES} slices"),
            advice: "Use a longer distance, or media of similar size that are near each other.".into(),
        });
    }
    let slicing = Slicing { world_from_box, thickness: thickness.into(), distance };
    let slicing = gpu.buffer("slicing", &slicing);
    let back_to_front = settings.choice("order") == "back_to_front";
    let target = layers::texture(gpu, resident.film).await?;
    graph
        .raster("slices", &SLICING)
        .constant("EMISSION", settings.choice("model") == "emission")
        .constant("BACK_TO_FRONT", back_to_front)
        .world(resident)
        .read("view", &resident.view)
        .read("slicing", &slicing)
        .draw(Draw {
            vertices: 12,
            instances: if world.volumes.is_empty() { 0 } else { most as u32 + 1 },
            batch: BATCH,
            target: Some(Target {
                texture: &target,
                blend: Some(if back_to_front { layers::OVER } else { layers::UNDER }),
            }),
            depth: None,
            regions: None,
        })
        .await?;
    layers::before(graph, resident, &target, None, film).await
}

/// The map from the unit cube to a box around all media: to the medium's own where there is but one.
fn bounds(world: &World) -> Mat4 {
    if let [volume] = &world.volumes[..] {
        return volume.world_from_unit;
    }
    let corners = world.volumes.iter().flat_map(|volume| {
        (0..8).map(|c| {
            volume.world_from_unit.transform_point3(glam::vec3((c & 1) as f32, (c >> 1 & 1) as f32, (c >> 2) as f32))
        })
    });
    let ends = corners.map(|corner| (corner, corner)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
    let (low, high) = ends.unwrap_or((Vec3::ZERO, Vec3::ONE));
    Mat4::from_translation(low) * Mat4::from_scale(high - low)
}
