//! All bases at equal bytes: errors of the transmittance along rays, errors of pictures, and times.

use serde_json::{Value, json};
use tyndall::math::transmittance::{Basis, Cosine, Fourier, Haar, Legendre, Moments, Slices, Trigonometric, Window};
use tyndall_scene::World;
use tyndall_scene::metrics::linear::linear_errors;

use super::bench::{Bench, maps, world};
use super::pictures::hair;
use super::rays::{self, Ray};
use super::{errors, fourier};
use crate::failure::Failure;
use crate::reproduce::page::Page;
use crate::say;

const PLUME: &str = include_str!("../../../../../scenes/plume.toml");
const CLOUD: &str = include_str!("../../../../../scenes/cloud.toml");

/// A puff so far behind the plume that the light's depths are half as long again, and more.
const OUTLIER: &str = r#"
[media.outlier]
density.sphere = { center = [2.6, -0.2, 0.3], radius = 0.1, falloff = 0.05 }
optics.coefficients = { sigma_s = 2, sigma_a = 1 }
"#;

/// Three sheets, one over the other, and a floor that they shade.
const LAYERS: &str = r#"
camera = { position = [2.2, 1.2, 2.6], target = [0, 0, 0], fov = 34 }
lights.sun.directional = { direction = [0.25, -1, 0.1], irradiance = 12 }
materials.white.lambert.reflectance = 0.6
surfaces.floor = { shape.quad = { corner = [-3, -0.6, 3], edges = [[6, 0, 0], [0, 0, -6]] }, material = "white" }
# Of a sheet's thickness.
techniques.march = { step = 8, light_step = 8 }
techniques.transmittance.light_step = 16
techniques.direct.light_step = 16

[media.a]
density.homogeneous = { min = [-0.5, 0.4, -0.5], max = [0.5, 0.44, 0.5] }
optics.coefficients = { sigma_s = 30, sigma_a = 5 }
[media.b]
density.homogeneous = { min = [-0.6, 0.05, -0.3], max = [0.4, 0.09, 0.6] }
optics.coefficients = { sigma_s = 30, sigma_a = 5 }
[media.c]
density.homogeneous = { min = [-0.3, -0.3, -0.6], max = [0.6, -0.26, 0.4] }
optics.coefficients = { sigma_s = 30, sigma_a = 5 }
"#;

/// A basis by its name here and in scenes, with the numbers that it has of so many.
struct Kept {
    name: &'static str,
    settings: [&'static str; 2],
    basis: Box<dyn Basis>,
}

fn kept(name: &'static str, setting: &'static str, basis: impl Basis + 'static) -> Kept {
    Kept { name, settings: [setting, "off"], basis: Box::new(basis) }
}

/// All bases that so many bytes of 32-bit floats hold.
fn at(bytes: usize) -> Vec<Kept> {
    let numbers = bytes / 4;
    let window = Window::Off;
    let lanczos = Fourier { harmonics: (numbers - 1) / 2, window: Window::Lanczos };
    // Nine numbers are the most that moments are made for.
    let moments = if numbers >= 9 { 8 } else { 6 };
    vec![
        kept("Fourier", "fourier", fourier((numbers - 1) / 2)),
        Kept { name: "Fourier, Lanczos", settings: ["fourier", "lanczos"], basis: Box::new(lanczos) },
        kept("cosine", "cosine", Cosine { count: numbers, window }),
        kept("Legendre", "legendre", Legendre { count: numbers }),
        kept("slices", "slices", Slices { count: numbers }),
        kept("Haar", "haar", Haar { count: numbers }),
        kept("power moments", "moments", Moments::single(moments)),
        kept("trigonometric moments", "trigonometric", Trigonometric::single(moments / 2)),
    ]
}

/// The plume, as grids of voxels.
pub fn plume() -> Result<World, Failure> {
    world("plume.toml (embedded)", PLUME, &[])
}

/// Errors of the transmittance along rays.
pub fn transmittances(bench: &Bench, page: &mut Page) -> Result<(), Failure> {
    let rays = rays::through(&plume()?, 24).into_iter();
    let plume: Vec<_> = rays.filter(|ray| !ray.segments.is_empty()).collect();
    let own: Vec<_> = plume.iter().filter_map(|ray| ray.with_own_range(6.0)).collect();
    let cloud = world("cloud.toml (embedded)", CLOUD, &[])?;
    let cloud: Vec<_> = rays::through(&cloud, 10).into_iter().filter(|ray| !ray.segments.is_empty()).collect();
    let hair = rays::through_strands(&hair(bench, 40_000)?, 16);
    let scenes: [(&str, Vec<Ray>); 6] = [
        ("plume", plume),
        ("plume, own ranges", own),
        ("cloud", cloud),
        ("hair", hair),
        ("thin layers", (0..64).map(rays::layers).collect()),
        ("outlier", vec![rays::outlier()]),
    ];
    page.section(
        "All bases at equal bytes",
        "Absolute error of the transmittance, its mean and its 99th percentile, over light rays and depths from 0 to 1, with 32 and 64 \
         bytes a texel of 32-bit floats, against the rays themselves (what a deep shadow map keeps). Own ranges: the depths of each ray \
         run from where smoke begins to an optical depth of 6, which takes 8 bytes more. Moments take 28 bytes of the 32, 36 of the 64.",
    );
    for bytes in [32, 64] {
        let mut columns = vec!["basis".to_owned(), "numbers".to_owned()];
        columns.extend(scenes.iter().flat_map(|(name, _)| [format!("{name}: mean"), format!("{name}: 99 %")]));
        let rows: Vec<Vec<Value>> = at(bytes)
            .iter()
            .map(|kept| {
                let mut row = vec![json!(kept.name), json!(kept.basis.count())];
                for (_, rays) in &scenes {
                    let errors = errors(&*kept.basis, rays);
                    row.extend([json!(errors.mean), json!(errors.percentile)]);
                }
                row
            })
            .collect();
        let columns: Vec<_> = columns.iter().map(String::as_str).collect();
        page.table(&format!("bases_{bytes}_bytes"), &columns, &rows);
    }
    Ok(())
}

/// Errors of pictures, and times.
pub fn pictures(bench: &Bench, page: &mut Page) -> Result<(), Failure> {
    let film = bench.film([384, 288]);
    let side = bench.map(128);
    page.section(
        "All bases at equal bytes: pictures and times",
        &format!(
            "Relative root mean square error of pictures of {} x {}, against one with a deep shadow map of as many texels ({side} a side), \
             one range of depths a light; how long the maps take, and the scene with its lookups, on {}. The deep shadow map stands in \
             the last row.",
            film[0],
            film[1],
            bench.gpu.name()
        ),
    );
    let sun = [("techniques.march.environment_directions", "0".to_owned())];
    let scenes = [
        ("plume", plume()?),
        ("cloud", world("cloud.toml (embedded)", CLOUD, &sun)?),
        ("hair", hair(bench, 2000)?),
        ("thin layers", world("layers (embedded)", LAYERS, &[])?),
        ("outlier", world("outlier (embedded)", &format!("{PLUME}\n{OUTLIER}"), &[])?),
    ];
    // Pipelines are most of the time where little is rendered.
    let sizes: &[usize] = if bench.share < 1.0 { &[32] } else { &[32, 64] };
    for &bytes in sizes {
        let bases = at(bytes);
        let mut rows: Vec<Vec<Value>> = bases.iter().map(|kept| vec![json!(kept.name)]).collect();
        rows.push(vec![json!("deep shadow map")]);
        let mut columns = vec!["basis".to_owned()];
        for (name, world) in &scenes {
            say::note(&format!("  {name}, {bytes} bytes"));
            columns.extend(["error", "maps [ms]", "scene [ms]"].map(|column| format!("{name}: {column}")));
            let one = ("techniques.transmittance.depths", "light".to_owned());
            let deep = [maps("deep", 4, side), vec![one.clone()]].concat();
            let exact = bench.render(world, film, &deep)?;
            for (row, kept) in rows.iter_mut().zip(&bases) {
                let window = ("techniques.transmittance.window", kept.settings[1].to_owned());
                let settings = [maps(kept.settings[0], kept.basis.count(), side), vec![one.clone(), window]].concat();
                let shot = bench.render(world, film, &settings)?;
                let error = linear_errors(&shot.image, &exact.image).relative_rmse;
                row.extend([json!(error), json!(shot.maps), json!(shot.scene)]);
            }
            if let Some(row) = rows.last_mut() {
                row.extend([json!(0.0), json!(exact.maps), json!(exact.scene)]);
            }
        }
        let columns: Vec<_> = columns.iter().map(String::as_str).collect();
        page.table(&format!("bases_{bytes}_bytes_pictures"), &columns, &rows);
    }
    Ok(())
}
