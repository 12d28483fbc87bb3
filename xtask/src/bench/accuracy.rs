use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use super::{publish, table};
use crate::driver::{self, Consent};
use crate::process;

/// The marcher against the reference at equal scattering depth, on the shipped scenes and the brain; writes
/// docs/accuracy.md
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  cargo xtask bench accuracy    (takes some minutes)

The brain is rendered where mni152_t1_1mm.nii.gz lies in the folder that TYNDALL_DATA names, or in ../shared/data.")]
pub struct Arguments {
    #[command(flatten)]
    consent: Consent,
}

/// A scene, what of it is compared, and the reference's samples a pixel.
struct Case {
    name: &'static str,
    scene: &'static str,
    depth: u32,
    model: &'static str,
    samples: u32,
    size: &'static str,
    data: Option<&'static str>,
}

const CASES: [Case; 4] = [
    Case {
        name: "plume with sun",
        scene: "plume",
        depth: 1,
        model: "single_scattering",
        samples: 3000,
        size: "320x240",
        data: None,
    },
    Case {
        name: "fog with spot light",
        scene: "fog",
        depth: 1,
        model: "single_scattering",
        samples: 2000,
        size: "120x90",
        data: None,
    },
    Case {
        name: "plume as fire, emission",
        scene: "fire",
        depth: 0,
        model: "emission",
        samples: 1000,
        size: "320x240",
        data: None,
    },
    Case {
        name: "brain",
        scene: "brain",
        depth: 0,
        model: "emission",
        samples: 500,
        size: "320x240",
        data: Some("mni152_t1_1mm.nii.gz"),
    },
];

const SETTINGS: [(&str, &[&str]); 2] =
    [("default", &[]), ("high", &["step=0.5", "light_step=1", "samples=8", "termination=0.0001"])];

impl Arguments {
    /// Renders, traces, compares.
    pub fn run(&self) -> Result<()> {
        let tyndall = process::build_tyndall()?;
        driver::ensure(&tyndall, self.consent)?;
        let mut rows = vec![
            ["scene", "pixels", "settings", "relative RMSE", "the reference's noise", "bias", "FLIP mean"]
                .map(String::from)
                .to_vec(),
        ];
        let mut adapter = String::new();
        for case in &CASES {
            let mut scene = vec![format!("scenes/{}.toml", case.scene), format!("--size={}", case.size)];
            if let Some(file) = case.data {
                let Some(path) = data(file) else {
                    println!("skipped: {} ({file} is not there)", case.name);
                    continue;
                };
                scene.push(format!("--set=media.{}.density.grid.file={}", case.scene, path.display()));
            }
            let truth = process::scratch("accuracy")?.join(format!("{}.exr", case.scene));
            let (depth, samples) = (case.depth.to_string(), case.samples.to_string());
            println!("tracing {} ({samples} samples a pixel)", case.name);
            // Continues an earlier run's picture of the same scene.
            process::run(
                process::tyndall(&tyndall)?
                    .arg("reference")
                    .args(&scene)
                    .args(["--depth", &depth, "--samples", &samples, "-o"])
                    .arg(&truth),
            )?;
            for (name, settings) in SETTINGS {
                let (row, on) = compare(&tyndall, case, &scene, &truth, name, settings)?;
                adapter = on;
                rows.push(row);
            }
        }
        let text = format!(
            "# The marcher against the reference\n\nAt equal scattering depth, on {adapter}. *Relative RMSE* is over \
             the root mean square of the reference; it holds the reference's own noise, which *bias* is without. *high* is \
             {}. Written by `cargo xtask bench accuracy`.\n\n{}",
            SETTINGS[1].1.join(", "),
            table(&rows)
        );
        publish("accuracy.md", &text)
    }
}

/// A row of the table, and the adapter.
fn compare(
    tyndall: &Path,
    case: &Case,
    scene: &[String],
    truth: &Path,
    name: &str,
    settings: &[&str],
) -> Result<(Vec<String>, String)> {
    let picture = process::scratch("accuracy")?.join(format!("{}-{name}.exr", case.scene));
    let mut render = process::tyndall(tyndall)?;
    render.arg("render").args(scene).arg(format!("--set=techniques.march.model={}", case.model));
    render.args(settings.iter().map(|setting| format!("--set=techniques.march.{setting}")));
    let said = process::output(render.args(["--timings", "-o"]).arg(&picture))?;
    let line = |word: &str| said.lines().find_map(|line| line.strip_prefix(word)).map(|rest| rest.trim().to_owned());
    let report = process::output(process::tyndall(tyndall)?.arg("compare").args([&picture, truth]).arg("--json"))?;
    let report: serde_json::Value = serde_json::from_str(&report)?;
    let percent = |field: &str| -> Result<String> {
        let value = report["linear"][field].as_f64().with_context(|| format!("the report has no {field}"))?;
        Ok(format!("{:.2} %", value * 100.0))
    };
    let row = vec![
        case.name.into(),
        case.size.into(),
        name.into(),
        percent("relative_rmse")?,
        percent("reference_noise")?,
        percent("relative_bias")?,
        format!("{:.4}", report["flip_mean"].as_f64().context("the report has no flip_mean")?),
    ];
    println!("{}", row.join("  "));
    Ok((row, line("adapter").unwrap_or_default()))
}

/// A file of the data that the project does not ship, where it is there.
pub(super) fn data(file: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("TYNDALL_DATA").map_or_else(|| process::root().join("../shared/data"), PathBuf::from);
    folder.join(file).canonicalize().ok()
}
