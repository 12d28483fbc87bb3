use std::time::Instant;

use anyhow::{Context, Result};

use crate::driver::{self, Consent};
use crate::process;

/// Render a plume of smoke to out/demo.png, from nothing but git, a C compiler and Rust
///
/// Builds the `tyndall` command, looks for an adapter, offers to install a CPU Vulkan driver where there is none, and
/// renders the scene and volume that are part of the program. Prints the adapter and its times.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  cargo xtask demo
  cargo xtask demo --yes    (asks nothing)")]
pub struct Arguments {
    #[command(flatten)]
    consent: Consent,
}

impl Arguments {
    /// Builds, and renders the demo.
    pub fn run(&self) -> Result<()> {
        let started = Instant::now();
        let tyndall = process::build_tyndall()?;
        let built = started.elapsed();
        driver::ensure(&tyndall, self.consent)?;
        let folder = process::root().join("out");
        std::fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
        process::run(process::tyndall(&tyndall)?.args(["demo", "-o", "out/demo.png"]))?;
        println!("build    {:>10.3} s", built.as_secs_f64());
        Ok(())
    }
}
