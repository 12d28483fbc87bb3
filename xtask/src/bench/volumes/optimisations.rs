//! What every optimisation of the marcher gains, and its error.

use std::path::PathBuf;

use anyhow::{Context, Result};

use super::super::{accuracy, table};
use super::cost::cloud;
use super::measure::{read_exr, relative_rmse};
use super::{Bench, median};
use crate::process;

/// A scene, and what is set of it.
struct Case {
    name: &'static str,
    scene: PathBuf,
    settings: Vec<String>,
}

/// What is measured beside the plain march.
const SETTINGS: [&[&str]; 20] = [
    &["empty_space_skipping=on"],
    &["empty_space_skipping=on", "tolerance=0.02"],
    &["empty_space_skipping=on", "tolerance=0.05"],
    &["empty_space_skipping=on", "tolerance=0.1"],
    &["termination=0.001"],
    &["termination=0.01"],
    &["resolution=half"],
    &["resolution=quarter"],
    &["jitter=blue_noise"],
    &["jitter=blue_noise", "samples=4"],
    &["jitter=blue_noise", "samples=16"],
    &["samples=4"],
    &["preintegration=on"],
    &["step=2"],
    &["step=2", "preintegration=on"],
    &["step=2", "jitter=blue_noise", "samples=4"],
    &["empty_space_skipping=on", "termination=0.001"],
    &["empty_space_skipping=on", "termination=0.01", "tolerance=0.05"],
    &["empty_space_skipping=on", "termination=0.01", "tolerance=0.05", "resolution=half"],
    &["empty_space_skipping=on", "termination=0.01", "tolerance=0.05", "preintegration=on"],
];
/// No optimisation.
const PLAIN: [&str; 3] = ["empty_space_skipping=off", "termination=0", "step=1"];
/// What errors are held against: through pixels' centres, and, for what takes other rays, over the pixels.
const FINE: [&[&str]; 2] =
    [&["step=0.2", "light_step=0.4", "termination=0"], &["step=0.5", "light_step=1", "termination=0", "samples=16"]];

/// Measures.
pub fn section(bench: &Bench) -> Result<String> {
    let mut cases = vec![Case {
        name: "plume, 320 × 240",
        scene: process::root().join("scenes/plume.toml"),
        settings: vec!["film.size=[320,240]".into()],
    }];
    match accuracy::data("mni152_t1_1mm.nii.gz") {
        Some(file) => cases.insert(
            0,
            Case {
                name: "brain, 320 × 240",
                scene: process::root().join("scenes/brain.toml"),
                settings: vec![
                    "film.size=[320,240]".into(),
                    format!("media.brain.density.grid.file={}", file.display()),
                ],
            },
        ),
        None => println!("skipped: brain (mni152_t1_1mm.nii.gz is not there)"),
    }
    let (file, _) = cloud(bench, 512)?;
    cases.push(Case {
        name: "512³ sparse cloud, 160 × 120",
        scene: process::root().join("xtask/volumes/cloud.toml"),
        settings: vec!["film.size=[160,120]".into(), format!("media.cloud.density.grid.file={}", file.display())],
    });
    let mut head = vec!["settings".to_owned()];
    let mut columns = Vec::new();
    let (mut plain, mut adapter) = (vec!["none: ".to_owned() + &PLAIN.join(", ")], String::new());
    for case in &cases {
        println!("{}", case.name);
        let (first, column) = measure(bench, case, &mut adapter)?;
        head.extend([format!("{}: time", case.name), "relative RMSE".into()]);
        plain.extend(first);
        columns.push(column);
    }
    let mut rows = vec![head, plain];
    for (i, settings) in SETTINGS.iter().enumerate() {
        let mut row = vec![settings.join(", ")];
        row.extend(columns.iter().flat_map(|column| column[i].clone()));
        rows.push(row);
    }
    Ok(format!(
        "## What optimisations gain, and their error\n\nOn {adapter}. Time is that of the passes, relative to the plain march of the same turn (its first row, in \
         seconds); medians of {} turns.\nWhat a row does not name is as in the plain march. The error is held against a fine march \
         ({}),\nof rows with several samples or jitter against one over the pixels ({}).\n\n{}",
        bench.rounds,
        FINE[0].join(", "),
        FINE[1].join(", "),
        table(&rows)
    ))
}

/// The plain march's time and error, and the columns of a case.
fn measure(bench: &Bench, case: &Case, adapter: &mut String) -> Result<([String; 2], Vec<[String; 2]>)> {
    let render = |settings: &[&str], name: &str| {
        let march = settings.iter().map(|setting| format!("techniques.march.{setting}"));
        let all: Vec<_> = case.settings.iter().cloned().chain(march).collect();
        bench.tyndall.render(&case.scene, &all, &bench.folder.join(name))
    };
    let mut fine = Vec::new();
    for settings in FINE {
        println!("  fine march: {}", settings.join(", "));
        fine.push(read_exr(&render(settings, "fine.exr")?.picture)?);
    }
    let mut first = Vec::new();
    let mut ratios = vec![Vec::new(); SETTINGS.len()];
    let mut errors = vec![f64::NAN; SETTINGS.len()];
    let mut plain_error = f64::NAN;
    for round in 0..bench.rounds {
        println!("  round {}", round + 1);
        for (i, settings) in SETTINGS.iter().enumerate() {
            // The plain march now and then: load changes.
            if i % 5 == 0 {
                let plain = render(&PLAIN, "plain.exr")?;
                plain_error = relative_rmse(&read_exr(&plain.picture)?, &fine[0]);
                first.push(plain.pass);
                adapter.clone_from(&plain.adapter);
            }
            let beside: Vec<_> = PLAIN.iter().copied().chain(settings.iter().copied()).collect();
            let run = render(&beside, "setting.exr")?;
            let other = settings.iter().any(|setting| setting.starts_with("samples") || setting.starts_with("jitter"));
            errors[i] = relative_rmse(&read_exr(&run.picture)?, &fine[usize::from(other)]);
            ratios[i].push(run.pass / first.last().context("no plain march")?);
        }
    }
    let percent = |error: f64| format!("{:.2} %", 100.0 * error);
    let column =
        ratios.into_iter().zip(errors).map(|(ratios, error)| [format!("{:.2}", median(ratios)), percent(error)]);
    Ok(([format!("{:.2} s", median(first)), percent(plain_error)], column.collect()))
}
