//! `cargo xtask bench radiosity`: instant radiosity against Mitsuba's path tracer at equal error, and its cost.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result, ensure};
use serde_json::Value;
use tyndall_plot::{Line, slope};

use super::mitsuba::install;
use super::plot::draw;
use super::volumes::measure::read_exr;
use super::volumes::median;
use super::{publish, table};
use crate::driver::{self, Consent};
use crate::process;

/// Instant radiosity against Mitsuba's path tracer at equal error, and its cost against paths and triangles; writes
/// docs/radiosity-speed.md
///
/// Mitsuba renders the same box with `path`, once for long as what both are wrong against, and in turns with ours. Times are those of
/// one more picture in a process that has rendered it before, and CPU times of all threads.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  cargo xtask bench radiosity                    (takes half an hour on two cores)
  cargo xtask bench radiosity --rounds 1 --reference 256

Needs python3 with venv (Mitsuba comes from PyPI); DRJIT_LIBLLVM_PATH names an LLVM of 19 or later, or Debian's is downloaded.")]
pub struct Arguments {
    /// Turns whose medians are taken
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=99))]
    rounds: u32,
    /// Samples a pixel of the picture that both are held against; its noise is taken off
    #[arg(long, default_value_t = 1024, value_parser = clap::value_parser!(u32).range(16..=65536))]
    reference: u32,
    #[command(flatten)]
    consent: Consent,
}

const SCENE: &str = "scenes/cornell.toml";
const SIDE: u32 = 512;
/// How the technique is set.
#[derive(Clone, Copy)]
struct Set {
    paths: u32,
    /// Camera rays a pixel.
    samples: u32,
    /// Side of the squares of pixels that share out the virtual lights.
    interleaving: u32,
    /// Whether clamped light is sought along short rays.
    compensation: bool,
}

/// From fast to good.
const LADDER: [Set; 4] = [set(16, 4, 4, false), set(32, 4, 4, false), set(64, 8, 4, true), set(192, 8, 5, true)];
/// The error that is asked for, and the radiance from which on a pixel shows the lamp [W·sr⁻¹·m⁻²].
const AIM: f64 = 0.05;
const LAMP: f32 = 2.0;
/// Pictures of ours in a process whose times are taken, after the first.
const PICTURES: u32 = 1;
/// Samples of the picture of Mitsuba's that takes turns with ours.
const TURN: u32 = 16;
/// For the costs: the film's side, paths, and rings of the ball's triangles.
const COST_SIDE: u32 = 128;
const PATHS: [u32; 4] = [64, 256, 1024, 2048];
const RINGS: [u32; 4] = [8, 24, 72, 160];

const fn set(paths: u32, samples: u32, interleaving: u32, compensation: bool) -> Set {
    Set { paths, samples, interleaving, compensation }
}

impl Set {
    fn words(self) -> String {
        format!(
            "{}, {}, {}, {}",
            self.paths,
            self.samples,
            self.interleaving,
            if self.compensation { "on" } else { "off" }
        )
    }
}

struct Bench {
    /// The example that renders a scene several times.
    pictures: PathBuf,
    folder: PathBuf,
    rounds: u32,
    python: PathBuf,
    llvm: PathBuf,
}

/// The picture that both are held against, with the variance of its means.
struct Truth {
    mean: Vec<[f32; 3]>,
    variance: Vec<[f32; 3]>,
    /// Columns.
    width: usize,
}

/// Seconds of the clock and of all threads.
#[derive(Clone, Copy, Default)]
struct Cost {
    wall: f64,
    cpu: f64,
}

impl Arguments {
    /// Measures and writes the page.
    pub fn run(&self) -> Result<()> {
        let tyndall = process::build_tyndall()?;
        driver::ensure(&tyndall, self.consent)?;
        let pictures = process::build(&["--example", "pictures"], "examples/pictures")?;
        let scenes = process::build(&["--example", "mitsuba"], "examples/mitsuba")?;
        let folder = process::scratch("radiosity")?;
        let (python, llvm) = (install::python(&[])?, install::llvm()?);
        let bench = Bench { pictures, folder, rounds: self.rounds, python, llvm };
        let mut export = Command::new(scenes);
        export.current_dir(process::root()).args(["export", SCENE]).arg(&bench.folder);
        process::output(export.arg(format!("film.size=[{SIDE},{SIDE}]")))?;
        let truth = bench.truth(self.reference)?;
        let text = format!("{}\n{}", bench.ladder(&truth, self.reference)?, bench.costs()?);
        println!("\n{text}");
        publish("radiosity-speed.md", &text)
    }
}

impl Bench {
    /// A picture of Mitsuba's, kept from run to run.
    fn truth(&self, samples: u32) -> Result<Truth> {
        let name = format!("truth{samples}");
        if !self.folder.join(format!("{name}.json")).exists() {
            println!("Mitsuba, {samples} samples a pixel");
            self.mitsuba(&name, 8, samples / 8, 77)?;
        }
        let mut variance = floats(&self.folder.join(format!("{name}.variance.f32")))?;
        variance.iter_mut().flatten().for_each(|value| *value /= (samples / 8 * 8) as f32);
        Ok(Truth { mean: floats(&self.folder.join(format!("{name}.mean.f32")))?, variance, width: SIDE as usize })
    }

    /// Renders with Mitsuba, and gives what that took without compiling.
    fn mitsuba(&self, name: &str, batches: u32, samples: u32, seed: u32) -> Result<Cost> {
        let output = self.folder.join(name);
        let mut command = Command::new(&self.python);
        command.arg(process::root().join("xtask/mitsuba/render.py")).arg(self.folder.join("scene.json")).arg(&output);
        command.env("DRJIT_LIBLLVM_PATH", &self.llvm);
        command.args(["--variant", "llvm_ad_rgb", "--integrator", "path"]);
        for (name, value) in [("--batches", batches), ("--spp", samples), ("--seed", seed)] {
            command.args([name, &value.to_string()]);
        }
        process::output(&mut command)?;
        let report: Value = serde_json::from_str(&std::fs::read_to_string(output.with_extension("json"))?)?;
        let number = |key: &str| report[key].as_f64().with_context(|| format!("Mitsuba gave no {key}"));
        Ok(Cost { wall: number("seconds")?, cpu: number("cpu_seconds")? })
    }

    /// What one more picture costs, the median of the turns; the picture is ours.exr.
    fn cost(&self, scene: &std::path::Path, side: u32, of: Set, rounds: u32) -> Result<Cost> {
        let Set { paths, samples, interleaving, compensation } = of;
        let settings = [
            format!("film.size=[{side},{side}]"),
            format!("techniques.instant_radiosity.paths={paths}"),
            format!("techniques.instant_radiosity.samples={samples}"),
            format!("techniques.instant_radiosity.interleaving={interleaving}"),
            format!("techniques.instant_radiosity.compensation={}", if compensation { "on" } else { "off" }),
        ];
        let (mut wall, mut cpu) = (Vec::new(), Vec::new());
        for _ in 0..rounds {
            let mut command = process::tyndall(&self.pictures)?;
            command.arg(scene).arg(self.folder.join("ours.exr")).arg(PICTURES.to_string()).args(&settings);
            let report: Value = serde_json::from_str(&process::output(&mut command)?)?;
            let number = |key: &str| report[key].as_f64().with_context(|| format!("the example gave no {key}"));
            wall.push(number("clock")?);
            cpu.push(number("cpu")?);
        }
        Ok(Cost { wall: median(wall), cpu: median(cpu) })
    }

    /// Ours from fast to good, and how long Mitsuba takes for the same error.
    fn ladder(&self, truth: &Truth, reference: u32) -> Result<String> {
        let scene = process::root().join(SCENE);
        let errors = |picture: &[[f32; 3]]| [false, true].map(|room| truth.error(picture, room));
        let mut head = vec!["paths, camera rays, interleaving, short rays".to_owned()];
        for pixels in ["whole picture", "without the lamp"] {
            head.extend([pixels.to_owned(), "Mitsuba's samples for it".into(), "Mitsuba's CPU time over ours".into()]);
        }
        head.insert(1, "CPU s (clock)".into());
        let mut rows = vec![head];
        let (mut lines, mut reached) = ([Vec::new(), Vec::new()], [None, None]);
        let (mut per_sample, mut law) = (Cost::default(), [0.0; 2]);
        for of in LADDER {
            let (mut own, mut wall, mut other) = (Vec::new(), Vec::new(), Vec::new());
            for round in 0..self.rounds {
                let cost = self.cost(&scene, SIDE, of, 1)?;
                own.push(cost.cpu);
                wall.push(cost.wall);
                // Two batches, as one has no variance.
                other.push(self.mitsuba("turn", 2, TURN / 2, round)?);
            }
            let picture = read_exr(&self.folder.join("ours.exr"))?;
            let theirs = floats(&self.folder.join("turn.mean.f32"))?;
            per_sample = Cost {
                wall: median(other.iter().map(|cost| cost.wall)) / f64::from(TURN),
                cpu: median(other.iter().map(|cost| cost.cpu)) / f64::from(TURN),
            };
            law = errors(&theirs);
            let cost = Cost { wall: median(wall), cpu: median(own) };
            let mut row = vec![of.words(), format!("{:.2} ({:.2})", cost.cpu, cost.wall)];
            for (i, error) in errors(&picture).into_iter().enumerate() {
                // The error goes with 1/sqrt(samples).
                let samples = f64::from(TURN) * (law[i] / error).powi(2);
                let ratio = samples * per_sample.cpu / cost.cpu;
                row.extend([format!("{:.2} %", 100.0 * error), format!("{samples:.0}"), format!("{ratio:.2}")]);
                lines[i].push((cost.cpu, error));
                if error <= AIM && reached[i].is_none() {
                    reached[i] = Some((of, cost.cpu, error, ratio));
                }
            }
            println!("{}", row.join(" | "));
            rows.push(row);
        }
        let theirs = |i: usize| {
            let points = [8, 16, 64, 256].map(|n: u32| {
                let samples = f64::from(n);
                (samples * per_sample.cpu, law[i] * (f64::from(TURN) / samples).sqrt())
            });
            Line { name: format!("Mitsuba, {}", ["whole", "without lamp"][i]), points: points.into() }
        };
        let ours =
            |i: usize| Line { name: format!("Tyndall, {}", ["whole", "without lamp"][i]), points: lines[i].clone() };
        draw("radiosity-error.svg", "CPU time [s]", "relative RMSE", &[ours(0), ours(1), theirs(0), theirs(1)])?;
        let mut found = String::new();
        for (i, pixels) in ["the whole picture", "the picture without the lamp"].iter().enumerate() {
            match reached[i] {
                Some((of, cpu, error, ratio)) => writeln!(
                    found,
                    "- {:.0} % of {pixels}: {} paths and {} camera rays, {cpu:.2} s of CPU time at {:.2} %; **{ratio:.2} times as fast** as Mitsuba.",
                    100.0 * AIM,
                    of.paths,
                    of.samples,
                    100.0 * error
                )?,
                None => writeln!(found, "- {:.0} % of {pixels}: not reached by what was tried.", 100.0 * AIM)?,
            }
        }
        Ok(format!(
            "# Instant radiosity: speed\n\nWritten by `cargo xtask bench radiosity`, in one run; turns: {}.\n\n## Against Mitsuba at equal error\n\n\
             `{SCENE}`, {SIDE} × {SIDE}, all orders, on the CPU driver, against Mitsuba's `path` (`llvm_ad_rgb`), on the same cores.\n\
             Both are held against {reference} samples a pixel of Mitsuba's, whose noise is taken off: relative RMSE over all pixels, and over \
             those\nwith no pixel of {LAMP} W/sr/m² or more among their neighbours, which leaves out the lamp. Times are CPU seconds of all threads, as other load stretches the \
             clock's, and of both\nthose of one more picture in a process that is open, without writing the file: ours with the walk on the host; \
             Mitsuba's is\n{:.3} CPU s a sample a pixel.\nMitsuba's samples for an error follow from its error at {TURN} ({:.2} % and {:.2} %) by \
             1/√samples. More than 1 is faster than Mitsuba.\n\n{found}\n{}\n![error against time](pictures/radiosity-error.svg)\n",
            self.rounds,
            per_sample.cpu,
            100.0 * law[0],
            100.0 * law[1],
            table(&rows)
        ))
    }

    /// Cost against paths and triangles.
    fn costs(&self) -> Result<String> {
        println!("costs");
        let scene = process::root().join(SCENE);
        let mut paths = Vec::new();
        for count in PATHS {
            paths.push((f64::from(count), self.cost(&scene, COST_SIDE, set(count, 16, 1, true), self.rounds)?.cpu));
            println!("  {count} paths: {:.2} s", paths[paths.len() - 1].1);
        }
        let mut triangles = Vec::new();
        for rings in RINGS {
            let (path, count) = self.ball(rings)?;
            triangles.push((f64::from(count), self.cost(&path, COST_SIDE, set(64, 16, 1, true), self.rounds)?.cpu));
            println!("  {count} triangles: {:.2} s", triangles[triangles.len() - 1].1);
        }
        let line = |name: &str, points: &Vec<(f64, f64)>| Line { name: name.into(), points: points.clone() };
        draw("radiosity-paths.svg", "paths", "CPU time [s]", &[line("16 camera rays", &paths)])?;
        draw("radiosity-triangles.svg", "triangles", "CPU time [s]", &[line("64 paths", &triangles)])?;
        let rows = |head: &str, points: &[(f64, f64)]| {
            let mut rows = vec![vec![head.to_owned(), "CPU s".to_owned()]];
            rows.extend(points.iter().map(|(x, y)| vec![format!("{x:.0}"), format!("{y:.2}")]));
            table(&rows)
        };
        ensure!(paths.iter().chain(&triangles).all(|point| point.1 > 0.0), "times are lost in those of starting");
        let last = &paths[paths.len() - 3..];
        Ok(format!(
            "## Cost\n\nAt {COST_SIDE} × {COST_SIDE}. The box with 16 camera rays a pixel, against paths: an exponent of {:.2} over the last three, below \
             which camera\nrays are most of it. And with a ball of ever more triangles in place of the short block, 64 paths: an exponent of {:.2}, as a \
             hierarchy's\ndepth goes with the logarithm.\n\n{}\n{}\n![against paths](pictures/radiosity-paths.svg) ![against triangles](pictures/radiosity-triangles.svg)\n",
            slope(last).0,
            slope(&triangles).0,
            rows("paths", &paths),
            rows("triangles", &triangles)
        ))
    }

    /// The box with a ball of so many rings in place of the short block, and how many triangles the ball has.
    fn ball(&self, rings: u32) -> Result<(PathBuf, u32)> {
        let mut text = String::new();
        let columns = 2 * rings;
        for i in 0..=rings {
            let polar = std::f64::consts::PI * f64::from(i) / f64::from(rings);
            for j in 0..columns {
                let turn = std::f64::consts::TAU * f64::from(j) / f64::from(columns);
                let (x, y, z) = (polar.sin() * turn.cos(), polar.cos(), polar.sin() * turn.sin());
                writeln!(text, "v {:.6} {:.6} {:.6}", 0.186 + 0.09 * x, 0.09 + 0.09 * y, 0.169 + 0.09 * z)?;
            }
        }
        for i in 0..rings {
            for j in 0..columns {
                let [a, b] = [i * columns + j + 1, i * columns + (j + 1) % columns + 1];
                writeln!(text, "f {a} {b} {}\nf {a} {} {}", b + columns, b + columns, a + columns)?;
            }
        }
        std::fs::write(self.folder.join(format!("ball{rings}.obj")), text)?;
        let box_ = std::fs::read_to_string(process::root().join(SCENE))?;
        let (before, after) = box_.split_once("[surfaces.short_block]").context("the box has no short block")?;
        let (_, after) = after.split_once("[surfaces.tall_block]").context("the box has no tall block")?;
        let ball = format!("[surfaces.ball]\nmaterial = \"white\"\nshape.mesh.file = \"ball{rings}.obj\"\n");
        let path = self.folder.join(format!("ball{rings}.toml"));
        std::fs::write(&path, format!("{before}{ball}\n[surfaces.tall_block]{after}"))?;
        Ok((path, 2 * rings * columns))
    }
}

impl Truth {
    /// A picture's relative RMSE, the truth's noise taken off; over all pixels, or over those that do not show the lamp.
    fn error(&self, picture: &[[f32; 3]], room: bool) -> f64 {
        let (mut error, mut power) = (0.0, 0.0);
        for (i, ((value, mean), variance)) in picture.iter().zip(&self.mean).zip(&self.variance).enumerate() {
            if room && self.beside_lamp(i) {
                continue;
            }
            for c in 0..3 {
                error += f64::from(value[c] - mean[c]).powi(2) - f64::from(variance[c]);
                power += f64::from(mean[c]).powi(2) - f64::from(variance[c]);
            }
        }
        (error.max(0.0) / power).sqrt()
    }

    /// Whether a pixel or one beside it shows the lamp, whose edges are in pixels that are hardly bright, too.
    fn beside_lamp(&self, pixel: usize) -> bool {
        let (x, y) = (pixel % self.width, pixel / self.width);
        let beside = |at: usize, end: usize| at.saturating_sub(1)..(at + 2).min(end);
        let rows = beside(y, self.mean.len() / self.width);
        let mut near = rows.flat_map(|v| beside(x, self.width).map(move |u| v * self.width + u));
        near.any(|i| self.mean[i].iter().any(|&value| value >= LAMP))
    }
}

/// Pixels as render.py writes them.
fn floats(path: &std::path::Path) -> Result<Vec<[f32; 3]>> {
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    let float = |bytes: &[u8]| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    Ok(bytes.chunks_exact(12).map(|pixel| [0, 4, 8].map(|at| float(&pixel[at..]))).collect())
}

#[cfg(test)]
mod test {
    use super::*;

    /// Noise of the truth is no error, and the lamp counts only where it is asked for.
    #[test]
    fn errors() {
        let truth = Truth {
            mean: vec![[1.0; 3], [1.0; 3], [20.0; 3]],
            variance: vec![[0.04; 3], [0.0; 3], [0.0; 3]],
            width: 3,
        };
        assert!(truth.error(&[[1.2; 3], [4.0; 3], [25.0; 3]], true) < 1e-3);
        let whole = (34.0f64 / 401.96).sqrt();
        assert!((truth.error(&[[1.2; 3], [4.0; 3], [25.0; 3]], false) - whole).abs() < 1e-3);
        assert!(truth.error(&[[1.5; 3], [1.0; 3], [20.0; 3]], true) > 0.4);
    }
}
