//! `cargo xtask bench fourier-opacity`: what maps of transmittance cost and gain.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use tyndall_plot::{Line, slope};

use super::plot::draw;
use super::volumes::measure::{Run, Tyndall, read_exr, relative_rmse};
use super::volumes::median;
use super::{publish, table};
use crate::driver::{self, Consent};
use crate::process;

/// Speed of maps of transmittance: against slices, against the inner march, by texels and by particles; writes docs/fourier-opacity.md
#[derive(clap::Args)]
pub struct Arguments {
    /// Turns whose medians are taken
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=99))]
    rounds: u32,
    #[command(flatten)]
    consent: Consent,
}

const SCENE: &str = "scenes/plume.toml";
const SKY: &str = "scenes/sky.toml";
const DEPOSIT: &str = "transmittance.deposit";
const SIDES: [u32; 4] = [128, 256, 512, 1024];
const BODIES: &str = "transmittance.bodies";
const NUMBERS: [u32; 4] = [1_000, 10_000, 100_000, 1_000_000];

struct Bench {
    tyndall: Tyndall,
    folder: PathBuf,
    rounds: u32,
}

impl Bench {
    /// Runs of a scene, absolute or from the project's root, with each of these settings, which take turns.
    fn runs(&self, scene: impl AsRef<Path>, settings: &[Vec<String>]) -> Result<Vec<Vec<Run>>> {
        let scene = process::root().join(scene);
        let mut runs = vec![Vec::new(); settings.len()];
        for _ in 0..self.rounds {
            for (number, (settings, runs)) in settings.iter().zip(&mut runs).enumerate() {
                let picture = self.folder.join(format!("{number}.exr"));
                runs.push(self.tyndall.render(&scene, settings, &picture)?);
            }
        }
        Ok(runs)
    }
}

/// Settings of the technique, on a film of 320 x 240.
fn maps(settings: &str) -> Vec<String> {
    let film = "film.size=[320,240]".to_owned();
    let own = settings.split(' ').map(|setting| format!("techniques.transmittance.{setting}"));
    std::iter::once(film).chain(own).collect()
}

fn pass(runs: &[Run], name: &str) -> f64 {
    median(runs.iter().map(|run| run.passes.get(name).copied().unwrap_or(f64::NAN)))
}

impl Arguments {
    /// Measures, and writes the page.
    pub fn run(&self) -> Result<()> {
        let tyndall = process::build_tyndall()?;
        driver::ensure(&tyndall, self.consent)?;
        let folder = process::scratch("fourier-opacity")?;
        let bench = Bench { tyndall: Tyndall(tyndall), folder, rounds: self.rounds };
        let (against, adapter) = slices(&bench)?;
        let text = format!(
            "# Maps of transmittance: speed\n\nWritten by `cargo xtask bench fourier-opacity`, on {adapter}: the plume at 320 x 240, medians \
             of {} turns.\n\n{against}\n{}\n{}\n{}",
            self.rounds,
            inner_march(&bench)?,
            texels(&bench)?,
            particles(&bench)?
        );
        publish("fourier-opacity.md", &text)
    }
}

/// Fourier's coefficients against as many slices, on maps of 512 x 512 texels.
fn slices(bench: &Bench) -> Result<(String, String)> {
    let with = |basis: &str| maps(&format!("basis={basis} coefficients=7 resolution=512 depths=light"));
    let runs = bench.runs(SCENE, &[with("fourier"), with("slices")])?;
    let mut rows = vec![["pass", "Fourier", "slices", "ratio"].map(String::from).to_vec()];
    for name in [DEPOSIT, "march"] {
        let [fourier, slices] = [0, 1].map(|i| pass(&runs[i], name));
        rows.push(vec![
            name.into(),
            format!("{:.0} ms", fourier * 1e3),
            format!("{:.0} ms", slices * 1e3),
            format!("{:.2}", fourier / slices),
        ]);
    }
    let adapter = runs[0].first().context("no turn")?.adapter.clone();
    Ok((format!("## Against slices\n\nSeven numbers each, 512 x 512 texels.\n\n{}", table(&rows)), adapter))
}

/// Pictures with maps against the inner march, each against a march at fine steps: of the plume, and under a sky.
fn inner_march(bench: &Bench) -> Result<String> {
    let plume = [
        ("7 of Fourier's, 128", "coefficients=7 resolution=128"),
        ("8 cosines, 128", "basis=cosine coefficients=8 resolution=128"),
        ("15 of Fourier's, 256", "coefficients=15 resolution=256"),
    ];
    let sky = [
        ("8 cosines, 64", "basis=cosine coefficients=8 resolution=64"),
        ("4 cosines, 32", "basis=cosine coefficients=4 resolution=32"),
    ];
    Ok(format!(
        "## Against the inner march\n\nErrors are against light rays marched in fine steps. The light's part is what the passes take \
         beyond a march without any light, whose gain is what no map can exceed.\n\nThe plume in the sun, against steps of a quarter of a voxel:\n\n{}\n\
         `{SKY}`, 16 directions, against half a voxel:\n\n{}",
        against_march(bench, SCENE, "0.25", &plume)?,
        against_march(bench, SKY, "0.5", &sky)?
    ))
}

fn against_march(bench: &Bench, scene: &str, fine: &str, looked_up: &[(&str, &str)]) -> Result<String> {
    let film = "film.size=[320,240]".to_owned();
    let march = |setting: String| vec![film.clone(), format!("techniques.march.{setting}")];
    let names = ["inner march, 2 voxels", "inner march, 1 voxel"].into_iter().chain(looked_up.iter().map(|of| of.0));
    let names: Vec<_> = names.collect();
    let mut settings = vec![march("light_step=2".into()), march("light_step=1".into())];
    settings.extend(looked_up.iter().map(|of| maps(of.1)));
    settings.extend([march("model=emission".into()), march(format!("light_step={fine}"))]);
    let runs = bench.runs(scene, &settings)?;
    let last = |i: usize| read_exr(&bench.folder.join(format!("{i}.exr")));
    let truth = last(settings.len() - 1)?;
    let all = |runs: &[Run]| median(runs.iter().map(|run| run.pass));
    let unlit = all(&runs[names.len()]);
    let mut rows = vec![
        ["light", "all passes", "gain over 2 voxels", "of the light's part", "relative RMSE"]
            .map(String::from)
            .to_vec(),
    ];
    for (i, name) in names.iter().enumerate() {
        rows.push(vec![
            (*name).into(),
            format!("{:.0} ms", all(&runs[i]) * 1e3),
            format!("{:.1}", all(&runs[0]) / all(&runs[i])),
            format!("{:.1}", (all(&runs[0]) - unlit) / (all(&runs[i]) - unlit)),
            format!("{:.2} %", relative_rmse(&last(i)?, &truth) * 100.0),
        ]);
    }
    let bound = format!("{:.1}", all(&runs[0]) / unlit);
    rows.push(vec!["no light".into(), format!("{:.0} ms", unlit * 1e3), bound, String::new(), String::new()]);
    Ok(table(&rows))
}

/// The deposit by texels.
fn texels(bench: &Bench) -> Result<String> {
    let settings = SIDES.map(|side| maps(&format!("resolution={side}")));
    let runs = bench.runs(SCENE, &settings)?;
    let points: Vec<_> =
        SIDES.iter().zip(&runs).map(|(&side, runs)| (f64::from(side).powi(2), pass(runs, DEPOSIT) * 1e3)).collect();
    let exponent = slope(&points).0;
    let line = Line { name: "deposit".into(), points };
    draw("fourier-texels.svg", "texels", "deposit [ms]", &[line])?;
    Ok(format!(
        "## By texels\n\nThe deposit takes time as the {exponent:.2}th power of the texels.\n\n![texels](pictures/fourier-texels.svg)\n"
    ))
}

/// Random particles in a cube of 1 m over a floor, lit from above: what drawing them takes by their number.
fn particles(bench: &Bench) -> Result<String> {
    let scene = bench.folder.join("balls.toml");
    let text = "camera = { position = [0, 0.3, 3], target = [0, 0, 0] }\nfilm.size = [64, 64]\ntechniques.march = {}\n\
                lights.sun.directional = { direction = [0.2, -1, 0.1], irradiance = 3 }\n\
                surfaces.floor.shape.quad = { corner = [-1, -0.6, 1], edges = [[2, 0, 0], [0, 0, -2]] }\n\
                media.balls = { density.particles.file = \"balls.npy\", optics.coefficients.sigma_a = 1 }\n\
                techniques.transmittance = { resolution = 256, depths = \"light\" }\n";
    std::fs::write(&scene, text).with_context(|| format!("cannot write {}", scene.display()))?;
    let mut points = Vec::new();
    let mut rows = vec![["particles", "drawing", "a particle"].map(String::from).to_vec()];
    for number in NUMBERS {
        std::fs::write(bench.folder.join("balls.npy"), balls(number)).context("cannot write balls.npy")?;
        let runs = bench.runs(&scene, &[Vec::new()])?;
        let seconds = pass(&runs[0], BODIES);
        points.push((f64::from(number), seconds * 1e3));
        rows.push(vec![
            number.to_string(),
            format!("{:.1} ms", seconds * 1e3),
            format!("{:.2} \u{b5}s", seconds * 1e6 / f64::from(number)),
        ]);
    }
    let exponent = slope(&points[1..]).0;
    draw("fourier-particles.svg", "particles", "drawing [ms]", &[Line { name: "drawing".into(), points }])?;
    Ok(format!(
        "## By particles\n\nRandom balls of 3 texels across in one light, seven of Fourier's numbers, 256 x 256 texels, one range of \
         depths. From 10,000 on drawing takes time as the {exponent:.2}th power of their number.\n\n{}\n\
         ![particles](pictures/fourier-particles.svg)\n",
        table(&rows)
    ))
}

/// NumPy's file of so many rows x, y, z, radius, opacity.
fn balls(number: u32) -> Vec<u8> {
    let mut header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({number}, 5), }}");
    // Magic, version and length take ten bytes; data begins at a multiple of 64.
    while !(header.len() + 11).is_multiple_of(64) {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    // Multiples of irrational numbers fill the cube evenly.
    let share = |i: u32, by: f64| (f64::from(i) * by).fract() as f32 - 0.5;
    for i in 0..number {
        let values = [share(i, 0.819_172_513), share(i, 0.671_043_607), share(i, 0.549_700_478), 0.006, 0.01];
        bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }
    bytes
}
