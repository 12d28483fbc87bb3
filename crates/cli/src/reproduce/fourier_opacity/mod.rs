//! [Jansen10]: its figures and tables; and all bases at equal bytes. The figures of light rays stand here.

mod bases;
mod bench;
mod pictures;
mod rays;
mod timing;

use std::path::Path;

use serde_json::json;
use tyndall::Gpu;
use tyndall::math::transmittance::{Basis, Fourier, Slices, Window, absorbance};
use tyndall_plot::{Axes, Line, curves};
use tyndall_scene::image::DisplayImage;

use super::Experiment;
use super::page::Page;
use crate::failure::Failure;
use crate::interrupt::Interrupt;
use bench::Bench;
use rays::Ray;

/// Depths at which curves are drawn.
const POINTS: u32 = 400;

const AXES: Axes = Axes { title: "", x: "depth", y: "transmittance", top: 1.05 };

fn depths() -> impl Iterator<Item = f64> {
    (0..=POINTS).map(|i| f64::from(i) / f64::from(POINTS))
}

fn fourier(harmonics: usize) -> Fourier {
    Fourier { harmonics, window: Window::Off }
}

fn exact(ray: &Ray) -> Line {
    Line { name: "exact".into(), points: depths().map(|d| (d, (-ray.optical_depth(d)).exp())).collect() }
}

fn kept(name: &str, ray: &Ray, basis: &dyn Basis) -> Line {
    let sums = ray.sums(basis);
    Line { name: name.into(), points: depths().map(|d| (d, basis.transmittance(&sums, d))).collect() }
}

const EXPERIMENTS: [Experiment<Bench>; 12] = [
    ("figures 1a, 1b, 10: particles", pictures::particles),
    ("figure 1c: features", features),
    ("figure 2: coefficients", coefficient_maps),
    ("figure 4: along a ray", counts),
    ("figure 4: pictures", pictures::counts),
    ("figures 5, 6, 7: bounds", bounds),
    ("figure 8: ringing", ringing),
    ("figure 9: hair", pictures::strands),
    ("tables 1 and 2: times", timing::tables),
    ("half floats", stall),
    ("all bases: transmittance", bases::transmittances),
    ("all bases: pictures and times", bases::pictures),
];

/// Runs all experiments.
pub fn page(gpu: Gpu, interrupt: Interrupt, quick: bool, folder: &Path) -> Result<(), Failure> {
    // A CPU driver takes minutes for the paper's films.
    let film = match (quick, gpu.is_cpu()) {
        (true, _) => 1.0 / 16.0,
        (false, true) => 0.25,
        (false, false) => 1.0,
    };
    let bench = Bench { gpu, interrupt, film, share: if quick { 1.0 / 16.0 } else { 1.0 } };
    super::page("Fourier Opacity Mapping (Jansen and Bavoil 2010)", &EXPERIMENTS, &bench, &bench.interrupt, folder)
}

/// Figure 1c.
fn features(_: &Bench, page: &mut Page) -> Result<(), Failure> {
    page.section("Figure 1c", "Transmittance along a ray with several features, exact and with 15 coefficients.");
    let ray = rays::puffs();
    page.plot(&curves(&AXES, &[exact(&ray), kept("15 coefficients", &ray, &fourier(7))]).map_err(Failure::Failed)?);
    Ok(())
}

/// Figure 2.
fn coefficient_maps(_: &Bench, page: &mut Page) -> Result<(), Failure> {
    page.section(
        "Figure 2",
        "The seven coefficient maps of the plume, in parallel light from the side: a0, a1, b1, a2, b2, a3, b3. Grey is 0; each is scaled to \
         its greatest magnitude.",
    );
    const SIDE: u32 = 96;
    let basis = fourier(3);
    let sums: Vec<_> = rays::through(&bases::plume()?, SIDE).iter().map(|ray| ray.sums(&basis)).collect();
    let count = Basis::count(&basis) as u32;
    let greatest = |k: usize| sums.iter().map(|texel| texel[k].abs()).fold(1e-30, f64::max);
    let scales: Vec<_> = (0..count as usize).map(greatest).collect();
    let shade = |x: u32, y: u32| {
        let (k, z) = ((x / SIDE) as usize, x % SIDE);
        (0.5 + 0.5 * sums[((SIDE - 1 - y) * SIDE + z) as usize][k] / scales[k]) as f32
    };
    let pixels = (0..SIDE * SIDE * count).map(|i| [shade(i % (SIDE * count), i / (SIDE * count)); 3]).collect();
    page.picture("coefficients", "the coefficients", &DisplayImage { width: SIDE * count, height: SIDE, pixels })
}

/// Figure 4, along a ray.
fn counts(_: &Bench, page: &mut Page) -> Result<(), Failure> {
    page.section(
        "Figure 4",
        "Fourier's coefficients against as many slices: root mean square error of the transmittance.",
    );
    let ray = rays::puffs();
    let mut rows = Vec::new();
    for count in [3, 5, 7, 15, 31] {
        let error = |basis: &dyn Basis| errors(basis, std::slice::from_ref(&ray)).rms;
        rows.push(vec![json!(count), json!(error(&fourier(count / 2))), json!(error(&Slices { count }))]);
    }
    page.table("figure_4", &["coefficients", "Fourier", "slices"], &rows);
    let lines = [exact(&ray), kept("Fourier, 7", &ray, &fourier(3)), kept("slices, 7", &ray, &Slices { count: 7 })];
    page.plot(&curves(&AXES, &lines).map_err(Failure::Failed)?);
    Ok(())
}

/// Figures 5 to 7.
fn bounds(_: &Bench, page: &mut Page) -> Result<(), Failure> {
    page.section(
        "Figures 5, 6 and 7",
        "How much the transmittance at the same places of the smoke changes, at most over the steps of a change, in root mean \
         square, with 15 coefficients: bounds up to 10 % wider, smoke that moves by up to 0.07 of the bounds, and an outlier \
         that makes them half as long again.",
    );
    let steps = [
        (
            "bounds 10 % wider",
            (0..=10).map(|i| 1.0 / (1.0 + 0.01 * f64::from(i))).map(|s| (s, 0.5 - 0.5 * s)).collect(),
        ),
        ("translation", (-7..=7).map(|i| (1.0, 0.01 * f64::from(i))).collect()),
        ("outlier", vec![(1.0 / 1.5, 0.0)]),
    ];
    let still = rays::puffs();
    let change = |basis: &dyn Basis, steps: &[(f64, f64)]| {
        let profile = |scale: f64, offset: f64| -> Vec<f64> {
            let sums = still.moved(scale, offset).sums(basis);
            depths().map(|d| basis.transmittance(&sums, scale * (0.15 + 0.7 * d) + offset)).collect()
        };
        let before = profile(1.0, 0.0);
        let rms = |after: Vec<f64>| {
            (before.iter().zip(&after).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / before.len() as f64).sqrt()
        };
        steps.iter().map(|&(scale, offset)| rms(profile(scale, offset))).fold(0.0, f64::max)
    };
    let row = |(what, steps): &(&str, Vec<(f64, f64)>)| {
        vec![json!(what), json!(change(&fourier(7), steps)), json!(change(&Slices { count: 15 }, steps))]
    };
    let rows: Vec<_> = steps.iter().map(row).collect();
    page.table("figures_5_to_7", &["change", "Fourier", "slices"], &rows);
    Ok(())
}

/// Figure 8.
fn ringing(_: &Bench, page: &mut Page) -> Result<(), Failure> {
    page.section(
        "Figure 8",
        "One layer at half depth. Its transmittance, not bounded by 1, rings whatever the number of coefficients; a window trades \
         that for blur.",
    );
    let layer = |opacity: f64| Ray { primitives: vec![(0.5, absorbance(opacity))], segments: Vec::new() };
    let unbounded = |ray: &Ray, basis: Fourier| -> Vec<(f64, f64)> {
        let sums = ray.sums(&basis);
        // Close to the layer, where many coefficients ring.
        let fine = (0..=20_000).map(|i| f64::from(i) / 20_000.0).filter(|d| (d - 0.5).abs() < 0.01);
        let mut at: Vec<f64> = depths().chain(fine).collect();
        at.sort_by(f64::total_cmp);
        at.into_iter().map(|d| (d, (-basis.optical_depth(&sums, d)).exp())).collect()
    };
    let mut rows = Vec::new();
    for (harmonics, window) in [
        (3, Window::Off),
        (7, Window::Off),
        (49, Window::Off),
        (499, Window::Off),
        (7, Window::Lanczos),
        (7, Window::Fejer),
    ] {
        let top = |opacity| {
            let points = unbounded(&layer(opacity), Fourier { harmonics, window });
            points.iter().map(|point| point.1).fold(0.0, f64::max)
        };
        rows.push(vec![json!(2 * harmonics + 1), json!(format!("{window:?}")), json!(top(0.9)), json!(top(0.99))]);
    }
    page.table("figure_8", &["coefficients", "window", "greatest T, α = 0.9", "α = 0.99"], &rows);
    let ray = layer(0.9);
    let mut lines = vec![exact(&ray)];
    for (name, harmonics, window) in [
        ("15", 7, Window::Off),
        ("101", 50, Window::Off),
        ("999", 499, Window::Off),
        ("15, Lanczos", 7, Window::Lanczos),
    ] {
        lines.push(Line { name: name.into(), points: unbounded(&ray, Fourier { harmonics, window }) });
    }
    page.plot(&curves(&Axes { top: 1.4, ..AXES }, &lines).map_err(Failure::Failed)?);
    Ok(())
}

/// Half floats.
fn stall(_: &Bench, page: &mut Page) -> Result<(), Failure> {
    page.section(
        "Half floats",
        "Equal layers added one by one to a 16-bit a₀: the optical depth at which the sum stands still.",
    );
    let step = |x: f64| f64::from(half_of(x));
    let stalled = |opacity: f64| {
        let add = step(2.0 * absorbance(opacity));
        let mut sum = 0.0;
        loop {
            let next = step(sum + add);
            if next == sum {
                return sum / 2.0;
            }
            sum = next;
        }
    };
    let rows: Vec<_> = [0.001, 0.002, 1.0 / 255.0].map(|alpha| vec![json!(alpha), json!(stalled(alpha))]).into();
    page.table("half_floats", &["opacity of a layer", "optical depth"], &rows);
    Ok(())
}

/// A positive number rounded to 11 bits, as half floats round it.
fn half_of(x: f64) -> f32 {
    let exponent = x.log2().floor().max(-14.0);
    let unit = (exponent - 10.0).exp2();
    ((x / unit).round_ties_even() * unit) as f32
}

/// How wrong a basis is over rays.
struct Errors {
    mean: f64,
    percentile: f64,
    rms: f64,
}

fn errors(basis: &dyn Basis, rays: &[Ray]) -> Errors {
    let mut off = Vec::new();
    for ray in rays {
        let sums = ray.sums(basis);
        off.extend(depths().map(|d| (basis.transmittance(&sums, d) - (-ray.optical_depth(d)).exp()).abs()));
    }
    off.sort_by(f64::total_cmp);
    let count = off.len().max(1) as f64;
    Errors {
        mean: off.iter().sum::<f64>() / count,
        percentile: off.get(off.len() * 99 / 100).copied().unwrap_or(f64::NAN),
        rms: (off.iter().map(|x| x * x).sum::<f64>() / count).sqrt(),
    }
}
