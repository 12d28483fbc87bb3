//! The plume in the sun, scattered once, against Mitsuba: the time to an equal error.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};
use serde_json::Value;

use super::super::mitsuba::install;
use super::super::table;
use super::{Bench, median};
use crate::process;

pub const SCENE: &str = "scenes/plume.toml";
pub const SIZE: &str = "640x480";
const PIXELS: f64 = 640.0 * 480.0;
/// Samples a pixel of the reference.
const SAMPLES: u32 = 512;
/// Mitsuba's variants.
pub const VARIANTS: [&str; 2] = ["scalar_rgb", "llvm_ad_rgb"];

/// A batch of Mitsuba's.
pub struct Batch {
    pub version: String,
    /// Paths per second of wall time, and of CPU time.
    pub rates: [f64; 2],
    /// The noise of one sample a pixel, relative to the picture's root mean square.
    pub noise: f64,
}

/// Mitsuba, with a scene that it takes.
pub struct Mitsuba {
    python: PathBuf,
    llvm: PathBuf,
    folder: PathBuf,
}

impl Mitsuba {
    /// Takes a scene to Mitsuba.
    pub fn new(bench: &Bench, scene: &str, size: &str) -> Result<Self> {
        let exporter = process::build(&["--example", "mitsuba"], "examples/mitsuba")?;
        let folder = bench.folder.join("mitsuba");
        std::fs::create_dir_all(&folder)?;
        let mut command = Command::new(exporter);
        process::output(
            command
                .current_dir(process::root())
                .args(["export", scene])
                .arg(&folder)
                .arg(format!("film.size=[{}]", size.replace('x', ","))),
        )?;
        Ok(Self { python: install::python(&[])?, llvm: install::llvm()?, folder })
    }

    /// Renders batches of so many samples a pixel; depth 2 is light scattered once, −1 as often as it is.
    pub fn render(&self, variant: &str, max_depth: i32, batches: u32, samples: u32, seed: u32) -> Result<Batch> {
        let output = self.folder.join("picture");
        let mut command = Command::new(&self.python);
        command.arg(process::root().join("xtask/mitsuba/render.py")).arg(self.folder.join("scene.json")).arg(&output);
        command.env("DRJIT_LIBLLVM_PATH", &self.llvm);
        command.args(["--variant", variant, &format!("--max-depth={max_depth}")]);
        for (name, value) in [("--batches", batches), ("--spp", samples), ("--seed", seed)] {
            command.args([name, &value.to_string()]);
        }
        process::output(&mut command)?;
        let report: Value = serde_json::from_str(&std::fs::read_to_string(output.with_extension("json"))?)?;
        let scene: Value = serde_json::from_str(&std::fs::read_to_string(self.folder.join("scene.json"))?)?;
        let number = |value: &Value| value.as_f64().context("Mitsuba's report lacks a number");
        let paths = number(&report["samples"])? * number(&scene["size"][0])? * number(&scene["size"][1])?;
        let [mean, variance] = ["picture.mean.f32", "picture.variance.f32"].map(|name| floats(&self.folder.join(name)));
        // The mean's own noise is no signal.
        let variance: f64 = variance?.into_iter().map(f64::from).sum();
        let squares: f64 = mean?.into_iter().map(|v| f64::from(v).powi(2)).sum();
        let signal = squares - variance / number(&report["samples"])?;
        Ok(Batch {
            version: report["version"].as_str().unwrap_or_default().into(),
            rates: [paths / number(&report["seconds"])?, paths / number(&report["cpu_seconds"])?],
            noise: (variance / signal).sqrt(),
        })
    }
}

/// Raw little-endian floats.
pub fn floats(path: &Path) -> Result<Vec<f32>> {
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    Ok(bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect())
}

const SETTINGS: [(&str, &[&str]); 2] = [("default", &[]), ("high", &["step=0.5", "light_step=1", "samples=4"])];

/// Measures.
pub fn section(bench: &Bench) -> Result<String> {
    let truth = bench.folder.join("plume.exr");
    println!("tracing the reference ({SAMPLES} samples a pixel)");
    bench.tyndall.reference(SCENE, SIZE, 1, SAMPLES, &truth)?;
    let mitsuba = Mitsuba::new(bench, SCENE, SIZE)?;
    let mut ours = SETTINGS.map(|_| Vec::new());
    let mut theirs = VARIANTS.map(|_| Vec::<Batch>::new());
    for round in 0..bench.rounds {
        println!("round {}", round + 1);
        for ((name, settings), runs) in SETTINGS.iter().zip(&mut ours) {
            let settings: Vec<_> = settings.iter().map(|setting| format!("techniques.march.{setting}")).collect();
            let picture = bench.folder.join(format!("plume-{name}.exr"));
            runs.push(bench.tyndall.render(&process::root().join(SCENE), &settings, &picture)?);
        }
        for (variant, batches) in VARIANTS.iter().zip(&mut theirs) {
            batches.push(mitsuba.render(variant, 2, 8, 2, round)?);
        }
    }
    let mut rows = vec![
        [
            "settings",
            "relative RMSE without the reference's noise",
            "pass",
            "whole command, wall",
            "CPU s",
            "variant",
            "paths/s",
            "paths/CPU s",
            "σ₁",
            "its time to that error",
            "ratio to the pass",
            "to the command",
            "CPU over CPU",
        ]
        .map(String::from)
        .to_vec(),
    ];
    let (mut adapter, mut version, mut noise) = (String::new(), String::new(), f64::NAN);
    for ((name, settings), runs) in SETTINGS.iter().zip(&ours) {
        let last = runs.last().context("no round")?;
        adapter.clone_from(&last.adapter);
        let errors = bench.tyndall.compare(&last.picture, &truth)?;
        let error = errors["relative_bias"].as_f64().context("no bias")?;
        noise = errors["reference_noise"].as_f64().context("no noise")?;
        let of = |field: fn(&super::Run) -> f64| median(runs.iter().map(field));
        let (pass, wall, cpu) = (of(|run| run.pass), of(|run| run.wall), of(|run| run.cpu));
        for (variant, batches) in VARIANTS.iter().zip(&theirs) {
            version.clone_from(&batches[0].version);
            let sigma = median(batches.iter().map(|batch| batch.noise));
            let [rate, cpu_rate] = [0, 1].map(|i| median(batches.iter().map(|batch| batch.rates[i])));
            let paths = (sigma / error).powi(2) * PIXELS;
            rows.push(vec![
                if settings.is_empty() { (*name).into() } else { settings.join(", ") },
                format!("{:.2} %", error * 100.0),
                format!("{pass:.2} s"),
                format!("{wall:.2} s"),
                format!("{cpu:.2}"),
                (*variant).into(),
                format!("{:.2} M", rate * 1e-6),
                format!("{:.2} M", cpu_rate * 1e-6),
                format!("{sigma:.3}"),
                format!("{:.0} s", paths / rate),
                format!("{:.0}", paths / rate / pass),
                format!("{:.0}", paths / rate / wall),
                format!("{:.0}", paths / cpu_rate / cpu),
            ]);
        }
    }
    Ok(format!(
        "## Single scattering against Mitsuba, at equal error\n\n`{SCENE}`, {SIZE}, on {adapter}, against `volpath` of Mitsuba {version} with `max_depth` \
         2. Our error is held against the reference at depth 1 with {SAMPLES} samples\na pixel, whose noise ({:.1} %) is taken \
         out. Mitsuba's error is noise: σ₁ is that of one sample a pixel, relative to the picture's root mean square, and\n\
         it needs (σ₁/e)² samples a pixel for an error of e. Medians of {} turns.\n\n{}",
        noise * 100.0,
        bench.rounds,
        table(&rows)
    ))
}
