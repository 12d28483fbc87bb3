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
const SETTINGS: [&[&str]; 22] = [
    &["empty_space_skipping=on"],
    &["empty_space_skipping=on", "tolerance=0.02"],
    &["empty_space_skipping=on", "tolerance=0.05"],
    &["empty_space_skipping=on", "tolerance=0.1"],
    &["termination=0.001"],
    &["termination=0.01"],
    &["resolution=half"],
    &["resolution=quarter"],
    &["resolution=quarter", "resolution_tolerance=0.004"],
    &["resolution=quarter", "resolution_tolerance=1"],
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
/// Frames that are measured.
const FRAMES: u32 = 2;
/// No optimisation.
const PLAIN: [&str; 3] = ["empty_space_skipping=off", "termination=0", "step=1"];
/// What settings may add to the error to be chosen.
const MOST_ADDED: [f64; 3] = [0.0005, 0.002, 0.01];
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
        let column = measure(bench, case, &mut adapter)?;
        head.extend([format!("{}: time", case.name), "relative RMSE".into()]);
        plain.extend([format!("{:.2} s", column.plain.time), percent(column.plain.error)]);
        columns.push(column);
    }
    let mut rows = vec![head, plain];
    for (i, settings) in SETTINGS.iter().enumerate() {
        let mut row = vec![settings.join(", ")];
        for found in columns.iter().map(|column| column.settings[i]) {
            row.extend([format!("{:.2}", found.time), percent(found.error)]);
        }
        rows.push(row);
    }
    Ok(format!(
        "## What optimisations gain, and their error\n\nOn {adapter}. Time is that of a frame after the first{}, relative to the plain march of the same turn (its first row, in \
         seconds); medians of {} turns.\nWhat a row does not name is as in the plain march. The error is held against a fine march \
         ({}),\nof rows with several samples or jitter against one over the pixels ({}).\n\n{}\n{}\n",
        if on_cpu(&adapter) { " in CPU seconds" } else { "" },
        bench.rounds,
        FINE[0].join(", "),
        FINE[1].join(", "),
        table(&rows),
        choice(&columns)
    ))
}

/// A time and an error: of the plain march in seconds, of settings relative to it.
#[derive(Clone, Copy)]
struct Found {
    time: f64,
    error: f64,
}

/// What was found in a scene.
struct Column {
    plain: Found,
    settings: Vec<Found>,
}

/// Whether a device is a driver on the CPU: then a frame takes CPU time, which other load changes less.
fn on_cpu(adapter: &str) -> bool {
    adapter.contains("llvmpipe")
}

/// Whether other rays are taken than through the pixels' centres.
fn over_pixels(settings: &[&str]) -> bool {
    settings.iter().any(|setting| setting.starts_with("samples") || setting.starts_with("jitter"))
}

fn percent(error: f64) -> String {
    format!("{:.2} %", 100.0 * error)
}

/// The fastest settings, in the geometric mean over the scenes, that nowhere add more than an error.
fn choice(columns: &[Column]) -> String {
    let best = |most: f64| {
        let fit = (0..SETTINGS.len()).filter(|&i| {
            !over_pixels(SETTINGS[i]) && columns.iter().all(|c| c.settings[i].error <= c.plain.error + most)
        });
        let mean = |i: usize| columns.iter().map(|c| c.settings[i].time.ln()).sum::<f64>() / columns.len() as f64;
        let best = fit.map(|i| (mean(i).exp(), SETTINGS[i].join(", "))).min_by(|a, b| a.0.total_cmp(&b.0));
        best.map_or_else(
            || format!("- {}: none\n", percent(most)),
            |(time, settings)| format!("- {}: {settings} (time × {time:.2})\n", percent(most)),
        )
    };
    let lines: String = MOST_ADDED.into_iter().map(best).collect();
    format!("The fastest settings that in no scene add more to the plain march's error than\n\n{lines}")
}

/// Measures a scene.
fn measure(bench: &Bench, case: &Case, adapter: &mut String) -> Result<Column> {
    let all = |settings: &[&str]| -> Vec<_> {
        let march = settings.iter().map(|setting| format!("techniques.march.{setting}"));
        case.settings.iter().cloned().chain(march).collect()
    };
    let render =
        |settings: &[&str], name: &str| bench.tyndall.render(&case.scene, &all(settings), &bench.folder.join(name));
    let time = |settings: &[&str], adapter: &str| -> Result<f64> {
        let frame = bench.frames(&case.scene, &all(settings), FRAMES)?;
        Ok(if on_cpu(adapter) { frame.cpu } else { frame.wall })
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
                adapter.clone_from(&plain.adapter);
                first.push(time(&PLAIN, adapter)?);
            }
            let beside: Vec<_> = PLAIN.iter().copied().chain(settings.iter().copied()).collect();
            let run = render(&beside, "setting.exr")?;
            let other = over_pixels(settings);
            errors[i] = relative_rmse(&read_exr(&run.picture)?, &fine[usize::from(other)]);
            ratios[i].push(time(&beside, adapter)? / first.last().context("no plain march")?);
        }
    }
    let settings = ratios.into_iter().zip(errors).map(|(ratios, error)| Found { time: median(ratios), error });
    Ok(Column { plain: Found { time: median(first), error: plain_error }, settings: settings.collect() })
}
