//! The `tyndall` command.

mod bake;
mod compare;
mod demo;
mod failure;
mod info;
mod input;
mod interrupt;
mod probe;
mod progress;
mod reference;
mod render;
mod reproduce;
mod say;
mod schema;
mod vpls;

use std::io::IsTerminal as _;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use tracing_subscriber::EnvFilter;

/// Renders light through things that are not opaque, and states how wrong each picture is.
#[derive(Parser)]
#[command(
    name = "tyndall",
    version,
    arg_required_else_help = true,
    after_help = "\
Examples:
  tyndall demo -o demo.png
  tyndall render scenes/plume.toml -o plume.png
  tyndall reference scenes/plume.toml -o truth.exr --depth 1 --error 0.01
  tyndall render scenes/plume.toml -o plume.exr
  tyndall compare plume.exr truth.exr --map difference.png
  tyndall probe scenes/plume.toml --pixel 320,240 --plot ray.svg

Exit codes: 0 done, 1 failed, 2 usage or bad input, 130 interrupted."
)]
struct Cli {
    /// Say more of what is done (-v), and more (-vv); RUST_LOG overrides it
    #[arg(short, long, global = true, action = clap::ArgAction::Count)]
    verbose: u8,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Demo(demo::Arguments),
    Render(render::Arguments),
    Reference(reference::Arguments),
    Bake(bake::Arguments),
    Compare(compare::Arguments),
    Probe(probe::Arguments),
    Reproduce(reproduce::Arguments),
    Info(info::Arguments),
    Schema(schema::Arguments),
    Vpls(vpls::Arguments),
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let level = match cli.verbose {
        0 => "warn,wgpu_hal=error",
        1 => "info,wgpu_hal=warn",
        _ => "debug,naga=info",
    };
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new(level));
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_ansi(std::io::stderr().is_terminal())
        .with_writer(std::io::stderr)
        .without_time()
        .log_internal_errors(false)
        .init();
    let outcome = match cli.command {
        Command::Demo(arguments) => arguments.run(),
        Command::Render(arguments) => arguments.run(),
        Command::Reference(arguments) => arguments.run(),
        Command::Bake(arguments) => arguments.run(),
        Command::Compare(arguments) => arguments.run(),
        Command::Probe(arguments) => arguments.run(),
        Command::Reproduce(arguments) => arguments.run(),
        Command::Info(arguments) => arguments.run(),
        Command::Schema(arguments) => arguments.run(),
        Command::Vpls(arguments) => arguments.run(),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}
