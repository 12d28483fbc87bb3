//! What does not fit is said before it is allocated, and a lost device is an error.

use std::sync::Arc;

use glam::Mat4;
use half::f16;
use tyndall_scene::volume::{Grid, Voxels};
use tyndall_scene::{Field, World};

use super::{PLUME, gpu, render, shipped, world, world_of};
use crate::RenderError;

const BOX: &str = "density.homogeneous = { min = [0, 0, 0], max = [1, 1, 1] }\noptics.coefficients = { sigma_a = 1 }\n";

fn limit(result: Result<crate::Rendering, RenderError>) -> String {
    match result {
        Err(error @ RenderError::Limit { .. }) => error.to_string(),
        other => panic!("{:?}", other.map(|_| "a picture")),
    }
}

fn scene(media: usize) -> String {
    let media: String = (0..media).map(|i| format!("[media.m{i}]\n{BOX}")).collect();
    format!("camera = {{ position = [0, 0, 5], target = [0, 0, 0] }}\nfilm.size = [4, 4]\n{media}")
}

#[test]
fn more_media_than_the_shader_holds() {
    let Some(gpu) = gpu() else { return };
    assert!(render(&gpu, &world(&scene(8))).is_ok());
    let message = limit(render(&gpu, &world(&scene(9))));
    assert!(message.contains("found 9 media; this device accepts at most 8 media"), "{message}");
}

/// Bricks are packed: a grid may be longer than a texture.
#[test]
fn a_grid_longer_than_a_texture() {
    let Some(gpu) = gpu() else { return };
    let longest = gpu.device.limits().max_texture_dimension_3d;
    let mut world: World = world(&scene(1));
    let dims = [longest + 1, 1, 1];
    let voxels = Voxels::F16((0..dims[0]).map(|i| f16::from_f32((i % 7) as f32)).collect());
    world.volumes[0].field = Field::Grid(Arc::new(Grid::dense(dims, voxels, Mat4::IDENTITY)));
    assert!(render(&gpu, &world).is_ok());
}

#[test]
fn more_light_steps_than_an_invocation_stands() {
    let Some(gpu) = gpu() else { return };
    let text = format!(
        "{PLUME}\n[lights.sky.constant]\nradiance = 1\n[techniques.march]\nenvironment_directions = 1024\nlight_step = 0.1\n"
    );
    let message = limit(render(&gpu, &world_of(&text, &shipped())));
    assert!(message.contains("lights") && message.contains("environment_directions"), "{message}");
}

#[test]
fn a_lost_device_is_an_error() {
    let Some(gpu) = gpu() else { return };
    gpu.device.destroy();
    assert!(render(&gpu, &world(&scene(1))).is_err());
}

#[test]
fn an_interruption_gives_no_picture() {
    let Some(gpu) = gpu() else { return };
    let world = world(&scene(1));
    let result = pollster::block_on(crate::render(&gpu, &world, &mut |_| std::ops::ControlFlow::Break(())));
    assert!(matches!(result, Err(RenderError::Interrupted)));
}

#[test]
fn an_empty_world_is_the_environment() {
    let Some(gpu) = gpu() else { return };
    let text = "camera = { position = [0, 0, 5], target = [0, 0, 0] }\nfilm.size = [5, 3]\nlights.sky.constant.radiance = [1, 2, 3]";
    let image = super::picture(&gpu, &world(text));
    assert_eq!(image.pixels, vec![[1.0, 2.0, 3.0]; 15]);
}

/// Volumes of absurd proportions, near and far: a picture of finite numbers, or an error, but no hang and no panic.
#[test]
fn absurd_proportions() {
    let Some(gpu) = gpu() else { return };
    let proportions = [("[1e9, 1, 1]", 0.0), ("[1e30, 1, 1e-6]", 0.0), ("1e12", 0.0), ("1e-9", 0.0), ("0.01", 1e7)];
    let techniques = ["march", "project", "slicing", "splatting"];
    for ((scale, place), technique) in proportions.iter().flat_map(|&p| techniques.map(|technique| (p, technique))) {
        let text = format!(
            "camera = {{ position = [{place}, 0.1, 5], target = [{place}, 0, 0] }}\nfilm.size = [4, 4]\n\
             lights.sun.directional = {{ direction = [-1, -1, -1], irradiance = 1 }}\n[media.fog]\n\
             density.exponential = {{ min = [-1, -1, -1], max = [1, 1, 1], scale_height = 1 }}\n\
             optics.coefficients.sigma_s = 1\ntransform = {{ scale = {scale}, translate = [{place}, 0, 0] }}\n\
             [techniques.{technique}]"
        );
        match render(&gpu, &world(&text)) {
            Ok(rendering) => {
                assert!(rendering.image.pixels.iter().flatten().all(|v| v.is_finite()), "{technique} {scale}")
            }
            Err(error) => assert!(matches!(error, RenderError::Limit { .. }), "{technique} {scale}: {error}"),
        }
    }
}
