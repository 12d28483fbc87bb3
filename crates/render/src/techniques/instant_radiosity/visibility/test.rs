//! Maps against rays.

use tyndall_scene::World;
use tyndall_scene::image::Image;
use tyndall_scene::metrics;

use super::super::test::{cornell, furnace};
use crate::test::{gpu, picture, tolerance};

/// The pictures by rays and by maps of a world that some settings make.
fn both(gpu: &crate::Gpu, settings: &str, of: impl Fn(&str) -> World) -> [Image; 2] {
    ["rays", "maps"].map(|visibility| picture(gpu, &of(&format!("{settings}\nvisibility = \"{visibility}\""))))
}

/// Radiance below which light is taken to be grazing, relative to the brightest but for the lamp.
const GRAZING: f32 = 0.1;

/// Shadows of many lights: each is off by a texel at its edges, the sum by much less.
#[test]
fn maps_agree_with_rays() {
    let Some(gpu) = gpu() else { return };
    let settings = "paths = 64\nsamples = 16";
    let open = |settings: &str| {
        let mut world = cornell(32, settings, "[lights]\nl.constant.radiance = [0.3, 0.5, 0.9]");
        world.surfaces.retain(|surface| !matches!(surface.name.as_str(), "lamp" | "ceiling" | "left"));
        world
    };
    let room = |settings: &str| cornell(32, settings, "");
    let differ = |name: &str, [rays, maps]: [Image; 2], tolerated: f64| {
        let error = metrics::linear::linear_errors(&maps, &rays).relative_rmse;
        println!("{name}: maps differ from rays by {:.3} %", 100.0 * error);
        assert!(error > 0.0 && error < tolerated, "{name}: {error}");
    };
    differ("room", both(&gpu, settings, room), tolerance::MAPS);
    differ("sky", both(&gpu, settings, open), tolerance::MAPS_OF_SKY);
}

/// One light of a lamp: a pixel that maps show otherwise than rays is no farther from an edge of a shadow than a texel reaches, but where
/// light is so grazing that a texel reaches far along the surface.
#[test]
fn a_shadow_differs_at_its_edges_alone() {
    let Some(gpu) = gpu() else { return };
    let (side, reach) = (96, 3);
    let settings = "paths = 1\nwalks = 1\nsamples = 1\nbounces = 0\nclamp = 0.0";
    let [rays, maps] = both(&gpu, settings, |settings| cornell(side, settings, ""));
    let lit = |image: &Image, x: u32, y: u32| image.pixels[(y * side + x) as usize][1] > 0.0;
    let brightest = rays.pixels.iter().map(|pixel| pixel[1]).filter(|&green| green < 2.0).fold(0.0, f32::max);
    let (mut wrong, mut grazed, mut dark) = (0, 0, 0);
    for (x, y) in (0..side).flat_map(|y| (0..side).map(move |x| (x, y))) {
        let [truth, found] = [&rays, &maps].map(|image| image.pixels[(y * side + x) as usize]);
        dark += u32::from(truth[1] == 0.0);
        if truth == found {
            continue;
        }
        if truth[1].max(found[1]) < GRAZING * brightest {
            grazed += 1;
            continue;
        }
        wrong += 1;
        let near = |at: u32| at.saturating_sub(reach)..=(at + reach).min(side - 1);
        let edge = near(y).any(|v| near(x).any(|u| lit(&rays, u, v) != lit(&rays, x, y)));
        assert!(edge, "({x}, {y}): {found:?} for {truth:?}");
    }
    println!("{wrong} pixels differ of {}, {grazed} where light grazes, {dark} are dark", side * side);
    assert!(dark > side * side / 20 && wrong + grazed < dark / 8, "{wrong}, {grazed} of {dark}");
}

/// In a closed room every light is seen from everywhere: what is lost is where a wall is seen at its edge, in less than a texel.
#[test]
fn a_furnace_has_no_shadows() {
    let Some(gpu) = gpu() else { return };
    let [rays, maps] = both(&gpu, "paths = 64\ncompensation = \"off\"", |settings| furnace(0.5, 1.0, settings));
    let error = metrics::linear::linear_errors(&maps, &rays).relative_rmse;
    println!("furnace: maps differ from rays by {error:.1e}");
    assert!(error < 1e-3, "{error}");
}

/// Of maps so large that the atlas has room for four lights, each four take turns, and nothing is lost.
#[test]
fn maps_take_turns() {
    let Some(gpu) = gpu() else { return };
    let error = |resolution: u32| {
        let settings = format!("paths = 8\nsamples = 2\ncompensation = \"off\"\nmap_resolution = {resolution}");
        let [rays, maps] = both(&gpu, &settings, |settings| cornell(150, settings, ""));
        metrics::linear::linear_errors(&maps, &rays).relative_rmse
    };
    let (coarse, fine) = (error(64), error(1024));
    println!("maps of 64 texels differ by {:.3} %, of 1024 by {:.3} %", 100.0 * coarse, 100.0 * fine);
    assert!(fine < 0.3 * coarse, "{fine}, {coarse}");
}
