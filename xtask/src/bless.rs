use anyhow::Result;

use crate::driver::{self, Consent};
use crate::process;

/// Render the golden pictures anew; look at them before you commit them
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  cargo xtask bless && git diff --stat")]
pub struct Arguments {
    #[command(flatten)]
    consent: Consent,
}

impl Arguments {
    /// Runs the golden tests in the mode that writes.
    pub fn run(&self) -> Result<()> {
        driver::ensure(&process::build_tyndall()?, self.consent)?;
        let mut test = process::cargo(&["test", "--package", "tyndall", "--lib", "golden"]);
        process::quiet_driver(&mut test)?;
        process::run(test.envs([("TYNDALL_BLESS", "1"), ("TYNDALL_REQUIRE_ADAPTER", "1")]))
    }
}
