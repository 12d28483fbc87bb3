//! Techniques: a folder each, and a line here. The build lists the folders.

pub mod cells;
pub mod march;
pub mod project;
pub mod slicing;
pub mod splatting;

use std::pin::Pin;

use tyndall_scene::description::{Density, Optics};
use tyndall_scene::parameter::{Parameter, Settings};
use tyndall_scene::{Field, FieldError, World};

use crate::RenderError;
use crate::graph::Graph;
use crate::resident::Resident;

/// Every technique, in the order of their names.
pub const TECHNIQUES: &[Technique] = &include!(concat!(env!("OUT_DIR"), "/techniques.rs"));

/// The technique of a scene that names none.
fn default(scene: &tyndall_scene::Scene) -> &'static str {
    let meshes = scene.media.values().all(|medium| matches!(medium.density, Density::Mesh { .. }));
    if meshes && !scene.media.is_empty() { cells::TECHNIQUE.name } else { march::TECHNIQUE.name }
}

/// What a technique declares of itself.
#[derive(Clone, Copy)]
pub struct Technique {
    /// Its name in scene files.
    pub name: &'static str,
    /// One line of help.
    pub summary: &'static str,
    /// Its parameters; scene files, `--set`, `tyndall info` and documentation are driven by them.
    pub parameters: &'static [Parameter],
    /// Records the passes that fill the film: radiance (rgb) and opacity (a), `Rgba32Float`.
    pub record: for<'r> fn(Recording<'r, '_>) -> Recorded<'r>,
}

/// What a technique records into, and from what.
pub struct Recording<'r, 'a> {
    /// The list of passes.
    pub graph: &'r mut Graph<'a>,
    /// The world on the device.
    pub resident: &'r Resident,
    /// The parameters' values.
    pub settings: &'r Settings,
    /// The texture to fill.
    pub film: &'r wgpu::Texture,
    /// The world that is on the device.
    pub world: &'r World,
}

/// A recording in progress; it waits for the device's verdict on each pass.
pub type Recorded<'r> = Pin<Box<dyn Future<Output = Result<(), RenderError>> + 'r>>;

/// The technique that a scene asks for (the default where it names none) with its settings.
///
/// # Errors
/// A technique that is not there, more than one, and settings that it does not accept.
pub fn chosen(scene: &tyndall_scene::Scene) -> Result<(&'static Technique, Settings), RenderError> {
    let names = || TECHNIQUES.iter().map(|technique| technique.name).collect::<Vec<_>>().join(", ");
    let mut asked = scene.techniques.iter();
    let (name, given) = match asked.next() {
        Some((name, given)) => (name.as_str(), Some(given)),
        None => (default(scene), None),
    };
    let technique = TECHNIQUES.iter().find(|technique| technique.name == name);
    match (technique, asked.next()) {
        (Some(technique), None) => Ok((technique, Settings::new(name, technique.parameters, given)?)),
        (Some(_), Some((second, _))) => Err(RenderError::NoSuchTechnique {
            found: second.clone(),
            accepted: format!("one technique (the scene also has {name})"),
        }),
        (None, _) => Err(RenderError::NoSuchTechnique { found: name.into(), accepted: names() }),
    }
}

/// Refuses unstructured meshes, in the name of a technique that does not render them.
fn without_meshes(world: &World, technique: &str) -> Result<(), RenderError> {
    match world.volumes.iter().find(|volume| matches!(volume.field, Field::Mesh(_))) {
        None => Ok(()),
        Some(volume) => Err(FieldError {
            path: format!("media.{}.density.mesh", volume.name),
            found: format!("a mesh, with techniques.{technique}"),
            accepted: "a mesh with techniques.cells".into(),
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
