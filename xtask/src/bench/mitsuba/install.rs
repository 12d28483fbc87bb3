//! Mitsuba from PyPI, and an LLVM for its fast variants.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::process;

/// What is installed, by pip's names.
const PACKAGES: [&str; 3] = ["mitsuba==3.9.1", "drjit==1.5.0", "numpy==2.4.6"];

/// Debian's package of an LLVM that Dr.Jit 1.5 works with, as it does with LLVM 22. With 15, which Mesa's driver brings, and
/// with 16 it aborts ("LLVM ERROR: Cannot select").
const LLVM: &str = "libllvm19";

/// A Python with Mitsuba, and with more packages.
pub fn python(more: &[&str]) -> Result<PathBuf> {
    let folder = process::scratch("mitsuba")?.join("venv");
    let python = folder.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
    if !python.is_file() {
        let python3 = if cfg!(windows) { "python" } else { "python3" };
        process::run(Command::new(python3).args(["-m", "venv"]).arg(&folder))
            .context("python3 with its module venv is needed (Debian: python3-venv)")?;
    }
    let mut install = Command::new(&python);
    install.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]).args(PACKAGES).args(more);
    process::run(&mut install)?;
    Ok(python)
}

/// The LLVM that DRJIT_LIBLLVM_PATH names; else Debian's, downloaded and unpacked below cargo's folder: nothing is
/// installed.
pub fn llvm() -> Result<PathBuf> {
    if let Some(path) = std::env::var_os("DRJIT_LIBLLVM_PATH") {
        return Ok(path.into());
    }
    let folder = process::scratch("mitsuba/llvm")?;
    let find = || -> Result<Option<PathBuf>> {
        // usr/lib/TRIPLE/libLLVM.so.19.1
        for triple in std::fs::read_dir(folder.join("usr/lib")).into_iter().flatten() {
            for file in std::fs::read_dir(triple?.path())? {
                let path = file?.path();
                if path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("libLLVM")) {
                    return Ok(Some(path));
                }
            }
        }
        Ok(None)
    };
    if let Some(path) = find()? {
        return Ok(path);
    }
    const WANTED: &str = "this variant needs LLVM 19 or later: name its libLLVM.so in DRJIT_LIBLLVM_PATH";
    ensure!(process::exists("apt-get") && process::exists("dpkg-deb"), "{WANTED}");
    process::run(Command::new("apt-get").args(["download", "--quiet", LLVM]).current_dir(&folder)).context(WANTED)?;
    for package in std::fs::read_dir(&folder)? {
        let package = package?.path();
        if package.extension().is_some_and(|extension| extension == "deb") {
            process::run(Command::new("dpkg-deb").arg("--extract").arg(&package).arg(&folder)).context(WANTED)?;
        }
    }
    find()?.with_context(|| format!("{LLVM} has no libLLVM; {WANTED}"))
}
