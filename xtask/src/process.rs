//! Other programs: cargo, `tyndall`, package managers.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};

/// The folder of the workspace.
pub fn root() -> PathBuf {
    let manifest = std::env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from);
    manifest.as_deref().and_then(Path::parent).map_or_else(|| ".".into(), Into::into)
}

/// A folder for what commands leave behind, below cargo's own; it is made where it is missing.
pub fn scratch(name: &str) -> Result<PathBuf> {
    // This program lies in target/debug.
    let program = std::env::current_exe().context("cannot find this program")?;
    let target = program.ancestors().nth(2).context("this program does not lie in cargo's target folder")?;
    let folder = target.join("xtask").join(name);
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    Ok(folder)
}

/// The cargo that runs this program, in the workspace's folder.
pub fn cargo(arguments: &[&str]) -> Command {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(arguments).current_dir(root());
    command
}

/// Builds the `tyndall` command and gives its path.
pub fn build_tyndall() -> Result<PathBuf> {
    build(&["--bin", "tyndall"], "tyndall")
}

/// Builds these targets of the workspace, and gives the path of a program among them (`examples/NAME` for an example).
pub fn build(targets: &[&str], program: &str) -> Result<PathBuf> {
    // The whole workspace chooses the dependencies' features, so that nothing is built twice.
    run(cargo(&["build", "--workspace"]).args(targets))?;
    let path = std::env::current_exe()?.with_file_name(format!("{program}{}", std::env::consts::EXE_SUFFIX));
    ensure!(path.is_file(), "cargo built no {}", path.display());
    Ok(path)
}

/// The `tyndall` command, in the workspace's folder.
pub fn tyndall(program: &Path) -> Result<Command> {
    let mut command = Command::new(program);
    command.current_dir(root());
    quiet_driver(&mut command)?;
    Ok(command)
}

/// Mesa prints an error, of no consequence, where there is no desktop session: this gives it one.
pub fn quiet_driver(command: &mut Command) -> Result<()> {
    if cfg!(target_os = "linux") && std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        command.env("XDG_RUNTIME_DIR", scratch("runtime")?);
    }
    Ok(())
}

/// Runs a command to its end; anything but success is an error.
pub fn run(command: &mut Command) -> Result<()> {
    let status = command.status().with_context(|| format!("cannot start {}", shown(command)))?;
    ensure!(status.success(), "{} failed ({status})", shown(command));
    Ok(())
}

/// Runs a command and gives what it prints; anything but success is an error with what it said.
pub fn output(command: &mut Command) -> Result<String> {
    let output = command.output().with_context(|| format!("cannot start {}", shown(command)))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        bail!("{} failed ({}):\n{}", shown(command), output.status, said.trim_end());
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// The command as one would type it.
pub fn shown(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(|word| word.to_string_lossy().into_owned()).collect::<Vec<_>>().join(" ")
}

/// Whether a program of this name can be started.
pub fn exists(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).any(|folder| folder.join(program).is_file())
}
