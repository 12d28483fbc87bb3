use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::process::Stdio;
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};

use crate::driver::{self, Consent};
use crate::{checks, process};

/// Check everything that must hold before a change lands, the cheap first
///
/// Formatting, files, clippy, documentation, the build for browsers, and all tests, with a CPU Vulkan driver where there is
/// no adapter. Ends with the line `N passed, N failed, N skipped`; what was skipped is said with its reason.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  cargo xtask test
  cargo xtask test --yes    (asks nothing)")]
pub struct Arguments {
    #[command(flatten)]
    consent: Consent,
}

/// How a stage ended that did not fail.
enum Outcome {
    Passed,
    Skipped(String),
    Tested(Tally),
}

type Stage = (&'static str, fn(&Arguments) -> Result<Outcome>);

const STAGES: [Stage; 7] = [
    ("format", |_| passed(process::run(&mut process::cargo(&["fmt", "--all", "--check"])))),
    ("files", |_| passed(checks::run())),
    ("clippy", |_| {
        let arguments = ["clippy", "--quiet", "--workspace", "--all-targets", "--", "-D", "warnings"];
        passed(process::run(&mut process::cargo(&arguments)))
    }),
    ("docs", |_| {
        let mut doc = process::cargo(&["doc", "--quiet", "--workspace", "--no-deps"]);
        passed(process::run(doc.env("RUSTDOCFLAGS", "-D warnings")))
    }),
    ("wasm32", |_| wasm()),
    ("driver", |arguments| {
        // All targets: the tests need them, and with their dependencies' features.
        passed(driver::ensure(&process::build(&["--all-targets"], "tyndall")?, arguments.consent))
    }),
    ("tests", |_| tests()),
];

impl Arguments {
    /// Runs the stages up to the first that fails.
    pub fn run(&self) -> Result<()> {
        let (mut summary, mut tally, mut failed) = (String::new(), Tally::default(), None);
        for (name, stage) in STAGES {
            println!("== {name}");
            let begun = Instant::now();
            let outcome = stage(self);
            let verdict = match outcome {
                Ok(Outcome::Passed) => "passed",
                Ok(Outcome::Skipped(reason)) => {
                    tally.skipped.push(format!("{name}: {reason}"));
                    "skipped"
                }
                Ok(Outcome::Tested(found)) => {
                    failed = (found.failed > 0).then_some(name);
                    tally.passed += found.passed;
                    tally.failed += found.failed;
                    tally.skipped.extend(found.skipped);
                    if failed.is_some() { "failed" } else { "passed" }
                }
                Err(error) => {
                    eprintln!("{error:#}");
                    tally.failed += 1;
                    failed = Some(name);
                    "failed"
                }
            };
            summary += &format!("{name:<8} {verdict} in {:.1} s\n", begun.elapsed().as_secs_f64());
            if failed.is_some() {
                break;
            }
        }
        println!("\n{summary}");
        for skipped in &tally.skipped {
            println!("skipped: {skipped}");
        }
        println!("{} passed, {} failed, {} skipped", tally.passed, tally.failed, tally.skipped.len());
        match failed {
            None => Ok(()),
            Some(name) => bail!("stage `{name}` failed"),
        }
    }
}

fn passed(result: Result<()>) -> Result<Outcome> {
    result.map(|()| Outcome::Passed)
}

/// The libraries that browsers run must build for them.
fn wasm() -> Result<Outcome> {
    const TARGET: &str = "wasm32-unknown-unknown";
    let sysroot = process::output(std::process::Command::new("rustc").args(["--print", "sysroot"]))?;
    let there = || std::path::Path::new(sysroot.trim()).join("lib/rustlib").join(TARGET).is_dir();
    if !there() && process::exists("rustup") {
        let _ = process::run(std::process::Command::new("rustup").args(["target", "add", TARGET]));
    }
    if !there() {
        return Ok(Outcome::Skipped(format!("Rust's {TARGET} target is not installed and could not be")));
    }
    let arguments = ["check", "--quiet", "--target", TARGET, "--package", "tyndall-scene", "--package", "tyndall"];
    passed(process::run(&mut process::cargo(&arguments)))
}

/// All tests of the workspace; they fail, not skip, where there is no adapter.
fn tests() -> Result<Outcome> {
    let log = process::scratch("")?.join("test.log");
    let mut file = File::create(&log).with_context(|| format!("cannot write {}", log.display()))?;
    let mut test = process::cargo(&["test", "--workspace", "--no-fail-fast", "--", "--show-output"]);
    process::quiet_driver(&mut test)?;
    let mut child = test.env("TYNDALL_REQUIRE_ADAPTER", "1").stdout(Stdio::piped()).spawn()?;
    let mut tally = Tally::default();
    let mut section = Section::default();
    for line in BufReader::new(child.stdout.take().context("cargo has no output")?).split(b'\n') {
        let line = String::from_utf8_lossy(&line?).into_owned();
        writeln!(file, "{line}")?;
        if tally.read(&line, &mut section) {
            println!("{line}");
        }
    }
    let status = child.wait()?;
    println!("all that the tests said: {}", log.display());
    ensure!(status.success() || tally.failed > 0, "cargo test failed ({status}), though no test says so");
    ensure!(tally.passed + tally.failed > 0, "there were no tests");
    Ok(Outcome::Tested(tally))
}

/// What tests came to.
#[derive(Debug, Default, PartialEq)]
struct Tally {
    passed: usize,
    failed: usize,
    /// The test's name with its reason.
    skipped: Vec<String>,
}

/// Which part of a test program's output is being read.
#[derive(Default)]
struct Section {
    failures: bool,
    /// Tests that skipped, of this program.
    skipped: usize,
    /// The test whose output follows, until it has said that it skips.
    test: Option<String>,
}

impl Tally {
    /// Takes in a line of what tests print with `--show-output`; whether it is worth showing.
    ///
    /// A test that could not run succeeds after a line `skipped: REASON`: it counts as skipped, not as passed.
    fn read(&mut self, line: &str, section: &mut Section) -> bool {
        if let Some(name) = line.strip_prefix("---- ").and_then(|rest| rest.strip_suffix(" stdout ----")) {
            section.test = Some(name.into());
        } else if line == "successes:" || line == "failures:" {
            *section = Section { failures: line == "failures:", test: None, ..*section };
        } else if let Some(reason) = line.strip_prefix("skipped: ").filter(|_| !section.failures) {
            if let Some(test) = section.test.take() {
                section.skipped += 1;
                self.skipped.push(format!("{test}: {reason}"));
            }
        } else if let Some((name, reason)) = line.strip_prefix("test ").and_then(|test| test.split_once(" ... ignored"))
        {
            let reason = reason.strip_prefix(", ").unwrap_or("ignored");
            self.skipped.push(format!("{name}: {reason}"));
        } else if let Some(counts) = line.strip_prefix("test result: ") {
            let count = |of: &str| {
                let words: Vec<_> = counts.split([' ', ';', '.']).collect();
                let at = words.iter().position(|word| *word == of);
                at.and_then(|at| words.get(at.checked_sub(1)?)?.parse::<usize>().ok()).unwrap_or(0)
            };
            self.passed += count("passed").saturating_sub(section.skipped);
            self.failed += count("failed");
            *section = Section::default();
            return true;
        }
        section.failures || line.ends_with(" ... FAILED")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_skipped_test_counts_as_skipped() {
        let said = "\
test drawn ... ok
test lit ... ok
test slow ... ignored, takes an hour
test wrong ... FAILED

successes:

---- drawn stdout ----
skipped: no adapter
skipped: no adapter

---- lit stdout ----
12 lamps

successes:
    drawn
    lit

failures:

---- wrong stdout ----
skipped: not really

failures:
    wrong

test result: FAILED. 2 passed; 1 failed; 1 ignored; 0 measured; 0 filtered out; finished in 0.00s";
        let (mut tally, mut section) = (Tally::default(), Section::default());
        let shown = said.lines().filter(|line| tally.read(line, &mut section)).collect::<Vec<_>>();
        let skipped = vec!["slow: takes an hour".into(), "drawn: no adapter".into()];
        assert_eq!(tally, Tally { passed: 1, failed: 1, skipped });
        assert_eq!(shown.first(), Some(&"test wrong ... FAILED"));
        assert!(shown.contains(&"skipped: not really"));
    }
}
