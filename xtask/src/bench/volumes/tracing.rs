//! The reference's paths per second against Mitsuba's.

use std::time::Instant;

use anyhow::Result;

use super::super::table;
use super::measure::children_seconds;
use super::scattering::{Batch, Mitsuba, SCENE, VARIANTS};
use super::{Bench, median};
use crate::process;

const SIZE: &str = "320x240";
const PIXELS: f64 = 320.0 * 240.0;
/// Samples a pixel of ours and of Mitsuba's a turn.
const SAMPLES: [u32; 2] = [256, 32];
/// Scattering depth of ours (`None`: all) and of Mitsuba's.
const DEPTHS: [(Option<u32>, i32, &str); 2] = [(Some(1), 2, "scattered once"), (None, -1, "all orders")];

/// Measures.
pub fn section(bench: &Bench) -> Result<String> {
    let mitsuba = Mitsuba::new(bench, SCENE, SIZE)?;
    let head = [
        "light",
        "ours, paths/s",
        "paths/CPU s",
        "variant",
        "Mitsuba's, paths/s",
        "paths/CPU s",
        "ratio",
        "CPU over CPU",
    ];
    let mut rows = vec![head.map(String::from).to_vec()];
    let mut version = String::new();
    for (depth, max_depth, name) in DEPTHS {
        let mut ours = Vec::new();
        let mut theirs = VARIANTS.map(|_| Vec::<Batch>::new());
        for round in 0..bench.rounds {
            println!("{name}, round {}", round + 1);
            ours.push(trace(bench, depth)?);
            for (variant, batches) in VARIANTS.iter().zip(&mut theirs) {
                batches.push(mitsuba.render(variant, max_depth, 2, SAMPLES[1] / 2, round)?);
            }
        }
        let mine = [0, 1].map(|i| median(ours.iter().map(|rates| rates[i])));
        for (variant, batches) in VARIANTS.iter().zip(&theirs) {
            version.clone_from(&batches[0].version);
            let rates = [0, 1].map(|i| median(batches.iter().map(|batch| batch.rates[i])));
            let millions = |rate: f64| format!("{:.2} M", rate * 1e-6);
            rows.push(vec![
                name.into(),
                millions(mine[0]),
                millions(mine[1]),
                (*variant).into(),
                millions(rates[0]),
                millions(rates[1]),
                format!("{:.2}", mine[0] / rates[0]),
                format!("{:.2}", mine[1] / rates[1]),
            ]);
        }
    }
    Ok(format!(
        "## The reference against Mitsuba\n\n`tyndall reference {SCENE}`, {SIZE}, with the time to load, against `volpath` of Mitsuba {version} without \
         its time to load and compile. Medians of {} turns.\n\n{}",
        bench.rounds,
        table(&rows)
    ))
}

/// Paths per second of wall time and of CPU time.
fn trace(bench: &Bench, depth: Option<u32>) -> Result<[f64; 2]> {
    let picture = bench.folder.join("traced.exr");
    if picture.exists() {
        std::fs::remove_file(&picture)?;
    }
    let mut command = process::tyndall(&bench.tyndall.0)?;
    command.args(["reference", SCENE, "--size", SIZE, "--samples", &SAMPLES[0].to_string(), "-o"]).arg(&picture);
    command.args(depth.map(|depth| format!("--depth={depth}")));
    let (before, begun) = (children_seconds(), Instant::now());
    process::output(&mut command)?;
    let paths = f64::from(SAMPLES[0]) * PIXELS;
    Ok([paths / begun.elapsed().as_secs_f64(), paths / (children_seconds() - before)])
}
