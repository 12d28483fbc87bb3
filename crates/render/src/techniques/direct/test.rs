//! Every kind of light against the reference, which follows light to its first surface; and smoke over a floor.

use std::sync::Arc;

use glam::{DVec3, Vec2};
use tyndall_reference::{Random, Tracer};
use tyndall_scene::image::Image;
use tyndall_scene::metrics::linear::linear_errors;
use tyndall_scene::{EnvironmentMap, World};

use crate::resident::surfaces::triangles;
use crate::surfaces::test::{cast, through, view_of};
use crate::test::{gpu, maps, picture, render, tolerance, world};

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

/// A long bar of smoke.
const MANY: &str = "[media.bar]\ndensity.noise = { min = [-9, 3, 0], max = [9, 3.1, 0.1], scale = 1 }\n\
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
        (paths.sum::<DVec3>() / f64::from(samples)).as_vec3().to_array()
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
        assert!(error <= tolerance::DIRECT, "{light}: {error}");
    }
}

/// What has a size, on rough metal, too: the reference's noise is some 2 %.
#[test]
fn lights_with_a_size_agree_with_the_reference() {
    for light in [
        "surfaces.lamp = { shape.quad = { corner = [0.5, 2, 0], edges = [[1, 0, 0], [0, 0, 1]] }, radiance = [3, 2, 1] }",
        "surfaces.lamp = { shape.sphere = { center = [1.5, 1.6, 0.5], radius = 0.2 }, radiance = [9, 6, 3] }",
        "lights.sky.constant.radiance = [1, 2, 3]",
    ] {
        let Some(error) = error(light, 64) else { return };
        assert!(error <= tolerance::DIRECT_SIZE, "{light}: {error}");
    }
    // A sky that is bright towards the sun, all around.
    let Some(gpu) = gpu() else { return };
    let mut world = world(SCENE);
    let pixels =
        (0..32 * 16).map(|i| [0.3 + 6.0 * (-0.02 * ((i % 32 - 20i32).pow(2) + (i / 32 - 3).pow(2)) as f32).exp(); 3]);
    let map = Image { width: 32, height: 16, pixels: pixels.collect(), ..Default::default() };
    world.environment = Some(Arc::new(EnvironmentMap::new(map, 0.0).unwrap()));
    let error = linear_errors(&picture(&gpu, &world), &reference(&world, 64)).relative_rmse;
    assert!(error <= tolerance::DIRECT_SIZE, "map: {error}");
}

/// Floor, wall and block without the ball, of Lambert's kind, in this light: how far the picture is from a sum over so many
/// small lights on the host, of each of which `light` says, for its number and a point, the unit direction to it, its distance
/// [m] and the irradiance across it.
fn error_of_many(more: &str, lights: u32, light: impl Fn(u32, DVec3) -> (DVec3, f64, f64)) -> Option<f64> {
    let gpu = gpu()?;
    let without: String = SCENE.lines().filter(|line| !line.contains("ball")).collect::<Vec<_>>().join("\n");
    let world = world(&format!("{without}\n{more}"));
    let image = picture(&gpu, &world);
    let (vertices, list) = triangles(&world.surfaces);
    let corners: Vec<_> =
        list.iter().map(|t| [t.x, t.y, t.z].map(|i| vertices[i as usize].position.as_dvec3())).collect();
    let view = view_of(&world);
    let eye = view.position.as_dvec3();
    let (mut found, mut expected) = (Vec::new(), Vec::new());
    for (i, pixel) in image.pixels.iter().enumerate() {
        let film = Vec2::new((i as u32 % view.width) as f32, (i as u32 / view.width) as f32) + 0.5;
        let direction = through(&view, film);
        let Some((number, distance)) = cast(&corners, eye, direction) else { continue };
        let surface = &world.surfaces[list[number].w as usize];
        if surface.material.emission != glam::Vec3::ZERO {
            continue;
        }
        let [a, b, c] = corners[number];
        let mut normal = (b - a).cross(c - a).normalize();
        normal *= -normal.dot(direction).signum();
        let point = eye + distance * direction + 1e-7 * normal;
        let reached = (0..lights).map(|k| {
            let (towards, distance, irradiance) = light(k, point);
            let cosine = normal.dot(towards);
            let free = cosine > 0.0 && cast(&corners, point, towards).is_none_or(|(_, t)| t >= distance * (1.0 - 1e-6));
            if free { cosine * irradiance } else { 0.0 }
        });
        let reflectance = if surface.name == "wall" { 0.7 } else { 0.5 };
        expected.push([(reached.sum::<f64>() * reflectance / std::f64::consts::PI) as f32; 3]);
        found.push([pixel[0]; 3]);
    }
    let image = |pixels: Vec<[f32; 3]>| Image { width: pixels.len() as u32, height: 1, pixels, ..Default::default() };
    Some(linear_errors(&image(found), &image(expected)).relative_rmse)
}

/// A lamp of 1 m², facing down, as 400 points.
#[test]
fn area_lights_agree_with_many_points() {
    let lamp =
        "surfaces.lamp = { shape.quad = { corner = [0.5, 2, 0], edges = [[1, 0, 0], [0, 0, 1]] }, radiance = 3 }\n";
    for (points, budget) in [(16, tolerance::DIRECT_AREA), (256, tolerance::DIRECT_AREA_MANY)] {
        let Some(error) = error_of_many(&format!("{lamp}techniques.direct.area_points = {points}"), 400, |k, point| {
            let [x, z] = [k % 20, k / 20].map(|k| (f64::from(k) + 0.5) / 20.0);
            let to_light = DVec3::new(0.5 + x, 2.0, z) - point;
            let (towards, squared) = (to_light.normalize(), to_light.length_squared());
            (towards, squared.sqrt(), 3.0 * towards.y.max(0.0) / squared / 400.0)
        }) else {
            return;
        };
        assert!(error <= budget, "{points} points: {error}");
    }
}

/// A constant sky as 2000 directions.
#[test]
fn skies_agree_with_many_directions() {
    for (directions, budget) in [(16, tolerance::DIRECT_SKY), (128, tolerance::DIRECT_SKY_MANY)] {
        let sky = format!("lights.sky.constant.radiance = 2\ntechniques.direct.environment_directions = {directions}");
        let Some(error) = error_of_many(&sky, 2000, |k, _| {
            let y = 1.0 - (f64::from(k) + 0.5) / 1000.0;
            let (r, phi) = ((1.0 - y * y).sqrt(), f64::from(k) * 2.399_963_229_728_653);
            let towards = DVec3::new(r * phi.cos(), y, r * phi.sin());
            (towards, f64::INFINITY, 2.0 * 4.0 * std::f64::consts::PI / 2000.0)
        }) else {
            return;
        };
        assert!(error <= budget, "{directions} directions: {error}");
    }
}

/// A square that glows, slantwise before a blue sky.
const GLOWING: &str = "camera = { position = [0, 0, 4], target = [0, 0, 0], fov = 40 }\nfilm.size = [140, 36]\n\
    lights.sky.constant.radiance = [0, 0, 1]\nmaterials.black.lambert.reflectance = 0\n\
    surfaces.square = { shape.quad = { corner = [-0.9, -0.5, 0], edges = [[1.6, 0.5, 0], [-0.5, 1.3, 0]] }, \
    radiance = [1, 1, 0], material = \"black\" }\n";

/// Edges against the sky are as the reference has them, whose rays are a grid of 16 x 16 a pixel.
#[test]
fn edges_are_averaged_over_pixels() {
    let Some(gpu) = gpu() else { return };
    let of = |samples: u32| world(&format!("techniques.direct.samples = {samples}\n{GLOWING}"));
    let expected = maps::reference(&of(1), 16);
    let largest = |samples: u32| {
        let pairs = picture(&gpu, &of(samples)).pixels.into_iter().zip(&expected.pixels);
        let errors = pairs.flat_map(|(a, b)| [0, 1, 2].map(|c| (a[c] - b[c]).abs()));
        errors.fold(0f32, f32::max)
    };
    let [one, several, many] = [1, 16, 64].map(largest);
    println!("the largest error of 1, 16, 64 rays a pixel: {one:.3}, {several:.3}, {many:.3}");
    assert!(one > 0.4, "{one}");
    assert!(several < tolerance::EDGES as f32 && many < 0.5 * tolerance::EDGES as f32, "{several} {many}");
}

/// As are those of a lit scene, in the picture as a whole.
#[test]
fn edges_of_a_scene_agree_with_the_reference() {
    let Some(gpu) = gpu() else { return };
    let sun = "lights.sun.directional = { direction = [-2, -1.5, -1], irradiance = [3, 2, 1] }";
    let of = |samples: u32| world(&format!("{SCENE}techniques.direct.samples = {samples}\n{sun}"));
    let expected = maps::reference(&of(1), 8);
    let [one, several] = [1, 16].map(|samples| linear_errors(&picture(&gpu, &of(samples)), &expected).relative_rmse);
    println!("relative RMSE of 1 and 16 rays a pixel: {one:.4}, {several:.4}");
    assert!(several < tolerance::DIRECT && several < 0.2 * one, "{one} {several}");
}

/// A slab that absorbs, before the square: of every pixel, on edges too, as much comes through as along its ray.
#[test]
fn media_lie_before_edges() {
    let Some(gpu) = gpu() else { return };
    let slab = "[media.slab]\ndensity.homogeneous = { min = [-9, -9, 1], max = [9, 9, 1.5] }\noptics.coefficients.sigma_a = 2\n";
    let of = |media: &str| {
        world(&format!("techniques = {{ direct.samples = 16, march.model = \"absorption\" }}\n{GLOWING}{media}"))
    };
    let view = view_of(&of(""));
    let (clear, behind) = (picture(&gpu, &of("")), picture(&gpu, &of(slab)));
    let mut edges = 0;
    for (i, (clear, behind)) in clear.pixels.iter().zip(&behind.pixels).enumerate() {
        let film = Vec2::new((i as u32 % view.width) as f32, (i as u32 / view.width) as f32) + 0.5;
        let transmittance = (-1.0 / -through(&view, film).z).exp() as f32;
        edges += u32::from(clear[0] > 0.0 && clear[2] > 0.0);
        for c in 0..3 {
            let expected = transmittance * clear[c];
            assert!((behind[c] - expected).abs() <= tolerance::EXACT as f32, "{film}: {behind:?} {clear:?}");
        }
    }
    assert!(edges > 60, "{edges}");
}

#[test]
fn smoke_over_a_floor_agrees_with_the_reference() {
    let sun = "lights.sun.directional = { direction = [-2, -1.5, -1], irradiance = 3 }\n";
    let Some(error) = error(&format!("{sun}techniques.march.step = 0.5\n{SMOKE}"), 64) else { return };
    assert!(error <= tolerance::DIRECT_SMOKE, "{error}");
}

/// A roof over half of a thin medium keeps the sun from that half, and from no more.
#[test]
fn media_receive_shadows() {
    let Some(gpu) = gpu() else { return };
    let of = |roof: &str| {
        let text = format!(
            "camera = {{ position = [0, 0, 5], target = [0, 0, 0], fov = 2 }}\nfilm.size = [40, 4]\n\
             lights.sun.directional = {{ direction = [0, -1, 0], irradiance = 1 }}\n{roof}\n[media.m]\n\
             density.homogeneous = {{ min = [-0.8, -0.5, -0.5], max = [0.8, 0.5, 0.5] }}\noptics.coefficients.sigma_s = 0.1"
        );
        picture(&gpu, &world(&text))
    };
    let (open, roofed) =
        (of(""), of("surfaces.roof.shape.quad = { corner = [0, 0.9, 2], edges = [[2, 0, 0], [0, 0, -4]] }"));
    // Rays converge: near the edge they see both halves.
    for (i, (open, roofed)) in open.pixels.iter().zip(&roofed.pixels).enumerate() {
        match i % 40 {
            0..=17 => {
                assert!((f64::from(open[0] / roofed[0]) - 1.0).abs() < tolerance::EXACT, "{i}: {open:?} {roofed:?}")
            }
            22..=39 => assert_eq!(*roofed, [0.0; 3], "{i}"),
            _ => {}
        }
    }
    assert!(open.pixels[30][0] > 1e-3);
}

/// Marched towards the eye, the picture is the same; at half the resolution it is nearly so, and surfaces keep theirs.
#[test]
fn media_end_at_surfaces_however_they_are_marched() {
    let Some(gpu) = gpu() else { return };
    let of = |settings: &str, smoke: &str| {
        let sun = "lights.sun.directional = { direction = [-2, -1.5, -1], irradiance = 3 }";
        let scene = SCENE.replace("[48, 36]", "[96, 72]");
        let text = format!("{scene}{sun}\ntechniques.march = {{ {settings} }}\n{smoke}");
        picture(&gpu, &world(&text))
    };
    let (whole, clear) = (of("", SMOKE), of("", ""));
    let turned = linear_errors(&of("order = \"back_to_front\"", SMOKE), &whole).relative_rmse;
    assert!(turned <= tolerance::SURFACE_ORDER, "{turned}");
    let half = linear_errors(&of("resolution = \"half\"", SMOKE), &whole).relative_rmse;
    assert!(half <= tolerance::SURFACE_HALF && half > 0.0, "{half}");
    assert_eq!(of("resolution = \"half\"", "").pixels, clear.pixels);
    let smoke = linear_errors(&clear, &whole).relative_rmse;
    assert!(smoke > 10.0 * tolerance::SURFACE_HALF, "the smoke is seen: {smoke}");
}

/// What does not end at surfaces refuses them.
#[test]
fn other_techniques_say_that_they_have_no_surfaces() {
    let Some(gpu) = gpu() else { return };
    for technique in ["project", "slicing", "splatting"] {
        let result = render(&gpu, &world(&format!("{SCENE}techniques.{technique} = {{}}\n{SMOKE}")));
        let message = result.err().map(|error| error.to_string()).unwrap_or_default();
        assert!(message.contains("surfaces.ball") && message.contains("techniques.march"), "{message}");
    }
}

/// More maps than the atlas holds, and more steps than an invocation stands, are said before they are made.
#[test]
fn what_does_not_fit_is_refused() {
    let Some(gpu) = gpu() else { return };
    let sky = "lights.sky.constant.radiance = 1\nsurfaces.lamp = { shape.sphere = { center = [1.5, 1.6, 0.5], radius = 0.2 }, radiance = 1 }\n";
    for (settings, says) in [
        ("environment_directions = 1024, shadow_resolution = 8192", "shadow_resolution"),
        ("area_points = 4096, shadow_resolution = 64", "area_points"),
        ("light_step = 0.01", "light_step"),
    ] {
        let result = render(&gpu, &world(&format!("{SCENE}{sky}techniques.direct = {{ {settings} }}\n{}", MANY)));
        let message = result.err().map(|error| error.to_string()).unwrap_or_default();
        assert!(message.contains(says), "{settings}: {message}");
    }
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
