use std::fs::File;
use std::io::{BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};

use super::{publish, table};
use crate::driver::{self, Consent};
use crate::process;

/// Peak memory of `tyndall render` with volumes of 512^3, and of one that cannot fit; writes docs/memory.md
///
/// Fails where a render's peak is more than 3 times its volume plus the film, or where a volume that cannot fit is not
/// refused at once.
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  cargo xtask bench memory    (takes a minute, and 1 GiB of disk meanwhile)")]
pub struct Arguments {
    #[command(flatten)]
    consent: Consent,
}

/// Voxels along a side.
const SIDE: u64 = 512;
/// The most memory, in times of the volume.
const MOST: f64 = 3.0;
/// Pixels of the pictures.
const FILM: [u64; 2] = [64, 48];
/// Voxels along a side of the volume that cannot fit.
const ABSURD_SIDE: u64 = 4000;
/// How long a refusal may take, and what memory.
const REFUSAL: (Duration, u64) = (Duration::from_secs(1), 256 << 20);

const MIB: f64 = (1 << 20) as f64;

/// How voxels are stored in a file.
struct Format {
    /// For people.
    name: &'static str,
    /// NIfTI's `datatype` and `bitpix`.
    codes: [i16; 2],
    /// Bytes of a voxel in memory: a volume whose values are all exact in half precision is held so.
    held: u64,
    voxel: fn(f32, &mut Vec<u8>),
}

const FORMATS: [Format; 2] = [
    Format { name: "float", codes: [16, 32], held: 4, voxel: |value, row| row.extend(value.to_le_bytes()) },
    Format { name: "8-bit", codes: [2, 8], held: 2, voxel: |value, row| row.push((value * 255.0) as u8) },
];

impl Arguments {
    /// Writes the volumes, renders them, and measures.
    pub fn run(&self) -> Result<()> {
        ensure!(cfg!(target_os = "linux"), "peak memory is read from /proc, which only Linux has");
        let tyndall = process::build_tyndall()?;
        driver::ensure(&tyndall, self.consent)?;
        let folder = Volumes(process::scratch("memory")?);
        let mut rows =
            vec![["volume", "file", "in memory", "peak", "peak over volume", "limit", ""].map(String::from).to_vec()];
        let (mut passed, mut adapter) = (true, String::new());
        for format in &FORMATS {
            println!("writing a volume of {SIDE}^3, {}", format.name);
            let file = folder.0.join("volume.nii");
            write_volume(&file, format)?;
            let bytes = file.metadata()?.len();
            println!("rendering it");
            let peak = render(&tyndall, &folder.0)?;
            ensure!(peak.success, "the render failed: {}", peak.said);
            adapter = peak.adapter;
            let volume = SIDE.pow(3) * format.held;
            // A pixel is four floats.
            let film = FILM[0] * FILM[1] * 16;
            let good = peak.bytes as f64 <= MOST * volume as f64 + film as f64;
            passed &= good;
            rows.push(vec![
                format!("{SIDE}³ {}", format.name),
                format!("{:.0} MiB", bytes as f64 / MIB),
                format!("{:.0} MiB", volume as f64 / MIB),
                format!("{:.0} MiB", peak.bytes as f64 / MIB),
                format!("{:.2}", peak.bytes.saturating_sub(film) as f64 / volume as f64),
                format!("{MOST}"),
                verdict(good),
            ]);
        }

        println!("rendering one of {ABSURD_SIDE}^3 that cannot fit");
        write_absurd(&folder.0.join("volume.nii"))?;
        let refusal = render(&tyndall, &folder.0)?;
        let good = !refusal.success && refusal.time < REFUSAL.0 && refusal.bytes < REFUSAL.1;
        passed &= good;
        let text = page(&adapter, &rows, &refusal, good);
        println!("\n{text}");
        publish("memory.md", &text)?;
        if passed { Ok(()) } else { bail!("more memory was used than is allowed; see the table") }
    }
}

fn verdict(good: bool) -> String {
    if good { "passed" } else { "failed" }.into()
}

fn page(adapter: &str, rows: &[Vec<String>], refusal: &Peak, good: bool) -> String {
    format!(
        "# Memory\n\nPeak resident memory of `tyndall render` (on Linux, VmHWM of the process), {} × {} pixels, single \
         scattering, on\n{}. A CPU driver keeps what it holds in the same memory: the peak counts the volume for the \
         loader and for the\ndevice. Made by `cargo xtask bench memory`.\n\n{}\nA volume of {ABSURD_SIDE}³ floats ({:.0} \
         GiB) is refused after {:.0} ms, with a peak of {:.0} MiB: {}.\n\n```text\n{}\n```\n",
        FILM[0],
        FILM[1],
        adapter,
        table(rows),
        (ABSURD_SIDE.pow(3) * 4) as f64 / (MIB * 1024.0),
        refusal.time.as_secs_f64() * 1e3,
        refusal.bytes as f64 / MIB,
        verdict(good),
        refusal.said,
    )
}

/// The folder of the volumes, which are deleted in the end.
struct Volumes(PathBuf);

impl Drop for Volumes {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// A NIfTI-1 header of cubic voxels of 1 mm.
fn header(side: u64, codes: [i16; 2]) -> Vec<u8> {
    const LENGTH: usize = 352;
    let mut header = vec![0; LENGTH];
    let mut put = |at: usize, bytes: &[u8]| header[at..at + bytes.len()].copy_from_slice(bytes);
    put(0, &348i32.to_le_bytes());
    for (i, n) in [3, side as i16, side as i16, side as i16, 1, 1, 1, 1].into_iter().enumerate() {
        put(40 + 2 * i, &n.to_le_bytes());
    }
    put(70, &codes[0].to_le_bytes());
    put(72, &codes[1].to_le_bytes());
    for i in 0..4 {
        put(76 + 4 * i, &1f32.to_le_bytes());
    }
    put(108, &(LENGTH as f32).to_le_bytes());
    put(112, &1f32.to_le_bytes());
    put(123, &[2]);
    put(344, b"n+1\0");
    header
}

/// A ball with waves in it, at 1 mm a voxel.
fn write_volume(path: &Path, format: &Format) -> Result<()> {
    let mut file = BufWriter::new(File::create(path).with_context(|| format!("cannot write {}", path.display()))?);
    file.write_all(&header(SIDE, format.codes))?;
    let at = |i: u64| (i as f32 + 0.5) / SIDE as f32 - 0.5;
    let waves: Vec<f32> = (0..SIDE).map(|i| 0.75 + 0.25 * (40.0 * at(i)).sin()).collect();
    let mut row = Vec::new();
    for k in 0..SIDE {
        for j in 0..SIDE {
            row.clear();
            for i in 0..SIDE {
                let inside = at(i).powi(2) + at(j).powi(2) + at(k).powi(2) < 0.2;
                let value = waves[i as usize] * waves[j as usize] * waves[k as usize];
                (format.voxel)(if inside { value } else { 0.0 }, &mut row);
            }
            file.write_all(&row)?;
        }
    }
    file.flush().context("cannot write the volume")
}

/// A file as long as its header claims, all but the header a hole.
fn write_absurd(path: &Path) -> Result<()> {
    let header = header(ABSURD_SIDE, FORMATS[0].codes);
    let mut file = File::create(path)?;
    file.write_all(&header)?;
    let length = header.len() as u64 + ABSURD_SIDE.pow(3) * 4;
    file.set_len(length).context("the file system holds no file of 256 GB, even one of holes")
}

/// A render, measured.
struct Peak {
    bytes: u64,
    time: Duration,
    success: bool,
    adapter: String,
    /// What it wrote to standard error.
    said: String,
}

/// Renders `volume.nii` of a folder.
fn render(tyndall: &Path, folder: &Path) -> Result<Peak> {
    let scene = folder.join("scene.toml");
    let [width, height] = FILM;
    let text = format!(
        "[camera]\nposition = [0.9, 0.5, 1.2]\ntarget = [0.256, 0.256, 0.256]\nfov = 30\n\n\
         [film]\nsize = [{width}, {height}]\n\n\
         [lights.sun.directional]\ndirection = [-1, -1, -0.3]\nirradiance = 3\n\n\
         [media.ball]\ndensity.grid = {{ file = \"volume.nii\" }}\noptics.coefficients = {{ sigma_s = 8, sigma_a = 1 }}\n"
    );
    std::fs::write(&scene, text).with_context(|| format!("cannot write {}", scene.display()))?;
    let mut command: Command = process::tyndall(tyndall)?;
    command.arg("render").arg(&scene).arg("-o").arg(folder.join("picture.exr")).arg("--timings");
    let begun = Instant::now();
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()?;
    let mut bytes = 0;
    let status = loop {
        bytes = bytes.max(high_water(child.id()).unwrap_or(0));
        if let Some(status) = child.try_wait()? {
            break status;
        }
        // A refusal takes but a few milliseconds.
        std::thread::sleep(Duration::from_micros(200));
    };
    let time = begun.elapsed();
    let (mut printed, mut said) = (String::new(), String::new());
    child.stdout.take().context("no output")?.read_to_string(&mut printed)?;
    child.stderr.take().context("no output")?.read_to_string(&mut said)?;
    let adapter = printed.lines().find_map(|line| line.strip_prefix("adapter")).unwrap_or_default().trim().to_owned();
    // What is printed is to be the same wherever the project lies.
    let said = said.trim().replace(&format!("{}/", folder.display()), "");
    Ok(Peak { bytes, time, success: status.success(), adapter, said })
}

/// The peak resident memory of a process so far [bytes].
pub(super) fn high_water(process: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix(" kB")?.trim().parse::<u64>().ok().map(|kib| kib << 10)
}
