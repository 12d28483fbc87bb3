//! Runs of `tyndall`, measured, and the pictures that they leave.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use serde_json::Value;

use super::super::memory::high_water;
use crate::process;

/// The `tyndall` command.
pub struct Tyndall(pub PathBuf);

/// A render.
#[derive(Clone, Debug)]
pub struct Run {
    pub picture: PathBuf,
    pub adapter: String,
    /// Time on the device by pass [s].
    pub passes: BTreeMap<String, f64>,
    /// Time on the device, of all passes [s].
    pub pass: f64,
    /// From the start of the process to its end [s].
    pub wall: f64,
    /// User's CPU time of the process, of all threads [s]; NaN where it is not known (only Linux tells).
    pub cpu: f64,
    /// Peak resident memory [bytes]; 0 where it is not known.
    pub peak: u64,
}

impl Tyndall {
    /// Renders a scene to an EXR; `settings` are `path=value`.
    pub fn render(&self, scene: &Path, settings: &[String], picture: &Path) -> Result<Run> {
        let mut command = process::tyndall(&self.0)?;
        command.arg("render").arg(scene).args(settings.iter().map(|setting| format!("--set={setting}")));
        command.args(["--timings", "-o"]).arg(picture).stdout(Stdio::piped()).stderr(Stdio::piped());
        let before = children_seconds();
        let begun = Instant::now();
        let mut child = command.spawn().with_context(|| format!("cannot start {}", process::shown(&command)))?;
        let mut peak = 0;
        let status = loop {
            peak = peak.max(high_water(child.id()).unwrap_or(0));
            if let Some(status) = child.try_wait()? {
                break status;
            }
            std::thread::sleep(Duration::from_millis(2));
        };
        let wall = begun.elapsed().as_secs_f64();
        let cpu = children_seconds() - before;
        let (mut printed, mut said) = (String::new(), String::new());
        child.stdout.take().context("no output")?.read_to_string(&mut printed)?;
        child.stderr.take().context("no output")?.read_to_string(&mut said)?;
        if !status.success() {
            bail!("{} failed ({status}):\n{}", process::shown(&command), said.trim_end());
        }
        let lines = |word: &'static str| printed.lines().filter_map(move |line| line.strip_prefix(word)).map(str::trim);
        let mut passes = BTreeMap::new();
        for line in lines("pass") {
            let mut words = line.split_whitespace();
            let milliseconds = words.next().and_then(|word| word.parse::<f64>().ok());
            if let (Some(milliseconds), Some(name)) = (milliseconds, words.last()) {
                passes.insert(name.to_owned(), milliseconds * 1e-3);
            }
        }
        let pass = passes.values().sum();
        let adapter = lines("adapter").next().unwrap_or_default().to_owned();
        Ok(Run { picture: picture.into(), adapter, passes, pass, wall, cpu, peak })
    }

    /// Traces a scene, or continues its picture.
    pub fn reference(&self, scene: &str, size: &str, depth: u32, samples: u32, picture: &Path) -> Result<()> {
        let mut command = process::tyndall(&self.0)?;
        command.args(["reference", scene, "--size", size]);
        command.args(["--depth", &depth.to_string(), "--samples", &samples.to_string(), "-o"]).arg(picture);
        process::output(&mut command).map(drop)
    }

    /// A picture's errors in radiance against a reference, as `tyndall compare` reports them.
    pub fn compare(&self, picture: &Path, reference: &Path) -> Result<Value> {
        let text = process::output(process::tyndall(&self.0)?.arg("compare").args([picture, reference]).arg("--json"))?;
        let mut report: Value = serde_json::from_str(&text)?;
        Ok(report["linear"].take())
    }
}

/// User's CPU time of all children that have ended [s]; NaN where it is not known.
pub fn children_seconds() -> f64 {
    // What follows the name in proc_pid_stat(5) begins with field 3; field 16 is cutime, in hundredths of a second.
    let ticks = std::fs::read_to_string("/proc/self/stat").ok().and_then(|text| {
        let (_, fields) = text.rsplit_once(')')?;
        fields.split_whitespace().nth(13)?.parse::<f64>().ok()
    });
    ticks.map_or(f64::NAN, |ticks| ticks * 0.01)
}

/// The pixels of an EXR, the top row first.
pub fn read_exr(path: &Path) -> Result<Vec<[f32; 3]>> {
    use exr::prelude::*;
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| (size.width(), vec![[0f32; 3]; size.area()]),
            |(width, pixels), at, (r, g, b): (f32, f32, f32)| pixels[at.y() * *width + at.x()] = [r, g, b],
        )
        .first_valid_layer()
        .all_attributes()
        .from_file(path)
        .with_context(|| format!("cannot read {}", path.display()))?;
    Ok(image.layer_data.channel_data.pixels.1)
}

/// The root mean square of the difference over that of the reference.
pub fn relative_rmse(picture: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    let square = |values: &mut dyn Iterator<Item = f32>| values.map(|v| f64::from(v).powi(2)).sum::<f64>();
    let pairs = picture.iter().flatten().zip(reference.iter().flatten());
    (square(&mut pairs.map(|(a, b)| a - b)) / square(&mut reference.iter().flatten().copied())).sqrt()
}
