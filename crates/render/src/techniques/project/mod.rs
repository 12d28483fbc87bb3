//! Intensity projection: the greatest, the least, or the mean value along a ray [Wallis89].
//!
//! Not a model of light, but what radiology reads: max_t f(t), min_t f(t), or (1/l) ∫ f dt over the length l within a
//! volume. With a transfer function the value is shown in its colour (radiance times colour, whatever its opacity), else the
//! density itself as grey. Of several volumes the extreme is that of them all; their averages, as they are shown, count by
//! the length within each. A ray that meets no volume sees the environment.
//!
//! A ray through a volume is cut into equal segments of at most `step` voxels, and sampled in their middles. For an extreme,
//! bricks are passed over that hold no value beyond the one kept so far; the picture does not depend on it.

#[cfg(test)]
mod test;

use tyndall_scene::parameter::{Kind, Parameter};

use super::{Recording, Role, Technique, plain, without_bodies, without_surfaces};
use crate::RenderError;
use crate::graph::{Shader, shader};

/// The projection's declaration.
pub const TECHNIQUE: Technique = Technique {
    name: "project",
    summary: "Intensity projection: the maximum, the minimum or the average along a ray",
    role: Role::Media,
    parameters: &[
        Parameter {
            name: "projection",
            help: "Which value along a ray is shown",
            unit: "",
            kind: Kind::Choice(&PROJECTIONS),
        },
        Parameter {
            name: "step",
            help: "Longest step",
            unit: "voxels",
            kind: Kind::Number { min: 0.01, max: 64.0, default: 0.5 },
        },
        Parameter {
            name: "skipping",
            help: "Whether bricks that cannot hold the extreme are passed over: faster, and the same picture",
            unit: "",
            kind: Kind::Choice(&["on", "off"]),
        },
    ],
    record: |recording| Box::pin(record(recording)),
};

/// In the order of their numbers in the shader.
const PROJECTIONS: [&str; 3] = ["maximum", "minimum", "average"];

static PROJECT: Shader = shader!("techniques/project/project");

/// The buffer `project`.
#[derive(Clone, Copy, Debug, encase::ShaderType)]
pub(crate) struct Project {
    step: f32,
}

async fn record(recording: Recording<'_, '_>) -> Result<(), RenderError> {
    let Recording { graph, world, resident, settings, film, .. } = recording;
    without_bodies(world, TECHNIQUE.name)?;
    without_surfaces(world, TECHNIQUE.name)?;
    plain(world, TECHNIQUE.name)?;
    let gpu = graph.gpu();
    let step = settings.number("step");
    // As floats: a volume may be absurdly long.
    let samples: f32 = resident.traits.diagonals.iter().map(|voxels| (voxels / step).ceil() + 2.0).sum();
    let most = gpu.iterations();
    if samples > most as f32 {
        return Err(RenderError::Limit {
            what: "techniques.project.step".into(),
            found: format!("{samples} steps along a ray"),
            limit: format!("{most} steps"),
            advice: "Use a longer step.".into(),
        });
    }
    let projection = PROJECTIONS.iter().position(|&name| name == settings.choice("projection"));
    let project = gpu.buffer("project", &Project { step });
    let tile = graph.tile();
    graph
        .compute("project", &PROJECT)
        .constant("PROJECTION", projection.unwrap_or(0) as u32)
        .constant("SKIPPING", settings.choice("skipping") == "on")
        .world(resident)
        .read("view", &resident.view)
        .read("tile", &tile)
        .read("project", &project)
        .write("film", film)
        .over_film(1)
        .await
}
