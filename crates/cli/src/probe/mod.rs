mod csv;
mod plot;

use std::ops::ControlFlow;
use std::path::PathBuf;

use anyhow::anyhow;
use tyndall_reference::Estimate;
use tyndall_scene::World;
use tyndall_scene::image::write_atomically;

use crate::failure::Failure;
use crate::input::{Input, check_output};
use crate::interrupt::Interrupt;
use crate::render::RenderingArguments;
use crate::{progress, say};

/// Show what a camera ray meets: extinction, transmittance, source and radiance, by the marcher and by the reference
///
/// Along the ray through the middle of a pixel, from where it enters the first medium's box to where it leaves the last,
/// at points in the middle of equal cells: the mean extinction of the cell, the transmittance T to the eye, the mean light S
/// that the cell emits and scatters once towards the eye, and the radiance L = ∫ T S dt up to there. The marcher runs as the
/// scene's settings say; the reference is single scattering without bias, with its standard error.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  tyndall probe scenes/plume.toml --pixel 320,240
  tyndall probe scenes/plume.toml --pixel 320,240 -o ray.csv --plot ray.svg
  tyndall probe scenes/fog.toml --pixel 200,100 --points 400 --samples 1000 --set techniques.march.step=0.5 -o ray.csv")]
pub struct Arguments {
    #[command(flatten)]
    input: Input,
    #[command(flatten)]
    rendering: RenderingArguments,
    /// Column and row of the pixel, from 0,0 at the top left
    #[arg(long, value_name = "X,Y", value_parser = pixel)]
    pixel: [u32; 2],
    /// Where the table goes (.csv); default: standard output, unless there is a plot
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Where a plot of the table goes (.svg)
    #[arg(long)]
    plot: Option<PathBuf>,
    /// Points along the ray
    #[arg(long, default_value_t = 128, value_parser = clap::value_parser!(u32).range(2..=1000))]
    points: u32,
    /// Samples of the reference at each point
    #[arg(long, default_value_t = 256, value_parser = clap::value_parser!(u32).range(2..))]
    samples: u32,
}

/// What is known at a point of the ray, each of the [`TERMS`] by both.
struct Row {
    /// From the eye [m].
    distance: f64,
    marcher: [[f64; 3]; 4],
    reference: [Estimate; 4],
}

/// The terms of a ray's integral: symbol, name, unit.
const TERMS: [[&str; 3]; 4] = [
    ["sigma_t", "extinction", "1/m"],
    ["T", "transmittance", "1"],
    ["S", "source", "W/sr/m^3"],
    ["L", "radiance", "W/sr/m^2"],
];

impl Arguments {
    /// Probes by both and writes table and plot.
    pub fn run(&self) -> Result<(), Failure> {
        for (path, extension) in [(&self.output, "csv"), (&self.plot, "svg")] {
            path.as_ref().map_or(Ok(()), |path| check_output(path, &[extension]))?;
        }
        let world = self.input.load()?;
        let interrupt = Interrupt::watch();
        let span = self.span(&world)?;
        let gpu = self.rendering.open()?;
        let rows = self.probe(&gpu, &world, span, &interrupt)?;
        let [width, height] = world.scene.film.size;
        let [x, y] = self.pixel;
        let scene = self.input.scene.display();
        let about = [
            concat!("tyndall ", env!("CARGO_PKG_VERSION")).into(),
            format!("scene {scene}"),
            format!("scene hash {}", world.hash),
            format!("pixel {x},{y} of {width}x{height}"),
            format!("adapter {}", gpu.name()),
            format!("samples {}", self.samples),
        ];
        let plot = match &self.plot {
            Some(path) => Some((path, plot::svg(&rows, &format!("{scene}, pixel {x},{y}"))?)),
            None => None,
        };
        let table = csv::table(&rows, &about);
        match &self.output {
            Some(path) => write_atomically(path, table.as_bytes())?,
            None if plot.is_none() => say::result(&table)?,
            None => {}
        }
        if let Some((path, svg)) = plot {
            write_atomically(path, svg.as_bytes())?;
        }
        Ok(())
    }

    /// The part of the pixel's ray that may be in a medium [m].
    fn span(&self, world: &World) -> Result<[f64; 2], Failure> {
        let ([x, y], [width, height]) = (self.pixel, world.scene.film.size);
        if x >= width || y >= height {
            let last = format!("{},{}", width.saturating_sub(1), height.saturating_sub(1));
            return Err(Failure::Input(anyhow!(
                "--pixel {x},{y}: outside the film of {width}x{height}; accepted: 0,0 to {last}"
            )));
        }
        tyndall_reference::span(world, self.pixel)?.ok_or_else(|| {
            Failure::Input(anyhow!("--pixel {x},{y}: its ray meets no medium; accepted: a pixel in which there is one"))
        })
    }

    fn probe(
        &self,
        gpu: &tyndall::Gpu,
        world: &World,
        span: [f64; 2],
        interrupt: &Interrupt,
    ) -> Result<Vec<Row>, Failure> {
        let bar = progress::bar();
        let mut watch = |done: f64| {
            progress::set(&bar, done);
            if interrupt.pressed() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        bar.set_message("marcher");
        let marched = pollster::block_on(tyndall::probe(gpu, world, self.pixel, span, self.points, &mut watch))?;
        bar.set_message("reference");
        let traced = tyndall_reference::probe(world, self.pixel, span, self.points, self.samples, &mut watch)?;
        bar.finish_and_clear();
        let traced = traced.ok_or(Failure::Interrupted)?;
        let rows = marched.into_iter().zip(traced).map(|(marched, traced)| Row {
            distance: traced.distance,
            marcher: [marched.extinction, marched.transmittance, marched.source, marched.radiance],
            reference: [traced.extinction, traced.transmittance, traced.source, traced.radiance],
        });
        Ok(rows.collect())
    }
}

fn pixel(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once(',').map(|(x, y)| (x.trim().parse(), y.trim().parse()));
    match sides {
        Some((Ok(x), Ok(y))) => Ok([x, y]),
        _ => Err("accepted: column and row from 0, such as 320,240".into()),
    }
}
