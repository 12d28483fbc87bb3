//! A paper's figures and tables, made anew: pictures, plots and numbers on a page.

mod fourier_opacity;
mod instant_radiosity;
mod page;

use std::path::PathBuf;

use crate::failure::Failure;
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
        let page: Page = match self.paper {
            Paper::FourierOpacity => fourier_opacity::page(&self.rendering, self.quick, &self.out)?,
            Paper::InstantRadiosity => instant_radiosity::page(&self.rendering)?,
        };
        let index = page.write(&self.out)?;
        say::result(&format!("page     {}\n", index.display()))
    }
}
