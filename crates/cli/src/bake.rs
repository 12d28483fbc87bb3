use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Instant;

use anyhow::anyhow;
use tyndall::techniques::instant_radiosity::bake::bake;
use tyndall_scene::image::write_atomically;
use tyndall_scene::surface::Export;

use crate::failure::Failure;
use crate::input::{Input, check_output};
use crate::interrupt::Interrupt;
use crate::render::RenderingArguments;
use crate::{progress, say};

/// Bake the light of a scene's surfaces into a light map, as glTF that shows it in any viewer without a light
///
/// The light is that of techniques.instant_radiosity. Each texel holds the radiance that a Lambertian surface sends out; a surface of
/// the file emits it (emissiveTexture, KHR_materials_emissive_strength) and reflects nothing. Gloss is left out, mirrors and glass stay
/// what they are, media and the sky are no part of the file.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  tyndall bake scenes/cornell.toml -o cornell.glb
  tyndall bake scenes/cornell.toml -o cornell.glb --paths 1024 --texels 512
  tyndall render cornell.glb -o cornell.png        (at the cost of surfaces that only emit)")]
pub struct Arguments {
    #[command(flatten)]
    input: Input,
    #[command(flatten)]
    rendering: RenderingArguments,
    /// Where it goes (.glb)
    #[arg(short, long)]
    output: PathBuf,
    /// Columns of the light map, and rows at most
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(16..=4096))]
    texels: u32,
    /// Particles that start from the lights, in place of techniques.instant_radiosity.paths
    #[arg(long, value_name = "N")]
    paths: Option<u32>,
}

impl Arguments {
    /// Bakes and writes.
    pub fn run(&self) -> Result<(), Failure> {
        check_output(&self.output, &["glb"])?;
        let started = Instant::now();
        let mut world = self.input.load()?;
        let interrupt = Interrupt::watch();
        if let Some(paths) = self.paths {
            let set = world.scene.set("techniques.instant_radiosity.paths", &paths.to_string());
            set.map_err(|error| Failure::Input(anyhow!("--paths {paths}: {error}")))?;
        }
        if world.surfaces.is_empty() {
            return Err(Failure::Input(anyhow!("{}: there are no surfaces to bake", self.input.scene.display())));
        }
        if !world.volumes.is_empty() {
            tracing::warn!("media: they are left out, with what they do to light");
        }
        let gpu = self.rendering.open()?;
        let bar = progress::bar();
        let baked = pollster::block_on(bake(&gpu, &world, self.texels, &mut |done| {
            progress::set(&bar, done);
            if interrupt.pressed() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        }));
        bar.finish_and_clear();
        let baked = baked?;
        let [width, height] = world.scene.film.size;
        let cameras = vec![("camera".into(), world.scene.camera.clone(), width as f32 / height as f32)];
        let export = Export { surfaces: baked.surfaces, lights: Vec::new(), cameras };
        let bytes = export.to_glb().map_err(|error| Failure::Failed(anyhow!(error)))?;
        write_atomically(&self.output, &bytes)?;
        let [width, height] = baked.size;
        let (vpls, seconds) = (baked.vpls, started.elapsed().as_secs_f64());
        say::result(&format!("map      {width} x {height} texels\nlights   {vpls}\ntime     {seconds:.1} s\n"))
    }
}
