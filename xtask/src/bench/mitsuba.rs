pub(super) mod install;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;

use super::{accuracy, publish, table};
use crate::process;

/// The reference against Mitsuba 3, an independent renderer; writes docs/mitsuba.md
///
/// Mitsuba comes from PyPI into a virtual environment of its own. Both render the same scenes with all orders of
/// scattering; the z-test must find no difference beyond their noise, and must find one where a scene was changed on purpose.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  cargo xtask bench mitsuba                 (needs python3 with venv; takes some minutes)
  cargo xtask bench mitsuba --effort 4      (4 times the samples: half the noise)
  cargo xtask bench mitsuba --only brain    (the scenes of that name; the page stays as it is)
  cargo xtask bench mitsuba --variant llvm_ad_rgb")]
pub struct Arguments {
    /// Samples, in times of the usual
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    effort: u32,
    /// Mitsuba's variant; for llvm_ad_rgb, DRJIT_LIBLLVM_PATH names an LLVM of 19 or later, or Debian's is downloaded
    #[arg(long, default_value = "scalar_rgb")]
    variant: String,
    /// Only scenes whose name has this in it; the page is not written
    #[arg(long, value_name = "NAME")]
    only: Option<String>,
}

/// Both renderers take turns so many times, for the ratio of their speeds.
const ROUNDS: u32 = 3;
/// Independent pictures of Mitsuba's a round; the spread of all tells their variance.
const BATCHES: u32 = 8;

/// A scene with how it is rendered.
struct Case {
    name: &'static str,
    scene: &'static str,
    /// Fields that are set anew, PATH=VALUE.
    settings: &'static [&'static str],
    /// The field that names a volume that is not shipped, and its file.
    data: Option<(&'static str, &'static str)>,
    integrator: &'static str,
    /// Samples a pixel, a round.
    samples: [u32; 2],
    /// A change of our scene alone that the z-test must find.
    change: &'static str,
}

const CASES: [Case; 7] = [
    Case {
        name: "homogeneous slab, sun and sky",
        scene: "xtask/mitsuba/slab.toml",
        settings: &[],
        data: None,
        // Mitsuba's own for media whose extinction differs among the channels.
        integrator: "volpathmis",
        samples: [512, 512],
        change: "media.slab.optics.coefficients.phase.hg.g=0.48",
    },
    Case {
        name: "plume with sun",
        scene: "scenes/plume.toml",
        settings: &["film.size=[160,120]"],
        data: None,
        integrator: "volpath",
        samples: [1024, 1024],
        change: "media.plume.optics.coefficients.phase.hg.g=0.25",
    },
    Case {
        name: "emissive plume",
        scene: "xtask/mitsuba/ember.toml",
        settings: &[],
        data: None,
        integrator: "volpath",
        samples: [512, 512],
        change: "media.plume.optics.coefficients.emission=[21,8.4,2.1]",
    },
    Case {
        name: "plume under a sky",
        scene: "scenes/sky.toml",
        settings: &["film.size=[96,120]", "camera.fov=16", "lights.sky.environment.rotate=30"],
        data: None,
        integrator: "volpath",
        samples: [256, 256],
        change: "lights.sky.environment.rotate=33",
    },
    Case {
        name: "brain in the sun",
        scene: "xtask/mitsuba/brain.toml",
        settings: &[],
        data: Some(("media.brain.density.grid.file", "mni152_t1_1mm.nii.gz")),
        integrator: "volpath",
        samples: [256, 256],
        change: "media.brain.optics.coefficients.phase.hg.g=0.35",
    },
    Case {
        name: "Cornell box",
        scene: "scenes/cornell.toml",
        settings: &["film.size=[128,128]"],
        data: None,
        integrator: "path",
        samples: [128, 128],
        change: "materials.white.lambert.reflectance=[0.73,0.7358,0.74]",
    },
    Case {
        name: "mirror and glass",
        scene: "xtask/mitsuba/mirror-glass.toml",
        settings: &[],
        data: None,
        integrator: "path",
        samples: [256, 256],
        change: "materials.glass.dielectric.ior=1.45",
    },
];

impl Arguments {
    /// Renders all cases with both, and compares.
    pub fn run(&self) -> Result<()> {
        let tyndall = process::build_tyndall()?;
        let scenes = process::build(&["--example", "mitsuba"], "examples/mitsuba")?;
        let python = install::python(&[])?;
        let llvm = if self.variant.starts_with("llvm") { Some(install::llvm()?) } else { None };
        let head = [
            "scene",
            "samples ours, Mitsuba's",
            "relative RMSE",
            "noise of both",
            "largest \\|z\\|",
            "limit",
            "mean z²",
            "z-test",
            "changed scene",
            "paths/s over Mitsuba's",
        ];
        let mut rows = vec![head.map(String::from).to_vec()];
        let mut failed = Vec::new();
        let mut version = String::new();
        let wanted = |case: &&Case| self.only.as_ref().is_none_or(|only| case.name.contains(only.as_str()));
        let mut skipped = Vec::new();
        for case in CASES.iter().filter(wanted) {
            let mut settings: Vec<String> = case.settings.iter().map(ToString::to_string).collect();
            if let Some((field, file)) = case.data {
                let Some(path) = accuracy::data(file) else {
                    println!(
                        "{}: SKIPPED, as {file} is not in the folder that TYNDALL_DATA names, nor in ../shared/data",
                        case.name
                    );
                    skipped.push(case.name);
                    continue;
                };
                settings.push(format!("{field}={}", path.display()));
            }
            println!("{} ({})", case.name, case.scene);
            let bench = Bench {
                case,
                arguments: self,
                tyndall: &tyndall,
                python: &python,
                scenes: &scenes,
                llvm: llvm.as_deref(),
                settings,
                folder: process::scratch(&format!("mitsuba/{}", case.name))?,
            };
            let found = bench.run()?;
            let test = &found.same;
            println!(
                "  z-test {}: largest |z| {:.2} at ({}, {}), limit {:.2}, mean z^2 {:.3}; the changed scene: |z| {:.2}",
                if test.pass { "passed" } else { "FAILED" },
                test.max_z,
                test.x,
                test.y,
                test.threshold,
                test.mean_z_squared,
                found.changed.max_z
            );
            if !test.pass {
                failed.push(format!("{}: the pictures differ beyond their noise", case.name));
            }
            if found.changed.pass {
                failed.push(format!("{}: {} was not noticed", case.name, case.change));
            }
            let word = |pass| if pass { "passed" } else { "failed" };
            rows.push(vec![
                format!("[{}](../{})", case.name, case.scene),
                format!("{}, {}", found.samples[0], found.samples[1]),
                format!("{:.3} %", test.relative_rmse * 100.0),
                format!("{:.3} %", test.noise * 100.0),
                format!("{:.2}", test.max_z),
                format!("{:.2}", test.threshold),
                format!("{:.3}", test.mean_z_squared),
                word(test.pass).into(),
                format!("{} at \\|z\\| = {:.1}: `{}`", word(found.changed.pass), found.changed.max_z, setting(case)),
                format!("{:.2}", found.speed),
            ]);
            version = found.version;
        }
        ensure!(
            rows.len() > 1 || !skipped.is_empty(),
            "no scene has that name; accepted: {}",
            CASES.map(|case| case.name).join(", ")
        );
        let text = page(&version, &self.variant, &rows);
        println!("\n{text}");
        // A page with all scenes is not replaced by one with fewer.
        if self.only.is_none() && skipped.is_empty() {
            publish("mitsuba.md", &text)?;
        }
        if failed.is_empty() { Ok(()) } else { bail!("{}", failed.join("\n")) }
    }
}

/// The change's last field and value.
fn setting(case: &Case) -> &str {
    ["coefficients.", "lights.", "materials."]
        .iter()
        .find_map(|part| case.change.split_once(part))
        .map_or(case.change, |(_, setting)| setting)
}

fn page(version: &str, variant: &str, rows: &[Vec<String>]) -> String {
    format!(
        "# The reference against Mitsuba 3\n\n\
         `tyndall reference` and [Mitsuba](https://mitsuba-renderer.org) {version} (`{variant}`) render the same scenes, with \
         all orders of scattering.\nBoth estimate the same radiance without bias, so that what differs is noise: the z-test \
         holds the difference of every\nblock of 8 × 8 pixels and channel against the noise of both, Šidák-corrected to a \
         probability of 1 % for a false alarm.\nThe last but one column is the same test with a scene that was changed for us \
         alone: there it must fail.\n\n\
         Mitsuba's Russian roulette is off but for `path`. In `volpathmis`, its integrator for extinction that differs among channels, it \
         loses light:\nof a white slab (σ_s = 5 m⁻¹, g = 0.5) in a white environment of radiance 1 it shows 0.9973 ± 0.0002 with \
         roulette,\n1.0000 ± 0.0001 without. `volpath` shows 1.0001 ± 0.0002 with roulette.\n\n\
         Mitsuba has no emissive media. By Kirchhoff's law a medium with emission B·σ_a in an environment of radiance B is \
         in\nequilibrium, and looks B everywhere: so its emission alone gives B less what Mitsuba shows of the same medium, \
         not\nglowing, in an environment of radiance B. The view\nof that scene is into the plume's core. With the whole plume in view the test failed in one block at its rim, where Mitsuba's\npaths collide so seldom that their variance is not known (|z| 7.3; 4.1 with four times the samples): rims are not compared.\n\n\
         Both maps of a sky are bilinear in longitude and latitude, but Mitsuba's outermost rows stand at the poles and ours half \
         a row\nwithin. It is given a map of 2h + 1 rows, at our rows' centres, in the middle between them and at the poles: that \
         is the same\nfunction of direction. Each samples its map in a way of its own; both are without bias.\n\n\
         Rough surfaces are not compared: Mitsuba masks facets by Smith's separable G, glTF's model by the height-correlated \
         one.\n\n\
         The speeds were measured in turns in one run; ours is of the `dev` profile with the time to load the scene. Made \
         by\n`cargo xtask bench mitsuba`.\n\n{}",
        table(rows)
    )
}

/// A comparison's result.
#[derive(Debug)]
struct Comparison {
    pass: bool,
    max_z: f64,
    threshold: f64,
    mean_z_squared: f64,
    x: u64,
    y: u64,
    relative_rmse: f64,
    /// The relative RMSE that the noise of both pictures would cause.
    noise: f64,
}

/// What a case came to.
struct Found {
    same: Comparison,
    changed: Comparison,
    samples: [u32; 2],
    /// Our paths per second over Mitsuba's: the median of the rounds.
    speed: f64,
    version: String,
}

struct Bench<'a> {
    case: &'a Case,
    arguments: &'a Arguments,
    tyndall: &'a Path,
    python: &'a Path,
    /// The program that takes scenes to Mitsuba.
    scenes: &'a Path,
    llvm: Option<&'a Path>,
    settings: Vec<String>,
    folder: PathBuf,
}

impl Bench<'_> {
    fn run(&self) -> Result<Found> {
        let settings: Vec<_> = self.settings.iter().map(String::as_str).collect();
        self.convert("export", &[self.case.scene.into(), self.folder.clone()], &settings)?;
        let [ours, theirs, changed] = ["tyndall.exr", "mitsuba.exr", "changed.exr"].map(|name| self.folder.join(name));
        for file in [&ours, &changed] {
            if file.exists() {
                std::fs::remove_file(file)?;
            }
        }
        let [our_samples, their_samples] = self.case.samples.map(|samples| samples * self.arguments.effort);
        let (mut speeds, mut rounds, mut version) = (Vec::new(), Vec::new(), String::new());
        for round in 0..ROUNDS {
            let begun = Instant::now();
            self.reference(&ours, our_samples * (round + 1), None)?;
            let our_speed = f64::from(our_samples) / begun.elapsed().as_secs_f64();
            let report = self.mitsuba(their_samples, round)?;
            version = report["version"].as_str().unwrap_or_default().into();
            let seconds = report["seconds"].as_f64().context("Mitsuba gave no time")?;
            let their_speed = f64::from(their_samples) / seconds;
            println!("  round {}: {our_speed:.1} samples a pixel and second, Mitsuba {their_speed:.1}", round + 1);
            rounds.push(format!("round{round}"));
            speeds.push(our_speed / their_speed);
        }
        speeds.sort_by(f64::total_cmp);
        let samples = [our_samples, their_samples].map(|samples| samples * ROUNDS);
        let rounds: Vec<_> = rounds.iter().map(String::as_str).collect();
        self.convert("import", &[self.folder.clone(), theirs.clone()], &rounds)?;
        self.reference(&changed, samples[0], Some(self.case.change))?;
        Ok(Found {
            same: self.compare(&ours, &theirs)?,
            changed: self.compare(&changed, &theirs)?,
            samples,
            speed: speeds[speeds.len() / 2],
            version,
        })
    }

    /// Renders, or continues, our picture.
    fn reference(&self, output: &Path, samples: u32, change: Option<&str>) -> Result<()> {
        let mut command = process::tyndall(self.tyndall)?;
        command.args(["reference", self.case.scene, "--samples", &samples.to_string(), "-o"]).arg(output);
        // What is set last counts.
        command.args(self.settings.iter().map(String::as_str).chain(change).map(|setting| format!("--set={setting}")));
        process::output(&mut command).map(drop)
    }

    /// Takes the scene to Mitsuba, or its pictures back.
    fn convert(&self, verb: &str, paths: &[PathBuf], words: &[&str]) -> Result<()> {
        let mut command = Command::new(self.scenes);
        command.current_dir(process::root());
        process::output(command.arg(verb).args(paths).args(words)).map(drop)
    }

    /// Renders a round of Mitsuba's and gives its report.
    fn mitsuba(&self, samples: u32, round: u32) -> Result<Value> {
        let output = self.folder.join(format!("round{round}"));
        let mut command = Command::new(self.python);
        command.arg(process::root().join("xtask/mitsuba/render.py")).arg(self.folder.join("scene.json")).arg(&output);
        command.envs(self.llvm.map(|path| ("DRJIT_LIBLLVM_PATH", path)));
        command.args(["--variant", &self.arguments.variant, "--integrator", self.case.integrator]);
        for (name, value) in [("--batches", BATCHES), ("--spp", samples / BATCHES), ("--seed", round)] {
            command.args([name, &value.to_string()]);
        }
        process::output(&mut command)?;
        Ok(serde_json::from_str(&std::fs::read_to_string(output.with_extension("json"))?)?)
    }

    /// Holds a picture of ours against Mitsuba's.
    fn compare(&self, ours: &Path, theirs: &Path) -> Result<Comparison> {
        let mut command = process::tyndall(self.tyndall)?;
        let text = process::output(command.arg("compare").arg(ours).arg(theirs).arg("--json"))?;
        let report: Value = serde_json::from_str(&text)?;
        let number = |pointer: &str| report.pointer(pointer).and_then(Value::as_f64);
        let needed = |pointer: &str| number(pointer).with_context(|| format!("`tyndall compare` gives no {pointer}"));
        Ok(Comparison {
            pass: report.pointer("/z_test/pass").and_then(Value::as_bool).context("there was no z-test")?,
            // JSON has no infinity.
            max_z: number("/z_test/max_z").unwrap_or(f64::INFINITY),
            threshold: needed("/z_test/threshold")?,
            mean_z_squared: number("/z_test/mean_z_squared").unwrap_or(f64::INFINITY),
            x: needed("/z_test/x")? as u64,
            y: needed("/z_test/y")? as u64,
            relative_rmse: needed("/linear/relative_rmse")?,
            noise: needed("/linear/noise")?.hypot(needed("/linear/reference_noise")?),
        })
    }
}
