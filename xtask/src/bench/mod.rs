//! `cargo xtask bench`: what takes minutes, and writes the tables in docs/.

mod accuracy;
mod fourier_opacity;
mod memory;
mod mitsuba;
mod plot;
mod radiosity;
mod volumes;

use anyhow::{Context, Result};

use crate::process;

/// Measure, and write the tables in docs/
#[derive(clap::Subcommand)]
pub enum Command {
    Accuracy(accuracy::Arguments),
    FourierOpacity(fourier_opacity::Arguments),
    Mitsuba(mitsuba::Arguments),
    Memory(memory::Arguments),
    Radiosity(radiosity::Arguments),
    Volumes(volumes::Arguments),
}

impl Command {
    /// Runs one.
    pub fn run(&self) -> Result<()> {
        match self {
            Command::Accuracy(arguments) => arguments.run(),
            Command::FourierOpacity(arguments) => arguments.run(),
            Command::Mitsuba(arguments) => arguments.run(),
            Command::Memory(arguments) => arguments.run(),
            Command::Radiosity(arguments) => arguments.run(),
            Command::Volumes(arguments) => arguments.run(),
        }
    }
}

/// Writes a page of docs/, whole or not at all.
fn publish(name: &str, text: &str) -> Result<()> {
    let (unfinished, path) = (process::scratch("")?.join(name), process::root().join("docs").join(name));
    std::fs::create_dir_all(process::root().join("docs"))
        .and_then(|()| std::fs::write(&unfinished, text))
        .and_then(|()| std::fs::rename(&unfinished, &path))
        .with_context(|| format!("cannot write {}", path.display()))?;
    println!("wrote docs/{name}");
    Ok(())
}

/// Rows of equal length as a Markdown table, the first its head.
fn table(rows: &[Vec<String>]) -> String {
    let mut text = String::new();
    for (number, row) in rows.iter().enumerate() {
        text += &format!("| {} |\n", row.join(" | "));
        if number == 0 {
            text += &format!("|{}\n", "---|".repeat(row.len()));
        }
    }
    text
}
