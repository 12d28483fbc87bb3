//! Instant radiosity against closed forms.

use tyndall_scene::World;
use tyndall_scene::image::Image;
use tyndall_scene::parameter::Settings;

use super::geometry::Geometry;
use super::vpl::Vpl;
use super::{TECHNIQUE, lights, walk};
use crate::test::{gpu, picture, tolerance, world};

/// A cube of quads that face inwards, of reflectance and radiance, seen from within.
fn furnace(reflectance: f32, radiance: f32, settings: &str) -> World {
    let quad = |name: &str, corner: [f32; 3], u: [f32; 3], v: [f32; 3]| {
        format!("[surfaces.{name}]\nshape.quad = {{ corner = {corner:?}, edges = [{u:?}, {v:?}] }}\nmaterial = \"m\"\nradiance = {radiance}\n")
    };
    let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
    world(&format!(
        "camera = {{ position = [0.5, 0.45, 0.9], target = [0.3, 0.2, 0], fov = 90 }}\nfilm.size = [32, 32]\n\
         [materials.m.lambert]\nreflectance = {reflectance}\n[techniques.instant_radiosity]\n{settings}\n{}{}{}{}{}{}",
        quad("back", [0.0; 3], x, y),
        quad("front", z, y, x),
        quad("bottom", [0.0; 3], z, x),
        quad("top", y, x, z),
        quad("left", [0.0; 3], y, z),
        quad("right", x, z, y),
    ))
}

/// L = L_e/(1 − ρ) everywhere [truth 1].
#[test]
fn furnace_with_compensation() {
    let Some(gpu) = gpu() else { return };
    let mean = |settings: &str| {
        let image = picture(&gpu, &furnace(0.5, 1.0, settings));
        image.pixels.iter().map(|p| p[0]).sum::<f32>() / image.pixels.len() as f32
    };
    let compensated = mean("paths = 256\nclamp = 0.2");
    let clamped = mean("paths = 256\nclamp = 0.2\ncompensation = \"off\"");
    println!("furnace 2: {compensated} with compensation, {clamped} clamped: {:.1} % lost", 50.0 * (2.0 - clamped));
    assert!((compensated / 2.0 - 1.0).abs() < tolerance::FURNACE, "{compensated}");
    assert!(clamped < 2.0 * (1.0 - 2.0 * tolerance::FURNACE), "{clamped}: clamping must be seen");
}

/// The Cornell box: a cube of a metre with a light in its ceiling, and two blocks.
pub(crate) fn cornell(size: u32, settings: &str, more: &str) -> World {
    world(&format!(
        "camera = {{ position = [0.5, 0.5, 2.4], target = [0.5, 0.5, 0], fov = 38 }}\nfilm.size = [{size}, {size}]\n\
         [techniques.instant_radiosity]\n{settings}\n{CORNELL}\n{more}"
    ))
}

const CORNELL: &str = r#"
[materials.white.lambert]
reflectance = 0.73
[materials.red.lambert]
reflectance = [0.63, 0.065, 0.05]
[materials.green.lambert]
reflectance = [0.14, 0.45, 0.09]
[surfaces.floor]
shape.quad = { corner = [0, 0, 0], edges = [[0, 0, 1], [1, 0, 0]] }
material = "white"
[surfaces.ceiling]
shape.quad = { corner = [0, 1, 0], edges = [[1, 0, 0], [0, 0, 1]] }
material = "white"
[surfaces.back]
shape.quad = { corner = [0, 0, 0], edges = [[1, 0, 0], [0, 1, 0]] }
material = "white"
[surfaces.left]
shape.quad = { corner = [0, 0, 0], edges = [[0, 1, 0], [0, 0, 1]] }
material = "red"
[surfaces.right]
shape.quad = { corner = [1, 0, 0], edges = [[0, 0, 1], [0, 1, 0]] }
material = "green"
[surfaces.lamp]
shape.quad = { corner = [0.38, 0.998, 0.4], edges = [[0.24, 0, 0], [0, 0, 0.2]] }
material = "white"
radiance = [17, 12, 5]
[surfaces.tall]
shape.box = { min = [-0.15, 0, -0.15], max = [0.15, 0.6, 0.15] }
material = "white"
transform = { rotate = [0, 17, 0], translate = [0.33, 0, 0.35] }
[surfaces.short]
shape.box = { min = [-0.15, 0, -0.15], max = [0.15, 0.3, 0.15] }
material = "white"
transform = { rotate = [0, -16, 0], translate = [0.67, 0, 0.65] }
"#;

/// The reference's picture of a world.
fn reference(world: &World, samples: u32) -> Image {
    let options = tyndall_reference::Options { samples: Some(samples), ..Default::default() };
    tyndall_reference::render(world, &options, None, &mut |_| std::ops::ControlFlow::Continue(())).unwrap()
}

/// √(Σ difference² − noise²)/√(Σ truth²), the reference's own noise taken out.
fn relative_rmse(image: &Image, truth: &Image) -> f64 {
    let statistics = truth.statistics.as_ref().unwrap();
    let (mut error, mut noise, mut total) = (0.0, 0.0, 0.0);
    for (i, (a, b)) in image.pixels.iter().zip(&truth.pixels).enumerate() {
        for c in 0..3 {
            error += f64::from(a[c] - b[c]).powi(2);
            noise += f64::from(statistics.variance[i][c]) / f64::from(statistics.samples[i]);
            total += f64::from(b[c]).powi(2);
        }
    }
    ((error - noise).max(0.0) / total).sqrt()
}

/// Not a test: a picture to look at.
#[test]
#[ignore]
fn look() {
    let Some(gpu) = gpu() else { return };
    let more = std::env::var("MORE").unwrap_or_default();
    let size = std::env::var("SIZE").map_or(256, |s| s.parse().unwrap());
    let world = cornell(size, &std::env::var("SETTINGS").unwrap_or_default().replace(';', "\n"), &more.replace(';', "\n"));
    let start = std::time::Instant::now();
    let image = picture(&gpu, &world);
    println!("{:?}", start.elapsed());
    if let Ok(samples) = std::env::var("REFERENCE") {
        let truth = reference(&world, samples.parse().unwrap());
        println!("against the reference: {}", relative_rmse(&image, &truth));
        truth.write(std::path::Path::new("/tmp/rad_truth.png"), 0.0).unwrap();
    }
    image.write(std::path::Path::new("/tmp/rad_look.png"), 0.0).unwrap();
}

/// The virtual lights of a world, by its scene's settings.
fn vpls(world: &World) -> Vec<Vpl> {
    let given = world.scene.techniques.get(TECHNIQUE.name);
    let settings = Settings::new(TECHNIQUE.name, TECHNIQUE.parameters, given).unwrap();
    lights(world, &Geometry::new(&world.surfaces), &settings).unwrap()
}

/// The counts of survivors are those of the paper's loop, and there are fewer than N/(1 − ρ̄) images. [Keller97]
#[test]
fn survivors_are_the_papers() {
    for paths in [1u32, 2, 10, 64, 1000] {
        for reflectivity in [0.0, 0.1, 0.5, 0.77, 0.99] {
            let counts = walk::survivors(paths, reflectivity, 1000);
            let images: u32 = counts.iter().sum();
            assert!(f64::from(images) < f64::from(paths) / (1.0 - reflectivity) + 1e-9);
            let (mut start, mut end, mut reflections) = (f64::from(paths), paths, 0);
            let mut rendered = vec![0; counts.len()];
            while end > 0 {
                start *= reflectivity;
                for _ in start as u32..end {
                    (0..=reflections).for_each(|j: usize| rendered[j] += 1);
                }
                reflections += 1;
                end = start as u32;
            }
            assert_eq!(rendered, counts, "{paths} paths, {reflectivity}");
        }
    }
    assert_eq!(walk::survivors(64, 0.5, 2), [64, 32, 16]);
}

/// In a closed enclosure bounce j has ρʲ of the power, whatever the sequence.
#[test]
fn power_is_conserved_per_bounce() {
    for sequence in ["jittered", "halton", "rooks", "random"] {
        let list = vpls(&furnace(0.5, 1.0, &format!("paths = 128\nsequence = \"{sequence}\"")));
        for bounce in 0..8 {
            let power: f32 = list.iter().filter(|v| v.bounce == bounce).map(|v| v.power.x * std::f32::consts::PI).sum();
            let expected = 6.0 * std::f32::consts::PI * 0.5f32.powi(bounce as i32);
            assert!((power / expected - 1.0).abs() < 1e-4, "{sequence}: {power} for {expected} at bounce {bounce}");
        }
        assert_eq!(list.len(), 128 + 64 + 32 + 16 + 8 + 4 + 2 + 1);
    }
}

/// The first points lie evenly on the lights: in each of 16 strips of a light about as many, each light by its power.
#[test]
fn first_points_are_even() {
    let list = vpls(&cornell(8, "paths = 1024\nbounces = 0\nsequence = \"halton\"", ""));
    assert_eq!(list.len(), 1024);
    for strip in 0..16 {
        let inside = |v: &&Vpl| ((v.position.x - 0.38) / 0.24 * 16.0) as i32 == strip;
        let count = list.iter().filter(inside).count();
        assert!((58..=70).contains(&count), "{count} in strip {strip}");
    }
    let area: f32 = list.iter().map(|v| v.power.x).sum();
    assert!((area / (17.0 * 0.24 * 0.2) - 1.0).abs() < 1e-4, "{area}");
}
