//! Instant radiosity against closed forms.

use tyndall_scene::World;

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
materials.white.lambert.reflectance = 0.73
materials.red.lambert.reflectance = [0.63, 0.065, 0.05]
materials.green.lambert.reflectance = [0.14, 0.45, 0.09]
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
    image.write(std::path::Path::new("/tmp/rad_look.png"), 0.0).unwrap();
}
