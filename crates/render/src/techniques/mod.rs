//! Techniques: a folder each, and a line here. The build lists the folders.

pub mod cells;
pub mod direct;
pub mod instant_radiosity;
pub mod march;
pub mod particles;
pub mod project;
pub mod slicing;
pub mod splatting;
pub mod transmittance;

use std::pin::Pin;

use tyndall_scene::description::{Density, Optics};
use tyndall_scene::parameter::{Kind, Parameter, Settings};
use tyndall_scene::{Field, FieldError, World};

use crate::RenderError;
use crate::graph::Graph;
use crate::resident::Resident;
use crate::surfaces::GBuffer;

/// Every technique, in the order of their names.
pub const TECHNIQUES: &[Technique] = &include!(concat!(env!("OUT_DIR"), "/techniques.rs"));

/// What a technique does in a frame; a frame has at most one of each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// How much of a light's light passes through media.
    Shadows,
    /// The light that surfaces send to the eye.
    Surfaces,
    /// Media, before what surfaces and the environment show; fills the film.
    Media,
}

impl Role {
    /// The technique of a scene that names none of this role.
    fn default(self, scene: &tyndall_scene::Scene) -> Option<&'static Technique> {
        let all = |kind: fn(&Density) -> bool| {
            !scene.media.is_empty() && scene.media.values().all(|medium| kind(&medium.density))
        };
        // Whether the scene has bodies rendered by something else than what draws them.
        let others = TECHNIQUES.iter().any(|technique| {
            technique.role == Role::Media
                && technique.name != particles::TECHNIQUE.name
                && scene.techniques.contains_key(technique.name)
        });
        match self {
            Role::Media if all(|density| matches!(density, Density::Mesh { .. })) => Some(&cells::TECHNIQUE),
            Role::Media if all(|density| density.bodies().is_some()) => Some(&particles::TECHNIQUE),
            Role::Media => Some(&march::TECHNIQUE),
            Role::Surfaces => Some(&direct::TECHNIQUE),
            // Drawn one by one, bodies cannot march to lights.
            Role::Shadows if all(|density| density.bodies().is_some()) && !others => Some(&transmittance::TECHNIQUE),
            Role::Shadows => None,
        }
    }
}

/// What a technique that scatters computes.
const MODEL: Parameter = Parameter {
    name: "model",
    help: "What is computed: single scattering, or emission and absorption alone, or absorption alone",
    unit: "",
    kind: Kind::Choice(&["single_scattering", "emission", "absorption"]),
};

/// When a camera ray ends early.
const TERMINATION: Parameter = Parameter {
    name: "termination",
    help: "Transmittance at which a camera ray ends",
    unit: "",
    kind: Kind::Number { min: 0.0, max: 0.5, default: 0.001 },
};

/// How many rays a pixel has.
const SAMPLES: Parameter = Parameter {
    name: "samples",
    help: "Rays per pixel; one runs through the pixel's centre",
    unit: "",
    kind: Kind::Count { min: 1, max: 1024, default: 1 },
};

/// As how many parallel lights the environment shines.
const ENVIRONMENT_DIRECTIONS: Parameter = Parameter {
    name: "environment_directions",
    help: "Directions from which the environment shines (0: it is only seen behind everything)",
    unit: "",
    kind: Kind::Count { min: 0, max: 1024, default: 16 },
};

/// As how many points surfaces that emit shine.
const AREA_POINTS: Parameter = Parameter {
    name: "area_points",
    help: "Points on surfaces that emit, all together, from which they shine (0: they are only seen)",
    unit: "",
    kind: Kind::Count { min: 0, max: 4096, default: 16 },
};

/// What a technique of blended layers computes.
const LAYERED_MODEL: Parameter = Parameter {
    name: "model",
    help: "What is computed: emission and absorption, or absorption alone (for single scattering: technique march)",
    unit: "",
    kind: Kind::Choice(&["emission", "absorption"]),
};

/// What a technique declares of itself.
#[derive(Clone, Copy)]
pub struct Technique {
    /// Its name in scene files.
    pub name: &'static str,
    /// One line of help.
    pub summary: &'static str,
    /// What it does in a frame.
    pub role: Role,
    /// Its parameters; scene files, `--set`, `tyndall info` and documentation are driven by them.
    pub parameters: &'static [Parameter],
    /// Records the passes that do it. They fill the film, `Rgba32Float`, but for those of shadows: of surfaces, their radiance (rgb) and their distance along the camera
    /// ray [m] (a), 1e30 where there are none; of media, the picture's radiance (rgb) and opacity (a).
    pub record: for<'r> fn(Recording<'r, '_>) -> Recorded<'r>,
}

/// What a technique records into, and from what.
pub struct Recording<'r, 'a> {
    /// The list of passes.
    pub graph: &'r mut Graph<'a>,
    /// The world on the device. A technique that makes what others read puts it there.
    pub resident: &'r mut Resident,
    /// The parameters' values.
    pub settings: &'r Settings,
    /// The texture to fill.
    pub film: &'r wgpu::Texture,
    /// The world that is on the device.
    pub world: &'r World,
    /// What is seen of surfaces; `None` where there are none.
    pub gbuffer: Option<&'r GBuffer>,
    /// What the technique of surfaces has filled, for the one of media.
    pub behind: Option<&'r wgpu::Texture>,
}

/// A recording in progress; it waits for the device's verdict on each pass.
pub type Recorded<'r> = Pin<Box<dyn Future<Output = Result<(), RenderError>> + 'r>>;

/// A technique of a frame with its settings.
pub type Chosen = (&'static Technique, Settings);

/// The techniques of a frame with their settings, in the order of their roles: those that the scene names, and the default
/// of a role that none has.
///
/// # Errors
/// A technique that is not there, two of one role, and settings that it does not accept.
pub fn chosen(scene: &tyndall_scene::Scene) -> Result<Vec<Chosen>, RenderError> {
    let mut chosen: Vec<Chosen> = Vec::new();
    for (name, given) in &scene.techniques {
        let Some(technique) = TECHNIQUES.iter().find(|technique| technique.name == name) else {
            let names: Vec<_> = TECHNIQUES.iter().map(|technique| technique.name).collect();
            return Err(RenderError::NoSuchTechnique { found: name.clone(), accepted: names.join(", ") });
        };
        if let Some((first, _)) = chosen.iter().find(|(other, _)| other.role == technique.role) {
            let accepted = format!("one technique of its kind (the scene also has {})", first.name);
            return Err(RenderError::NoSuchTechnique { found: name.clone(), accepted });
        }
        chosen.push((technique, Settings::new(name, technique.parameters, Some(given))?));
    }
    for role in [Role::Shadows, Role::Surfaces, Role::Media] {
        if let (false, Some(technique)) =
            (chosen.iter().any(|(technique, _)| technique.role == role), role.default(scene))
        {
            chosen.push((technique, Settings::new(technique.name, technique.parameters, None)?));
        }
    }
    chosen.sort_by_key(|(technique, _)| technique.role);
    Ok(chosen)
}

/// Who renders particles and strands.
const BODIES: &str =
    "particles and strands, with no other media beside them, with techniques.particles; or `tyndall reference`";

/// Refuses bodies in place of a field over a box (the cells of a mesh, particles, strands), in the name of a technique that does not
/// render it.
fn without_bodies(world: &World, technique: &str) -> Result<(), RenderError> {
    for volume in &world.volumes {
        let (density, what, accepted) = match &volume.field {
            Field::Mesh(_) => ("mesh", "a mesh", "a mesh with techniques.cells"),
            Field::Particles(_) => ("particles", "particles", BODIES),
            Field::Strands(_) => ("strands", "strands", BODIES),
            _ => continue,
        };
        let density = world.scene.media.get(&volume.name).and_then(|medium| medium.density.bodies()).unwrap_or(density);
        return Err(FieldError {
            path: format!("media.{}.density.{density}", volume.name),
            found: format!("{what}, with techniques.{technique}"),
            accepted: accepted.into(),
        }
        .into());
    }
    Ok(())
}

/// As [`without_bodies`], in the name of a technique that has no use for cells alone.
fn without_meshes(world: &World, technique: &str) -> Result<(), RenderError> {
    let meshes = world.volumes.iter().filter(|volume| matches!(volume.field, Field::Mesh(_))).cloned().collect();
    without_bodies(&World { volumes: meshes, scene: world.scene.clone(), ..World::default() }, technique)
}

/// Refuses surfaces, in the name of a technique whose media do not end at them.
fn without_surfaces(world: &World, technique: &str) -> Result<(), RenderError> {
    match world.surfaces.first() {
        None => Ok(()),
        Some(surface) => Err(FieldError {
            path: format!("surfaces.{}", surface.name),
            found: format!("a surface, with techniques.{technique}"),
            accepted: format!("surfaces with techniques.{}", march::TECHNIQUE.name),
        }
        .into()),
    }
}

/// Refuses what only marching renders, in the name of another technique.
fn plain(world: &World, technique: &str) -> Result<(), RenderError> {
    for volume in &world.volumes {
        let transfer = match &volume.optics {
            Optics::Transfer(transfer) => transfer.unphysical().map(|field| format!("optics.transfer.{field}")),
            Optics::Coefficients { .. } => None,
        };
        let clip = (!volume.clip.is_empty()).then(|| "clip".into());
        let temperature = volume.temperature.is_some().then(|| "temperature".into());
        let color = volume.color.is_some().then(|| "color".into());
        if let Some(field) = transfer.or(clip).or(temperature).or(color) {
            return Err(FieldError {
                path: format!("media.{}.{field}", volume.name),
                found: format!("it with techniques.{technique}"),
                accepted: format!("it with techniques.{}", march::TECHNIQUE.name),
            }
            .into());
        }
    }
    Ok(())
}
