//! Plots of the documentation.

use std::fs;

use anyhow::{Context, Result};
use tyndall_plot::{Line, log_log};

use crate::process;

/// Draws lines over logarithmic axes into docs/pictures/.
pub fn draw(name: &str, x: &str, y: &str, lines: &[Line]) -> Result<()> {
    let path = process::root().join("docs/pictures").join(name);
    fs::write(&path, log_log("", x, y, lines)?).with_context(|| format!("cannot write {}", path.display()))
}
