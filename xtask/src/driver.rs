//! A CPU Vulkan driver for machines without an adapter.

use std::io::{IsTerminal, Write};
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::process::{self, exists, shown};

/// Whether packages may be installed without asking.
#[derive(clap::Args, Clone, Copy)]
pub struct Consent {
    /// Install a CPU Vulkan driver without asking where there is no adapter; so it is, too, where CI is set
    #[arg(long)]
    yes: bool,
}

/// A package manager that can bring a driver and the Vulkan loader.
struct Manager {
    program: &'static str,
    /// Brings its lists up to date.
    update: &'static [&'static str],
    install: &'static [&'static str],
}

const MANAGERS: [Manager; 4] = [
    Manager {
        program: "apt-get",
        update: &["update"],
        install: &["install", "--yes", "--no-install-recommends", "mesa-vulkan-drivers", "libvulkan1"],
    },
    Manager {
        program: "dnf",
        update: &["makecache"],
        install: &["install", "--assumeyes", "mesa-vulkan-drivers", "vulkan-loader"],
    },
    Manager {
        program: "pacman",
        update: &["-Sy", "--noconfirm"],
        install: &["-S", "--noconfirm", "--needed", "vulkan-swrast", "vulkan-icd-loader"],
    },
    Manager { program: "apk", update: &["update"], install: &["add", "mesa-vulkan-swrast", "vulkan-loader"] },
];

/// Sees to it that there is an adapter: installs a driver where there is none, if it may.
///
/// # Errors
/// No adapter, and none to be had: with what to do by hand.
pub fn ensure(tyndall: &Path, consent: Consent) -> Result<()> {
    let Some(help) = missing(tyndall)? else { return Ok(()) };
    let manager = MANAGERS.iter().find(|manager| exists(manager.program));
    let Some(manager) = manager.filter(|_| cfg!(target_os = "linux")) else { bail!(help) };
    let mut install = privileged(manager.program, manager.install)?;
    let ci = std::env::var_os("CI").is_some_and(|value| !value.is_empty() && value != "false");
    let allowed = consent.yes || ci || {
        println!("There is no graphics adapter. A CPU Vulkan driver makes up for it, installed by\n");
        println!("    {}\n", shown(&install));
        ask("Install it now?")?
    };
    if !allowed {
        bail!("{help}\n\nOr let this command install it: add --yes");
    }
    println!("installing a CPU Vulkan driver: {}", shown(&install));
    if process::run(&mut install).is_err() {
        // Fresh machines have no lists of packages, old ones have old lists.
        process::run(&mut privileged(manager.program, manager.update)?)?;
        process::run(&mut install)?;
    }
    match missing(tyndall)? {
        None => Ok(()),
        Some(help) => bail!("the driver is installed, yet there is no adapter.\n{help}"),
    }
}

/// What `tyndall info` says where there is no adapter; `None` where there is one.
fn missing(tyndall: &Path) -> Result<Option<String>> {
    let mut info = process::tyndall(tyndall)?;
    let output = info.arg("info").output().with_context(|| format!("cannot start {}", tyndall.display()))?;
    let said = String::from_utf8_lossy(&output.stderr).trim().to_owned();
    match output.status.code() {
        Some(0) => Ok(None),
        // Before the message may stand what the Vulkan loader complains of.
        Some(1) => Ok(Some(said.rsplit_once("error: ").map_or(&*said, |(_, message)| message).to_owned())),
        _ => bail!("`tyndall info` ended with {}:\n{said}", output.status),
    }
}

/// A command as root: by itself where that is who we are, else through sudo or doas.
fn privileged(program: &str, arguments: &[&str]) -> Result<Command> {
    let root = process::output(Command::new("id").arg("-u")).is_ok_and(|id| id.trim() == "0");
    let through = ["sudo", "doas"].into_iter().find(|program| exists(program));
    let mut command = match through {
        _ if root => Command::new("env"),
        Some(through) => {
            let mut command = Command::new(through);
            command.arg("env");
            command
        }
        None => bail!("installing a driver needs root: run as root `{program} {}`", arguments.join(" ")),
    };
    command.arg("DEBIAN_FRONTEND=noninteractive").arg(program).args(arguments);
    Ok(command)
}

/// Asks on the terminal; without one the answer is no.
fn ask(question: &str) -> Result<bool> {
    if !std::io::stdin().is_terminal() {
        return Ok(false);
    }
    print!("{question} [y/N] ");
    std::io::stdout().flush()?;
    let mut answer = String::new();
    std::io::stdin().read_line(&mut answer)?;
    Ok(matches!(answer.trim().to_lowercase().as_str(), "y" | "yes"))
}
