use std::path::PathBuf;

use anyhow::anyhow;
use tyndall::techniques::instant_radiosity::punctual;
use tyndall_scene::image::write_atomically;
use tyndall_scene::surface::{Export, Exported};

use crate::failure::Failure;
use crate::input::{Input, check_output};
use crate::say;

/// Write a scene's surfaces and its virtual point lights as glTF, for renderers that know point and spot lights
///
/// They are those of techniques.instant_radiosity, by the scene's settings. A light that falls with the cosine is written as a spot
/// of 90 degrees of the same flux (KHR_lights_punctual), which falls with the cosine's square.
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  tyndall vpls scenes/cornell.toml -o cornell.glb --set techniques.instant_radiosity.paths=64")]
pub struct Arguments {
    #[command(flatten)]
    input: Input,
    /// Where they go (.glb)
    #[arg(short, long)]
    output: PathBuf,
}

impl Arguments {
    /// Walks and writes.
    pub fn run(&self) -> Result<(), Failure> {
        check_output(&self.output, &["glb"])?;
        let world = self.input.load()?;
        let lights = punctual(&world)?;
        let count = lights.len();
        let surfaces = world.surfaces.iter().cloned();
        let [width, height] = world.scene.film.size;
        let export = Export {
            surfaces: surfaces.map(|surface| Exported { surface, light_map_texcoords: Vec::new() }).collect(),
            lights,
            cameras: vec![("camera".into(), world.scene.camera.clone(), width as f32 / height as f32)],
        };
        let bytes = export.to_glb().map_err(|error| Failure::Failed(anyhow!(error)))?;
        write_atomically(&self.output, &bytes)?;
        say::result(&format!("lights   {count}\n"))
    }
}
