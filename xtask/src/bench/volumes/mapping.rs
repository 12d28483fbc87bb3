//! Transfer functions against VTK's two volume mappers: the same picture, and the time.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};
use serde_json::{Value, json};

use super::super::mitsuba::install;
use super::super::table;
use super::measure::read_exr;
use super::scattering::floats;
use super::{Bench, Frame, median};
use crate::process;

const VTK: &str = "vtk==9.7.2";
const MAPPERS: [(&str, &str); 2] = [("fixed", "fixed-point"), ("opengl", "OpenGL")];
/// Frames of ours that are measured.
const FRAMES: u32 = 3;
/// At which resolution ours is marched first.
const RESOLUTIONS: [&str; 3] = ["full", "half", "quarter"];
/// The most that pictures may differ, in the mean [1/255].
const MOST: f64 = 2.0;

/// Values and opacities of phantom.py's colours that show the skull and hide what is behind it.
const DENSE: [(u32, f64); 8] =
    [(0, 0.0), (20, 0.0), (45, 0.02), (66, 0.0), (95, 0.15), (135, 0.5), (170, 0.2), (255, 0.8)];

/// Measures.
pub fn section(bench: &Bench) -> Result<String> {
    let python = install::python(&[VTK])?;
    println!("writing the phantom");
    let phantom = process::root().join("xtask/volumes/phantom.py");
    process::run(Command::new(&python).arg(phantom).arg(&bench.folder))?;
    std::fs::rename(bench.folder.join("phantom.u8"), bench.folder.join("phantom.raw"))?;
    let head = [
        "transfer function",
        "shading",
        "ours marches at",
        "against",
        "mean absolute difference",
        "of pixels not black",
        "≤ 2/255",
        "ours, frame",
        "CPU s",
        "theirs, frame",
        "CPU s",
        "their time over ours",
        "CPU over CPU",
    ];
    let mut rows = vec![head.map(String::from).to_vec()];
    let (mut adapter, mut version, mut renderer) = (String::new(), String::new(), String::new());
    for dense in [false, true] {
        for shading in ["unshaded", "shaded"] {
            let name = format!("{}-{shading}", if dense { "dense" } else { "translucent" });
            let [case, scene] = write_case(bench, &name, dense, shading)?;
            let mut ours = RESOLUTIONS.map(|_| Vec::new());
            let mut theirs = MAPPERS.map(|_| Vec::new());
            for round in 0..bench.rounds {
                println!("{name}, round {}", round + 1);
                for (resolution, frames) in RESOLUTIONS.iter().zip(&mut ours) {
                    let settings = [format!("techniques.march.resolution={resolution}")];
                    if round == 0 {
                        let picture = bench.folder.join(format!("{name}-{resolution}.exr"));
                        adapter = bench.tyndall.render(&scene, &settings, &picture)?.adapter;
                    }
                    frames.push(bench.frames(&scene, &settings, FRAMES)?);
                }
                for ((mapper, _), frames) in MAPPERS.iter().zip(&mut theirs) {
                    let report = vtk(&python, &case, &bench.folder.join(format!("{name}-{mapper}")), mapper)?;
                    let number = |field: &str| report[field].as_f64().context("VTK's report lacks a number");
                    frames.push(Frame { wall: number("median")?, cpu: number("cpu_seconds")? });
                    version = report["version"].as_str().unwrap_or_default().into();
                    if *mapper == "opengl" {
                        renderer = report["opengl"].as_str().unwrap_or_default().into();
                    }
                }
            }
            let medians = |frames: &[Frame]| {
                [median(frames.iter().map(|frame| frame.wall)), median(frames.iter().map(|frame| frame.cpu))]
            };
            for (resolution, frames) in RESOLUTIONS.iter().zip(&ours) {
                let picture = read_exr(&bench.folder.join(format!("{name}-{resolution}.exr")))?;
                let [wall, cpu] = medians(frames);
                for ((mapper, title), frames) in MAPPERS.iter().zip(&theirs) {
                    let other = floats(&bench.folder.join(format!("{name}-{mapper}.f32")))?;
                    let (difference, lit) = difference(&picture, &other)?;
                    let [their_wall, their_cpu] = medians(frames);
                    rows.push(vec![
                        if dense { "denser" } else { "translucent" }.into(),
                        shading.into(),
                        match *resolution {
                            "full" => "every pixel",
                            "half" => "one in 2 × 2, refined",
                            _ => "one in 4 × 4, refined",
                        }
                        .into(),
                        (*title).into(),
                        format!("{difference:.2}/255"),
                        format!("{lit:.2}/255"),
                        if difference <= MOST { "yes" } else { "NO" }.into(),
                        format!("{wall:.2} s"),
                        format!("{cpu:.2}"),
                        format!("{their_wall:.2} s"),
                        format!("{their_cpu:.2}"),
                        format!("{:.1}", their_wall / wall),
                        format!("{:.1}", their_cpu / cpu),
                    ]);
                }
            }
        }
    }
    Ok(format!(
        "## Transfer functions against VTK\n\nA phantom of a head, 256³ bytes (`xtask/volumes/phantom.py`), 1280 × 720, steps of half a voxel, no tone \
         mapping, against VTK {version}: its fixed-point mapper,\nand its OpenGL mapper on {renderer}; ours on {adapter}. The light \
         is at the eye's side, parallel to the camera's axis, both sides\nof surfaces are lit. Ours ends rays at a transmittance of \
         0.4 %, the fixed-point mapper at 0.8 %, the OpenGL mapper at 0.4 %. Times are of a frame after the first,\nof \
         ours the mean of {FRAMES}. Both mappers of VTK's sample every pixel. Medians, of {} turns.\nWhat bounds the ratios: \
         [march.md](march.md).\n\n{}",
        bench.rounds,
        table(&rows)
    ))
}

/// Writes a case for VTK, and our scene of it.
fn write_case(bench: &Bench, name: &str, dense: bool, shading: &str) -> Result<[PathBuf; 2]> {
    let mut case: Value =
        serde_json::from_str(&std::fs::read_to_string(bench.folder.join(format!("{shading}.json")))?)?;
    case["voxels"] = json!("phantom.raw");
    let vector =
        |value: &Value| -> Vec<f64> { value.as_array().into_iter().flatten().filter_map(Value::as_f64).collect() };
    let (position, target) = (vector(&case["camera"]["position"]), vector(&case["camera"]["target"]));
    let axis: Vec<f64> = target.iter().zip(&position).map(|(target, position)| target - position).collect();
    // The voxels' centre is our origin, and the point (N - 1)/2 of VTK's.
    let seen: Vec<f64> = axis.iter().map(|x| -x).collect();
    if dense {
        for (stop, (value, opacity)) in case["transfer"].as_array_mut().into_iter().flatten().zip(DENSE) {
            stop[0] = json!(value);
            stop[1] = json!(opacity);
        }
    }
    let shaded = case["shading"].is_object();
    if shaded {
        // From the eye: what faces away is then lit alike by all three, each of which treats it in its own way.
        case["shading"]["direction"] = json!(axis);
        case["shading"]["two_sided"] = json!(true);
    }
    let stops: Vec<String> = (case["transfer"].as_array().into_iter().flatten())
        .map(|stop| format!("    {{ value = {}, opacity = {}, color = {} }},\n", stop[0], stop[1], stop[2]))
        .collect();
    let light = if shaded {
        let (of, pi) = (&case["shading"], std::f64::consts::PI);
        format!(
            "shading = {{ ambient = {}, diffuse = {}, specular = {}, shininess = {} }}\n\n\
             [lights.eye.directional]\ndirection = {axis:?}\nirradiance = {pi}\n",
            of["ambient"], of["diffuse"], of["specular"], of["power"]
        )
    } else {
        String::new()
    };
    let text = format!(
        "camera = {{ position = {seen:?}, target = [0, 0, 0], up = {}, fov = {} }}\nfilm.size = {}\n\n\
         [techniques.march]\nmodel = \"emission\"\nstep = {}\ntermination = 0.004\n\n\
         [media.phantom]\ndensity.grid = {{ file = \"phantom.raw\", raw = {{ dims = {}, type = \"u8\", spacing = [1, 1, 1] }} }}\n\n\
         [media.phantom.optics.transfer]\nunit_length = 1\nstops = [\n{}]\n{light}",
        case["camera"]["up"],
        case["camera"]["fov"],
        case["size"],
        case["step"],
        case["dims"],
        stops.concat(),
    );
    let [json, toml] = ["json", "toml"].map(|extension| bench.folder.join(format!("{name}.{extension}")));
    std::fs::write(&json, case.to_string())?;
    std::fs::write(&toml, text)?;
    Ok([json, toml])
}

/// Renders with VTK and gives its report.
fn vtk(python: &Path, case: &Path, output: &Path, mapper: &str) -> Result<Value> {
    let mut command = Command::new(python);
    command.arg(process::root().join("xtask/volumes/vtk_render.py")).arg(case).arg(output);
    process::quiet_driver(&mut command)?;
    process::output(command.args(["--mapper", mapper, "--frames", "1"]))?;
    let report = output.with_extension("json");
    Ok(serde_json::from_str(&std::fs::read_to_string(report)?)?)
}

/// The mean absolute difference of two pictures, over all and over the pixels that are not black in both [1/255].
fn difference(ours: &[[f32; 3]], theirs: &[f32]) -> Result<(f64, f64)> {
    anyhow::ensure!(ours.len() * 3 == theirs.len(), "the pictures are not of one size");
    let (mut sum, mut lit) = (0.0, 0usize);
    for (a, b) in ours.iter().zip(theirs.chunks_exact(3)) {
        if a.iter().chain(b).any(|&v| v > 0.5 / 255.0) {
            lit += 1;
        }
        // A display shows no more than 1.
        sum += a.iter().zip(b).map(|(a, b)| f64::from((a.min(1.0) - b).abs())).sum::<f64>();
    }
    let mean = |pixels: usize| 255.0 * sum / (3 * pixels.max(1)) as f64;
    Ok((mean(ours.len()), mean(lit)))
}
