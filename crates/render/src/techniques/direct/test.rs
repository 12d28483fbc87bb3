//! Every kind of light against the reference, which follows light to its first surface; and smoke over a floor.

use glam::Vec2;
use tyndall_reference::{Random, Tracer};
use tyndall_scene::World;
use tyndall_scene::image::Image;
use tyndall_scene::metrics::linear::linear_errors;

use crate::surfaces::test::{through, view_of};
use crate::test::{gpu, picture, tolerance, world};

const SCENE: &str = "camera = { position = [1.6, 1.5, 3.4], target = [0, 0.5, 0], fov = 40 }\nfilm.size = [48, 36]\n\
    surfaces.floor = { shape.quad = { corner = [-2, 0, 2], edges = [[4, 0, 0], [0, 0, -4]] } }\n\
    surfaces.ball = { shape.sphere = { center = [0.2, 0.5, 0], radius = 0.5 }, material = \"rough\" }\n\
    surfaces.wall = { shape.quad = { corner = [-1.2, 0, 1], edges = [[0.01, 0, -2], [0, 1.4, 0.3]] }, material = \"red\" }\n\
    surfaces.block = { shape.box = { min = [0.6, 0, 0.6], max = [0.9, 0.7, 0.9] }, transform.rotate = [0, 20, 0] }\n\
    materials.red.lambert.reflectance = [0.7, 0.1, 0.1]\n\
    materials.rough.metallic_roughness = { base_color = [0.9, 0.7, 0.3], metallic = 0.5, roughness = 0.6 }\n";

/// Smoke beside the ball, above the floor.
const SMOKE: &str = "[media.smoke]\ndensity.sphere = { center = [-0.5, 0.6, 0.7], radius = 0.5, falloff = 0.3 }\n\
    optics.coefficients = { sigma_s = 4, sigma_a = 1 }\n";

/// The reference's light of the first order through the middle of every pixel, the mean of so many paths.
fn reference(world: &World, samples: u32) -> Image {
    let tracer = Tracer::new(world).unwrap();
    let view = view_of(world);
    let mut rng = Random::new(1, 0, 0);
    let pixels = (0..view.width * view.height).map(|i| {
        let film = Vec2::new((i % view.width) as f32, (i / view.width) as f32) + 0.5;
        let direction = through(&view, film);
        let paths = (0..samples).map(|_| tracer.radiance(view.position.as_dvec3(), direction, Some(1), &mut rng));
        (paths.sum::<glam::DVec3>() / f64::from(samples)).as_vec3().to_array()
    });
    Image { width: view.width, height: view.height, pixels: pixels.collect(), ..Default::default() }
}

/// How far the picture of this light is from the reference's: the root of the mean squared error over that of the mean square.
fn error(more: &str, samples: u32) -> Option<f64> {
    let gpu = gpu()?;
    let world = world(&format!("{SCENE}{more}"));
    Some(linear_errors(&picture(&gpu, &world), &reference(&world, samples)).relative_rmse)
}

#[test]
fn lights_without_a_size_agree_with_the_reference() {
    for light in [
        "lights.sun.directional = { direction = [-2, -1.5, -1], irradiance = [3, 2, 1] }",
        "lights.lamp.point = { position = [0.9, 1.6, 1.2], intensity = [1, 2, 3] }",
        "lights.spot.spot = { position = [2, 1.5, 1], direction = [-2, -1.5, -1], intensity = 3, inner_angle = 20, outer_angle = 50 }",
        "lights.spot.spot = { position = [2, 1.5, 1], direction = [-2, -1.5, -1], intensity = 3, inner_angle = 40, outer_angle = 80 }",
    ] {
        let Some(error) = error(&format!("{light}\ntechniques.direct.shadow_radius = 0.5"), 1) else { return };
        eprintln!("{light} {error}");
        assert!(error <= tolerance::DIRECT, "{light}: {error}");
    }
}

#[test]
fn area_lights_and_skies_agree_with_the_reference() {
    for (light, budget) in [
        (
            "surfaces.lamp = { shape.quad = { corner = [0.5, 2, 0], edges = [[1, 0, 0], [0, 0, 1]] }, radiance = [3, 2, 1] }",
            0.05,
        ),
        ("surfaces.lamp = { shape.sphere = { center = [1.5, 1.6, 0.5], radius = 0.3 }, radiance = [9, 6, 3] }", 0.05),
        ("lights.sky.constant.radiance = [1, 2, 3]", 0.05),
    ] {
        let Some(error) = error(light, 64) else { return };
        eprintln!("{light} {error}");
        assert!(error <= budget, "{light}: {error}");
    }
}

#[test]
fn smoke_over_a_floor_agrees_with_the_reference() {
    let sun = "lights.sun.directional = { direction = [-2, -1.5, -1], irradiance = 3 }\n";
    let Some(error) = error(&format!("{sun}techniques.march.step = 0.5\n{SMOKE}"), 64) else { return };
    eprintln!("smoke {error}");
    assert!(error <= tolerance::DIRECT_SMOKE, "{error}");
}

/// The tests see a light that is a tenth too bright.
#[test]
fn another_light_is_caught() {
    let Some(gpu) = gpu() else { return };
    let sun = |irradiance: f32| {
        world(&format!("{SCENE}lights.sun.directional = {{ direction = [-2, -1.5, -1], irradiance = {irradiance} }}"))
    };
    let error = linear_errors(&picture(&gpu, &sun(3.3)), &reference(&sun(3.0), 1)).relative_rmse;
    assert!(error > tolerance::DIRECT, "{error}");
}
