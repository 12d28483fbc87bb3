//! Light maps against a closed form, against the picture of the same virtual lights, and against the reference; all of them by way of
//! a file.

use std::ops::ControlFlow;

use tyndall_scene::World;
use tyndall_scene::assets::Embedded;
use tyndall_scene::image::Image;
use tyndall_scene::metrics::linear::linear_errors;
use tyndall_scene::surface::Export;

use super::{Baked, bake};
use crate::techniques::instant_radiosity::test::{cornell, furnace, reference, without_lamp};
use crate::test::{gpu, picture, tolerance, world_of};
use crate::{Gpu, RenderError};

fn baked(gpu: &Gpu, world: &World, side: u32) -> Result<Baked, RenderError> {
    pollster::block_on(bake(gpu, world, side, &mut |_| ControlFlow::Continue(())))
}

/// What a file of the light map looks like from the world's camera, `fine` times as fine in each direction and averaged.
fn seen(gpu: &Gpu, world: &World, side: u32, fine: u32) -> Image {
    let surfaces = baked(gpu, world, side).unwrap().surfaces;
    let [width, height] = world.scene.film.size;
    let cameras = vec![("eye".into(), world.scene.camera.clone(), width as f32 / height as f32)];
    let glb = Export { surfaces, cameras, ..Export::default() }.to_glb().unwrap();
    let scene = format!("film.size = [{}, {}]\nsurfaces.all.shape.mesh.file = \"a.glb\"", fine * width, fine * height);
    let read = world_of(&scene, &Embedded(vec![("a.glb", &glb)]));
    assert!(read.lights.is_empty(), "the light is in the map");
    let image = picture(gpu, &read);
    let mean = |i: u32| {
        let (x, y) = (i % width * fine, i / width * fine);
        let pixels = (0..fine * fine).map(|k| image.pixels[((y + k / fine) * fine * width + x + k % fine) as usize]);
        pixels.fold([0.0; 3], |sum, p| [0, 1, 2].map(|c| sum[c] + p[c] / (fine * fine) as f32))
    };
    Image { width, height, pixels: (0..width * height).map(mean).collect(), ..Default::default() }
}

/// L = L_e/(1 − ρ) everywhere [truth 1], in corners and at edges, too.
#[test]
fn a_furnace_is_the_same_everywhere() {
    let Some(gpu) = gpu() else { return };
    let image = seen(&gpu, &furnace(0.5, 1.0, "paths = 256\nclamp = 0.2"), 48, 1);
    let mean = image.pixels.iter().map(|p| p[0]).sum::<f32>() / image.pixels.len() as f32;
    let worst = image.pixels.iter().map(|p| (p[0] / 2.0 - 1.0).abs()).fold(0.0, f32::max);
    println!("baked furnace: mean {mean}, at worst {worst} off");
    assert!((mean / 2.0 - 1.0).abs() < tolerance::FURNACE, "{mean}");
    assert!(worst < tolerance::BAKED_TEXEL, "{worst}");
}

/// Without short rays, which are random, the map's texels are what pixels are at the same places.
#[test]
fn the_cornell_box_looks_as_it_is_rendered() {
    let Some(gpu) = gpu() else { return };
    let world = cornell(48, "paths = 32\nsamples = 1\ncompensation = \"off\"", "");
    let (map, image) = (seen(&gpu, &world, 160, 1), picture(&gpu, &world));
    let error = linear_errors(&map, &image).relative_rmse;
    let other = picture(&gpu, &cornell(48, "paths = 32\nsamples = 1\nseed = 1\ncompensation = \"off\"", ""));
    println!("baked: {:.2} % from the picture of the same lights", 100.0 * error);
    assert!(error < tolerance::BAKED, "{error}");
    let worse = linear_errors(&map, &other).relative_rmse;
    assert!(worse > tolerance::BAKED, "{worse}: other lights must be told apart");
}

#[test]
fn the_cornell_box_agrees_with_the_reference() {
    let Some(gpu) = gpu() else { return };
    let world = cornell(32, "paths = 256\nsamples = 64", "");
    let error = without_lamp(&seen(&gpu, &world, 96, 4), &reference(&world, None, 256));
    println!("baked: {:.2} % from the reference, without the lamp", 100.0 * error);
    assert!(error < tolerance::BAKED_ROOM, "{error}");
}

/// Walls of which the fronts face outwards are lit from behind, and are seen from there.
#[test]
fn backs_that_light_reaches_are_baked() {
    let Some(gpu) = gpu() else { return };
    let mut world = cornell(16, "paths = 16\nsamples = 1\ncompensation = \"off\"", "");
    for surface in world.surfaces.iter_mut().filter(|surface| surface.name == "back") {
        let mesh = std::sync::Arc::make_mut(&mut surface.mesh);
        mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        mesh.normals.iter_mut().for_each(|normal| *normal = -*normal);
    }
    let names: Vec<_> = baked(&gpu, &world, 64).unwrap().surfaces.into_iter().map(|s| s.surface.name).collect();
    assert!(names.contains(&"back, back".to_owned()) && !names.contains(&"back".to_owned()), "{names:?}");
    assert!(names.contains(&"floor".to_owned()) && !names.contains(&"tall, back".to_owned()), "{names:?}");
}

#[test]
fn what_does_not_fit_is_said_and_work_is_broken_off() {
    let Some(gpu) = gpu() else { return };
    let world = cornell(16, "paths = 4\nsamples = 1", "");
    let error = baked(&gpu, &world, 16).unwrap_err().to_string();
    assert!(error.starts_with("the light map: found") && error.contains("16 x 16 texels"), "{error}");
    let stopped = pollster::block_on(bake(&gpu, &world, 64, &mut |_| ControlFlow::Break(())));
    assert!(matches!(stopped, Err(RenderError::Interrupted)));
}
