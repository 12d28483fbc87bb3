//! What the program says. A reader that went away, as `head` does, is no mistake of ours.

use std::io::{ErrorKind, Write};

use anyhow::Context as _;

use crate::failure::Failure;

/// Writes results to standard output.
///
/// # Errors
/// Where it does not take them, a full disk for example; a closed pipe counts as having read enough.
pub fn result(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(error).context("cannot write to standard output").map_err(Failure::Failed)
        }
        _ => Ok(()),
    }
}

/// Writes a line to standard error, if anyone listens.
pub fn note(line: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{line}");
}
