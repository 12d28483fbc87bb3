//! A paper's figures and tables, made anew: pictures, plots and numbers on a page.

mod fourier_opacity;
mod instant_radiosity;
mod page;

use std::path::{Path, PathBuf};

use anyhow::Context as _;

use crate::failure::Failure;
use crate::interrupt::Interrupt;
use crate::render::RenderingArguments;
use crate::say;
use page::Page;

/// Make a paper's figures and tables anew, as pictures, plots and numbers on an HTML page with JSON beside it
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  tyndall reproduce fourier-opacity --out fourier
  tyndall reproduce fourier-opacity --out look --quick
  tyndall reproduce instant-radiosity --out radiosity")]
pub struct Arguments {
    /// Which paper
    paper: Paper,
    /// The folder for index.html and results.json; it is made if it is not there
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Films, maps and bodies a sixteenth as large: a look at the page, of which times and pictures say little
    /// (fourier-opacity)
    #[arg(long)]
    quick: bool,
    #[command(flatten)]
    rendering: RenderingArguments,
}

/// The papers whose experiments are known.
#[derive(Clone, Copy, clap::ValueEnum)]
enum Paper {
    /// Jansen and Bavoil, Fourier Opacity Mapping, 2010
    FourierOpacity,
    /// Keller, Instant Radiosity, 1997
    InstantRadiosity,
}

impl Arguments {
    /// Runs the experiments and writes the page.
    pub fn run(&self) -> Result<(), Failure> {
        std::fs::create_dir_all(&self.out)
            .with_context(|| format!("cannot make {}", self.out.display()))
            .map_err(Failure::Failed)?;
        let gpu = self.rendering.open()?;
        let interrupt = Interrupt::watch();
        match self.paper {
            Paper::FourierOpacity => fourier_opacity::page(gpu, interrupt, self.quick, &self.out)?,
            Paper::InstantRadiosity => instant_radiosity::page(gpu, interrupt, &self.out)?,
        }
        say::result(&format!("page     {}\n", self.out.join("index.html").display()))
    }
}

/// What is measured, as it is announced, and how.
type Experiment<Bench> = (&'static str, fn(&Bench, &mut Page) -> Result<(), Failure>);

/// Runs all experiments, and writes the page after each: what is finished stays, whatever comes.
fn page<Bench>(
    title: &str,
    experiments: &[Experiment<Bench>],
    bench: &Bench,
    interrupt: &Interrupt,
    folder: &Path,
) -> Result<(), Failure> {
    let mut page = Page::new(title);
    for (i, (name, run)) in experiments.iter().enumerate() {
        say::note(&format!("{}/{}  {name}", i + 1, experiments.len()));
        let done = if interrupt.pressed() { Err(Failure::Interrupted) } else { run(bench, &mut page) };
        if done.is_err() {
            page.section("Not finished", &format!("It ended during: {name}."));
        }
        page.write(folder)?;
        done?;
    }
    Ok(())
}
