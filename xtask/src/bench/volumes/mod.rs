//! `cargo xtask bench volumes`: how fast volumes are marched, and how wrong they are then.

mod cost;
mod fetch;
mod mapping;
pub(super) mod measure;
mod optimisations;
mod scattering;
mod tracing;

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};
use clap::ValueEnum;
use serde_json::Value;

use self::measure::{Run, Tyndall};
use super::publish;
use crate::driver::{self, Consent};
use crate::process;

/// Ray marching's speed against Mitsuba's and VTK's, and what its settings cost and gain; writes docs/volumes.md
///
/// Every part takes turns with what it is compared with, so that other load meets both. Parts can be measured one at
/// a time; of the others the page stays as it is.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  cargo xtask bench volumes                 (takes half an hour)
  cargo xtask bench volumes --only mapping

Needs python3 with venv (Mitsuba and VTK come from PyPI), a Mesa EGL driver for VTK's OpenGL mapper (Debian:
libegl1 libgl1-mesa-dri), a recent LLVM for Mitsuba's variant llvm_ad_rgb where DRJIT_LIBLLVM_PATH names it, and
OpenVDB's Python module for the sparse clouds (Debian: python3-openvdb, of /usr/bin/python3).")]
pub struct Arguments {
    /// One part alone
    #[arg(long)]
    only: Option<Part>,
    /// Turns whose medians are taken
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=99))]
    rounds: u32,
    #[command(flatten)]
    consent: Consent,
}

/// What is measured, in the page's order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Part {
    /// Single scattering against Mitsuba at equal error
    Scattering,
    /// Transfer functions against VTK's mappers
    Mapping,
    /// Samples per second against a bare loop of fetches
    Fetch,
    /// The reference's paths per second against Mitsuba's
    Tracing,
    /// What every optimisation gains, and its error
    Optimisations,
    /// Cost against sizes and step, and a sparse cloud's memory
    Cost,
}

impl Part {
    fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// What its section of the page begins with.
    fn heading(self) -> &'static str {
        match self {
            Part::Scattering => "## Single scattering against Mitsuba",
            Part::Mapping => "## Transfer functions against VTK",
            Part::Fetch => "## Samples against bare fetches",
            Part::Tracing => "## The reference against Mitsuba",
            Part::Optimisations => "## What optimisations gain",
            Part::Cost => "## Cost against sizes and step",
        }
    }

    /// Its section as it stands on a page, up to that of another part.
    fn standing(self, page: &str) -> Option<String> {
        let begin = page.find(self.heading())?;
        let others = Part::value_variants().iter().filter_map(|part| page.find(part.heading()));
        let end = others.filter(|&at| at > begin).min().unwrap_or(page.len());
        Some(format!("{}\n", page[begin..end].trim_end()))
    }

    /// Measures, and gives its section of the page.
    fn measure(self, bench: &Bench) -> Result<String> {
        match self {
            Part::Scattering => scattering::section(bench),
            Part::Mapping => mapping::section(bench),
            Part::Fetch => fetch::section(bench),
            Part::Tracing => tracing::section(bench),
            Part::Optimisations => optimisations::section(bench),
            Part::Cost => cost::section(bench),
        }
    }
}

/// What all parts need.
struct Bench {
    tyndall: Tyndall,
    /// The example `frames`, which says what frames take after the first.
    frames: PathBuf,
    /// Keeps what is measured and rendered.
    folder: PathBuf,
    rounds: u32,
}

impl Bench {
    /// What a frame of a scene takes after the first, the mean of so many; `settings` are `path=value`.
    fn frames(&self, scene: &Path, settings: &[String], count: u32) -> Result<Frame> {
        let mut command = Command::new(&self.frames);
        process::quiet_driver(&mut command)?;
        let report = process::output(command.arg(scene).arg(count.to_string()).args(settings))?;
        let report: Value = serde_json::from_str(&report)?;
        let number = |field: &str| report[field].as_f64().with_context(|| format!("no {field}"));
        Ok(Frame { wall: number("wall")?, cpu: number("cpu")? })
    }
}

/// What a frame takes [s]. Timestamps are not asked: those of a CPU driver leave out most of some passes.
#[derive(Clone, Copy, Debug)]
struct Frame {
    wall: f64,
    /// CPU time of the process, of all its threads.
    cpu: f64,
}

impl Arguments {
    /// Measures, and puts the page together.
    pub fn run(&self) -> Result<()> {
        let tyndall = process::build_tyndall()?;
        driver::ensure(&tyndall, self.consent)?;
        let folder = process::scratch("volumes")?;
        let frames = process::build(&["--example", "frames"], "examples/frames")?;
        let bench = Bench { tyndall: Tyndall(tyndall), frames, folder, rounds: self.rounds };
        let page = std::fs::read_to_string(process::root().join("docs/volumes.md")).unwrap_or_default();
        let mut sections = Part::value_variants().iter().map(|part| part.standing(&page)).collect::<Vec<_>>();
        for (part, section) in Part::value_variants().iter().zip(&mut sections) {
            if self.only.is_none_or(|only| only == *part) {
                println!("{}", part.name());
                let text = part.measure(&bench).with_context(|| format!("part {}", part.name()))?;
                println!("\n{text}");
                *section = Some(text);
            }
        }
        let head = "# Volumes: speed and error\n\nWritten by `cargo xtask bench volumes`; every section was measured in a run of its own, \
                    in which what is compared took turns.\n`tyndall` is of the `dev` profile; the marcher runs on the device.\n";
        let sections = sections.into_iter().flatten();
        publish("volumes.md", &std::iter::once(head.to_owned()).chain(sections).collect::<Vec<_>>().join("\n"))
    }
}

/// The middle value of some; of an even number the higher of two. NaN of none.
pub(super) fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<_> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod test {
    use super::*;

    /// The page as it stands is made of all parts' sections: measuring one again leaves the others.
    #[test]
    fn other_sections_stay() {
        let page = std::fs::read_to_string(process::root().join("docs/volumes.md")).unwrap();
        let sections: Vec<_> = Part::value_variants().iter().filter_map(|part| part.standing(&page)).collect();
        assert_eq!(sections.len(), Part::value_variants().len());
        let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        assert!(words(&page).ends_with(&words(&sections.concat())));
    }
}
