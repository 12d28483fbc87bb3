//! Samples per second of the marcher against a bare loop of fetches.

use std::process::Command;

use anyhow::{Context, Result};
use serde_json::Value;

use super::super::table;
use super::{Bench, median};
use crate::process;

/// Measures.
pub fn section(bench: &Bench) -> Result<String> {
    let probe = process::build(&["--example", "fetch"], "examples/fetch")?;
    let mut command = Command::new(probe);
    process::quiet_driver(&mut command)?;
    let report: Value = serde_json::from_str(&process::output(command.arg(bench.rounds.to_string()))?)?;
    let rate = |name: &str| -> Result<f64> {
        let rates = report[name].as_array().with_context(|| format!("no {name}"))?;
        Ok(median(rates.iter().filter_map(Value::as_f64)))
    };
    let bare = rate("bare")?;
    let mut rows = vec![["loop", "trilinear samples/s", "of the bare loop"].map(String::from).to_vec()];
    for (key, name) in [
        ("bare", "fetches alone"),
        ("coefficients", "march, absorption, coefficients"),
        ("transfer", "march, absorption, transfer function"),
    ] {
        let rate = rate(key)?;
        rows.push(vec![name.into(), format!("{:.1} M", rate * 1e-6), format!("{:.0} %", 100.0 * rate / bare)]);
    }
    Ok(format!(
        "## Samples against bare fetches\n\nOn {}: 128³ random bytes, dense, one sample a voxel, no skipping, 512 × 512 rays. The bare loop sums as \
         many fetches\nof a dense texture of half floats on the same rays. Medians of {} turns.\n\n{}",
        report["adapter"].as_str().unwrap_or_default(),
        bench.rounds,
        table(&rows)
    ))
}
