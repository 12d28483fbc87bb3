use std::path::PathBuf;

use anyhow::anyhow;
use tyndall_scene::image::{Picture, png, write_atomically};
use tyndall_scene::metrics::{self, Report, error_map};

use crate::failure::Failure;
use crate::input::check_output;
use crate::say;

/// Measure how wrong an image is against a reference
///
/// Prints RMSE, relative RMSE (RMSE over the reference's root mean square), PSNR, SSIM and FLIP (mean, 99th percentile),
/// and the z-test where both images carry variance. Two EXRs are compared in radiance and, tone-mapped alike, as a screen
/// shows them; a PNG only as a screen shows it.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  tyndall compare plume.exr truth.exr
  tyndall compare plume.exr truth.exr --json --map difference.png
  tyndall compare plume.exr truth.exr --fail-over relative_rmse=0.02 --fail-over flip_mean=0.05")]
pub struct Arguments {
    /// The image under test (.exr or .png)
    image: PathBuf,
    /// What it is measured against (.exr or .png)
    reference: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Write the FLIP error of every pixel as a picture (.png)
    #[arg(long, value_name = "DIFF.png")]
    map: Option<PathBuf>,
    /// Exposure in stops for the measures of what a screen shows
    #[arg(long, default_value_t = 0.0, allow_hyphen_values = true, value_parser = exposure)]
    exposure: f32,
    /// Exit with 1 where a measure is worse than VALUE: rmse, relative_rmse, relative_bias, flip_mean, flip_p99 and
    /// max_z above it, psnr_db and ssim below it (repeatable)
    #[arg(long, value_name = "METRIC=VALUE", value_parser = limit)]
    fail_over: Vec<(String, f64)>,
}

/// Measures of which more is better.
const MORE_IS_BETTER: [&str; 2] = ["psnr_db", "ssim"];

impl Arguments {
    /// Compares and prints.
    pub fn run(&self) -> Result<(), Failure> {
        if let Some(map) = &self.map {
            check_output(map, &["png"])?;
        }
        let read = |path| Picture::read(path).map_err(|error| Failure::Input(error.into()));
        let [image, reference] = [read(&self.image)?, read(&self.reference)?];
        let options = metrics::Options { exposure: self.exposure, ..Default::default() };
        let report = metrics::compare(&image, &reference, &options)?;
        let named = named(&report);
        for (name, _) in &self.fail_over {
            if !named.iter().any(|(known, _)| known == name) {
                let known: Vec<_> = named.iter().map(|(known, _)| *known).collect();
                let message = "--fail-over: these images have no measure";
                return Err(Failure::Input(anyhow!("{message} `{name}`; accepted: {}", known.join(", "))));
            }
        }
        if let Some(map) = &self.map {
            write_atomically(map, &png::encode(&error_map(&report))?)?;
        }
        if self.json {
            let text = serde_json::to_string_pretty(&report).map_err(|error| Failure::Failed(error.into()))?;
            say::result(&(text + "\n"))?;
        } else {
            say::result(&table(&report))?;
        }
        let worse: Vec<_> = self
            .fail_over
            .iter()
            .filter_map(|(name, limit)| {
                let (_, value) = named.iter().find(|(known, _)| known == name)?;
                let good = if MORE_IS_BETTER.contains(&name.as_str()) { value >= limit } else { value <= limit };
                (!good).then(|| format!("{name} is {value:.6}, the limit {limit}"))
            })
            .collect();
        if worse.is_empty() { Ok(()) } else { Err(Failure::Failed(anyhow!(worse.join("; ")))) }
    }
}

/// The measures that these images have, by name.
fn named(report: &Report) -> Vec<(&'static str, f64)> {
    let mut named = Vec::new();
    if let Some(linear) = &report.linear {
        named.extend([("rmse", linear.rmse), ("relative_rmse", linear.relative_rmse)]);
        named.extend(linear.relative_bias.map(|bias| ("relative_bias", bias)));
    }
    named.extend([
        ("psnr_db", report.psnr_db),
        ("ssim", report.ssim),
        ("flip_mean", report.flip_mean),
        ("flip_p99", report.flip_p99),
    ]);
    named.extend(report.z_test.as_ref().map(|test| ("max_z", test.max_z)));
    named
}

fn table(report: &Report) -> String {
    let mut lines = vec![format!("size             {} x {}", report.width, report.height)];
    if let Some(linear) = &report.linear {
        lines.push(format!("RMSE             {:.6} W/sr/m^2", linear.rmse));
        lines.push(format!("relative RMSE    {:.4} %", linear.relative_rmse * 100.0));
        for (label, value) in
            [("image noise", linear.noise), ("ref. noise", linear.reference_noise), ("bias", linear.relative_bias)]
        {
            lines.extend(value.map(|value| format!("  {label:<15}{:.4} %", value * 100.0)));
        }
    }
    lines.push(format!("PSNR             {:.2} dB", report.psnr_db));
    lines.push(format!("SSIM             {:.5}", report.ssim));
    lines.push(format!("FLIP             {:.5} mean, {:.5} 99th percentile", report.flip_mean, report.flip_p99));
    if let Some(test) = &report.z_test {
        let verdict = if test.pass { "passed" } else { "failed" };
        lines.push(format!(
            "z-test           {verdict}: largest |z| {:.2} at ({}, {}), limit {:.2}, {} tests",
            test.max_z, test.x, test.y, test.threshold, test.tests
        ));
    }
    lines.join("\n") + "\n"
}

fn limit(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("accepted: METRIC=VALUE, such as relative_rmse=0.02")?;
    let value: f64 = value.parse().map_err(|_| format!("`{value}` is not a number"))?;
    if value.is_nan() {
        return Err("accepted: a number that is not NaN".into());
    }
    Ok((name.into(), value))
}

fn exposure(text: &str) -> Result<f32, String> {
    let value = text.parse().ok().filter(|value: &f32| value.is_finite());
    value.ok_or_else(|| "accepted: a finite number of stops".into())
}
