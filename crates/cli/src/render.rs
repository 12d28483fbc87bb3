use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use tyndall::{AdapterChoice, Gpu};
use tyndall_scene::World;

use crate::failure::Failure;
use crate::input::{Input, check_output};
use crate::interrupt::Interrupt;
use crate::{progress, say};

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
    #[command(flatten)]
    rendering: RenderingArguments,
    /// Where the picture goes: .exr holds linear radiance, .png is tone-mapped (film.exposure, AgX)
    #[arg(short, long)]
    output: PathBuf,
    /// Write the distance of surfaces from the eye [m] into the .exr, too, as channel depth.Z (1e30 where there is none)
    #[arg(long)]
    depth: bool,
    /// Print the adapter, and the GPU time of every pass
    #[arg(long)]
    timings: bool,
}

/// What `render`, `probe` and `demo` are told of the device.
#[derive(clap::Args)]
pub struct RenderingArguments {
    /// An adapter whose name contains NAME, or `cpu` for a CPU driver; default: the best there is
    #[arg(long, value_name = "NAME|cpu")]
    adapter: Option<String>,
}

impl Arguments {
    /// Renders and writes the picture.
    pub fn run(&self) -> Result<(), Failure> {
        check_output(&self.output, if self.depth { &["exr"] } else { &["exr", "png"] })?;
        let started = Instant::now();
        let world = self.input.load()?;
        let interrupt = Interrupt::watch();
        let loaded = started.elapsed();
        let timings = self.rendering.render(&world, &self.output, self.depth, &interrupt)?;
        if self.timings {
            let [loaded, total] = [loaded, started.elapsed()].map(|time| time.as_secs_f64() * 1e3);
            say::result(&format!("load     {loaded:>10.3} ms\n{timings}total    {total:>10.3} ms\n"))?;
        }
        Ok(())
    }
}

impl RenderingArguments {
    /// Opens the device asked for.
    pub fn open(&self) -> Result<Gpu, Failure> {
        let gpu = pollster::block_on(Gpu::open(&choice(self.adapter.as_deref())))?;
        tracing::info!(adapter = gpu.name(), "device");
        Ok(gpu)
    }

    /// Renders a world to a file, with the distance of surfaces where `depth` asks for it; the adapter and its times, as lines of
    /// text.
    pub fn render(&self, world: &World, output: &Path, depth: bool, interrupt: &Interrupt) -> Result<String, Failure> {
        let started = Instant::now();
        let gpu = self.open()?;
        let bar = progress::bar();
        let rendering = pollster::block_on(tyndall::render(&gpu, world, &mut |done| {
            progress::set(&bar, done);
            if interrupt.pressed() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        }));
        bar.finish_and_clear();
        let mut rendering = rendering?;
        let gpu_time: f64 = rendering.passes.values().sum();
        if let (true, Some(depth)) = (depth, rendering.depth) {
            rendering.image.channels.insert("depth.Z".into(), depth);
        }
        let attributes = &mut rendering.image.attributes;
        describe(world, attributes);
        attributes.insert("adapter".into(), gpu.name());
        attributes.insert("seconds rendering".into(), format!("{:.3}", started.elapsed().as_secs_f64()));
        attributes.insert("seconds on the device".into(), format!("{gpu_time:.6}"));
        rendering.image.write(output, world.scene.film.exposure)?;
        let mut text = format!("adapter  {}\n", gpu.name());
        if rendering.passes.is_empty() {
            text += "passes   not timed: the adapter has no timestamps\n";
        }
        for (pass, seconds) in &rendering.passes {
            text += &format!("pass     {:>10.3} ms  {pass}\n", seconds * 1e3);
        }
        Ok(text)
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
