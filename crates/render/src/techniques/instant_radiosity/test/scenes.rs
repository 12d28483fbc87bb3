//! Instant radiosity in whole scenes: a model on tiles, a hall of many triangles, glass, a sky; and in an enclosure that is known.

use std::path::PathBuf;

use tyndall_scene::assets::Embedded;

use super::*;
use crate::test::world_of;

#[allow(dead_code, reason = "the example's own main")]
#[path = "../../../../../scene/examples/hall.rs"]
mod hall;

/// A cube of six patches, all of reflectance ½, one of which emits. What particles bring from there to the others are the form factors;
/// with these, of patches whose light is the same all over, B = E + ½ F B. [truth 7]
#[test]
fn a_cube_of_six_patches() {
    let mut world = furnace(0.5, 1.0, "paths = 65536\nbounces = 1");
    for surface in world.surfaces.iter_mut().filter(|surface| surface.name != "bottom") {
        let bsdf = surface.material.bsdf.clone();
        surface.material = std::sync::Arc::new(Material { bsdf, ..Material::default() });
    }
    let list = vpls(&world);
    let factor = |normal: Vec3| {
        let there = list.iter().filter(|vpl| vpl.bounce == 1 && vpl.normal.dot(normal) > 0.99);
        there.map(|vpl| f64::from(vpl.power.x) / 0.5).sum::<f64>()
    };
    let (opposite, beside) = (factor(Vec3::NEG_Y), factor(Vec3::X));
    println!("form factors: opposite {opposite:.5}, adjacent {beside:.5}");
    assert!((opposite / 0.199825 - 1.0).abs() < tolerance::FORM_FACTORS, "{opposite}");
    assert!((beside / 0.200044 - 1.0).abs() < tolerance::FORM_FACTORS, "{beside}");
    let (mut bottom, mut side, mut top) = (1.0, 0.0, 0.0);
    for _ in 0..60 {
        (bottom, side, top) = (
            1.0 + 0.5 * (4.0 * beside * side + opposite * top),
            0.5 * (beside * (bottom + top + 2.0 * side) + opposite * side),
            0.5 * (4.0 * beside * side + opposite * bottom),
        );
    }
    for (found, expected) in [(bottom, 1.0909), (side, 0.18175), (top, 0.18184)] {
        assert!((found / expected - 1.0).abs() < tolerance::FORM_FACTORS, "{found} for {expected}");
    }
}

/// Spot the cow on a floor of tiles, under a lamp and a sky; the model is not shipped.
#[test]
fn spot_agrees_with_the_reference() {
    let Some(gpu) = gpu() else { return };
    let folder = std::env::var_os("TYNDALL_DATA")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"), PathBuf::from);
    let Ok(spot) = std::fs::read(folder.join("spot.obj")) else {
        eprintln!("skipped: no spot.obj in {}", folder.display());
        return;
    };
    let tiles = include_bytes!("../../../../../../scenes/tiles.png");
    let scene = include_str!("../../../../../../scenes/spot.toml").replace("[512, 512]", "[32, 32]");
    let text = format!("{scene}\n[techniques.instant_radiosity]\npaths = 256");
    let world = world_of(&text, &Embedded(vec![("spot.obj", &spot), ("tiles.png", tiles)]));
    assert_near(&gpu, "cow", &world, None, 2048, tolerance::RADIOSITY);
}

/// A hall of 40,000 triangles.
#[test]
fn a_hall_agrees_with_the_reference() {
    let Some(gpu) = gpu() else { return };
    let hall = hall::hall();
    // Of 64 camera rays a pixel the edges of the lamps, seen from afar, alone are 3 % off.
    let settings = "[techniques.instant_radiosity]\npaths = 256\nsamples = 128";
    let mut world =
        world(&format!("camera = {{ position = [0, 0, 1], target = [0, 0, 0] }}\nfilm.size = [32, 32]\n{settings}"));
    world.scene.camera = hall.cameras[0].1.clone();
    world.surfaces = hall.surfaces.into_iter().map(|exported| exported.surface).collect();
    let triangles: usize = world.surfaces.iter().map(|surface| surface.mesh.triangles.len()).sum();
    assert!(triangles > 39_000, "{triangles}");
    assert_near(&gpu, "hall", &world, None, 4096, tolerance::RADIOSITY);
}

/// A ball of glass in the Cornell box, without the caustics that the eye sees.
#[test]
fn glass_agrees_with_the_reference() {
    let Some(gpu) = gpu() else { return };
    let ball = "[materials.glass.dielectric]\nior = 1.5\n[surfaces.ball]\nmaterial = \"glass\"\n\
                shape.sphere = { center = [0.68, 0.5, 0.6], radius = 0.15 }";
    let world = cornell(32, "paths = 256", ball);
    let [image, truth] = [picture(&gpu, &world), kept("glass", &world, None, 8192, false)];
    let [bias, room, flip] = errors(&world, &image, &truth);
    println!("glass: relative RMSE {:.2} %, without lamps {:.2} %, FLIP {flip:.4}", 100.0 * bias, 100.0 * room);
    assert!(bias <= tolerance::RADIOSITY && flip <= tolerance::RADIOSITY_FLIP, "{bias}, FLIP {flip}");
}

/// Under an environment map whose sun is a small part of it.
#[test]
fn a_sky_agrees_with_the_reference() {
    let Some(gpu) = gpu() else { return };
    let text = "camera = { position = [0.5, 0.5, 2.4], target = [0.5, 0.5, 0], fov = 38 }\nfilm.size = [32, 32]\n\
                lights.sky.environment.file = \"sky.exr\"\n[techniques.instant_radiosity]\npaths = 256\n";
    let sky = include_bytes!("../../../../../../scenes/sky.exr");
    let mut world = world_of(&format!("{text}{CORNELL}"), &Embedded(vec![("sky.exr", sky)]));
    world.surfaces.retain(|surface| !matches!(surface.name.as_str(), "lamp" | "ceiling" | "left" | "right"));
    assert_near(&gpu, "sky", &world, None, 2048, tolerance::RADIOSITY);
}

/// Vertex colours are honoured, by particles and by the eye.
#[test]
fn vertex_colors_agree_with_the_reference() {
    let Some(gpu) = gpu() else { return };
    let mut world = cornell(32, "paths = 256", "");
    for surface in &mut world.surfaces {
        let mut mesh = (*surface.mesh).clone();
        let color = |p: &Vec3| (0.3 + 0.7 * p.abs().min(Vec3::ONE)).extend(1.0);
        mesh.colors = mesh.positions.iter().map(color).collect();
        surface.mesh = std::sync::Arc::new(mesh);
    }
    assert_near(&gpu, "vertex-colors", &world, None, 2048, tolerance::RADIOSITY);
}

/// What alpha cuts away lets light through, for particles and for rays.
#[test]
fn cutouts_agree_with_the_reference() {
    let Some(gpu) = gpu() else { return };
    let mut world = cornell(32, "paths = 256", "");
    let tall = world.surfaces.iter_mut().find(|surface| surface.name == "tall").unwrap();
    let mut mesh = (*tall.mesh).clone();
    // Of its front a part is gone: alpha is 0 at one end and 1 at the other.
    mesh.colors = mesh.positions.iter().map(|p| glam::Vec4::new(1.0, 1.0, 1.0, 2.0 * p.y)).collect();
    tall.mesh = std::sync::Arc::new(mesh);
    tall.material =
        std::sync::Arc::new(Material { alpha_cutoff: Some(0.6), double_sided: true, ..(*tall.material).clone() });
    assert_near(&gpu, "cutouts", &world, None, 2048, tolerance::RADIOSITY);
}
