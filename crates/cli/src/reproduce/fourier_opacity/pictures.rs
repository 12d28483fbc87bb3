//! The figures that are pictures: particles, an opaque object in smoke, hair, and Fourier's series against slices.

use serde_json::json;
use tyndall_scene::World;
use tyndall_scene::image::tonemap;
use tyndall_scene::metrics::linear::linear_errors;

use super::bench::{Bench, Shot, maps, world};
use crate::failure::Failure;
use crate::reproduce::page::Page;

const PLUME: &str = include_str!("../../../../../scenes/particles.toml");
const HAIR: &str = include_str!("../../../../../scenes/hair.toml");

/// A second emitter beside the plume, of dark smoke, and dust over the ground.
const COMPLEX: &str = r#"
[media.dark]
optics.coefficients = { sigma_s = 0.45, sigma_a = 0.55 }
density.emitter = { position = [0.7, 0.05, 0.2], size = 0.06, number = NUMBER, lifetime = 3.2, velocity = [-0.2, 0.75, 0], turbulence = 0.5, scale = 0.4, octaves = 3, radius = 0.02, end_radius = 0.14, opacity = 0.12, end_opacity = 0.0, color = [0.7, 0.6, 0.5], end_color = [0.8, 0.8, 0.85], time = 6, frame_rate = 24, seed = 5 }

[media.dust]
optics.coefficients = { sigma_s = 0.9, sigma_a = 0.1 }
density.emitter = { position = [0.2, 0.0, 0.3], size = 0.7, number = NUMBER, lifetime = 5, velocity = [0.25, 0.03, 0.1], turbulence = 0.2, scale = 0.5, octaves = 2, radius = 0.05, end_radius = 0.16, opacity = 0.03, end_opacity = 0.0, color = [0.85, 0.7, 0.5], end_color = [0.85, 0.75, 0.6], time = 6, frame_rate = 24, seed = 9 }
"#;

const BALL: &str = r#"
[materials.paint.lambert]
reflectance = [0.6, 0.12, 0.08]

[surfaces.ball]
shape.sphere = { center = [0.3, 0.9, 0.15], radius = 0.3 }
material = "paint"
"#;

/// The plume of particles with its sun alone, as in the paper.
pub fn plume(bench: &Bench, more: &str) -> Result<World, Failure> {
    let number = bench.bodies(16384).to_string();
    let more = more.replace("NUMBER", &bench.bodies(8192).to_string());
    world(
        "particles.toml (embedded)",
        &format!("{PLUME}\n{more}"),
        &[("media.plume.density.emitter.number", number), ("techniques.particles.environment_directions", "0".into())],
    )
}

/// How many hairs are grown of so many: a CPU driver draws a quarter of them.
fn hairs(bench: &Bench, number: u32) -> u32 {
    bench.bodies(if bench.gpu.is_cpu() { number / 4 } else { number })
}

/// A head of hair in the light of its lamps.
pub fn hair(bench: &Bench, number: u32) -> Result<World, Failure> {
    world(
        "hair.toml (embedded)",
        HAIR,
        &[
            ("media.hair.density.head.number", hairs(bench, number).to_string()),
            ("techniques.particles.environment_directions", "0".into()),
        ],
    )
}

fn show(page: &mut Page, name: &str, caption: &str, world: &World, shot: &Shot) -> Result<(), Failure> {
    page.picture(name, caption, &tonemap::display(&shot.image, world.scene.film.exposure))
}

/// Figures 1a, 1b and 10.
pub fn particles(bench: &Bench, page: &mut Page) -> Result<(), Failure> {
    page.section(
        "Figures 1a, 1b and 10",
        "Particles with shadows on themselves, on each other and on the ground, by maps of seven of Fourier's coefficients: a plume of \
         16384 (fewer with --quick), three emitters together, and an opaque ball in the smoke, whose own shadow, by an ordinary shadow \
         map, is multiplied onto the smoke's. The paper's figure 10 is of a game; its particle systems are not to be had.",
    );
    let side = bench.picture();
    for (name, caption, more) in [
        ("figure-1a", "1a: a plume", ""),
        ("figure-1b", "1b: three emitters", COMPLEX),
        ("figure-10", "10: an opaque ball in smoke", BALL),
    ] {
        let world = plume(bench, more)?;
        let shot = bench.render(&world, side, &maps("fourier", 7, bench.map(512)))?;
        show(page, name, caption, &world, &shot)?;
    }
    Ok(())
}

/// Figure 4, of the plume of particles.
pub fn counts(bench: &Bench, page: &mut Page) -> Result<(), Failure> {
    let world = plume(bench, "")?;
    let film = bench.picture();
    let error = |found: &Shot, exact: &Shot| json!(linear_errors(&found.image, &exact.image).relative_rmse);
    // A deep shadow map of more texels takes more memory than devices promise.
    let side = bench.map(128);
    let exact = bench.render(&world, film, &maps("deep", 4, side))?;
    page.section(
        "Figure 4, pictures: coefficients",
        &format!(
            "The plume of particles with Fourier's coefficients and with slices, maps of {side} texels a side: relative root mean \
             square error of the picture against one with a deep shadow map of as many texels, which keeps every particle of a \
             light ray."
        ),
    );
    let mut rows = Vec::new();
    for count in [3, 7, 15, 31] {
        let mut row = vec![json!(count)];
        for basis in ["fourier", "slices"] {
            let shot = bench.render(&world, film, &maps(basis, count, side))?;
            row.push(error(&shot, &exact));
            if count == 7 {
                show(page, &format!("figure-4-{basis}"), &format!("{basis}, 7 numbers"), &world, &shot)?;
            }
        }
        rows.push(row);
    }
    show(page, "figure-4-deep", "deep shadow map", &world, &exact)?;
    page.table("figure_4_coefficients", &["coefficients", "Fourier", "slices"], &rows);
    page.section(
        "Figure 4, pictures: texels",
        "The same with 15 numbers and more or fewer texels, against the most texels with the same numbers.",
    );
    let sides = [64, 128, 256, 512].map(|side| bench.map(side));
    let mut rows: Vec<_> = sides[..3].iter().map(|side| vec![json!(side)]).collect();
    for basis in ["fourier", "slices"] {
        let finest = bench.render(&world, film, &maps(basis, 15, sides[3]))?;
        for (row, &side) in rows.iter_mut().zip(&sides) {
            row.push(error(&bench.render(&world, film, &maps(basis, 15, side))?, &finest));
        }
    }
    page.table("figure_4_texels", &["texels a side", "Fourier", "slices"], &rows);
    Ok(())
}

/// Figure 9.
pub fn strands(bench: &Bench, page: &mut Page) -> Result<(), Failure> {
    let world = hair(bench, 10_000)?;
    let (film, side) = (bench.picture(), bench.map(512));
    let radius = bench.map(16 * 16) / 16;
    page.section(
        "Figure 9",
        &format!(
            "Hair with maps of {side} texels a side, filtered by a box of {0} x {0}: 32 slices against five of Fourier's \
             coefficients. The head is grown here, of {1} hairs; the paper's model comes with a program.",
            2 * radius + 1,
            hairs(bench, 10_000)
        ),
    );
    let mut shots = Vec::new();
    for (basis, count, name) in [("slices", 32, "32 slices"), ("fourier", 5, "5 of Fourier's coefficients")] {
        let mut settings = maps(basis, count, side);
        settings.push(("techniques.transmittance.prefilter", radius.to_string()));
        settings.push(("techniques.transmittance.depths", "light".into()));
        let shot = bench.render(&world, film, &settings)?;
        show(page, &format!("figure-9-{basis}"), name, &world, &shot)?;
        shots.push((name, shot));
    }
    let difference = linear_errors(&shots[1].1.image, &shots[0].1.image).relative_rmse;
    let rows: Vec<_> = shots
        .iter()
        .map(|(name, shot)| vec![json!(name), json!(shot.maps), json!(shot.scene), json!(difference)])
        .collect();
    page.table("figure_9", &["maps", "maps [ms]", "scene [ms]", "relative RMS of their difference"], &rows);
    Ok(())
}
