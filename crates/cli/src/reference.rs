use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::anyhow;
use tyndall_reference::{Options, Progress};
use tyndall_scene::World;
use tyndall_scene::image::Image;

use crate::failure::Failure;
use crate::input::{Input, check_output};
use crate::interrupt::Interrupt;
use crate::{progress, render, say};

/// Path-trace a scene on the CPU: the ground truth, with its variance
///
/// Surfaces and media are traced together. The picture is without bias: what is left is noise, and the EXR says how much (variance and number of samples a
/// pixel). It stops at --samples, at --error, or at Ctrl-C, and is written then. Where the output is already there and is
/// of the same scene and depth, it is continued; of another scene, it is refused.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  tyndall reference scenes/plume.toml -o truth.exr --samples 256
  tyndall reference scenes/plume.toml -o truth.exr --error 0.005     (continues the same file)
  tyndall reference scenes/plume.toml -o single.exr --depth 1 --error 0.01
  tyndall reference scenes/cornell-mirror.toml -o mirror.exr --no-caustics")]
pub struct Arguments {
    #[command(flatten)]
    input: Input,
    /// Where the picture goes (.exr)
    #[arg(short, long)]
    output: PathBuf,
    /// Stop at this many samples a pixel [default: 64 where --error is not given]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    samples: Option<u32>,
    /// Stop at this relative standard error, such as 0.01
    #[arg(long, value_parser = error)]
    error: Option<f64>,
    /// The most times that light is scattered, by surfaces and media alike: 0 emission and absorption only, 1 direct light and
    /// single scattering [default: any]
    #[arg(long)]
    depth: Option<u32>,
    /// Leave out light that mirrors and glass alone lead from where it is made to where the eye sees it scattered
    #[arg(long)]
    no_caustics: bool,
    /// Pictures of different seeds are independent
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

/// The attribute that says how long the picture took in all its runs.
const SECONDS: &str = "seconds rendering";

/// The attribute of pictures without caustics.
const CAUSTICS: &str = "caustics";

/// How often the unfinished picture is written.
const CHECKPOINT: Duration = Duration::from_secs(120);

impl Arguments {
    /// Traces and writes the picture.
    pub fn run(&self) -> Result<(), Failure> {
        check_output(&self.output, &["exr"])?;
        let world = self.input.load()?;
        let interrupt = Interrupt::watch();
        let mut image = self.previous(&world)?;
        let samples = self.samples.or(if self.error.is_none() { Some(64) } else { None });
        let options =
            Options { depth: self.depth, caustics: !self.no_caustics, samples, error: self.error, seed: self.seed };
        let bar = progress::bar();
        let mut last = None;
        let seconds = |image: &Image| image.attributes.get(SECONDS).and_then(|text| text.parse().ok()).unwrap_or(0.0);
        let mut spent: f64 = image.as_ref().map_or(0.0, seconds);
        loop {
            let begun = Instant::now();
            let mut due = false;
            let mut traced = tyndall_reference::render(&world, &options, image.take(), &mut |now: &Progress| {
                show(&bar, now);
                last = Some(*now);
                due = begun.elapsed() > CHECKPOINT;
                if due || interrupt.pressed() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            })?;
            self.describe(&world, &mut traced);
            spent += begun.elapsed().as_secs_f64();
            traced.attributes.insert(SECONDS.into(), format!("{spent:.3}"));
            // An interruption within the first pass leaves pixels without a sample: no picture yet.
            if traced.statistics.as_ref().is_some_and(|s| s.samples.iter().all(|&n| n > 0)) {
                traced.write(&self.output, 0.0)?;
            }
            if !due || interrupt.pressed() {
                break;
            }
            image = Some(traced);
        }
        bar.finish_and_clear();
        if let Some(last) = last {
            say::note(&format!(
                "{}: {} samples a pixel, relative standard error {}",
                self.output.display(),
                last.samples,
                percent(last.relative_error)
            ));
        }
        if interrupt.pressed() { Err(Failure::Interrupted) } else { Ok(()) }
    }

    /// The picture to continue, where the output is one of this scene.
    fn previous(&self, world: &World) -> Result<Option<Image>, Failure> {
        if !self.output.exists() {
            return Ok(None);
        }
        let image = Image::read(&self.output).map_err(|error| Failure::Input(error.into()))?;
        let mut expected = Image::default();
        self.describe(world, &mut expected);
        let same = |name: &str| image.attributes.get(name) == expected.attributes.get(name);
        let different = match ["scene hash", "depth", "seed", CAUSTICS].into_iter().find(|name| !same(name)) {
            None => return Ok(Some(image)),
            Some(CAUSTICS) if self.no_caustics => "a picture with caustics",
            Some(CAUSTICS) => "a picture without caustics",
            Some("depth") => "a picture of another depth",
            Some("seed") => "a picture of another seed",
            Some(_) => "a picture of another scene",
        };
        Err(Failure::Input(anyhow!(
            "output {}: found {different}; accepted: one of this scene, depth, caustics and seed to continue, or no file of that \
             name",
            Path::display(&self.output)
        )))
    }

    fn describe(&self, world: &World, image: &mut Image) {
        render::describe(world, &mut image.attributes);
        let depth = self.depth.map_or("any".into(), |depth| depth.to_string());
        image.attributes.insert("method".into(), "path tracing".into());
        image.attributes.insert("depth".into(), depth);
        image.attributes.insert("seed".into(), self.seed.to_string());
        if self.no_caustics {
            image.attributes.insert(CAUSTICS.into(), "left out".into());
        }
    }
}

fn show(bar: &indicatif::ProgressBar, now: &Progress) {
    if let Some(done) = now.done {
        progress::set(bar, done);
    }
    let left = now.eta.map_or("?".into(), |left| format!("{:.0} s", left.as_secs_f64()));
    bar.set_message(format!(
        "{} samples, error {}, {:.0} paths/s, {left} left",
        now.samples,
        percent(now.relative_error),
        now.paths_per_second
    ));
}

/// A relative error, of which one sample says nothing.
fn percent(error: f64) -> String {
    if error.is_finite() { format!("{:.3} %", error * 100.0) } else { "unknown".into() }
}

fn error(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value < 1.0 => Ok(value),
        _ => Err("accepted: a number between 0 and 1, such as 0.01 for 1 %".into()),
    }
}
