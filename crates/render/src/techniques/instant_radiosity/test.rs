//! Instant radiosity against closed forms.

use glam::Vec3;
use tyndall_scene::World;
use tyndall_scene::image::{Image, Picture};
use tyndall_scene::metrics;
use tyndall_scene::parameter::Settings;
use tyndall_scene::surface::{Bsdf, Material};

use super::vpl::Vpl;
use super::{TECHNIQUE, Walk, walk};
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
    let options = tyndall_reference::Options { samples: Some(samples), depth: std::env::var("DEPTH").ok().map(|d| d.parse().unwrap()), ..Default::default() };
    tyndall_reference::render(world, &options, None, &mut |_| std::ops::ControlFlow::Continue(())).unwrap()
}

/// The virtual lights of a world, by its scene's settings.
fn vpls(world: &World) -> Vec<Vpl> {
    let given = world.scene.techniques.get(TECHNIQUE.name);
    let settings = Settings::new(TECHNIQUE.name, TECHNIQUE.parameters, given).unwrap();
    Walk::new(world, &settings).unwrap().lights()
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

/// Relative bias (the RMSE but for the reference's noise) and mean FLIP against the reference.
fn error(gpu: &crate::Gpu, world: &World, samples: u32) -> (f64, f64) {
    let [image, truth] = [picture(gpu, world), reference(world, samples)].map(Picture::Linear);
    let report = metrics::compare(&image, &truth, &Default::default()).unwrap();
    (report.linear.unwrap().relative_bias.unwrap(), report.flip_mean)
}

fn assert_near(name: &str, (rmse, flip): (f64, f64)) {
    println!("{name}: relative RMSE {:.2} %, FLIP {flip:.3}", 100.0 * rmse);
    assert!(rmse <= tolerance::RADIOSITY, "{name}: {rmse}");
    assert!(flip <= tolerance::RADIOSITY_FLIP, "{name}: FLIP {flip}");
}

#[test]
fn the_cornell_box_agrees_with_the_reference() {
    let Some(gpu) = gpu() else { return };
    assert_near("Cornell box", error(&gpu, &cornell(40, "paths = 256\nsamples = 256", ""), 1024));
}

/// The tall block is a mirror, seen and lighting what is before it.
#[test]
fn the_cornell_box_with_a_mirror_agrees_with_the_reference() {
    let Some(gpu) = gpu() else { return };
    let mut world = cornell(40, "paths = 256\nsamples = 256", "");
    let tall = world.surfaces.iter_mut().find(|surface| surface.name == "tall").unwrap();
    tall.material = std::sync::Arc::new(Material { bsdf: Bsdf::Mirror { reflectance: Vec3::ONE }, ..Material::default() });
    assert_near("Cornell box with a mirror", error(&gpu, &world, 1024));
}

/// Lamps of every kind, one after the other, in an open room.
#[test]
fn every_light_agrees_with_the_reference() {
    let Some(gpu) = gpu() else { return };
    let lights = [
        ("point", "point = { position = [0.7, 0.8, 0.7], intensity = [0.5, 0.6, 0.7] }"),
        ("spot", "spot = { position = [0.5, 0.9, 0.9], direction = [-0.2, -1, -0.4], intensity = 3, inner_angle = 20, outer_angle = 35 }"),
        ("directional", "directional = { direction = [-0.2, -0.5, -1], irradiance = [2, 3, 4] }"),
        ("constant", "constant.radiance = [0.3, 0.5, 0.9]"),
    ];
    for (name, light) in lights {
        let mut world = cornell(32, "paths = 512\nsamples = 256", &format!("[lights]\nl.{light}"));
        world.surfaces.retain(|surface| surface.name != "lamp" && surface.name != "short");
        assert_near(name, error(&gpu, &world, 1024));
    }
}

/// A wall hides the lamp: all light that is seen has been reflected.
#[test]
fn a_room_lit_indirectly_agrees_with_the_reference() {
    let Some(gpu) = gpu() else { return };
    let shade = "[surfaces.shade]\nshape.quad = { corner = [0.25, 0.85, 0.25], edges = [[0.5, 0, 0], [0, 0, 0.5]] }\nmaterial = \"white\"";
    assert_near("indirect", error(&gpu, &cornell(40, "paths = 256\nsamples = 256", shade), 2048));
}

/// Rough metal and a glossy dielectric.
#[test]
fn glossy_surfaces_agree_with_the_reference() {
    let Some(gpu) = gpu() else { return };
    let mut world = cornell(40, "paths = 256\nsamples = 256", "");
    for (name, metallic, roughness) in [("tall", 1.0, 0.6), ("floor", 0.0, 0.5)] {
        let surface = world.surfaces.iter_mut().find(|surface| surface.name == name).unwrap();
        let bsdf = Bsdf::MetallicRoughness {
            base_color: Vec3::new(0.8, 0.6, 0.3),
            base_color_map: None,
            metallic,
            roughness,
            metallic_roughness_map: None,
        };
        surface.material = std::sync::Arc::new(Material { bsdf, ..Material::default() });
    }
    assert_near("glossy", error(&gpu, &world, 1024));
}
#[test]
#[ignore]
fn look() {
    let Some(gpu) = gpu() else { return };
    let var = |name| std::env::var(name).unwrap_or_default().replace(';', "\n");
    let size = std::env::var("SIZE").map_or(64, |s| s.parse().unwrap());
    let mut truth = None;
    for settings in var("SETTINGS").split('|') {
        let world = cornell(size, &settings.replace(',', "\n"), &var("MORE"));
        let start = std::time::Instant::now();
        let image = picture(&gpu, &world);
        let time = start.elapsed();
        let truth = truth.get_or_insert_with(|| reference(&world, var("REFERENCE").parse().unwrap_or(256)));
        let report = metrics::compare(&Picture::Linear(image.clone()), &Picture::Linear(truth.clone()), &Default::default()).unwrap();
        let dim = |limit: f32| {
            let (mut e, mut t, mut d) = (0.0, 0.0, 0.0);
            for (a, b) in image.pixels.iter().zip(&truth.pixels).filter(|(_, b)| b[0] < limit) {
                for c in 0..3 { e += (a[c] - b[c]).powi(2); t += b[c].powi(2); d += a[c] - b[c]; }
            }
            ((e / t).sqrt(), d / (t.sqrt() * (image.pixels.len() as f32 * 3.0).sqrt()))
        };
        for (x, y) in [(24, 44), (24, 12), (5, 24), (43, 24), (24, 24)] { println!("{x} {y} {:?} {:?}", image.pixels[y * size as usize + x], truth.pixels[y * size as usize + x]); }
        println!("{settings}: {:?} FLIP {} dim {:?} {time:?}", report.linear.unwrap(), report.flip_mean, dim(2.0));
        let mut map = image.clone();
        for (m, t) in map.pixels.iter_mut().zip(&truth.pixels) {
            *m = [0, 1, 2].map(|c| (0.5 + 2.0 * (m[c] - t[c])).max(0.0));
        }
        for (image, name) in [(&map, "diff"), (&image, "look"), (&*truth, "truth")] {
            image.write(&std::path::Path::new("/tmp").join(format!("rad_{name}.png")), 0.0).unwrap();
        }
    }
}

/// What is reflected at a Lambertian point to anywhere, by chance: direct light of the lamp, and what comes after so many bounces.
fn brute(geometry: &super::geometry::Geometry, origin: glam::DVec3, direction: glam::DVec3, bounces: u32, state: &mut u32) -> glam::DVec3 {
    let mut random = || { *state += 1; super::sequence::uniform(99, *state, 0) };
    let Some(point) = geometry.trace(origin, direction) else { return glam::DVec3::ZERO };
    let [normal, _] = super::sources::towards(&point, -direction);
    let brdf = geometry.brdf(&point).base / std::f64::consts::PI;
    let lamp = glam::DVec3::new(0.38 + 0.24 * random(), 0.998, 0.4 + 0.2 * random());
    let way = lamp - point.position;
    let cosines = (way.normalize().dot(normal)).max(0.0) * way.normalize().y.max(0.0);
    let start = point.position + 1e-5 * normal;
    let free = !geometry.bvh.occluded(start.as_vec3(), ((lamp - start) * 0.9999).as_vec3(), 1.0);
    let mut sum = glam::DVec3::ZERO;
    if free {
        sum += brdf * glam::DVec3::new(17.0, 12.0, 5.0) * (0.24 * 0.2 * cosines / way.length_squared());
    }
    if bounces > 0 {
        let onward = super::sources::around(normal, (1.0 - random()).sqrt(), random());
        sum += brdf * std::f64::consts::PI * brute(geometry, point.position, onward, bounces - 1, state);
    }
    sum
}

#[test]
#[ignore]
fn look_brute() {
    let world = cornell(48, "", "");
    let geometry = super::geometry::Geometry::new(&world.surfaces);
    let [right, up, backward] = world.scene.camera.frame().unwrap().map(|v| v.as_dvec3());
    let half = (world.scene.camera.fov.to_radians() as f64 / 2.0).tan();
    let mut state = 0;
    for (x, y) in [(24, 44), (24, 12), (5, 24), (43, 24), (24, 24)] {
        let mut sums = [glam::DVec3::ZERO; 2];
        for k in 0..20000 {
            let u = super::sequence::uniform(1, k, 1);
            let v = super::sequence::uniform(1, k, 2);
            let d = (((x as f64 + u) / 24.0 - 1.0) * half * right + (1.0 - (y as f64 + v) / 24.0) * half * up - backward).normalize();
            for b in 0..2 { sums[b] += brute(&geometry, world.scene.camera.position.as_dvec3(), d, b as u32, &mut state) / 20000.0; }
        }
        println!("{x} {y} {:?}", sums);
    }
}

#[test]
#[ignore]
fn look_variants() {
    let Some(gpu) = gpu() else { return };
    let mean = |image: &Image| image.pixels.iter().map(|p| p[0].min(1.0)).sum::<f32>() / image.pixels.len() as f32;
    let base = cornell(24, "paths = 256\nsamples = 256\nbounces = 1", "");
    let without = |names: &[&str]| { let mut w = base.clone(); w.surfaces.retain(|s| !names.contains(&s.name.as_str())); w };
    for (name, world) in [
        ("furnace", furnace(0.5, 1.0, "paths = 256\nbounces = 1")),
        ("all", base.clone()),
        ("no blocks", without(&["tall", "short"])),
        ("floor back lamp", without(&["tall", "short", "ceiling", "left", "right"])),
        ("floor left lamp", without(&["tall", "short", "ceiling", "back", "right"])),
        ("floor lamp", without(&["tall", "short", "ceiling", "left", "back", "right"])),
    ] {
        if name == "floor lamp" {
            let (a, b) = (picture(&gpu, &world), reference(&world, 1024));
            for y in 0..24 { println!("VAR {y} {:?} | {:?}", (0..24).step_by(4).map(|x| a.pixels[y * 24 + x][0]).collect::<Vec<_>>(), (0..24).step_by(4).map(|x| b.pixels[y * 24 + x][0]).collect::<Vec<_>>()); }
        }
        println!("VAR {name}: {} {}", mean(&picture(&gpu, &world)), mean(&reference(&world, 1024)));
    }
}
