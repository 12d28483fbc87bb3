//! Splatting against closed forms and the marcher.

use std::sync::Arc;

use glam::Mat4;
use tyndall_scene::image::Image;
use tyndall_scene::metrics::linear::linear_errors;
use tyndall_scene::volume::{Grid, Voxels};
use tyndall_scene::{Field, World};

use crate::RenderError;
use crate::test::{blob, glowing_plume, gpu, picture, render, small_fire, tolerance, world};

/// Looks along −z; the unit cube around the origin absorbs.
fn unit_box(fov: f32, size: u32, settings: &str, optics: &str) -> World {
    world(&format!(
        "camera = {{ position = [0, 0, 5], target = [0, 0, 0], fov = {fov} }}\nfilm.size = [{size}, {size}]\n\
         lights.sky.constant.radiance = 1\ntechniques.splatting = {{ {settings} }}\n[media.box]\n\
         density.homogeneous = {{ min = [-0.5, -0.5, -0.5], max = [0.5, 0.5, 0.5] }}\noptics.coefficients = {{ {optics} }}"
    ))
}

fn with_voxels(mut world: World, dims: [u32; 3], values: Vec<f32>) -> World {
    world.volumes[0].field = Field::Grid(Arc::new(Grid::dense(dims, Voxels::F32(values), Mat4::IDENTITY)));
    world
}

/// A single voxel of 1 m is one Gaussian, s = ½ m: −ln of what it lets through is σ e^{−r²/2s²}/(2π s² (1 − e^{−9/2})) [m] at
/// r metres from its middle.
#[test]
fn one_voxel_is_one_gaussian() {
    let Some(gpu) = gpu() else { return };
    let world = with_voxels(unit_box(20.0, 33, "", "sigma_a = 2"), [1; 3], vec![1.0]);
    let image = picture(&gpu, &world);
    let half = 10f64.to_radians().tan();
    for (x, pixel) in image.pixels[33 * 16..33 * 17].iter().enumerate() {
        // The distance from the origin to a ray from 5 m away.
        let slope = half * (2.0 * (x as f64 + 0.5) / 33.0 - 1.0);
        let squared = 25.0 * slope * slope / (1.0 + slope * slope);
        let peak = 2.0 / (2.0 * std::f64::consts::PI * 0.25 * -(-4.5f64).exp_m1());
        let expected = (-peak * (-squared / 0.5).exp()).exp();
        assert!((f64::from(pixel[0]) - expected).abs() < tolerance::EXACT, "{pixel:?} for {expected} at {x}");
    }
}

/// The optical depth summed over a footprint's pixels is the voxel's, σ·V, however wide the kernel.
#[test]
fn a_footprint_keeps_the_optical_depth() {
    let Some(gpu) = gpu() else { return };
    for sigma in [0.3, 0.5, 0.8] {
        let text = format!("model = \"absorption\", sigma = {sigma}");
        let mut world = with_voxels(unit_box(1.0, 64, &text, "sigma_a = 0.01"), [1; 3], vec![1.0]);
        // From so far that rays are parallel.
        world.scene.camera.position.z = 300.0;
        let pixel = 2.0 * 300.0 * 0.5f64.to_radians().tan() / 64.0;
        let sum: f64 = picture(&gpu, &world).pixels.iter().map(|p| -f64::from(p[0]).ln() * pixel * pixel).sum();
        assert!((sum / 0.01 - 1.0).abs() < tolerance::FOOTPRINT, "{sum} with a kernel of {sigma}");
    }
}

/// [ground truth 2] Through a homogeneous box, away from its edges, e^{−σL}, with kernels wide enough not to ripple; coarser splats
/// give the same.
#[test]
fn beers_law() {
    let Some(gpu) = gpu() else { return };
    for settings in ["sigma = 0.6", "sigma = 0.6, stride = 2", "sigma = 0.6, stride = 3", "sigma = 1"] {
        let world = unit_box(4.0, 8, settings, "sigma_a = 2");
        for pixel in picture(&gpu, &world).pixels {
            let error = f64::from(pixel[0]) / (-2f64).exp() - 1.0;
            assert!(error.abs() < tolerance::SPLATTED_BOX, "{error} with {settings:?}");
        }
    }
}

/// What is nearer hides what is farther, from whichever side one looks: the sort.
#[test]
fn the_nearer_hides_the_farther() {
    let Some(gpu) = gpu() else { return };
    // A row along z: a red voxel at its far end, a green one at its near end.
    let values: Vec<f32> = (0..8).map(|i| if i % 7 == 0 { 1.0 + i as f32 / 7.0 } else { 0.0 }).collect();
    let stops = "unit_length = 0.01, stops = [{ value = 0, opacity = 0, color = 0 }, \
                 { value = 1, opacity = 0.9, color = [1, 0, 0] }, { value = 2, opacity = 0.9, color = [0, 1, 0] }]";
    let scene = |z: i32| {
        let text = format!(
            "camera = {{ position = [0, 0, {z}], target = [0, 0, 0], fov = 0.01 }}\nfilm.size = [2, 2]\n\
             techniques.splatting = {{}}\n[media.row]\noptics.transfer = {{ {stops} }}\n\
             density.homogeneous = {{ min = [-0.5, -0.5, -0.5], max = [0.5, 0.5, 0.5] }}"
        );
        picture(&gpu, &with_voxels(world(&text), [1, 1, 8], values.clone())).pixels[0]
    };
    let (front, back) = (scene(5), scene(-5));
    assert!(front[1] > 0.99 && front[0] < 0.01, "{front:?}");
    assert!(back[0] > 0.99 && back[1] < 0.01, "{back:?}");
}

fn relative_rmse(found: &Image, expected: &Image) -> f64 {
    assert!(expected.pixels.iter().any(|p| p.iter().any(|&c| c > 0.0)), "there is something to compare");
    linear_errors(found, expected).relative_rmse
}

/// Against the marcher: smooth data, data with edges of a voxel, and data whose colours lie between voxels.
#[test]
fn splats_agree_with_the_marcher() {
    let Some(gpu) = gpu() else { return };
    let pictures = |settings: &str| {
        let technique = format!("[techniques.{settings}");
        [blob, glowing_plume, small_fire].map(|scene| picture(&gpu, &scene(&technique)))
    };
    let marched = pictures("march]\nmodel = \"emission\"\nstep = 0.25");
    let errors = |settings: &str| {
        let splatted = pictures(&format!("splatting]\n{settings}"));
        let errors = [0, 1, 2].map(|i| relative_rmse(&splatted[i], &marched[i]));
        eprintln!("{settings:?}: {errors:?} (blob, plume, fire)");
        errors
    };
    let [blob, plume, fire] = errors("");
    assert!(blob <= tolerance::SPLATTED_BLOB, "{blob}");
    assert!(plume <= tolerance::SPLATTED_PLUME, "{plume}");
    assert!(fire <= tolerance::SPLATTED_FIRE, "{fire}");
    let [blob, plume, _] = errors("stride = 4");
    assert!(
        blob > tolerance::SPLATTED_BLOB && plume > tolerance::SPLATTED_PLUME,
        "the test sees splats that are too coarse"
    );
}

#[test]
fn too_many_splats_are_refused() {
    let Some(gpu) = gpu() else { return };
    let mut world = unit_box(20.0, 4, "", "sigma_a = 1");
    world.volumes[0].world_from_unit = Mat4::from_scale(glam::vec3(1e6, 1.0, 1.0));
    match render(&gpu, &world) {
        Err(error @ RenderError::Limit { .. }) => assert!(error.to_string().contains("stride"), "{error}"),
        other => panic!("{:?}", other.map(|_| "a picture")),
    }
}

/// What is empty makes no splats, and nothing but empty voxels make a picture of the environment.
#[test]
fn nothing_is_the_environment() {
    let Some(gpu) = gpu() else { return };
    let world = with_voxels(unit_box(20.0, 4, "", "sigma_a = 1"), [20, 3, 3], vec![0.0; 180]);
    assert_eq!(picture(&gpu, &world).pixels, vec![[1.0; 3]; 16]);
}
