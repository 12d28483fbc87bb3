//! `cargo xtask`: the project's own commands.

mod bench;
mod bless;
mod checks;
mod demo;
mod driver;
mod process;
mod test;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Commands for those who work on Tyndall, and for a first look at it.
#[derive(Parser)]
#[command(
    name = "cargo xtask",
    bin_name = "cargo xtask",
    arg_required_else_help = true,
    after_help = "\
Examples:
  cargo xtask demo             a picture of smoke in out/demo.png, on any machine
  cargo xtask test             everything that must hold before a change lands
  cargo xtask bless            new golden pictures, to be looked at before they are committed
  cargo xtask bench accuracy   the marcher against the reference; writes docs/accuracy.md
  cargo xtask bench mitsuba    the reference against Mitsuba 3; writes docs/mitsuba.md
  cargo xtask bench memory     peak memory with volumes of 512^3; writes docs/memory.md
  cargo xtask bench volumes    ray marching's speed and its error; writes docs/volumes.md"
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Demo(demo::Arguments),
    Test(test::Arguments),
    Bless(bless::Arguments),
    #[command(subcommand)]
    Bench(bench::Command),
}

fn main() -> ExitCode {
    let outcome = match Cli::parse().command {
        Command::Demo(arguments) => arguments.run(),
        Command::Test(arguments) => arguments.run(),
        Command::Bless(arguments) => arguments.run(),
        Command::Bench(command) => command.run(),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
