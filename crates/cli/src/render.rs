use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Instant;

use tyndall::{AdapterChoice, Gpu};
use tyndall_scene::World;

use crate::failure::Failure;
use crate::input::{Input, check_output};
use crate::interrupt::Interrupt;
use crate::progress;

/// Render a scene on the GPU, or on the CPU driver where there is none
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  tyndall render scenes/plume.toml -o plume.png
  tyndall render scenes/plume.toml -o plume.exr --size 1280x720 --set techniques.march.step=0.5 --timings
  tyndall render scenes/plume.toml -o plume.png --adapter cpu")]
pub struct Arguments {
    #[command(flatten)]
    input: Input,
    /// Where the picture goes: .exr holds linear radiance, .png is tone-mapped (film.exposure, AgX)
    #[arg(short, long)]
    output: PathBuf,
    /// An adapter whose name contains NAME, or `cpu` for a CPU driver; default: the best there is
    #[arg(long, value_name = "NAME|cpu")]
    adapter: Option<String>,
    /// Print the GPU time of every pass
    #[arg(long)]
    timings: bool,
}

impl Arguments {
    /// Renders and writes the picture.
    pub fn run(&self) -> Result<(), Failure> {
        check_output(&self.output, &["exr", "png"])?;
        let interrupt = Interrupt::watch();
        let started = Instant::now();
        let world = self.input.load()?;
        let loaded = started.elapsed();
        let gpu = pollster::block_on(Gpu::open(&choice(self.adapter.as_deref())))?;
        tracing::info!(adapter = gpu.name(), "device");
        let bar = progress::bar();
        let rendering = pollster::block_on(tyndall::render(&gpu, &world, &mut |done| {
            progress::set(&bar, done);
            if interrupt.pressed() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        }));
        bar.finish_and_clear();
        let mut rendering = rendering?;
        let total = started.elapsed();
        let gpu_time: f64 = rendering.passes.values().sum();
        let attributes = &mut rendering.image.attributes;
        describe(&world, attributes);
        attributes.insert("adapter".into(), gpu.name());
        attributes.insert("seconds total".into(), format!("{:.3}", total.as_secs_f64()));
        attributes.insert("seconds on the device".into(), format!("{gpu_time:.6}"));
        rendering.image.write(&self.output, world.scene.film.exposure)?;
        if self.timings {
            println!("adapter  {}", gpu.name());
            println!("load     {:>10.3} ms", loaded.as_secs_f64() * 1e3);
            if rendering.passes.is_empty() {
                println!("passes   not timed: the adapter has no timestamps");
            }
            for (pass, seconds) in &rendering.passes {
                println!("pass     {:>10.3} ms  {pass}", seconds * 1e3);
            }
            println!("total    {:>10.3} ms", total.as_secs_f64() * 1e3);
        }
        Ok(())
    }
}

/// What every picture says of where it comes from.
pub fn describe(world: &World, attributes: &mut std::collections::BTreeMap<String, String>) {
    attributes.insert("software".into(), concat!("tyndall ", env!("CARGO_PKG_VERSION")).into());
    attributes.insert("scene hash".into(), world.hash.clone());
}

fn choice(name: Option<&str>) -> AdapterChoice {
    match name {
        None => AdapterChoice::Best,
        Some("cpu") => AdapterChoice::Cpu,
        Some(name) => AdapterChoice::Named(name.into()),
    }
}
