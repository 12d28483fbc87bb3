//! [Jansen10], as far as its figures are of light rays; and all bases at equal bytes.

mod rays;

use serde_json::{Value, json};
use tyndall::math::transmittance::{Basis, Cosine, Fourier, Haar, Legendre, Moments, Slices, Window, absorbance};
use tyndall_scene::assets::Embedded;
use tyndall_scene::image::DisplayImage;
use tyndall_scene::{Document, World};

use super::curves::{Axes, Curve, svg};
use super::page::Page;
use crate::failure::Failure;
use crate::input::memory_budget;
use rays::Ray;

const SCENE: &str = include_str!("../../../../../scenes/plume.toml");
const VOLUME: &[u8] = include_bytes!("../../../../../scenes/smoke.vdb");

/// Depths at which curves are drawn.
const POINTS: u32 = 400;

const AXES: Axes = Axes { title: "", x: "depth", y: "transmittance", top: 1.05 };

fn depths() -> impl Iterator<Item = f64> {
    (0..=POINTS).map(|i| f64::from(i) / f64::from(POINTS))
}

fn fourier(harmonics: usize) -> Fourier {
    Fourier { harmonics, window: Window::Off }
}

fn exact(ray: &Ray) -> Curve {
    Curve { name: "exact".into(), points: depths().map(|d| (d, (-ray.optical_depth(d)).exp())).collect() }
}

fn kept(name: &str, ray: &Ray, basis: &dyn Basis) -> Curve {
    let sums = ray.sums(basis);
    Curve { name: name.into(), points: depths().map(|d| (d, basis.transmittance(&sums, d))).collect() }
}

/// All experiments.
pub fn page() -> Result<Page, Failure> {
    let mut page = Page::new("Fourier Opacity Mapping (Jansen and Bavoil 2010)");
    let world = plume()?;
    features(&mut page)?;
    coefficient_maps(&mut page, &world)?;
    counts(&mut page)?;
    bounds(&mut page)?;
    ringing(&mut page)?;
    stall(&mut page);
    bases(&mut page, &world);
    Ok(page)
}

/// Figure 1c.
fn features(page: &mut Page) -> Result<(), Failure> {
    page.section("Figure 1c", "Transmittance along a ray with several features, exact and with 15 coefficients.");
    let ray = rays::puffs();
    page.plot(&svg(&AXES, &[exact(&ray), kept("15 coefficients", &ray, &fourier(7))])?);
    Ok(())
}

/// The shipped plume.
fn plume() -> Result<World, Failure> {
    let document = Document::new("plume.toml (embedded)", SCENE);
    let assets = Embedded(vec![("smoke.vdb", VOLUME)]);
    World::load(document.parse()?, &assets, memory_budget()).map_err(|error| Failure::from(error.locate(&document)))
}

/// Figure 2.
fn coefficient_maps(page: &mut Page, world: &World) -> Result<(), Failure> {
    page.section(
        "Figure 2",
        "The seven coefficient maps of the plume, in parallel light from the side: a0, a1, b1, a2, b2, a3, b3. Grey is 0; each is scaled to \
         its greatest magnitude.",
    );
    const SIDE: u32 = 96;
    let basis = fourier(3);
    let sums: Vec<_> = rays::through(world, SIDE).iter().map(|ray| ray.sums(&basis)).collect();
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
fn counts(page: &mut Page) -> Result<(), Failure> {
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
    let curves = [exact(&ray), kept("Fourier, 7", &ray, &fourier(3)), kept("slices, 7", &ray, &Slices { count: 7 })];
    page.plot(&svg(&AXES, &curves)?);
    Ok(())
}

/// Figures 5 to 7.
fn bounds(page: &mut Page) -> Result<(), Failure> {
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
fn ringing(page: &mut Page) -> Result<(), Failure> {
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
    let mut curves = vec![exact(&ray)];
    for (name, harmonics, window) in [
        ("15", 7, Window::Off),
        ("101", 50, Window::Off),
        ("999", 499, Window::Off),
        ("15, Lanczos", 7, Window::Lanczos),
    ] {
        curves.push(Curve { name: name.into(), points: unbounded(&ray, Fourier { harmonics, window }) });
    }
    page.plot(&svg(&Axes { top: 1.4, ..AXES }, &curves)?);
    Ok(())
}

/// Half floats.
fn stall(page: &mut Page) {
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

/// A name, the numbers that it has, and a basis.
type Named = (&'static str, Box<dyn Basis>);

fn at(bytes: usize) -> Vec<Named> {
    let numbers = bytes / 4;
    let window = Window::Off;
    vec![
        ("Fourier", Box::new(fourier((numbers - 1) / 2))),
        ("Fourier, Lanczos", Box::new(Fourier { harmonics: (numbers - 1) / 2, window: Window::Lanczos })),
        ("cosine", Box::new(Cosine { count: numbers, window })),
        ("Legendre", Box::new(Legendre { count: numbers })),
        ("slices", Box::new(Slices { count: numbers })),
        ("Haar", Box::new(Haar { count: numbers })),
        ("power moments", Box::new(Moments::single(if numbers >= 9 { 8 } else { 6 }))),
    ]
}

/// All bases, at equal bytes a texel.
fn bases(page: &mut Page, world: &World) {
    let rays = rays::through(world, 24).into_iter();
    let plume: Vec<_> = rays.filter(|ray| !ray.segments.is_empty()).collect();
    let own: Vec<_> = plume.iter().filter_map(|ray| ray.with_own_range(6.0)).collect();
    let scenes = [
        ("plume", plume),
        ("plume, own ranges", own),
        ("thin layers", (0..64).map(rays::layers).collect()),
        ("strands", (0..64).map(rays::strands).collect()),
        ("outlier", vec![rays::outlier()]),
    ];
    page.section(
        "All bases at equal bytes",
        "Absolute error of the transmittance, its mean and its 99th percentile, over rays and depths from 0 to 1, with 32 and 64 bytes a \
         texel of 32-bit floats. Own ranges: the depths of each ray run from where smoke begins to an optical depth of 6, which \
         takes 8 bytes more. Eight power moments take 36 bytes of the 64, six take 28 of the 32.",
    );
    for bytes in [32, 64] {
        let mut columns = vec!["basis".to_owned(), "numbers".to_owned()];
        columns.extend(scenes.iter().flat_map(|(name, _)| [format!("{name}: mean"), format!("{name}: 99 %")]));
        let rows: Vec<Vec<Value>> = at(bytes)
            .iter()
            .map(|(name, basis)| {
                let mut row = vec![json!(name), json!(basis.count())];
                for (_, rays) in &scenes {
                    let errors = errors(&**basis, rays);
                    row.extend([json!(errors.mean), json!(errors.percentile)]);
                }
                row
            })
            .collect();
        let columns: Vec<_> = columns.iter().map(String::as_str).collect();
        page.table(&format!("bases_{bytes}_bytes"), &columns, &rows);
    }
}
