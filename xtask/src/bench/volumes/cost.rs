//! Cost against the volume's size, the film's and the step; a sparse cloud's memory.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result};
use tyndall_plot::{Line, slope};

use super::super::{plot::draw, table};
use super::{Bench, median};
use crate::process;

/// Voxels along a side of the clouds, pixels along the film's long side, steps in voxels.
const SIDES: [u32; 4] = [64, 128, 256, 512];
const WIDTHS: [u32; 4] = [160, 320, 640, 1280];
const STEPS: [f64; 5] = [4.0, 2.0, 1.0, 0.5, 0.25];
/// What stays where another varies.
const SIDE: u32 = 256;
/// The cloud whose memory is measured, and how much it may take [bytes].
const LARGE: u32 = 1024;
const MOST: u64 = 1_000_000_000;

const MODELS: [(&str, bool); 3] = [("emission", true), ("emission", false), ("single_scattering", true)];

/// A cloud of xtask/volumes/cloud.py, and the share of its voxels that are not 0.
pub fn cloud(bench: &Bench, side: u32) -> Result<(PathBuf, f64)> {
    let (path, note) = (bench.folder.join(format!("cloud{side}.vdb")), bench.folder.join(format!("cloud{side}.txt")));
    if !path.exists() || !note.exists() {
        println!("writing a cloud of {side}^3");
        // Debian's OpenVDB is there for Debian's Python alone.
        let mut command = Command::new(if cfg!(target_os = "linux") { "/usr/bin/python3" } else { "python3" });
        command.arg(process::root().join("xtask/volumes/cloud.py")).arg(&path).args(["--voxels", &side.to_string()]);
        let share =
            process::output(&mut command).context("OpenVDB's Python module is needed (Debian: python3-openvdb)")?;
        std::fs::write(&note, share)?;
    }
    let share = std::fs::read_to_string(&note)?.trim().parse().context("cloud.py printed no share")?;
    Ok((path, share))
}

/// Measures.
pub fn section(bench: &Bench) -> Result<String> {
    let scene = process::root().join("xtask/volumes/cloud.toml");
    let picture = bench.folder.join("cost.exr");
    let mut adapter = String::new();
    let mut time = |(model, skipping): (&str, bool), side: u32, width: u32, step: f64| -> Result<f64> {
        let (file, _) = cloud(bench, side)?;
        let settings = [
            format!("media.cloud.density.grid.file={}", file.display()),
            format!("film.size=[{width},{}]", width * 3 / 4),
            format!("techniques.march.model={model}"),
            format!("techniques.march.empty_space_skipping={}", if skipping { "on" } else { "off" }),
            format!("techniques.march.step={step}"),
            format!("techniques.march.light_step={}", 2.0 * step),
        ];
        let runs = (0..bench.rounds).map(|_| bench.tyndall.render(&scene, &settings, &picture));
        let runs = runs.collect::<Result<Vec<_>>>()?;
        adapter.clone_from(&runs[0].adapter);
        Ok(median(runs.iter().map(|run| run.pass)))
    };
    let mut rows =
        vec![["model", "against voxels along a side", "against pixels", "against 1/step"].map(String::from).to_vec()];
    let mut plots: [Vec<Line>; 3] = Default::default();
    for model in MODELS {
        let name = format!("{}{}", model.0.replace('_', " "), if model.1 { "" } else { ", no skipping" });
        println!("{name}");
        let mut row = vec![name.clone()];
        let sizes = SIDES.iter().map(|&side| Ok((f64::from(side), time(model, side, 320, 1.0)?)));
        let sizes = sizes.collect::<Result<Vec<_>>>()?;
        let films = WIDTHS.iter().map(|&width| Ok((f64::from(width * width * 3 / 4), time(model, SIDE, width, 1.0)?)));
        let films = films.collect::<Result<Vec<_>>>()?;
        let steps = STEPS.iter().map(|&step| Ok((1.0 / step, time(model, SIDE, 320, step)?)));
        let steps = steps.collect::<Result<Vec<_>>>()?;
        for (plot, points) in plots.iter_mut().zip([sizes, films, steps]) {
            row.push(format!("{:.2}", slope(&points).0));
            plot.push(Line { name: name.clone(), points });
        }
        rows.push(row);
    }
    for ((name, x), lines) in
        [("cost-volume.svg", "voxels along a side"), ("cost-film.svg", "pixels"), ("cost-step.svg", "1/step [1/voxel]")]
            .iter()
            .zip(&plots)
    {
        draw(name, x, "pass [s]", lines)?;
    }
    println!("rendering the cloud of {LARGE}^3");
    let (file, share) = cloud(bench, LARGE)?;
    let mut large = vec![["model", "peak memory", "under 1 GB", "pass", "command", "CPU s"].map(String::from).to_vec()];
    for model in ["emission", "single_scattering"] {
        let settings = [
            format!("media.cloud.density.grid.file={}", file.display()),
            "film.size=[640,480]".to_owned(),
            format!("techniques.march.model={model}"),
        ];
        let run = bench.tyndall.render(&scene, &settings, &picture)?;
        large.push(vec![
            model.replace('_', " "),
            format!("{:.0} MB", run.peak as f64 * 1e-6),
            if run.peak < MOST { "yes" } else { "NO" }.into(),
            format!("{:.2} s", run.pass),
            format!("{:.2} s", run.wall),
            format!("{:.2}", run.cpu),
        ]);
    }
    Ok(format!(
        "## Cost against sizes and step\n\nThe sparse cloud of `xtask/volumes/cloud.py` (2 % of its voxels are not 0) at {SIDE}³, 320 × 240 pixels and steps of a \
         voxel (to the light 2), one of which\nvaries; on {adapter}. The table has the exponents of the power laws through the \
         points, times are medians of {} runs.\n\n{}\n![against the volume's size](pictures/cost-volume.svg) ![against the film's](pictures/cost-film.svg) \
         ![against the step](pictures/cost-step.svg)\n\n## Memory of a sparse cloud\n\n{LARGE}³ voxels, of which {:.1} % are not 0 \
         ({:.0} MB if it were dense, in half floats), 640 × 480. Peak memory is VmHWM of the process, which on a\nCPU driver holds what the \
         device holds.\n\n{}",
        bench.rounds,
        table(&rows),
        share * 100.0,
        f64::from(LARGE).powi(3) * 2e-6,
        table(&large)
    ))
}
