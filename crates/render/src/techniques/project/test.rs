//! Projections against closed forms and their own brute force.

use std::sync::Arc;

use glam::Mat4;
use tyndall_scene::image::Image;
use tyndall_scene::metrics::linear::linear_errors;
use tyndall_scene::volume::{Grid, Voxels};
use tyndall_scene::{Field, World};

use crate::test::{blob, glowing_plume, gpu, picture, render, small_fire, tolerance, world};
use crate::{Gpu, RenderError};

/// A unit cube whose value is the number of the voxel along x, 0 to 31, seen along +x from `x`.
fn gradient(x: f32, projection: &str) -> World {
    let mut world = world(&format!(
        "camera = {{ position = [{x}, 0, 0], target = [9, 0, 0], fov = 0.001 }}\nfilm.size = [2, 2]\n\
         techniques.project = {{ projection = \"{projection}\", step = 0.125 }}\n[media.ramp]\n\
         density.homogeneous = {{ min = [-0.5, -0.5, -0.5], max = [0.5, 0.5, 0.5] }}\noptics.coefficients.sigma_a = 1"
    ));
    let voxels = Voxels::F32((0..32 * 4 * 4).map(|i| (i % 32) as f32).collect());
    world.volumes[0].field = Field::Grid(Arc::new(Grid::dense([32, 4, 4], voxels, Mat4::IDENTITY)));
    world
}

fn value(gpu: &Gpu, world: &World) -> f64 {
    picture(gpu, world).pixels[0][0].into()
}

fn assert_close(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance * expected.abs().max(1.0), "{found} for {expected}");
}

#[test]
fn a_ramp_has_known_projections() {
    let Some(gpu) = gpu() else { return };
    for (projection, expected) in [("maximum", 31.0), ("minimum", 0.0), ("average", 15.5)] {
        assert_close(value(&gpu, &gradient(-5.0, projection)), expected, tolerance::EXACT);
    }
}

/// From the middle of the ramp, between voxels 15 and 16: the first sample lies a 16th of a voxel ahead. The average is over 15
/// voxels and a half of the slope, from 15.5 to 31, and half a voxel at 31.
#[test]
fn a_ramp_from_within() {
    let Some(gpu) = gpu() else { return };
    let average = (15.5 * (15.5 + 31.0) / 2.0 + 0.5 * 31.0) / 16.0;
    for (projection, expected) in [("maximum", 31.0), ("minimum", 15.5625), ("average", average)] {
        assert_close(value(&gpu, &gradient(0.0, projection)), expected, tolerance::EXACT);
    }
}

/// The average of e^{−y/H} over 1 m is H (1 − e^{−1/H}).
#[test]
fn an_exponential_field_has_a_known_average() {
    let Some(gpu) = gpu() else { return };
    let text = "camera = { position = [0.5, -3, 0.5], target = [0.5, 0, 0.5], up = [0, 0, 1], fov = 0.001 }\n\
        film.size = [2, 2]\ntechniques.project.projection = \"average\"\n[media.fog]\n\
        density.exponential = { min = [0, 0, 0], max = [1, 1, 1], scale_height = 0.3 }\noptics.coefficients.sigma_a = 4";
    assert_close(value(&gpu, &world(text)), 0.3 * -(-1.0f64 / 0.3).exp_m1(), tolerance::SMOOTH);
}

/// Of two media, the extreme is that of both; the average counts each by its length.
#[test]
fn two_media() {
    let Some(gpu) = gpu() else { return };
    let scene = |projection: &str| {
        let mut world = world(&format!(
            "camera = {{ position = [0.5, 0.5, 5], target = [0.5, 0.5, 0], fov = 0.001 }}\nfilm.size = [2, 2]\n\
             techniques.project.projection = \"{projection}\"\n\
             [media.a]\ndensity.homogeneous = {{ min = [0, 0, 0], max = [1, 1, 1] }}\noptics.coefficients.sigma_a = 1\n\
             [media.b]\ndensity.homogeneous = {{ min = [0, 0, 0.5], max = [1, 1, 3.5] }}\noptics.coefficients.sigma_a = 1"
        ));
        world.volumes[0].field = Field::Grid(Arc::new(Grid::dense([2; 3], Voxels::F32(vec![5.0; 8]), Mat4::IDENTITY)));
        value(&gpu, &world)
    };
    assert_close(scene("maximum"), 5.0, tolerance::EXACT);
    assert_close(scene("minimum"), 1.0, tolerance::EXACT);
    assert_close(scene("average"), (5.0 + 3.0 * 1.0) / 4.0, tolerance::EXACT);
}

/// A transfer function shows the value's colour, whatever its opacity; beside the volume is the environment.
#[test]
fn colours_and_environment() {
    let Some(gpu) = gpu() else { return };
    let text = "camera = { position = [0, 0, 5], target = [0, 0, 0], fov = 30 }\nfilm.size = [9, 9]\n\
        lights.sky.constant.radiance = [1, 2, 3]\ntechniques.project = {}\n[media.box]\n\
        density.homogeneous = { min = [-0.5, -0.5, -0.5], max = [0.5, 0.5, 0.5] }\n\
        optics.transfer = { unit_length = 1, radiance = 8, stops = [{ value = 0, opacity = 0, color = [0.5, 0.25, 0] }] }";
    let image = picture(&gpu, &world(text));
    assert_eq!(image.pixels[0], [1.0, 2.0, 3.0]);
    assert_eq!(image.pixels[40], [4.0, 2.0, 0.0]);
}

fn scenes(gpu: &Gpu, settings: &str) -> [Image; 3] {
    let technique = format!("[techniques.project]\n{settings}");
    [blob, glowing_plume, small_fire].map(|scene| picture(gpu, &scene(&technique)))
}

#[test]
fn skipping_changes_nothing() {
    let Some(gpu) = gpu() else { return };
    for projection in ["maximum", "minimum"] {
        let [on, off] = ["on", "off"]
            .map(|skipping| scenes(&gpu, &format!("projection = \"{projection}\"\nskipping = \"{skipping}\"")));
        for (on, off) in on.iter().zip(&off) {
            assert_eq!(on.pixels, off.pixels, "{projection}");
        }
    }
}

#[test]
fn the_default_step_is_close_to_a_fine_one() {
    let Some(gpu) = gpu() else { return };
    for projection in ["maximum", "minimum", "average"] {
        let [found, coarse, brute] = ["", "step = 16", "step = 0.02"]
            .map(|step| scenes(&gpu, &format!("projection = \"{projection}\"\n{step}")));
        let error = |image: &[Image; 3]| [0, 1, 2].map(|i| linear_errors(&image[i], &brute[i]).relative_rmse);
        let (found, coarse) = (error(&found), error(&coarse));
        eprintln!("{projection}: {found:?} with the default step, {coarse:?} with one of 16 voxels");
        assert!(found[..2].iter().all(|&error| error <= tolerance::PROJECTION), "{projection}: {found:?}");
        let seen = projection == "minimum" || coarse.iter().any(|&error| error > tolerance::PROJECTION);
        assert!(seen, "{projection}: the test sees steps that are too long");
    }
}

#[test]
fn a_ray_too_long_for_an_invocation_is_refused() {
    let Some(mut gpu) = gpu() else { return };
    gpu.limit_iterations(100);
    match render(&gpu, &gradient(-5.0, "maximum")) {
        Err(error @ RenderError::Limit { .. }) => assert!(error.to_string().contains("longer step"), "{error}"),
        other => panic!("{:?}", other.map(|_| "a picture")),
    }
}
