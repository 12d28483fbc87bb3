use std::path::PathBuf;
use std::time::Instant;

use tyndall_scene::assets::Embedded;
use tyndall_scene::{Document, World};

use crate::failure::Failure;
use crate::input::{check_output, memory_budget};
use crate::interrupt::Interrupt;
use crate::render::RenderingArguments;
use crate::say;

const SCENE: &str = include_str!("../../../scenes/plume.toml");
const VOLUME: &[u8] = include_bytes!("../../../scenes/smoke.vdb");

/// Render the plume that is part of this program
#[derive(clap::Args)]
#[command(after_help = "Example:\n  tyndall demo -o demo.png")]
pub struct Arguments {
    #[command(flatten)]
    rendering: RenderingArguments,
    /// Where the picture goes (.png or .exr)
    #[arg(short, long, default_value = "demo.png")]
    output: PathBuf,
}

impl Arguments {
    /// Renders the embedded scene, and prints adapter and times.
    pub fn run(&self) -> Result<(), Failure> {
        check_output(&self.output, &["exr", "png"])?;
        let interrupt = Interrupt::watch();
        let started = Instant::now();
        let document = Document::new("plume.toml (embedded)", SCENE);
        let assets = Embedded(vec![("smoke.vdb", VOLUME)]);
        let world = World::load(document.parse()?, &assets, memory_budget())
            .map_err(|error| Failure::from(error.locate(&document)))?;
        let timings = self.rendering.render(&world, &self.output, false, &interrupt)?;
        let total = started.elapsed().as_secs_f64() * 1e3;
        say::result(&format!("{timings}total    {total:>10.3} ms\npicture  {}\n", self.output.display()))
    }
}
